#include "roxel/march/sample_plan.h"

#include <algorithm>
#include <cmath>

namespace roxel {

namespace {

/// Depths between which the box can be seen: of its corners, 0 where the camera is inside or beside it.
Stretch depths_of(const PinholeCamera& camera, const Eigen::AlignedBox3d& box) {
  Stretch depths{std::numeric_limits<double>::infinity(), 0};
  for (int corner = 0; corner < 8; ++corner) {
    const Eigen::Vector3d x = box.corner(static_cast<Eigen::AlignedBox3d::CornerType>(corner));
    const double z = camera.camera_from_world(x).z();
    depths.begin = std::min(depths.begin, z);
    depths.end = std::max(depths.end, z);
  }
  depths.begin = std::max(depths.begin, 0.0);
  return depths;
}

}  // namespace

SamplePlan SamplePlan::coarser() const {
  SamplePlan plan = *this;
  ++plan.finest_level;
  ++plan.root_level;
  plan.serves_until_.insert(plan.serves_until_.begin(), 0.0);
  return plan;
}

SamplePlan make_sample_plan(const PinholeCamera& camera, const Eigen::AlignedBox3d& box, double voxel_size,
                            Stretch range, const SamplePlanOptions& options) {
  const double focal = 0.5 * (camera.intrinsics.fx + camera.intrinsics.fy);
  const double diagonal_px_at_unit_depth = focal * voxel_size / options.samples_per_voxel;
  const Stretch box_depths = depths_of(camera, box);
  const double nearest = std::max(range.begin, box_depths.begin);
  const double farthest = std::max(std::min(range.end, box_depths.end), voxel_size);

  SamplePlan plan;
  plan.range = range;
  const auto level_at = [&](double depth) {
    const double side = diagonal_px_at_unit_depth / std::max(depth, 1e-9 * voxel_size) / std::sqrt(2.0);
    return std::clamp(static_cast<int>(std::floor(std::log2(std::max(side, 1e-9)))), 0, 30);
  };
  plan.finest_level = std::min(level_at(farthest), options.max_root_level);
  plan.root_level =
      options.adaptive ? std::min(level_at(nearest), options.max_root_level) : plan.finest_level;
  plan.root_level = std::max(plan.root_level, plan.finest_level);
  plan.serves_until_.resize(plan.root_level + 1);
  for (int level = 0; level <= plan.root_level; ++level)
    plan.serves_until_[level] = diagonal_px_at_unit_depth / (std::sqrt(2.0) * std::ldexp(1.0, level));
  return plan;
}

}  // namespace roxel
