#include "engine_worlds.h"

#include <algorithm>
#include <cmath>
#include <random>

#include "roxel/base/parallel.h"

namespace roxel {
namespace {

constexpr int kSampleLevel = 1;

Topology full_block(int side_in_bricks) {
  Topology topology({{0, 0, 0}, 1, Eigen::Vector3i::Constant(side_in_bricks)});
  for (int z = 0; z < side_in_bricks; ++z)
    for (int y = 0; y < side_in_bricks; ++y)
      for (int x = 0; x < side_in_bricks; ++x) topology.insert_brick({x, y, z}, BrickMask().set());
  return topology;
}

Topology half_block(int side_in_bricks) {
  Topology topology({{0, 0, 0}, 1, Eigen::Vector3i::Constant(side_in_bricks)});
  std::mt19937_64 random(1);
  for (int z = 0; z < side_in_bricks; ++z)
    for (int y = 0; y < side_in_bricks; ++y)
      for (int x = 0; x < side_in_bricks; ++x) {
        BrickMask mask;
        for (int word = 0; word < kBrickVoxels / 64; ++word) mask = mask << 64 | BrickMask(random());
        topology.insert_brick({x, y, z}, mask);
      }
  return topology;
}

Topology sheets(int side_in_bricks, double thickness) {
  Topology topology({{0, 0, 0}, 1, Eigen::Vector3i::Constant(side_in_bricks)});
  topology.insert_bricks(gyroid_bricks(side_in_bricks, 1.5, thickness, 1));
  return topology;
}

/// sin x cos y + sin y cos z + sin z cos x, zero on the gyroid, of phases at whole and half voxels.
class Gyroid {
 public:
  Gyroid(int side, double periods) : radians_(2 * M_PI * periods / side), sin_(side), cos_(side) {
    for (int i = 0; i < side; ++i) {
      sin_[i] = static_cast<float>(std::sin(radians_ * (i + 0.5)));
      cos_[i] = static_cast<float>(std::cos(radians_ * (i + 0.5)));
    }
  }
  float at(int x, int y, int z) const { return sin_[x] * cos_[y] + sin_[y] * cos_[z] + sin_[z] * cos_[x]; }
  /// The value this many voxels away from the sheet: the gradient there is 1.2 to 1.7 a radian.
  float from_voxels(double voxels) const { return static_cast<float>(1.5 * radians_ * voxels); }
  /// What the value changes by at most over so many voxels.
  float most_change(double voxels) const { return static_cast<float>(2.2 * radians_ * voxels); }

 private:
  double radians_;
  std::vector<float> sin_, cos_;
};

/// Pixels of one colour with some noise: most voxels agree with them, more or less.
Image speckle(int side, unsigned seed) {
  std::mt19937 random(seed);
  std::normal_distribution<float> noise(0, 3);
  Image image(side, side, 3);
  for (std::size_t i = 0; i < image.data().size(); ++i)
    image.data()[i] = (i % 3 == 0 ? 50 : 0) + noise(random);
  return image;
}

/// Evenly spread over the sphere.
Eigen::Vector3d direction_of(int index, int count) {
  const double z = 1 - (2.0 * index + 1) / count, angle = index * M_PI * (3 - std::sqrt(5.0)) + 0.5;
  const double radius = std::sqrt(1 - z * z);
  return {radius * std::cos(angle), radius * std::sin(angle), z};
}

PinholeCamera camera_towards(const Eigen::Vector3d& target, const Eigen::Vector3d& from, int side_px,
                             double focal_px) {
  const Eigen::Vector3d z = (target - from).normalized();
  const Eigen::Vector3d x = z.cross(Eigen::Vector3d(0.1, 1, 0.2)).normalized();
  PinholeCamera camera;
  camera.pose.centre = from;
  camera.pose.rotation << x.transpose(), z.cross(x).transpose(), z.transpose();
  camera.intrinsics = {side_px, side_px, focal_px, focal_px, 0.5 * side_px, 0.5 * side_px, 0};
  return camera;
}

}  // namespace

const char* name_of(Occupancy occupancy) {
  switch (occupancy) {
    case Occupancy::kFull:
      return "full";
    case Occupancy::kHalf:
      return "half";
    case Occupancy::kShell:
      return "shell";
    case Occupancy::kSheet:
      return "sheet";
  }
  return "";
}

std::vector<BrickVoxels> gyroid_bricks(int side_in_bricks, double periods, double thickness, int threads) {
  const Gyroid gyroid(kBrickSide * side_in_bricks, periods);
  const float limit = gyroid.from_voxels(thickness / 2), reach = gyroid.most_change(7);
  std::vector<std::vector<BrickVoxels>> of_layer(side_in_bricks);
  parallel_for(side_in_bricks, threads, [&](std::int64_t layer, int) {
    const int bz = static_cast<int>(layer);
    for (int by = 0; by < side_in_bricks; ++by)
      for (int bx = 0; bx < side_in_bricks; ++bx) {
        const Eigen::Vector3i first = kBrickSide * Eigen::Vector3i(bx, by, bz);
        if (std::abs(gyroid.at(first.x() + 4, first.y() + 4, first.z() + 4)) > limit + reach) continue;
        BrickMask mask;
        for (int k = 0; k < kBrickSide; ++k)
          for (int j = 0; j < kBrickSide; ++j)
            for (int i = 0; i < kBrickSide; ++i)
              mask[voxel_in_brick(i, j, k)] =
                  std::abs(gyroid.at(first.x() + i, first.y() + j, first.z() + k)) <= limit;
        if (mask.any()) of_layer[layer].push_back({{bx, by, bz}, mask});
      }
  });
  std::vector<BrickVoxels> bricks;
  for (const std::vector<BrickVoxels>& layer : of_layer)
    bricks.insert(bricks.end(), layer.begin(), layer.end());
  return bricks;
}

Volume make_volume(Occupancy occupancy) {
  Volume volume({occupancy == Occupancy::kFull    ? full_block(12)
                 : occupancy == Occupancy::kHalf  ? half_block(16)
                 : occupancy == Occupancy::kShell ? sheets(28, 4)
                                                  : sheets(32, 1.5)});
  // As opaque as lets most rays through.
  const bool thin = occupancy == Occupancy::kShell || occupancy == Occupancy::kSheet;
  std::fill(volume.tau.begin(), volume.tau.end(), tau_from_alpha(thin ? 0.08f : 0.02f));
  return volume;
}

std::vector<SampleNode> make_nodes(const Volume& volume, const ViewOptions& options) {
  const Eigen::AlignedBox3d box = volume.index(0).frame().box();
  const double side = box.sizes().maxCoeff(), distance = 1.8 * side, shown = 1.4 * side;
  const int samples = std::min(static_cast<int>(shown / options.spacing), options.most_samples);
  const int side_px = samples << kSampleLevel;
  std::vector<SampleNode> nodes;
  for (int n = 0; n < options.count; ++n) {
    const Eigen::Vector3d from = box.center() + distance * direction_of(n, options.count);
    SampleView view;
    view.camera = camera_towards(box.center(), from, side_px, side_px * distance / shown);
    view.plan.finest_level = view.plan.root_level = kSampleLevel;
    view.plan.range = {distance - 0.9 * side, distance + 0.9 * side};
    view.pyramid =
        std::make_shared<SamplePyramid>(speckle(side_px, n + 1), Mask(), Mask(), kSampleLevel, kSampleLevel);
    view.pixel_weight = 1.0f / (1 << 2 * kSampleLevel);
    nodes.push_back({view});
  }
  return nodes;
}

}  // namespace roxel
