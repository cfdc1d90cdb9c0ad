#include "roxel/synth/demo_textures.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <span>

#include "roxel/base/angles.h"
#include "roxel/color/color_space.h"
#include "roxel/synth/blend.h"
#include "roxel/synth/noise.h"
#include "roxel/synth/texture.h"

namespace roxel {
namespace {

using Eigen::Vector3f;

float clamp01(float x) { return std::clamp(x, 0.0f, 1.0f); }

/// One of several paints; t in [0, 1).
Vector3f pick(std::span<const std::uint32_t> paints, float t) {
  const auto last = static_cast<float>(paints.size() - 1);
  return paint(paints[static_cast<std::size_t>(std::clamp(t * (last + 1), 0.0f, last))]);
}

/// Grain that makes every surface match at every scale: multiplies by about 1 +- strength.
Vector3f grained(const Vector3f& color, const Vector3f& p, float frequency, float strength,
                 std::uint32_t seed) {
  return color * (1 + strength * fractal_noise(frequency * p, 4, seed));
}

/// Tiles on a surface with coordinates (s, t) in tiles: each its own paint and brightness, with dark joints.
Vector3f mosaic(float s, float t, float joint, std::span<const std::uint32_t> paints, std::uint32_t seed) {
  const float fs = s - std::floor(s), ft = t - std::floor(t);
  const int i = static_cast<int>(std::floor(s)), j = static_cast<int>(std::floor(t));
  const Vector3f tile =
      pick(paints, lattice_random(i, j, 1, seed)) * (0.75f + 0.4f * lattice_random(i, j, 2, seed));
  const float edge = std::min(std::min(fs, 1 - fs), std::min(ft, 1 - ft));
  return mix(paint(0x3a322c), tile, ramp(0.5f * joint, joint, edge));
}

/// Turns around the Z axis, [0, 1), as a whole number of cells.
float cells_around(const Vector3f& p, int count) {
  return (std::atan2(p.y(), p.x()) / (2 * kPiFloat) + 0.5f) * static_cast<float>(count);
}

Vector3f marble(const Vector3f& p, std::uint32_t tint, std::uint32_t seed) {
  const float warp = fractal_noise(3.5f * p, 3, seed + 1);
  const float vein = std::abs(value_noise(9 * p + Vector3f(3 * warp, 2 * warp, 4 * warp), seed + 2));
  const Vector3f base = mix(paint(0xe8dcc4), paint(tint), ramp(-0.2f, 0.7f, fractal_noise(5 * p, 3, seed)));
  return mix(paint(0x6d5a50), base, 0.35f + 0.65f * ramp(0.0f, 0.16f, vein));
}

Vector3f rock(const Vector3f& p, std::uint32_t seed) {
  static constexpr std::uint32_t kStrata[] = {0xa3743f, 0x6a4a36, 0xc9a26a, 0x7d5f6b,
                                              0x8c5137, 0x55473f, 0xb98a5a};
  const float level = 15 * p.z() + 2.0f * fractal_noise(2.6f * p, 4, seed + 3);
  const int layer = static_cast<int>(std::floor(level));
  const Vector3f below = pick(kStrata, lattice_random(layer, 0, 0, seed));
  const Vector3f above = pick(kStrata, lattice_random(layer + 1, 0, 0, seed));
  const Vector3f color = mix(below, above, ramp(0.7f, 1.0f, level - std::floor(level)));
  // Cracks: where a stretched noise changes sign.
  const float crack = std::abs(fractal_noise(p.cwiseProduct(Vector3f(9, 9, 4)), 3, seed + 12));
  const Vector3f cracked = color * (0.4f + 0.6f * ramp(0.0f, 0.09f, crack));
  return grained(cracked, p, 30, 0.9f, seed + 4);
}

Vector3f flowers(const Vector3f& lawn, const Vector3f& p, std::uint32_t seed) {
  static constexpr std::uint32_t kPetals[] = {0xe8452c, 0xf5d22e, 0xf4efe6, 0xc456c9, 0xf08a24};
  constexpr float kSpacing = 0.055f;
  const int i = static_cast<int>(std::floor(p.x() / kSpacing)),
            j = static_cast<int>(std::floor(p.y() / kSpacing));
  if (lattice_random(i, j, 5, seed) > 0.45f) return lawn;
  const float x = p.x() / kSpacing - i - 0.3f - 0.4f * lattice_random(i, j, 6, seed);
  const float y = p.y() / kSpacing - j - 0.3f - 0.4f * lattice_random(i, j, 7, seed);
  const float size = 0.16f + 0.14f * lattice_random(i, j, 8, seed);
  return mix(pick(kPetals, lattice_random(i, j, 9, seed)), lawn, ramp(0.8f * size, size, std::hypot(x, y)));
}

Vector3f lawn(const Vector3f& p, std::uint32_t seed) {
  const Vector3f dry =
      mix(paint(0x4a6b22), paint(0xa9a545), ramp(-0.5f, 0.5f, fractal_noise(3 * p, 3, seed + 5)));
  return flowers(grained(dry, p, 28, 0.7f, seed + 6), p, seed + 7);
}

Vector3f pavement(const Vector3f& p, std::uint32_t seed) {
  static constexpr std::uint32_t kStones[] = {0xb7a489, 0x8f8a86, 0xcbb88f, 0x9a7a63, 0x6f7d86, 0xd8cbb0};
  const float radius = p.head<2>().norm();
  const float ring = radius / 0.062f;
  const int count = std::max(6, static_cast<int>(std::floor(ring)) * 6);
  const float shift = std::floor(ring) * 0.37f;
  return grained(mosaic(cells_around(p, count) + shift, ring, 0.14f, kStones, seed + 8), p, 30, 0.35f,
                 seed + 9);
}

Vector3f island(const Vector3f& p, const Vector3f& normal, std::uint32_t seed) {
  const float wobble = 0.06f * fractal_noise(6 * p, 3, seed + 10);
  const float top = ramp(0.45f, 0.7f, normal.z() + 2 * wobble) * ramp(-0.16f, -0.06f, p.z() + wobble);
  const float paved = ramp(0.965f, 0.945f, p.head<2>().norm() + 0.4f * wobble);
  if (top <= 0) return rock(p, seed);
  return mix(rock(p, seed), mix(lawn(p, seed), pavement(p, seed), paved), top);
}

Vector3f steps(const Vector3f& p, const Vector3f& normal, int step, std::uint32_t seed) {
  static constexpr std::uint32_t kTiles[] = {0x1f6f78, 0xd9a441, 0xe9dfc9, 0xb5452f, 0x2d4a7c, 0xe9dfc9};
  const Vector3f stone = marble(p, 0xc9a98a, seed + 20);
  if (normal.z() < 0.7f)
    return mix(mosaic(cells_around(p, 44), p.z() / 0.06f, 0.1f, kTiles, seed + 21 + step), stone, 0.25f);
  if (step < 2) return stone;
  // The floor inside: rings of triangles around the pedestal.
  const float ring = p.head<2>().norm() / 0.075f;
  return grained(mosaic(cells_around(p, 24) + 0.5f * ring, ring, 0.08f, kTiles, seed + 24), p, 24, 0.3f,
                 seed + 25);
}

Vector3f column(const Vector3f& p, int index, std::uint32_t seed) {
  static constexpr std::uint32_t kBands[] = {0xb23a2a, 0x1f5f8b, 0xd39a2c, 0x2f7d5b};
  const Vector3f stone = marble(p, 0xd9c2a0, seed + 30 + index);
  const float turn = index * 2 * kPiFloat / 8;
  const float x = std::cos(turn) * p.x() + std::sin(turn) * p.y() - 0.55f;
  const float y = std::cos(turn) * p.y() - std::sin(turn) * p.x();
  const float spiral = 7 * p.z() + std::atan2(y, x) / (2 * kPiFloat);
  const float band = spiral - std::floor(spiral);
  const float ribbon = ramp(0.28f, 0.31f, band) * ramp(0.62f, 0.59f, band);
  return mix(stone, grained(paint(kBands[index % 4]), p, 34, 0.5f, seed + 31), 0.9f * ribbon);
}

Vector3f beam(const Vector3f& p, const Vector3f& normal, int index, std::uint32_t seed) {
  static constexpr std::uint32_t kFrieze[] = {0xd8b04a, 0x9e2f25, 0xefe6d2, 0x22577a, 0x33312f};
  if (std::abs(normal.z()) > 0.7f) return marble(p, 0xb98f6c, seed + 40);
  const float height = index == 0 ? (p.z() - 0.88f) / 0.12f : (p.z() - 1.0f) / 0.08f;
  const float around = cells_around(p, index == 0 ? 40 : 56);
  // A zigzag between two rows of tiles.
  const float saw = std::abs(around - std::floor(around) - 0.5f) * 2;
  const Vector3f zigzag = std::abs(height - 0.3f - 0.4f * saw) < 0.13f ? paint(0xd8b04a) : paint(0x5e1f1c);
  const Vector3f tiles = mosaic(2 * around, height * 5, 0.12f, kFrieze, seed + 41 + index);
  const bool middle = height > 0.2f && height < 0.8f;
  return grained(middle ? zigzag : tiles, p, 30, 0.4f, seed + 43);
}

Vector3f dome(const Vector3f& p, std::uint32_t seed) {
  static constexpr std::uint32_t kGlaze[] = {0x0f6b75, 0x1a8f8a, 0x14506b, 0x39aa9a,
                                             0x0c3f5c, 0xcf9b3a, 0x1c7f9c};
  const float climb = std::asin(clamp01((p.z() - 1.08f) / 0.5f)) / (0.5f * kPiFloat);
  const float row = climb * 15;
  const int index = static_cast<int>(std::floor(row));
  const int count =
      std::max(8, static_cast<int>(std::lround(44 * std::cos(0.5f * kPiFloat * index / 15.0f))));
  const float around = cells_around(p, count) + 0.5f * (index & 1);
  const float fs = around - std::floor(around) - 0.5f, ft = row - std::floor(row);
  const int tile = static_cast<int>(std::floor(around)) % count;
  const Vector3f glaze = pick(kGlaze, lattice_random(tile, index, 3, seed)) *
                         (0.7f + 0.5f * lattice_random(tile, index, 4, seed));
  // A scale's round lower edge is in its own shadow.
  const float edge = ft - 0.28f * (1 - std::sqrt(std::max(0.0f, 1 - 4 * fs * fs)));
  const Vector3f scale = mix(paint(0x0a1d26), glaze, ramp(-0.02f, 0.16f, edge));
  return grained(scale, p, 26, 0.45f, seed + 50);
}

Vector3f vase(const Vector3f& p, std::uint32_t seed) {
  const float z = (p.z() - 0.36f) / 0.36f;
  const float around = cells_around(p, 12);
  const float saw = std::abs(around - std::floor(around) - 0.5f) * 2;
  const bool black = (z > 0.16f && z < 0.22f) || (z > 0.62f && z < 0.7f) || z > 0.9f ||
                     (z > 0.28f && z < 0.3f + 0.25f * saw);
  return grained(black ? paint(0x2a1c18) : paint(0xd9702e), p, 30, 0.45f, seed + 60);
}

Vector3f leaves(const Vector3f& p, int index, std::uint32_t seed) {
  static constexpr std::uint32_t kDark[] = {0x8a2c4e, 0x8f3a12, 0x2f5a1e, 0x8a6a12};
  static constexpr std::uint32_t kLight[] = {0xf2a6c4, 0xf08a2a, 0x9fc04a, 0xf2d04a};
  const float t = 0.5f + 0.9f * fractal_noise(24 * p, 4, seed + 70 + index);
  return mix(paint(kDark[index % 4]), paint(kLight[index % 4]), t);
}

}  // namespace

Vector3f demo_texture(DemoPart part, int index, const Vector3f& p, const Vector3f& normal,
                      std::uint32_t seed) {
  const auto color = [&]() -> Vector3f {
    switch (part) {
      case DemoPart::kIsland:
        return island(p, normal, seed);
      case DemoPart::kSteps:
        return steps(p, normal, index, seed);
      case DemoPart::kColumn:
        return column(p, index, seed);
      case DemoPart::kCapital:
        return grained(marble(p, 0xd8a94e, seed + 80), p, 40, 0.3f, seed + 81);
      case DemoPart::kBeam:
        return beam(p, normal, index, seed);
      case DemoPart::kDome:
        return dome(p, seed);
      case DemoPart::kFinial:
        return grained(paint(0xe2a63a), p, 30, 0.5f, seed + 82);
      case DemoPart::kPedestal:
        return marble(p, 0x6f7f8c, seed + 83);
      case DemoPart::kVase:
        return vase(p, seed);
      case DemoPart::kTrunk:
        return grained(paint(0x5d4330), p.cwiseProduct(Vector3f(40, 40, 12)), 1, 0.6f, seed + 84);
      case DemoPart::kLeaves:
        return leaves(p, index, seed);
      case DemoPart::kBoulder:
        return grained(mix(paint(0x8d8478), paint(0x6b7a4a), 0.5f + fractal_noise(9 * p, 3, seed + 85)), p,
                       30, 0.5f, seed + 86);
    }
    return Vector3f::Zero();
  };
  return color().cwiseMax(0.0f).cwiseMin(1.0f);
}

}  // namespace roxel
