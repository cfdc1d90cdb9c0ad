#pragma once
/// For tests: small volumes and photographs to march through them.

#include <Eigen/Dense>
#include <cmath>
#include <memory>
#include <random>
#include <vector>

#include "roxel/infer/run_pass.h"

namespace roxel::fixture {

/// A square camera of size x size pixels at `centre` that looks at `target`, y of the image along -`up`.
inline PinholeCamera camera_at(const Eigen::Vector3d& centre, const Eigen::Vector3d& target, int size,
                               double focal_px, const Eigen::Vector3d& up = Eigen::Vector3d(0.1, 1, 0.2)) {
  const Eigen::Vector3d z = (target - centre).normalized();
  const Eigen::Vector3d x = z.cross(up).normalized();
  PinholeCamera camera;
  camera.pose.rotation.row(0) = x;
  camera.pose.rotation.row(1) = z.cross(x);
  camera.pose.rotation.row(2) = z;
  camera.pose.centre = centre;
  camera.intrinsics = {size, size, focal_px, focal_px, 0.5 * size, 0.5 * size, 0};
  return camera;
}

/// Samples of one size, or (divide_at given) roots that divide at those depths, nearest first, down to
/// pixels.
inline SamplePlan plan_of(Stretch range, int level, const std::vector<double>& divide_at = {}) {
  SamplePlan plan;
  plan.range = range;
  plan.root_level = level;
  plan.finest_level = level - static_cast<int>(divide_at.size());
  plan.serves_until_.assign(level + 1, 0.0);
  for (std::size_t i = 0; i < divide_at.size(); ++i) plan.serves_until_[level - i] = divide_at[i];
  return plan;
}

inline SampleView view_of(const PinholeCamera& camera, const Image& samples, const SamplePlan& plan,
                          const Mask& valid = {}, const Mask& foreground = {}) {
  SampleView view;
  view.camera = camera;
  view.plan = plan;
  view.pyramid =
      std::make_shared<SamplePyramid>(samples, valid, foreground, plan.finest_level, plan.root_level);
  return view;
}

inline Image plain_image(int size, const std::array<float, 3>& color) {
  Image image(size, size, 3);
  for (int i = 0; i < size * size; ++i)
    for (int c = 0; c < 3; ++c) image.data()[3 * i + c] = color[c];
  return image;
}

/// Pixels near one of four colours, so that some agree and some do not.
inline Image random_image(int size, std::mt19937& random) {
  constexpr float kPalette[4][3] = {{50, 0, 0}, {70, 20, -10}, {30, -20, 30}, {55, 5, 3}};
  std::uniform_int_distribution<int> pick(0, 3);
  std::normal_distribution<float> noise(0, 1.5f);
  Image image(size, size, 3);
  for (int i = 0; i < size * size; ++i) {
    const float* color = kPalette[pick(random)];
    for (int c = 0; c < 3; ++c) image.data()[3 * i + c] = color[c] + noise(random);
  }
  return image;
}

/// Voxels of size 1 from the origin on, each existing with probability `share`, tau between the two bounds
/// (uniform in the logarithm).
inline Volume random_volume(const Eigen::Vector3i& bricks, double share, double least_tau, double largest_tau,
                            std::mt19937& random) {
  Topology topology(LatticeFrame{{0, 0, 0}, 1, bricks});
  std::bernoulli_distribution exists(share);
  for (int z = 0; z < 8 * bricks.z(); ++z)
    for (int y = 0; y < 8 * bricks.y(); ++y)
      for (int x = 0; x < 8 * bricks.x(); ++x)
        if (exists(random)) topology.insert({x, y, z});
  Volume volume({topology});
  std::uniform_real_distribution<double> log_tau(std::log(least_tau), std::log(largest_tau));
  for (float& tau : volume.tau) tau = static_cast<float>(std::exp(log_tau(random)));
  return volume;
}

/// Nodes of one view each around random_volume's box, at about 20 voxels from its centre. Samples of
/// 2^divisions pixels that divide `divisions` times inside the box, down to single pixels.
inline std::vector<SampleNode> nodes_around(const Volume& volume, int count, int size_px, int divisions,
                                            std::mt19937& random) {
  const Eigen::Vector3d centre = volume.index(0).frame().box().center();
  std::normal_distribution<double> normal(0, 1);
  std::vector<SampleNode> nodes;
  for (int n = 0; n < count; ++n) {
    const Eigen::Vector3d towards =
        Eigen::Vector3d(normal(random), normal(random), normal(random)).normalized();
    const PinholeCamera camera = camera_at(centre + 20 * towards, centre, size_px, 1.6 * size_px);
    std::vector<double> divide_at;
    for (int d = 0; d < divisions; ++d) divide_at.push_back(18 + 3 * d);
    nodes.push_back({view_of(camera, random_image(size_px, random), plan_of({1, 40}, divisions, divide_at))});
  }
  return nodes;
}

/// Where the lattice of a volume made from one lattice has no voxel, kNoSlot.
inline std::uint32_t slot_at(const Volume& volume, int x, int y, int z) {
  return volume.index(0).slot({x, y, z});
}

}  // namespace roxel::fixture
