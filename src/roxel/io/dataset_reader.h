#pragma once
/// Reads calibrated photographs: COLMAP models (text and binary), transforms.json, Middlebury *_par.txt,
/// Strecha *.camera and KRT text files. Pixels are not read here, only image headers (docs/datasets.md).

#include <filesystem>
#include <optional>
#include <string>

#include "roxel/dataset/dataset.h"

namespace roxel {

struct ReadOptions {
  /// "colmap", "transforms", "middlebury", "strecha", "krt"; empty = by what is in the folder.
  std::string format;
  /// Keep only images whose path below the image root (with suffix), name (without) or file name matches this
  /// shell pattern ('*' also matches '/'); empty = all.
  std::string images;
  /// "A:B": keep nodes A to B - 1 of Dataset::nodes, counted from 0; either side may be left out; empty =
  /// all.
  std::string nodes;
  /// "auto": mask paths of the data set, or files masks/NAME.png, masks/NAME.SUFFIX.png or mask/... beside
  /// the images; "none"; or a folder that holds such files.
  std::string masks = "auto";
  /// Images whose centres are at most this far apart (world units, chains join) are of one node, where the
  /// data set says none; none = default_node_tolerance() of the images that are kept.
  std::optional<double> node_tolerance;
};

/// `path` is the data set's folder, or a transforms file. Nodes are assigned, image headers are compared with
/// the cameras, and every view's file exists. Throws InvalidInput, one clear message, for everything that
/// is wrong with the files.
Dataset read_dataset(const std::filesystem::path& path, const ReadOptions& options = {});

}  // namespace roxel
