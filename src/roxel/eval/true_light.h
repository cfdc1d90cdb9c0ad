#pragma once
/// The light of true skies on a true surface: what dividing light out can reach at best. Of what surfaces
/// give each other, once, as if all were grey.

#include <memory>
#include <vector>

#include "roxel/image/image.h"
#include "roxel/surface/mesh.h"
#include "roxel/surface/mesh_rays.h"

namespace roxel {

struct TrueSky {
  Image map;            ///< equirectangular radiance (sky_picture.h) without the disc; X east, Z up
  Eigen::Vector3d sun;  ///< unit
  Eigen::Vector3d sun_irradiance = Eigen::Vector3d::Zero();  ///< on a surface that faces it; 0: no disc
};

class TrueLight {
 public:
  TrueLight(const Mesh& surface, const std::vector<TrueSky>& skies);

  /// What a white surface at `x`, as seen from `eye`, looks like under each sky: by its triangle's normal,
  /// the part of the dome that nothing hides, the sun where it is seen, and what hides the rest, in its own
  /// sun and half a dome. Empty where the ray from the eye meets something else than x.
  std::vector<Eigen::Vector3d> at(const Eigen::Vector3d& x, const Eigen::Vector3d& eye) const;

 private:
  Eigen::Vector3d facing_normal(const MeshHit& hit, const Eigen::Vector3d& direction) const;
  Eigen::Vector3d sunlight(std::size_t sky, const Eigen::Vector3d& from, const Eigen::Vector3d& normal) const;

  const Mesh& surface_;
  MeshRays rays_;
  std::vector<TrueSky> skies_;
  std::vector<std::vector<Eigen::Vector3d>> radiance_;  ///< of each sky through each facet of the dome
  std::vector<Eigen::Vector3d> flat_;                   ///< of each dome on the horizontal, without the sun
};

}  // namespace roxel
