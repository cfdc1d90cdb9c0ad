#pragma once
/// The demo world's solid: a round temple on a floating island, with trees. World units of about the island's
/// radius, Z up, the lawn at z = 0. Geometry is a signed distance, colour a procedural diffuse texture with
/// detail at every scale, so that images match everywhere and at every resolution.

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <array>
#include <cstdint>

#include "roxel/synth/shapes.h"

namespace roxel {

/// What a surface point belongs to; decides its texture.
enum class DemoPart : std::uint8_t {
  kIsland,
  kSteps,
  kColumn,
  kCapital,
  kBeam,
  kDome,
  kFinial,
  kPedestal,
  kVase,
  kTrunk,
  kLeaves,
  kBoulder,
};

class DemoScene {
 public:
  struct Nearest {
    float distance;  ///< to the surface, negative inside; a safe step for a ray
    DemoPart part;
    int index;  ///< which column, tree or boulder
  };

  /// The seed moves trees and boulders and changes every texture's noise.
  explicit DemoScene(std::uint32_t seed);

  Nearest nearest(const Eigen::Vector3f& p) const;
  float distance(const Eigen::Vector3f& p) const { return nearest(p).distance; }
  /// Outward unit normal at a surface point, by differences over `step` (world units).
  Eigen::Vector3f normal(const Eigen::Vector3f& p, float step) const;
  /// Diffuse albedo, linear RGB in [0, 1], at a surface point with this outward normal.
  Eigen::Vector3f albedo(const Eigen::Vector3f& p, const Eigen::Vector3f& normal) const;

  /// Everything is inside this box; no part touches it.
  static Eigen::AlignedBox3f bounds();

 private:
  struct Tree {
    Eigen::Vector2f foot;
    float height;
    float crown_radius;
    Ellipsoid crown;
  };
  struct Boulder {
    Eigen::Vector3f centre;
    Ellipsoid shape;
  };

  float island(const Eigen::Vector3f& p) const;
  void add_temple(const Eigen::Vector3f& p, Nearest& best) const;
  void add_columns(const Eigen::Vector3f& p, Nearest& best) const;
  void add_vase(const Eigen::Vector3f& p, Nearest& best) const;
  void add_tree(const Eigen::Vector3f& p, int index, Nearest& best) const;
  void add_boulder(const Eigen::Vector3f& p, int index, Nearest& best) const;

  std::uint32_t seed_;
  std::array<Tree, 4> trees_;
  std::array<Boulder, 5> boulders_;
};

}  // namespace roxel
