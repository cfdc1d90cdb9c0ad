#pragma once
/// For tests only: cameras in the layouts that photographers use, without files.

#include <Eigen/Dense>
#include <cmath>
#include <string>
#include <vector>

#include "roxel/dataset/dataset.h"

namespace roxel::fixture {

/// A 400 x 300 camera at `centre` that looks at `target`; `up` is only a hint.
inline View looking_at(const Eigen::Vector3d& centre, const Eigen::Vector3d& target, double focal_px = 500,
                       const Eigen::Vector3d& up = Eigen::Vector3d::UnitZ()) {
  const Eigen::Vector3d z = (target - centre).normalized();
  const Eigen::Vector3d hint = std::abs(z.dot(up)) > 0.99 ? Eigen::Vector3d(Eigen::Vector3d::UnitX()) : up;
  const Eigen::Vector3d x = z.cross(hint).normalized();
  View view;
  view.camera.pose.rotation.row(0) = x;
  view.camera.pose.rotation.row(1) = z.cross(x);
  view.camera.pose.rotation.row(2) = z;
  view.camera.pose.centre = centre;
  view.camera.intrinsics = {400, 300, focal_px, focal_px, 200, 150, 0};
  view.lens.intrinsics = view.camera.intrinsics;
  return view;
}

inline Dataset with_nodes(std::vector<View> views) {
  Dataset dataset;
  dataset.path = "set";
  dataset.views = std::move(views);
  for (std::size_t i = 0; i < dataset.views.size(); ++i) dataset.views[i].name = std::to_string(i);
  assign_nodes(dataset);
  return dataset;
}

/// A turntable: `count` cameras at distance `radius` around `target`, a little above it.
inline Dataset ring(int count, double radius, const Eigen::Vector3d& target = Eigen::Vector3d::Zero()) {
  std::vector<View> views;
  for (int i = 0; i < count; ++i) {
    const double angle = 2 * M_PI * i / count;
    views.push_back(looking_at(
        target + radius * Eigen::Vector3d(std::cos(angle), std::sin(angle), 0.3).normalized(), target));
  }
  return with_nodes(views);
}

/// An aerial strip: rows of cameras at `height` that look straight down, with 70 % overlap.
inline Dataset nadir(int rows, int columns, double height) {
  std::vector<View> views;
  for (int r = 0; r < rows; ++r) {
    for (int c = 0; c < columns; ++c) {
      const Eigen::Vector3d centre(c * 0.3 * 0.8 * height, r * 0.3 * 0.6 * height, height);
      views.push_back(looking_at(centre, centre - Eigen::Vector3d::UnitZ(), 500, Eigen::Vector3d::UnitY()));
    }
  }
  return with_nodes(views);
}

/// Cameras in front of a wall in the plane y = 0, along an arc, turned towards its middle.
inline Dataset facade(int count, double distance) {
  std::vector<View> views;
  for (int i = 0; i < count; ++i) {
    const double angle = 0.9 * (2.0 * i / (count - 1) - 1);
    views.push_back(looking_at(distance * Eigen::Vector3d(std::sin(angle), -std::cos(angle), 0),
                               Eigen::Vector3d::Zero()));
  }
  return with_nodes(views);
}

/// Panoramas: at each place, six cameras that look out horizontally and one that looks up.
inline Dataset panoramas(const std::vector<Eigen::Vector3d>& places) {
  std::vector<View> views;
  for (const Eigen::Vector3d& place : places) {
    for (int i = 0; i < 6; ++i) {
      const double angle = M_PI * i / 3;
      views.push_back(looking_at(place, place + Eigen::Vector3d(std::cos(angle), std::sin(angle), 0), 300));
    }
    views.push_back(looking_at(place, place + Eigen::Vector3d::UnitZ(), 300));
  }
  return with_nodes(views);
}

}  // namespace roxel::fixture
