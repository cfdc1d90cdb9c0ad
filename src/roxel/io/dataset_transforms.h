#pragma once
/// transforms.json, the format of instant-ngp and nerfstudio, with roxel's own keys (docs/datasets.md).
/// transform_matrix is camera-to-world in OpenGL's camera: x right, y up, looking along -z; pixels as in
/// roxel.

#include <filesystem>

#include "roxel/dataset/dataset.h"

namespace roxel {

/// `path` itself where it is a file, or `path`/transforms.json, or transforms_train.json; empty if neither is
/// there.
std::filesystem::path find_transforms(const std::filesystem::path& path);

/// Views (image and mask paths, name, lens, pose, node, time, place, near, far) and scene_bounds; nodes and
/// the comparison with the images are left to read_dataset. Throws InvalidInput that names the frame and the
/// key.
Dataset read_transforms(const std::filesystem::path& path);

}  // namespace roxel
