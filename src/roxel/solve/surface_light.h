#pragma once
/// Daylight on the volume's own surfaces: by their normal, by how much of the dome they see, and by whether
/// the sun gets there, marched through the volume itself ([Jethwa04] section 9.2; docs/light.md).

#include <array>
#include <vector>

#include "roxel/base/run_context.h"
#include "roxel/march/ray_walk.h"
#include "roxel/solve/daylight.h"
#include "roxel/volume/volume.h"

namespace roxel {

using Rgb = std::array<float, 3>;

/// The voxels that are opaque enough to be surface, and which way they face.
struct SurfaceVoxels {
  std::vector<std::uint32_t> slots;      ///< ascending; a voxel's place is its index in here
  std::vector<std::int32_t> places;      ///< of every slot of the volume; -1 where it is no surface
  std::vector<Eigen::Vector3d> centres;  ///< world, one a place
  std::vector<Eigen::Vector3f> normals;  ///< unit, one a place; zero where opacity does not change

  std::size_t count() const { return slots.size(); }
};

/// The voxels of the box of at least this opacity. A normal's sign is the one that fits `towards`, one a
/// slot: where the voxel is seen from.
SurfaceVoxels surface_voxels(const Volume& volume, float least_opacity,
                             const std::vector<Eigen::Vector3f>& towards, int threads);

/// What a white surface looks like at each of the volume's surface voxels under each sky, in the unit of
/// light_of_views.
class SurfaceLight {
 public:
  /// The sky's and the sun's light on a voxel; light that other surfaces give back follows (add_bounce).
  SurfaceLight(const LatticeStack& stack, SurfaceVoxels voxels, const Daylight& daylight,
               const RunContext& context);

  const SurfaceVoxels& voxels() const { return voxels_; }
  /// Of a view of the data set; -1 where no light is known.
  int sky_of_view(int view_idx) const { return sky_of_views_[view_idx]; }
  int sky_count() const { return static_cast<int>(flat_.size()); }

  /// Light at a place.
  Rgb at(int sky, std::size_t place) const;
  /// At any slot: where it is no surface, that on the horizontal, nothing in the way. Sky -1: 1.
  Rgb of(int sky, std::uint32_t slot) const;
  /// All of it but the sun's.
  Rgb diffuse(int sky, std::size_t place) const;
  /// The sun's, nothing in the way.
  Rgb sun(int sky, std::size_t place) const;
  /// Share of the sun's light that arrives.
  float sunlit(int sky, std::size_t place) const { return sunlit_[index(sky, place)]; }
  void set_sunlit(int sky, std::size_t place, float share) { sunlit_[index(sky, place)] = share; }

  /// Light that the surfaces around a place give back, once, from what falls on them now: `albedo`, one a
  /// place, is the colour under this light.
  void add_bounce(const std::vector<Rgb>& albedo, const RunContext& context);

 private:
  /// A part of the dome that another surface hides from a place.
  struct Hidden {
    std::int32_t place;  ///< of that surface
    float weight;        ///< share of the cosine-weighted hemisphere
  };
  std::size_t index(int sky, std::size_t place) const {
    return place * static_cast<std::size_t>(sky_count()) + static_cast<std::size_t>(sky);
  }
  void look_around(const LatticeStack& stack, const Daylight& daylight, const RunContext& context);

  SurfaceVoxels voxels_;
  std::vector<int> sky_of_views_;
  std::vector<Rgb> flat_;                ///< of each sky, on the horizontal
  std::vector<Rgb> sun_;                 ///< of each sky, on a surface that faces the sun
  std::vector<Eigen::Vector3d> to_sun_;  ///< of each sky
  std::vector<Rgb> dome_, bounce_;       ///< by place and sky
  std::vector<float> sunlit_;
  std::vector<std::vector<Hidden>> hidden_;  ///< of each place
};

}  // namespace roxel
