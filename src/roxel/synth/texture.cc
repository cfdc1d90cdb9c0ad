#include "roxel/synth/texture.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

#include "roxel/color/color_space.h"
#include "roxel/synth/blend.h"
#include "roxel/synth/noise.h"

namespace roxel {
namespace {

using Eigen::Vector2f;
using Eigen::Vector3f;

Vector3f reflectance(const Vector3f& color) { return color.cwiseMax(0.0f).cwiseMin(1.0f); }

std::vector<Vector3f> mixed_paints(const std::vector<std::uint32_t>& codes) {
  std::vector<Vector3f> colors;
  for (std::uint32_t code : codes) colors.push_back(paint(code));
  return colors;
}

const Vector3f& pick(const std::vector<Vector3f>& colors, float t) {
  const auto last = static_cast<float>(colors.size() - 1);
  return colors[static_cast<std::size_t>(std::clamp(t * (last + 1), 0.0f, last))];
}

/// Coordinates along a surface: those of the coordinate plane that faces it most.
Vector2f along_surface(const Vector3f& p, const Vector3f& normal) {
  const Vector3f facing = normal.cwiseAbs();
  if (facing.z() > facing.x() && facing.z() > facing.y()) return {p.x(), p.y()};
  return {facing.x() > facing.y() ? p.y() : p.x(), p.z()};
}

int cell_of(float x) { return static_cast<int>(std::floor(x)); }

/// One layer of the collage: in some cells of a lattice a mark, upright or turned.
Vector3f with_marks(const Vector3f& below, const Vector2f& at, const std::vector<Vector3f>& colors,
                    std::uint32_t seed) {
  const int i = cell_of(at.x()), j = cell_of(at.y());
  const auto random = [&](int what) { return lattice_random(i, j, what, seed); };
  if (random(0) > 0.75f) return below;
  const Vector2f q(at.x() - i - 0.5f, at.y() - j - 0.5f);
  const float turn = 3.1416f * random(1);
  const Vector2f r(std::cos(turn) * q.x() + std::sin(turn) * q.y(),
                   std::cos(turn) * q.y() - std::sin(turn) * q.x());
  const float wide = 0.12f + 0.3f * random(2), high = 0.07f + 0.24f * random(3);
  const bool disc = random(4) < 0.3f;
  const bool inside = disc ? q.norm() < wide : std::abs(r.x()) < wide && std::abs(r.y()) < high;
  const bool hole = disc && q.norm() < 0.5f * wide;
  return inside && !hole ? pick(colors, random(5)) : below;
}

}  // namespace

Vector3f paint(std::uint32_t code) {
  static const std::array<float, 256> kTable = [] {
    std::array<float, 256> table;
    for (int i = 0; i < 256; ++i) table[i] = srgb_decode(static_cast<float>(i) / 255.0f);
    return table;
  }();
  return {kTable[code >> 16 & 255], kTable[code >> 8 & 255], kTable[code & 255]};
}

Texture uniform_paint(std::uint32_t code) {
  return [color = paint(code)](const Vector3f&, const Vector3f&) { return color; };
}

Texture mottled(std::uint32_t from, std::uint32_t to, float size, std::uint32_t seed) {
  return [a = paint(from), b = paint(to), size, seed](const Vector3f& p, const Vector3f&) {
    return mix(a, b, 0.5f + 0.9f * fractal_noise(p / size, 5, seed));
  };
}

Texture grained(Texture base, float size, float strength, std::uint32_t seed) {
  return [base = std::move(base), size, strength, seed](const Vector3f& p, const Vector3f& normal) {
    return reflectance(base(p, normal) * (1 + strength * fractal_noise(p / size, 4, seed)));
  };
}

Texture tiles(Tiling tiling, std::uint32_t seed) {
  return [colors = mixed_paints(tiling.paints), joint_color = paint(tiling.joint_paint),
          tiling = std::move(tiling), seed](const Vector3f& p, const Vector3f& normal) {
    const Vector2f at = along_surface(p, normal);
    const float t = at.y() / tiling.height;
    const int row = cell_of(t);
    const float s = at.x() / tiling.width + tiling.shift * static_cast<float>(row);
    const int column = cell_of(s);
    const float edge_s = std::min(s - column, 1 - (s - column)) * tiling.width;
    const float edge_t = std::min(t - row, 1 - (t - row)) * tiling.height;
    const Vector3f tile = pick(colors, lattice_random(column, row, 1, seed)) *
                          (0.75f + 0.4f * lattice_random(column, row, 2, seed));
    const float inside = ramp(0.3f * tiling.joint, tiling.joint, std::min(edge_s, edge_t));
    const float grain = 1 + 0.35f * fractal_noise(p / (0.3f * tiling.height), 3, seed + 3);
    return reflectance(grain * mix(joint_color, tile, inside));
  };
}

Texture collage(std::uint32_t ground, std::vector<std::uint32_t> paints, float size, std::uint32_t seed) {
  return [ground_color = paint(ground), colors = mixed_paints(paints), size, seed](const Vector3f& p,
                                                                                   const Vector3f& normal) {
    const Vector2f at = along_surface(p, normal) / size;
    Vector3f color = ground_color * (1 + 0.25f * fractal_noise(p / (0.4f * size), 4, seed));
    float frequency = 1;
    for (int layer = 0; layer < 4; ++layer, frequency *= 2.2f)
      color = with_marks(color, frequency * at + Vector2f(0.37f, 0.61f) * static_cast<float>(layer), colors,
                         seed + 10 + static_cast<std::uint32_t>(layer));
    return reflectance(color * (1 + 0.25f * fractal_noise(p / (0.08f * size), 2, seed + 4)));
  };
}

Texture planks(std::uint32_t dark, std::uint32_t light, float width, std::uint32_t seed) {
  return [a = paint(dark), b = paint(light), width, seed](const Vector3f& p, const Vector3f& normal) {
    const Vector2f at = along_surface(p, normal);
    const int board = cell_of(at.y() / width);
    const float across = at.y() / width - board;
    const float length = 9 * width, start = length * lattice_random(board, 0, 0, seed);
    const int piece = cell_of((at.x() + start) / length);
    const float along = (at.x() + start) / length - piece;
    const float tone = lattice_random(board, piece, 1, seed);
    const Vector3f stretched(at.x() / (2.2f * width), at.y() / (0.16f * width), 7.0f * tone + 0.1f * board);
    const float grain =
        fractal_noise(stretched, 4, seed + 2) + 0.5f * fractal_noise(p / (0.1f * width), 3, seed + 5);
    const float joint = std::min({across, 1 - across, 9 * along, 9 * (1 - along)});
    return Vector3f(mix(a, b, 0.25f + 0.5f * tone + 0.6f * grain) *
                    (0.35f + 0.65f * ramp(0.0f, 0.05f, joint)));
  };
}

Texture foliage(std::uint32_t dark, std::uint32_t light, float size, std::uint32_t seed) {
  return [a = paint(dark), b = paint(light), size, seed](const Vector3f& p, const Vector3f&) {
    return mix(a, b, 0.5f + 1.2f * fractal_noise(p / size, 4, seed));
  };
}

Texture banded(std::vector<std::uint32_t> paints, float height, std::uint32_t seed) {
  return [colors = mixed_paints(paints), height, seed](const Vector3f& p, const Vector3f&) {
    const float wave = 0.35f * height * value_noise(p / (1.5f * height), seed);
    const int band = cell_of((p.z() + wave) / height);
    const Vector3f& color = colors[static_cast<std::size_t>(lattice_hash(band, 0, 0, seed)) % colors.size()];
    return reflectance(color * (1 + 0.3f * fractal_noise(p / (0.4f * height), 4, seed + 1)));
  };
}

Texture in_frame(Texture texture, const Eigen::Affine3f& world_from_object) {
  const Eigen::Affine3f object_from_world = world_from_object.inverse(Eigen::Isometry);
  return [texture = std::move(texture), object_from_world](const Vector3f& p, const Vector3f& normal) {
    return texture(object_from_world * p, object_from_world.linear() * normal);
  };
}

}  // namespace roxel
