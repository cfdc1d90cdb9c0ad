#include "roxel/io/dataset_reader.h"

#include <fnmatch.h>

#include <algorithm>
#include <functional>
#include <map>

#include "roxel/base/error.h"
#include "roxel/image/undistort.h"
#include "roxel/io/dataset_camera.h"
#include "roxel/io/dataset_colmap.h"
#include "roxel/io/dataset_files.h"
#include "roxel/io/dataset_images.h"
#include "roxel/io/dataset_krt.h"
#include "roxel/io/dataset_middlebury.h"
#include "roxel/io/dataset_strecha.h"
#include "roxel/io/dataset_text.h"
#include "roxel/io/dataset_transforms.h"

namespace roxel {
namespace {

namespace fs = std::filesystem;

/// A format: whether its files are there, what they are called, and how to read them. The first in the list
/// that is there wins: transforms.json can carry nodes, times, masks and bounds.
struct Format {
  const char* name;
  const char* files;
  bool (*is_there)(const fs::path& path);
  Dataset (*read)(const fs::path& path);
};

const Format kFormats[] = {
    {"transforms", "transforms.json", [](const fs::path& p) { return !find_transforms(p).empty(); },
     read_transforms},
    {"colmap", "cameras and images (.bin or .txt) in sparse/0, sparse or the folder itself",
     [](const fs::path& p) { return !find_colmap_model(p).empty(); }, read_colmap},
    {"middlebury", "*_par.txt", [](const fs::path& p) { return !find_middlebury(p).empty(); },
     read_middlebury},
    {"strecha", "*.camera", [](const fs::path& p) { return !find_strecha(p).empty(); }, read_strecha},
    {"krt", "*.krt, or *.txt named like the images", [](const fs::path& p) { return !find_krt(p).empty(); },
     read_krt},
};

std::string all_formats() {
  std::string text;
  for (const Format& format : kFormats) {
    text += (text.empty() ? "" : "; ") + std::string(format.files) + " (" + format.name + ")";
  }
  return text;
}

std::vector<const Format*> formats_there(const fs::path& path) {
  std::vector<const Format*> there;
  for (const Format& format : kFormats) {
    // What looks like KRT beside another format's files is most likely that format's.
    if (!there.empty() && std::string(format.name) == "krt") continue;
    if (format.is_there(path)) there.push_back(&format);
  }
  return there;
}

void check_path(const fs::path& path) {
  check_name(path.string(), "data set");
  if (!fs::exists(path)) throw_invalid(path.string(), "no such file or folder", "a data set");
  if (fs::is_directory(path) && fs::is_empty(path)) {
    throw_invalid(path.string(), "an empty folder", "a data set: " + all_formats());
  }
}

const Format& forced_format(const fs::path& path, const std::string& name) {
  std::string known;
  for (const Format& format : kFormats) {
    known += (known.empty() ? "" : ", ") + std::string(format.name);
    if (name != format.name) continue;
    if (format.is_there(path)) return format;
    const std::vector<const Format*> there = formats_there(path);
    throw_invalid(path.string(),
                  (there.empty() ? std::string() : std::string(there[0]->name) + " files in ") +
                      (fs::is_directory(path) ? describe_folder(path) : "a plain file"),
                  std::string(format.files) + " (format " + name + " was asked for)");
  }
  throw_invalid("format", "'" + escaped(name) + "'", "one of " + known);
}

/// Whether both hold the same images at the same places.
bool cameras_agree(const Dataset& a, const Dataset& b) {
  std::map<std::string, const View*> by_name;
  for (const View& view : b.views) by_name[fs::path(view.name).filename().string()] = &view;
  double extent = 0, apart = 0;
  for (const View& view : a.views) {
    const auto found = by_name.find(fs::path(view.name).filename().string());
    if (found == by_name.end()) return false;
    extent = std::max(extent, (view.camera.pose.centre - a.views[0].camera.pose.centre).norm());
    apart = std::max(apart, (view.camera.pose.centre - found->second->camera.pose.centre).norm());
  }
  return apart <= 1e-3 * extent;
}

void take_colmap_points(const fs::path& path, Dataset& dataset) {
  const std::string folder = find_colmap_model(path).string();
  Dataset model;
  try {
    model = read_colmap(path);
  } catch (const InvalidInput& error) {
    throw InvalidInput(std::string(error.what()) +
                       " (this COLMAP model stands beside transforms.json and is read for its points; format "
                       "transforms, given by name, leaves it out)");
  }
  if (!cameras_agree(dataset, model)) {
    dataset.warnings.push_back(folder +
                               ": its images or camera places differ from transforms.json, so its points "
                               "are not used");
    return;
  }
  dataset.points = std::move(model.points);
  dataset.point_view_counts = std::move(model.point_view_counts);
  dataset.notes.push_back("cameras from transforms.json, " + std::to_string(dataset.points.size()) +
                          " points from the COLMAP model in " + folder);
}

Dataset read_detected(const fs::path& path) {
  const std::vector<const Format*> there = formats_there(path);
  if (there.empty()) {
    throw_invalid(path.string(), fs::is_directory(path) ? describe_folder(path) : "a plain file",
                  "one of: " + all_formats());
  }
  const std::string first = there[0]->name;
  const bool both = there.size() == 2 && first == "transforms" && std::string("colmap") == there[1]->name;
  if (there.size() > 1 && !both) {
    std::string names = first;
    for (std::size_t i = 1; i < there.size(); ++i) names += std::string(" and ") + there[i]->name;
    throw_invalid(path.string(), "files of the formats " + names,
                  "one format, or --format to say which is meant");
  }
  Dataset dataset = there[0]->read(path);
  dataset.format = first;
  if (both) take_colmap_points(path, dataset);
  return dataset;
}

void check_unique_names(const Dataset& dataset) {
  std::map<std::string, const View*> seen;
  for (const View& view : dataset.views) {
    const auto [first, is_new] = seen.emplace(view.name, &view);
    if (is_new) continue;
    throw_invalid(view.source + ": image name", "'" + escaped(view.name) + "' for the second time",
                  "each name (without suffix) once; it is also in " + first->second->source);
  }
}

bool matches(const std::string& pattern, const View& view) {
  const fs::path file = fs::path(view.image_path).filename();
  const std::string candidates[] = {view.name, view.name + file.extension().string(), file.string()};
  return std::any_of(std::begin(candidates), std::end(candidates),
                     [&](const std::string& name) { return fnmatch(pattern.c_str(), name.c_str(), 0) == 0; });
}

void keep_images(const std::string& pattern, Dataset& dataset) {
  if (pattern.empty()) return;
  std::erase_if(dataset.views, [&](const View& view) { return !matches(pattern, view); });
  if (dataset.views.empty()) {
    throw_invalid("images", "no image that matches '" + escaped(pattern) + "'", "at least one");
  }
}

/// Size against the header; the pinhole after undistortion.
void complete_camera(View& view) {
  const ImageSize size = checked_image_size(view.image_path, view.source);
  view.has_alpha = size.has_alpha;
  Intrinsics& k = view.lens.intrinsics;
  if (k.width == 0 && k.height == 0) {
    k.width = size.width;
    k.height = size.height;
  }
  if (size.width != k.width || size.height != k.height) {
    throw_invalid(
        view.image_path,
        "an image of " + std::to_string(size.width) + " x " + std::to_string(size.height) + " pixels",
        std::to_string(k.width) + " x " + std::to_string(k.height) + ", as its camera says (" + view.source +
            ")");
  }
  check_lens(view.lens, view.source);
  view.camera = undistorted_camera(view.lens, view.camera.pose);
}

void find_masks(const fs::path& path, const std::string& masks, Dataset& dataset) {
  if (masks == "none") {
    for (View& view : dataset.views) {
      view.mask_path.clear();
      view.has_alpha = false;
    }
    return;
  }
  std::vector<fs::path> folders;
  const fs::path base = fs::is_directory(path) ? path : path.parent_path();
  if (masks == "auto") {
    folders = {base / "masks", base / "mask"};
  } else {
    if (!fs::is_directory(masks))
      throw_invalid("masks", "'" + escaped(masks) + "'", "auto, none, or a folder");
    folders = {masks};
  }
  std::size_t with_mask = 0;
  for (View& view : dataset.views) {
    if (masks != "auto") view.mask_path.clear();
    for (const fs::path& folder : folders) {
      if (!view.mask_path.empty()) break;
      const fs::path found =
          mask_in_folder(folder, view.name + fs::path(view.image_path).extension().string());
      if (!found.empty()) view.mask_path = fs::absolute(found).lexically_normal().string();
    }
    with_mask += !view.mask_path.empty() || view.has_alpha;
  }
  const std::string share = std::to_string(with_mask) + " of " + std::to_string(dataset.views.size());
  if (masks != "auto" && with_mask == 0)
    throw_invalid("masks", "no mask for any image in " + escaped(masks), "NAME.png");
  if (with_mask > 0 && with_mask < dataset.views.size()) {
    dataset.warnings.push_back("only " + share + " views have a mask; the others count as all foreground");
  }
}

void check_mask_sizes(const Dataset& dataset) {
  for (const View& view : dataset.views) {
    if (view.mask_path.empty()) continue;
    const ImageSize size = checked_image_size(view.mask_path, view.source);
    const Intrinsics& k = view.lens.intrinsics;
    if (size.width == k.width && size.height == k.height) continue;
    throw_invalid(view.mask_path,
                  "a mask of " + std::to_string(size.width) + " x " + std::to_string(size.height) + " pixels",
                  std::to_string(k.width) + " x " + std::to_string(k.height) + ", like its image");
  }
}

/// A Python-like slice of [0, count).
std::pair<int, int> parse_range(const std::string& range, int count) {
  const std::size_t colon = range.find(':');
  if (colon == std::string::npos) throw_invalid("nodes", "'" + escaped(range) + "'", "A:B");
  const std::string_view first = std::string_view(range).substr(0, colon),
                         last = std::string_view(range).substr(colon + 1);
  const int begin = first.empty() ? 0 : parse_int(first, "nodes", "first");
  const int end = last.empty() ? count : parse_int(last, "nodes", "last");
  if (begin < 0 || begin >= end || begin >= count) {
    throw_invalid("nodes", "'" + escaped(range) + "'",
                  "A:B with 0 <= A < B, within the " + std::to_string(count) + " nodes");
  }
  return {begin, std::min(end, count)};
}

void keep_nodes(const std::string& range, double tolerance, Dataset& dataset) {
  assign_nodes(dataset, tolerance);
  if (range.empty()) return;
  const auto [begin, end] = parse_range(range, static_cast<int>(dataset.nodes.size()));
  std::erase_if(dataset.views, [first = begin, past = end](const View& view) {
    return view.node_idx < first || view.node_idx >= past;
  });
  assign_nodes(dataset, tolerance);
}

}  // namespace

Dataset read_dataset(const fs::path& path, const ReadOptions& options) {
  check_path(path);
  Dataset dataset;
  if (options.format.empty()) {
    dataset = read_detected(path);
  } else {
    const Format& format = forced_format(path, options.format);
    dataset = format.read(path);
    dataset.format = format.name;
  }
  dataset.path = path.string();
  check_unique_names(dataset);
  keep_images(options.images, dataset);
  for (View& view : dataset.views) complete_camera(view);
  find_masks(path, options.masks, dataset);
  check_mask_sizes(dataset);
  keep_nodes(options.nodes, options.node_tolerance.value_or(default_node_tolerance(dataset.views)), dataset);
  return dataset;
}

}  // namespace roxel
