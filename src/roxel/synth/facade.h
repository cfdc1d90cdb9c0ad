#pragma once
/// House fronts with windows, arches, ledges and a cornice.

#include <Eigen/Geometry>

#include "roxel/synth/mesh_builder.h"

namespace roxel {

/// Materials of a house.
struct FacadeMaterials {
  int wall, trim, glass, frame, door;
};

struct Facade {
  float width = 10;
  int floors = 3;  ///< above the ground floor
  float floor_height = 3.1f;
  float ground_height = 4.0f;
  bool arcade = false;          ///< the ground floor opens in arches
  bool arched_windows = false;  ///< on the first floor above
  float window_spacing = 2.6f;  ///< about
  FacadeMaterials materials{};
  std::uint32_t seed = 0;
  float height() const { return ground_height + floor_height * static_cast<float>(floors); }
};

/// Builds the front in the plane y = 0 from x = 0 to width, the street on the side of negative y, and moved
/// by `place`.
void add_facade(MeshBuilder& build, const Facade& facade, const Eigen::Affine3f& place);

}  // namespace roxel
