#pragma once
/// For tests only: temporary folders, tiny images, and one set of cameras written down in every format by
/// code that shares nothing with the readers.

#include <gtest/gtest.h>

#include <Eigen/Dense>
#include <cstdint>
#include <cstdio>
#include <filesystem>
#include <fstream>
#include <random>
#include <string>
#include <vector>

#include "roxel/base/temp_folder.h"
#include "roxel/image/image.h"
#include "roxel/io/image_file.h"

namespace roxel::fixture {

namespace fs = std::filesystem;

inline void write_file(const fs::path& file, const std::string& content) {
  fs::create_directories(file.parent_path());
  std::ofstream(file, std::ios::binary) << content;
}

inline std::string read_file(const fs::path& file) {
  std::ifstream in(file, std::ios::binary);
  return {std::istreambuf_iterator<char>(in), std::istreambuf_iterator<char>()};
}

inline void write_image(const fs::path& file, int width, int height) {
  fs::create_directories(file.parent_path());
  write_png(file.string(), Image(width, height, 3, 0.5f));
}

/// Replaces the first `from` in the file; fails the test where there is none.
inline void replace_in_file(const fs::path& file, const std::string& from, const std::string& to) {
  std::string content = read_file(file);
  const std::size_t at = content.find(from);
  ASSERT_NE(at, std::string::npos) << file << " does not contain " << from;
  write_file(file, content.replace(at, from.size(), to));
}

/// Enough digits to get the same double back.
inline std::string digits(double value) {
  char text[32];
  std::snprintf(text, sizeof text, "%.17g", value);
  return text;
}

/// One pinhole as a textbook has it: pixel ~ K (R x + t), corner of the image at (0, 0).
struct TextbookCamera {
  std::string name;  ///< "a.png"
  Eigen::Matrix3d k, r;
  Eigen::Vector3d t;
  int width = 32, height = 24;

  Eigen::Vector2d project(const Eigen::Vector3d& x) const {
    const Eigen::Vector3d p = k * (r * x + t);
    return p.head<2>() / p.z();
  }
};

/// Cameras around the origin with different intrinsics. `skew`: 0 for formats that have none.
inline std::vector<TextbookCamera> textbook_cameras(int count = 5, double skew = 0) {
  std::vector<TextbookCamera> cameras;
  for (int i = 0; i < count; ++i) {
    TextbookCamera camera;
    camera.name = std::string("view") + static_cast<char>('a' + i) + ".png";
    camera.k << 40 + i, skew, 15.7 + 0.3 * i, 0, 41 + 0.5 * i, 12.4 - 0.2 * i, 0, 0, 1;
    camera.r = (Eigen::AngleAxisd(0.3 + 0.9 * i, Eigen::Vector3d(0.2, 1, -0.3 * i).normalized()) *
                Eigen::AngleAxisd(0.4, Eigen::Vector3d::UnitX()))
                   .toRotationMatrix();
    camera.t = Eigen::Vector3d(0.1 * i, -0.2, 4 + 0.5 * i);
    cameras.push_back(camera);
  }
  return cameras;
}

inline std::vector<Eigen::Vector3d> known_points(int count = 40) {
  std::mt19937 random(7);
  std::uniform_real_distribution<double> coordinate(-1, 1);
  std::vector<Eigen::Vector3d> points;
  for (int i = 0; i < count; ++i)
    points.emplace_back(coordinate(random), coordinate(random), coordinate(random));
  return points;
}

inline std::string rows(const Eigen::Matrix3d& m, const char* row_end) {
  std::string text;
  for (int i = 0; i < 3; ++i)
    text += digits(m(i, 0)) + " " + digits(m(i, 1)) + " " + digits(m(i, 2)) + row_end;
  return text;
}

inline std::string row(const Eigen::Vector3d& v) {
  return digits(v.x()) + " " + digits(v.y()) + " " + digits(v.z());
}

inline void write_images(const fs::path& folder, const std::vector<TextbookCamera>& cameras) {
  for (const TextbookCamera& camera : cameras) write_image(folder / camera.name, camera.width, camera.height);
}

/// (w, x, y, z)
inline Eigen::Vector4d wxyz(const Eigen::Matrix3d& r) {
  const Eigen::Quaterniond q(r);
  return {q.w(), q.x(), q.y(), q.z()};
}

inline void write_colmap_text(const fs::path& set, const std::vector<TextbookCamera>& cameras,
                              const fs::path& model = "sparse/0") {
  write_images(set / "images", cameras);
  std::string camera_lines = "# cameras\n", image_lines = "# images\n", point_lines;
  int id = 0;
  for (const TextbookCamera& c : cameras) {
    ++id;
    camera_lines +=
        std::to_string(id) + " PINHOLE " + std::to_string(c.width) + " " + std::to_string(c.height);
    for (double p : {c.k(0, 0), c.k(1, 1), c.k(0, 2), c.k(1, 2)}) camera_lines += " " + digits(p);
    camera_lines += "\n";
    image_lines += std::to_string(10 + id);
    for (double q : wxyz(c.r)) image_lines += " " + digits(q);
    image_lines += " " + row(c.t) + " " + std::to_string(id) + " " + c.name + "\n";
    image_lines += id % 2 ? "\n" : "1.5 2.5 1 3.5 4.5 -1\n";
  }
  int point_id = 0;
  for (const Eigen::Vector3d& x : known_points()) {
    point_lines += std::to_string(++point_id) + " " + row(x) + " 1 2 3 0.5 11 0 12 0 13 0\n";
  }
  write_file(set / model / "cameras.txt", camera_lines);
  write_file(set / model / "images.txt", image_lines);
  write_file(set / model / "points3D.txt", point_lines);
}

template <class T>
void append(std::string& bytes, T value) {
  bytes.append(reinterpret_cast<const char*>(&value), sizeof value);
}

inline void write_colmap_binary(const fs::path& set, const std::vector<TextbookCamera>& cameras) {
  write_images(set / "images", cameras);
  std::string camera_bytes, image_bytes, point_bytes;
  append<std::uint64_t>(camera_bytes, cameras.size());
  append<std::uint64_t>(image_bytes, cameras.size());
  std::int32_t id = 0;
  for (const TextbookCamera& c : cameras) {
    append<std::int32_t>(camera_bytes, ++id);
    append<std::int32_t>(camera_bytes, 1);  // PINHOLE
    append<std::uint64_t>(camera_bytes, c.width);
    append<std::uint64_t>(camera_bytes, c.height);
    for (double p : {c.k(0, 0), c.k(1, 1), c.k(0, 2), c.k(1, 2)}) append(camera_bytes, p);
    append<std::int32_t>(image_bytes, 10 + id);
    for (double q : wxyz(c.r)) append(image_bytes, q);
    for (double t : c.t) append(image_bytes, t);
    append<std::int32_t>(image_bytes, id);
    image_bytes += c.name + '\0';
    append<std::uint64_t>(image_bytes, 1);
    append(image_bytes, 1.5);
    append(image_bytes, 2.5);
    append<std::int64_t>(image_bytes, -1);
  }
  append<std::uint64_t>(point_bytes, known_points().size());
  for (const Eigen::Vector3d& x : known_points()) {
    append<std::uint64_t>(point_bytes, 1);
    for (double value : x) append(point_bytes, value);
    point_bytes += "rgb";
    append(point_bytes, 0.5);
    append<std::uint64_t>(point_bytes, 3);
    for (std::int32_t i = 0; i < 6; ++i) append(point_bytes, i);
  }
  write_file(set / "sparse/0/cameras.bin", camera_bytes);
  write_file(set / "sparse/0/images.bin", image_bytes);
  write_file(set / "sparse/0/points3D.bin", point_bytes);
}

/// `extra` is put into every frame, e.g. "\"node\": 3,"; `shared` into the top level.
inline void write_transforms_json(const fs::path& set, const std::vector<TextbookCamera>& cameras,
                                  const std::string& extra = "", const std::string& shared = "") {
  write_images(set / "images", cameras);
  std::string json = "{" + shared + "\n\"frames\": [";
  for (std::size_t i = 0; i < cameras.size(); ++i) {
    const TextbookCamera& c = cameras[i];
    // World from camera, with the camera's y and z turned round.
    Eigen::Matrix4d m = Eigen::Matrix4d::Identity();
    m.topLeftCorner<3, 3>() = c.r.transpose();
    m.col(1) *= -1;
    m.col(2) *= -1;
    m.topRightCorner<3, 1>() = -c.r.transpose() * c.t;
    json += (i ? ",\n{" : "\n{") + extra + "\"file_path\": \"images/" + c.name + "\"";
    json += ", \"w\": " + std::to_string(c.width) + ", \"h\": " + std::to_string(c.height);
    if (c.k(0, 1) != 0) json += ", \"skew\": " + digits(c.k(0, 1));
    json += ", \"fl_x\": " + digits(c.k(0, 0)) + ", \"fl_y\": " + digits(c.k(1, 1));
    json +=
        ", \"cx\": " + digits(c.k(0, 2)) + ", \"cy\": " + digits(c.k(1, 2)) + ",\n\"transform_matrix\": [";
    for (int r = 0; r < 4; ++r) {
      json += r ? ", [" : "[";
      for (int col = 0; col < 4; ++col) json += (col ? ", " : "") + digits(m(r, col));
      json += "]";
    }
    json += "]}";
  }
  write_file(set / "transforms.json", json + "]\n}\n");
}

inline void write_middlebury(const fs::path& set, const std::vector<TextbookCamera>& cameras) {
  write_images(set, cameras);
  std::string text = std::to_string(cameras.size()) + "\n";
  for (const TextbookCamera& c : cameras) {
    Eigen::Matrix3d k = c.k;  // pixel centres at integers there
    k(0, 2) -= 0.5;
    k(1, 2) -= 0.5;
    text += c.name + " " + rows(k, " ") + rows(c.r, " ") + row(c.t) + "\n";
  }
  write_file(set / "test_par.txt", text);
}

inline void write_strecha(const fs::path& set, const std::vector<TextbookCamera>& cameras) {
  write_images(set / "images", cameras);
  for (const TextbookCamera& c : cameras) {
    write_file(set / "cameras" / (c.name + ".camera"),
               rows(c.k, "\n") + "0 0 0\n" + rows(c.r.transpose(), "\n") + row(-c.r.transpose() * c.t) +
                   "\n" + std::to_string(c.width) + " " + std::to_string(c.height) + "\n");
  }
}

inline void write_krt(const fs::path& set, const std::vector<TextbookCamera>& cameras,
                      const char* suffix = ".txt") {
  write_images(set / "images", cameras);
  for (const TextbookCamera& c : cameras) {
    write_file(set / "cameras" / (fs::path(c.name).stem().string() + suffix),
               "# K, R, t\n" + rows(c.k, "\n") + "\n" + rows(c.r, "\n") + "\n" + row(c.t) + "\n");
  }
}

}  // namespace roxel::fixture
