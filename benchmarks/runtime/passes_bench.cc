/// What a pass costs, and how that grows: the naive voxel-centred loop of [Jethwa04] Table 5.1 against the
/// image-centred pass of Table 5.2 as it is built here, on growing volumes and image counts, both compiled
/// with the same flags and run on one thread. Times are processor time; exponents are fitted in the
/// logarithm.

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <random>
#include <vector>

#include "processor_time.h"
#include "roxel/infer/run_pass.h"

namespace {

using namespace roxel;

constexpr int kImageSide = 96;

/// Cameras on a ring around the box [-1, 1]^3, looking at its centre.
PinholeCamera ring_camera(int index, int count) {
  const double angle = 2 * M_PI * index / count;
  PinholeCamera camera;
  camera.intrinsics = {kImageSide,       kImageSide, 1.6 * kImageSide, 1.6 * kImageSide, 0.5 * kImageSide,
                       0.5 * kImageSide, 0};
  camera.pose.centre = Eigen::Vector3d(4 * std::cos(angle), 4 * std::sin(angle), 0.7);
  const Eigen::Vector3d z = -camera.pose.centre.normalized();
  const Eigen::Vector3d x = z.cross(Eigen::Vector3d::UnitZ()).normalized();
  camera.pose.rotation << x.transpose(), z.cross(x).transpose(), z.transpose();
  return camera;
}

Image speckle(unsigned seed) {
  std::mt19937 random(seed);
  std::uniform_real_distribution<float> level(0, 100);
  Image image(kImageSide, kImageSide, 3);
  for (float& value : image.data()) value = level(random);
  return image;
}

struct World {
  std::vector<SampleNode> nodes;
  Volume volume;
};

World make_world(int side, int images) {
  World world;
  const Eigen::AlignedBox3d box(Eigen::Vector3d(-1, -1, -1), Eigen::Vector3d(1, 1, 1));
  const double voxel_size = 2.0 / side;
  Topology topology(nested_frames(box, voxel_size, 0)[0]);
  const Eigen::Vector3i bricks = topology.frame().size_in_bricks;
  for (int z = 0; z < bricks.z(); ++z)
    for (int y = 0; y < bricks.y(); ++y)
      for (int x = 0; x < bricks.x(); ++x) topology.insert_brick({x, y, z}, BrickMask().set());
  world.volume = Volume({topology});
  world.volume.resize_channels();
  std::fill(world.volume.tau.begin(), world.volume.tau.end(), tau_from_alpha(0.02f));
  for (int i = 0; i < images; ++i) {
    SampleView view;
    view.camera = ring_camera(i, images);
    SamplePlanOptions plan;
    plan.samples_per_voxel = 1;
    view.plan = make_sample_plan(view.camera, box, voxel_size, {0.1, 8}, plan);
    view.pyramid = std::make_shared<SamplePyramid>(speckle(i), Mask(), Mask(), view.plan.finest_level,
                                                   view.plan.root_level);
    world.nodes.push_back({view});
  }
  return world;
}

/// Table 5.1: for each voxel, for each image: the product of (1 - a) over the voxels between, found anew each
/// time.
double naive_pass(const World& world, int side) {
  const double start = processor_seconds();
  std::vector<float> opacity(static_cast<std::size_t>(side) * side * side, 0.02f), updated(opacity.size());
  const double voxel_size = 2.0 / side;
  const auto index = [side](int x, int y, int z) {
    return x + static_cast<std::size_t>(side) * (y + static_cast<std::size_t>(side) * z);
  };
  for (int z = 0; z < side; ++z)
    for (int y = 0; y < side; ++y)
      for (int x = 0; x < side; ++x) {
        const Eigen::Vector3d centre =
            voxel_size * Eigen::Vector3d(x + 0.5, y + 0.5, z + 0.5) - Eigen::Vector3d::Ones();
        double weighted = 0, weights = 1e-9;
        for (const SampleNode& node : world.nodes) {
          const SampleView& view = node[0];
          const Eigen::Vector3d seen = view.camera.project(centre);
          if (seen.x() < 0 || seen.y() < 0 || seen.x() >= kImageSide || seen.y() >= kImageSide) continue;
          const Eigen::Vector3d towards = view.camera.pose.centre - centre;
          const Eigen::Vector3d step = voxel_size * towards.normalized();
          double visibility = 1;
          for (Eigen::Vector3d at = centre + step;; at += step) {
            const Eigen::Vector3i cell =
                ((at + Eigen::Vector3d::Ones()) / voxel_size).array().floor().cast<int>();
            if ((cell.array() < 0).any() || (cell.array() >= side).any()) break;
            visibility *= 1 - opacity[index(cell.x(), cell.y(), cell.z())];
          }
          const int level = view.plan.finest_level;
          const RegionStats sample = view.pyramid->at(level, static_cast<int>(seen.x()) >> level,
                                                      static_cast<int>(seen.y()) >> level);
          const double agreement = std::exp(-(sample.mean[0] - 50) * (sample.mean[0] - 50) / 1000.0);
          weighted += visibility * agreement;
          weights += visibility;
        }
        updated[index(x, y, z)] = static_cast<float>(weighted / weights);
      }
  volatile float used = updated[updated.size() / 2];
  (void)used;
  return processor_seconds() - start;
}

struct Cost {
  double seconds;
  double ns_per_step;
};

Cost our_pass(World& world) {
  PassOptions options;
  const double start = processor_seconds();
  const PassReport report = run_pass(world.nodes, options, RunContext(1), nullptr, world.volume);
  return {processor_seconds() - start, 1e9 * report.opacity_march_cpu_seconds / report.opacity.steps};
}

/// Slope of log(cost) over log(size).
double exponent(const std::vector<double>& sizes, const std::vector<double>& costs) {
  double mx = 0, my = 0, xy = 0, xx = 0;
  for (std::size_t i = 0; i < sizes.size(); ++i) mx += std::log(sizes[i]), my += std::log(costs[i]);
  mx /= sizes.size(), my /= sizes.size();
  for (std::size_t i = 0; i < sizes.size(); ++i) {
    xy += (std::log(sizes[i]) - mx) * (std::log(costs[i]) - my);
    xx += (std::log(sizes[i]) - mx) * (std::log(sizes[i]) - mx);
  }
  return xy / xx;
}

void table(const char* title, const std::vector<std::pair<int, int>>& runs, bool over_voxels) {
  std::printf("\n%s\n%10s %8s %14s %14s %10s %10s\n", title, "voxels", "images", "voxel loop s",
              "image pass s", "ratio", "ns/step");
  std::vector<double> sizes, naive_costs, our_costs;
  for (const auto& [side, images] : runs) {
    World world = make_world(side, images);
    const double naive = naive_pass(world, side);
    const Cost ours = our_pass(world);
    std::printf("%10d %8d %14.3f %14.3f %10.2f %10.1f\n", side * side * side, images, naive, ours.seconds,
                naive / ours.seconds, ours.ns_per_step);
    sizes.push_back(over_voxels ? std::pow(side, 3) : images);
    naive_costs.push_back(naive);
    our_costs.push_back(ours.seconds);
  }
  std::printf("exponent in %s: voxel loop %.2f, image pass %.2f\n", over_voxels ? "voxels" : "images",
              exponent(sizes, naive_costs), exponent(sizes, our_costs));
}

}  // namespace

int main() {
  table("Growing volume", {{16, 8}, {32, 8}, {48, 8}, {64, 8}}, true);
  table("Growing image count", {{32, 4}, {32, 8}, {32, 16}, {32, 32}}, false);
}
