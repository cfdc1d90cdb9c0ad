#pragma once
/// Procedural diffuse colours: pure functions of a surface point, with detail at every scale where they are
/// not meant to be uniform.

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <cstdint>
#include <functional>
#include <vector>

namespace roxel {

/// Linear RGB in [0, 1] at a point with this unit normal.
using Texture = std::function<Eigen::Vector3f(const Eigen::Vector3f& p, const Eigen::Vector3f& normal)>;

/// A paint as a display shows it, 0xRRGGBB, in linear light.
Eigen::Vector3f paint(std::uint32_t code);

Texture uniform_paint(std::uint32_t code);
/// Noise from one paint to the other, features of about `size` and, in five octaves, smaller ones.
Texture mottled(std::uint32_t from, std::uint32_t to, float size, std::uint32_t seed);
/// `base` times grain of about 1 +- strength, features of about `size` and smaller.
Texture grained(Texture base, float size, float strength, std::uint32_t seed);

/// Tiles or bricks of a plane wall or floor, each its own paint; rows are shifted by `shift` of a tile.
struct Tiling {
  std::vector<std::uint32_t> paints;
  std::uint32_t joint_paint = 0x8a8378;
  float width = 0.25f;  ///< world units
  float height = 0.08f;
  float joint = 0.012f;
  float shift = 0.5f;
};
Texture tiles(Tiling tiling, std::uint32_t seed);

/// Lettering-like marks of every size on `ground`: rectangles and discs in `paints`.
Texture collage(std::uint32_t ground, std::vector<std::uint32_t> paints, float size, std::uint32_t seed);
/// Boards along the first coordinate of the surface, with grain.
Texture planks(std::uint32_t dark, std::uint32_t light, float width, std::uint32_t seed);
/// Leaves or grass: strong noise between dark and light.
Texture foliage(std::uint32_t dark, std::uint32_t light, float size, std::uint32_t seed);
/// Bands around the Z axis, each of its own paint, with wavy borders.
Texture banded(std::vector<std::uint32_t> paints, float height, std::uint32_t seed);

/// A texture of an object that was moved by this transform (without scale).
Texture in_frame(Texture texture, const Eigen::Affine3f& world_from_object);

}  // namespace roxel
