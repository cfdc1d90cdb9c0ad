#include "roxel/io/dataset_writer.h"

#include <array>
#include <cstdio>
#include <map>
#include <nlohmann/json.hpp>

#include "roxel/base/atomic_file.h"
#include "roxel/base/error.h"
#include "roxel/io/dataset_camera.h"
#include "roxel/io/dataset_colmap.h"
#include "roxel/io/dataset_text.h"

namespace roxel {
namespace {

namespace fs = std::filesystem;
using nlohmann::ordered_json;

std::string relative_to(const fs::path& folder, const std::string& path) {
  return fs::absolute(path)
      .lexically_normal()
      .lexically_proximate(fs::absolute(folder).lexically_normal())
      .string();
}

template <class T>
void put(ordered_json& frame, const char* key, const std::optional<T>& value) {
  if (value) frame[key] = *value;
}

void put_lens(ordered_json& frame, const Lens& lens) {
  const Intrinsics& k = lens.intrinsics;
  frame["camera_model"] = lens_model_name(lens.model);
  frame["w"] = k.width;
  frame["h"] = k.height;
  frame["fl_x"] = k.fx;
  frame["fl_y"] = k.fy;
  frame["cx"] = k.cx;
  frame["cy"] = k.cy;
  if (k.skew != 0) frame["skew"] = k.skew;
  const std::vector<std::string> names = lens_coefficient_names(lens.model);
  for (std::size_t i = 0; i < names.size(); ++i) frame[names[i]] = lens.coefficients[i];
}

/// Camera-to-world of a camera with y up that looks along -z.
ordered_json opengl_matrix(const Pose& pose) {
  const Eigen::Matrix3d rotation = pose.rotation.transpose() * Eigen::Vector3d(1, -1, -1).asDiagonal();
  ordered_json rows = ordered_json::array();
  for (int row = 0; row < 3; ++row) {
    rows.push_back({rotation(row, 0), rotation(row, 1), rotation(row, 2), pose.centre[row]});
  }
  rows.push_back({0.0, 0.0, 0.0, 1.0});
  return rows;
}

ordered_json frame_of(const View& view, const fs::path& folder) {
  ordered_json frame;
  frame["file_path"] = relative_to(folder, view.image_path);
  if (!view.mask_path.empty()) frame["mask_path"] = relative_to(folder, view.mask_path);
  put_lens(frame, view.lens);
  put(frame, "node", view.node_id);
  if (view.time_utc_s) frame["time_utc"] = format_utc_time(*view.time_utc_s);
  put(frame, "latitude", view.latitude_deg);
  put(frame, "longitude", view.longitude_deg);
  put(frame, "near", view.near);
  put(frame, "far", view.far);
  frame["transform_matrix"] = opengl_matrix(view.camera.pose);
  return frame;
}

/// 17 significant digits: what it takes to get the same double back.
std::string exact(double value) {
  std::array<char, 32> text{};
  std::snprintf(text.data(), text.size(), "%.17g", value);
  return text.data();
}

std::string camera_line(const Lens& lens) {
  if (lens.intrinsics.skew != 0)
    throw_invalid("skew", exact(lens.intrinsics.skew), "0: COLMAP's cameras have none");
  std::string line = std::string(lens_model_name(lens.model)) + " " + std::to_string(lens.intrinsics.width) +
                     " " + std::to_string(lens.intrinsics.height);
  std::vector<double> parameters = colmap_parameters(lens);
  const bool one_focal_length = parameters.size() == 3 + lens_coefficient_names(lens.model).size();
  if (one_focal_length && lens.intrinsics.fx != lens.intrinsics.fy) {
    throw_invalid("fl_y of a camera " + std::string(lens_model_name(lens.model)), exact(lens.intrinsics.fy),
                  "fl_x, " + exact(lens.intrinsics.fx) + ": COLMAP's model has one focal length");
  }
  for (double parameter : parameters) line += " " + exact(parameter);
  return line;
}

std::string colmap_image_name(const View& view, const fs::path& folder) {
  const std::string name = relative_to(folder / "images", view.image_path);
  if (name.starts_with("..") || fs::path(name).is_absolute()) {
    throw_invalid(view.image_path, "an image outside " + (folder / "images").string(),
                  "all images there, for COLMAP");
  }
  return name;
}

std::string image_lines(const View& view, int image_id, int camera_id, const fs::path& folder) {
  const Eigen::Vector4d q = quaternion_from_rotation(view.camera.pose.rotation);
  const Eigen::Vector3d t = -view.camera.pose.rotation * view.camera.pose.centre;
  std::string line = std::to_string(image_id);
  for (double value : q) line += " " + exact(value);
  for (double value : t) line += " " + exact(value);
  return line + " " + std::to_string(camera_id) + " " + colmap_image_name(view, folder) + "\n\n";
}

}  // namespace

void write_transforms(const Dataset& dataset, const fs::path& folder) {
  ordered_json top;
  if (dataset.scene_bounds) {
    const Eigen::Vector3d low = dataset.scene_bounds->min(), high = dataset.scene_bounds->max();
    top["scene_bounds"] = {{low.x(), low.y(), low.z()}, {high.x(), high.y(), high.z()}};
  }
  top["frames"] = ordered_json::array();
  for (const View& view : dataset.views) top["frames"].push_back(frame_of(view, folder));
  write_text_atomically(folder / "transforms.json", top.dump(1) + "\n");
}

void write_colmap_text(const Dataset& dataset, const fs::path& folder) {
  std::map<std::string, int> camera_ids;
  std::string cameras = "# CAMERA_ID, MODEL, WIDTH, HEIGHT, PARAMS[]\n";
  std::string images =
      "# Two lines an image: IMAGE_ID, QW, QX, QY, QZ, TX, TY, TZ, CAMERA_ID, NAME\n"
      "#   and POINTS2D[] as (X, Y, POINT3D_ID), empty here\n";
  std::string points = "# POINT3D_ID, X, Y, Z, R, G, B, ERROR, TRACK[] as (IMAGE_ID, POINT2D_IDX)\n";
  int image_id = 0, point_id = 0;
  for (const View& view : dataset.views) {
    const std::string line = camera_line(view.lens);
    const auto [camera, is_new] = camera_ids.emplace(line, static_cast<int>(camera_ids.size()) + 1);
    if (is_new) cameras += std::to_string(camera->second) + " " + line + "\n";
    images += image_lines(view, ++image_id, camera->second, folder);
  }
  for (const Eigen::Vector3d& x : dataset.points) {
    points += std::to_string(++point_id) + " " + exact(x.x()) + " " + exact(x.y()) + " " + exact(x.z()) +
              " 128 128 128 0\n";
  }
  const fs::path model = folder / "sparse" / "0";
  write_text_atomically(model / "cameras.txt", cameras);
  write_text_atomically(model / "images.txt", images);
  write_text_atomically(model / "points3D.txt", points);
}

}  // namespace roxel
