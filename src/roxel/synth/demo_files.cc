#include "roxel/synth/demo_files.h"

#include <cmath>
#include <cstdio>
#include <nlohmann/json.hpp>

#include "roxel/base/atomic_file.h"

namespace roxel {
namespace {

using nlohmann::ordered_json;

template <class... Values>
void append(std::string& text, const char* format, Values... values) {
  char line[512];
  std::snprintf(line, sizeof line, format, values...);
  text += line;
}

// OpenGL's camera looks along -z with y up: its y and z axes are ours turned round.
ordered_json opengl_matrix(const Pose& pose) {
  Eigen::Matrix4d m = Eigen::Matrix4d::Identity();
  m.block<3, 1>(0, 0) = pose.rotation.row(0);
  m.block<3, 1>(0, 1) = -pose.rotation.row(1);
  m.block<3, 1>(0, 2) = -pose.rotation.row(2);
  m.block<3, 1>(0, 3) = pose.centre;
  ordered_json rows = ordered_json::array();
  for (int i = 0; i < 4; ++i) rows.push_back({m(i, 0), m(i, 1), m(i, 2), m(i, 3)});
  return rows;
}

std::string cameras_text(const Intrinsics& k) {
  std::string text = "# CAMERA_ID, MODEL, WIDTH, HEIGHT, PARAMS[]\n";
  append(text, "1 PINHOLE %d %d %.17g %.17g %.17g %.17g\n", k.width, k.height, k.fx, k.fy, k.cx, k.cy);
  return text;
}

/// Observations of each image as (point index, observation index), in the order of the points.
std::vector<std::vector<std::pair<int, int>>> seen_by_image(const std::vector<SparsePoint>& points,
                                                            std::size_t images) {
  std::vector<std::vector<std::pair<int, int>>> seen(images);
  for (int p = 0; p < static_cast<int>(points.size()); ++p)
    for (int o = 0; o < static_cast<int>(points[p].observations.size()); ++o)
      seen[points[p].observations[o].image_idx].emplace_back(p, o);
  return seen;
}

std::string images_text(const SyntheticCameras& set, const std::vector<SparsePoint>& points) {
  const auto seen = seen_by_image(points, set.cameras.size());
  std::string text =
      "# IMAGE_ID, QW, QX, QY, QZ, TX, TY, TZ, CAMERA_ID, NAME\n# POINTS2D[] as (X, Y, POINT3D_ID)\n";
  for (int i = 0; i < static_cast<int>(set.cameras.size()); ++i) {
    const Pose& pose = set.cameras[i].pose;
    const Eigen::Quaterniond q(pose.rotation);
    const Eigen::Vector3d t = -(pose.rotation * pose.centre);
    append(text, "%d %.17g %.17g %.17g %.17g %.17g %.17g %.17g 1 %s.png\n", i + 1, q.w(), q.x(), q.y(), q.z(),
           t.x(), t.y(), t.z(), synthetic_name(i).c_str());
    for (const auto& [p, o] : seen[i]) {
      const Eigen::Vector2d& pixel = points[p].observations[o].pixel;
      append(text, "%.6f %.6f %d ", pixel.x(), pixel.y(), p + 1);
    }
    text += "\n";
  }
  return text;
}

std::string points_text(const std::vector<SparsePoint>& points, std::size_t images) {
  std::vector<int> next(images, 0);  // POINT2D_IDX: images.txt lists points in the same order
  std::string text = "# POINT3D_ID, X, Y, Z, R, G, B, ERROR, TRACK[] as (IMAGE_ID, POINT2D_IDX)\n";
  for (int p = 0; p < static_cast<int>(points.size()); ++p) {
    const SparsePoint& point = points[p];
    append(text, "%d %.9g %.9g %.9g %d %d %d 0", p + 1, point.position.x(), point.position.y(),
           point.position.z(), point.srgb[0], point.srgb[1], point.srgb[2]);
    for (const auto& seen : point.observations)
      append(text, " %d %d", seen.image_idx + 1, next[seen.image_idx]++);
    text += "\n";
  }
  return text;
}

}  // namespace

std::string synthetic_name(int image_idx) {
  std::string text;
  append(text, "%03d", image_idx);
  return text;
}

void write_synthetic_transforms(const std::filesystem::path& folder, const SyntheticCameras& set) {
  const Intrinsics& k = set.cameras.front().intrinsics;
  ordered_json root;
  root["camera_model"] = "PINHOLE";
  root["w"] = k.width;
  root["h"] = k.height;
  root["fl_x"] = k.fx;
  root["fl_y"] = k.fy;
  root["cx"] = k.cx;
  root["cy"] = k.cy;
  root["camera_angle_x"] = 2 * std::atan(0.5 * k.width / k.fx);
  const auto corner = [](const Eigen::Vector3d& p) { return ordered_json{p.x(), p.y(), p.z()}; };
  root["scene_bounds"] = {corner(set.bounds.min()), corner(set.bounds.max())};
  root["frames"] = ordered_json::array();
  for (int i = 0; i < static_cast<int>(set.cameras.size()); ++i) {
    const std::string name = synthetic_name(i);
    root["frames"].push_back({{"file_path", "images/" + name + ".png"},
                              {"mask_path", "mask/" + name + ".png"},
                              {"depth_path", "depth/" + name + ".exr"},
                              {"transform_matrix", opengl_matrix(set.cameras[i].pose)}});
  }
  write_text_atomically(folder / "transforms.json", root.dump(1) + "\n");
}

void write_synthetic_colmap(const std::filesystem::path& folder, const SyntheticCameras& set,
                            const std::vector<SparsePoint>& points) {
  const std::filesystem::path model = folder / "sparse" / "0";
  write_text_atomically(model / "cameras.txt", cameras_text(set.cameras.front().intrinsics));
  write_text_atomically(model / "images.txt", images_text(set, points));
  write_text_atomically(model / "points3D.txt", points_text(points, set.cameras.size()));
}

}  // namespace roxel
