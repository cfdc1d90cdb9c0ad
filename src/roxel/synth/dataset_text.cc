#include "roxel/synth/dataset_text.h"

#include <array>
#include <chrono>
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
  const auto seen = seen_by_image(points, set.frames.size());
  std::string text =
      "# IMAGE_ID, QW, QX, QY, QZ, TX, TY, TZ, CAMERA_ID, NAME\n# POINTS2D[] as (X, Y, POINT3D_ID)\n";
  for (int i = 0; i < static_cast<int>(set.frames.size()); ++i) {
    const Pose& pose = set.frames[i].camera.pose;
    const Eigen::Quaterniond q(pose.rotation);
    const Eigen::Vector3d t = -(pose.rotation * pose.centre);
    append(text, "%d %.17g %.17g %.17g %.17g %.17g %.17g %.17g 1 ", i + 1, q.w(), q.x(), q.y(), q.z(), t.x(),
           t.y(), t.z());
    text += set.frames[i].name + set.image_suffix + "\n";
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

ordered_json frame_json(const SyntheticFrame& frame, const SyntheticCameras& set) {
  const std::string& name = frame.name;
  ordered_json json{{"file_path", "images/" + name + set.image_suffix}};
  if (set.masked) json["mask_path"] = "mask/" + name + ".png";
  json["depth_path"] = "depth/" + name + ".exr";
  if (set.with_surfaces) {
    json["albedo_path"] = "albedo/" + name + ".exr";
    json["normal_path"] = "normal/" + name + ".exr";
  }
  if (set.with_transients) json["transient_path"] = "transient/" + name + ".png";
  if (frame.node) json["node"] = *frame.node;
  if (!frame.time_utc.empty()) json["time_utc"] = frame.time_utc;
  if (!frame.sky.empty()) json["sky_path"] = "sky/" + frame.sky + ".exr";
  json["transform_matrix"] = opengl_matrix(frame.camera.pose);
  return json;
}

}  // namespace

void write_synthetic_transforms(const std::filesystem::path& file, const SyntheticCameras& set) {
  const Intrinsics& k = set.frames.front().camera.intrinsics;
  ordered_json root;
  root["generator"] = kSyntheticGenerator;
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
  if (set.place) {
    root["latitude"] = set.place->latitude_deg;
    root["longitude"] = set.place->longitude_deg;
  }
  root["frames"] = ordered_json::array();
  for (const SyntheticFrame& frame : set.frames) root["frames"].push_back(frame_json(frame, set));
  write_text_atomically(file, root.dump(1) + "\n");
}

void write_synthetic_colmap(const std::filesystem::path& folder, const SyntheticCameras& set,
                            const std::vector<SparsePoint>& points) {
  const std::filesystem::path model = folder / "sparse" / "0";
  write_text_atomically(model / "cameras.txt", cameras_text(set.frames.front().camera.intrinsics));
  write_text_atomically(model / "images.txt", images_text(set, points));
  write_text_atomically(model / "points3D.txt", points_text(points, set.frames.size()));
}

std::string utc_text(double time_utc_s) {
  using namespace std::chrono;
  const sys_seconds time{seconds{static_cast<std::int64_t>(std::floor(time_utc_s))}};
  const sys_days day = floor<days>(time);
  const year_month_day date{day};
  const hh_mm_ss clock{time - day};
  std::string text;
  append(text, "%04d-%02u-%02uT%02d:%02d:%02dZ", static_cast<int>(date.year()),
         static_cast<unsigned>(date.month()), static_cast<unsigned>(date.day()),
         static_cast<int>(clock.hours().count()), static_cast<int>(clock.minutes().count()),
         static_cast<int>(clock.seconds().count()));
  return text;
}

}  // namespace roxel
