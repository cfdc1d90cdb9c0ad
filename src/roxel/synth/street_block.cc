#include "roxel/synth/street_block.h"

#include <numbers>

#include "roxel/synth/facade.h"
#include "roxel/synth/noise.h"
#include "roxel/synth/street_clutter.h"

namespace roxel {
namespace {

using Eigen::Affine3f;
using Eigen::Vector3d;
using Eigen::Vector3f;

constexpr float kQuarter = 0.5f * std::numbers::pi_v<float>;
constexpr float kHalfLength = 42, kHalfWidth = 9;

enum StreetStuff {
  kGlass,
  kFrame,
  kTrimLight,
  kTrimDark,
  kDoor,
  kRoofTiles,
  kRoofSlate,
  kRoofFlat,
  kPaving,
  kSidewalk,
  kLand,
  kBark,
  kLeavesA,
  kLeavesB,
  kMetal,
  kGlobe,
  kTyre,
  kWood,
  kWater,
  kStone,
  kCarA,
  kCarB,
  kCarC,
  kWalls,  // the first of several
};
constexpr int kWallCount = 7;

std::vector<Texture> street_textures(std::uint32_t seed) {
  const auto bricks = [&](std::vector<std::uint32_t> paints, float w, float h, std::uint32_t s) {
    return grained(tiles({std::move(paints), 0xb0a898, w, h, 0.1f * h, 0.5f}, seed + s), 1.6f, 0.35f,
                   seed + s + 1);
  };
  const auto plaster = [&](std::uint32_t a, std::uint32_t b, std::uint32_t s) {
    return grained(mottled(a, b, 1.4f, seed + s), 0.12f, 0.3f, seed + s + 1);
  };
  return {
      mottled(0x1a2530, 0x4a5a66, 0.7f, seed + 1),
      grained(uniform_paint(0xd8d4c8), 0.1f, 0.3f, seed + 2),
      plaster(0xb8ad98, 0xe0d8c4, 3),
      plaster(0x7d7466, 0xa89c88, 5),
      planks(0x3a2416, 0x7d5233, 0.16f, seed + 7),
      bricks({0x9a4a34, 0xa9583c, 0x7d3a2c, 0xb56a4a}, 0.3f, 0.36f, 9),
      bricks({0x4a505a, 0x5d646e, 0x3f444c, 0x6a6f74}, 0.36f, 0.3f, 11),
      plaster(0x6a665e, 0x96908a, 13),
      bricks({0xa39a8a, 0x8f8a80, 0xb5ab98, 0x7d7870}, 0.5f, 0.5f, 15),
      bricks({0xb8b0a0, 0xa9a498, 0xc4bcaa}, 0.9f, 0.9f, 17),
      grained(mottled(0x4a6b22, 0x8f9a55, 3.0f, seed + 19), 0.6f, 0.5f, seed + 60),
      foliage(0x3a2a1c, 0x7d6a52, 0.12f, seed + 20),
      foliage(0x1f3f14, 0x6f9a3a, 0.25f, seed + 21),
      foliage(0x3f4f14, 0xa9a045, 0.25f, seed + 22),
      grained(uniform_paint(0x2f3a34), 0.08f, 0.4f, seed + 23),
      uniform_paint(0xe8e4d8),
      grained(uniform_paint(0x2a2a2c), 0.06f, 0.3f, seed + 25),
      planks(0x5a3a20, 0xa9743f, 0.08f, seed + 26),
      mottled(0x1f4a55, 0x5a8a90, 0.3f, seed + 27),
      plaster(0x8a8478, 0xc4bcaa, 28),
      uniform_paint(0x8a1f1f),
      uniform_paint(0x2a4a6b),
      uniform_paint(0xd0d0cc),
      bricks({0x9a4a34, 0xb5654a, 0x7d3a2c, 0xa9583c}, 0.25f, 0.08f, 40),
      plaster(0xc9a45a, 0xe0c88a, 42),
      bricks({0xc4b08a, 0xb09a78, 0xd0c0a0, 0x9a8868}, 0.7f, 0.36f, 44),
      plaster(0xb5867a, 0xd8b0a0, 46),
      plaster(0x9aa89a, 0xc4d0c0, 48),
      bricks({0x8a8078, 0x7a706a, 0x9a9088}, 0.28f, 0.09f, 50),
      plaster(0xd0ccc0, 0xf0ece0, 52),
  };
}

/// A house on the ground rectangle from (0, 0) to (width, depth), its front along the x axis.
struct House {
  float width, depth;
  Facade front;
  int roof;  ///< material
  bool gable;
};

void add_roof(MeshBuilder& build, const House& house, const Affine3f& place) {
  const float z = house.front.height(), w = house.width, d = house.depth;
  build.place(place);
  build.use(house.roof);
  if (house.gable) {
    const float ridge = z + 0.32f * d, out = 0.4f;
    build.quad({-out, -out, z - 0.1f}, {w + out, -out, z - 0.1f}, {w + out, 0.5f * d, ridge},
               {-out, 0.5f * d, ridge});
    build.quad({-out, d + out, z - 0.1f}, {w + out, d + out, z - 0.1f}, {w + out, 0.5f * d, ridge},
               {-out, 0.5f * d, ridge});
    build.use(house.front.materials.wall);
    for (const float x : {0.0f, w}) build.triangle({x, 0, z}, {x, d, z}, {x, 0.5f * d, ridge - 0.1f});
    build.box({0.7f * w, 0.3f * d, z}, {0.7f * w + 0.7f, 0.3f * d + 0.7f, ridge + 0.6f});
    return;
  }
  build.quad({0, 0, z - 0.3f}, {w, 0, z - 0.3f}, {w, d, z - 0.3f}, {0, d, z - 0.3f});
  build.use(house.front.materials.trim);
  constexpr float t = 0.3f, h = 0.8f;
  build.box({0, 0, z - 0.3f}, {w, t, z + h});
  build.box({0, d - t, z - 0.3f}, {w, d, z + h});
  build.box({0, t, z - 0.3f}, {t, d - t, z + h});
  build.box({w - t, t, z - 0.3f}, {w, d - t, z + h});
  build.use(kMetal);
  build.box({0.3f * w, 0.4f * d, z - 0.3f}, {0.3f * w + 2, 0.4f * d + 1.4f, z + 1.1f});
}

/// Four fronts and a roof; sides and back are plainer than the street's front.
void add_house(MeshBuilder& build, const House& house, const Affine3f& place) {
  add_facade(build, house.front, place);
  Facade side = house.front;
  side.arcade = side.arched_windows = false;
  side.window_spacing = 3.6f;
  add_facade(build, side, place * placed({house.width, house.depth, 0}, 2 * kQuarter));
  side.width = house.depth;
  add_facade(build, side, place * placed({house.width, 0, 0}, kQuarter));
  add_facade(build, side, place * placed({0, house.depth, 0}, -kQuarter));
  add_roof(build, house, place);
}

House make_house(float width, int index, std::uint32_t seed) {
  const auto random = [&](int what) { return lattice_random(index, what, 1, seed); };
  House house;
  house.width = width;
  house.depth = 10 + 3 * random(0);
  house.front.width = width;
  house.front.floors = 2 + static_cast<int>(3 * random(1));
  house.front.floor_height = 2.9f + 0.5f * random(2);
  house.front.ground_height = 3.8f + 0.6f * random(3);
  house.front.arcade = index % 3 == 1;
  house.front.arched_windows = index % 4 == 2;
  house.front.window_spacing = 2.3f + 0.8f * random(4);
  house.front.seed = seed + static_cast<std::uint32_t>(index);
  house.front.materials = {kWalls + (index * 3 + static_cast<int>(seed % kWallCount)) % kWallCount,
                           index % 2 ? kTrimLight : kTrimDark, kGlass, kFrame, kDoor};
  house.gable = index % 3 != 2;
  house.roof = house.gable ? (index % 2 ? kRoofTiles : kRoofSlate) : kRoofFlat;
  return house;
}

/// A row of houses along the x axis of `place` with an alley after every second.
void add_row(MeshBuilder& build, float length, int first_index, const Affine3f& place, std::uint32_t seed) {
  float x = 0;
  for (int i = 0; x < length - 6; ++i) {
    const float wanted = 12 + 7 * lattice_random(first_index + i, 9, 1, seed);
    const float width = length - x - wanted < 9 ? length - x : wanted;
    const float set_back = 0.8f * lattice_random(first_index + i, 10, 1, seed);
    add_house(build, make_house(width, first_index + i, seed), place * placed({x, set_back, 0}));
    x += width + (i % 2 ? 2.6f : 0.0f);
  }
}

void add_ground(MeshBuilder& build, const Affine3f& frame) {
  build.place(frame);
  constexpr float x = kHalfLength + 20, y = kHalfWidth + 20, far = 420;
  build.use(kPaving);
  build.quad({-x, -y, 0}, {x, -y, 0}, {x, y, 0}, {-x, y, 0});
  build.use(kLand);
  build.quad({-far, -far, -0.05f}, {far, -far, -0.05f}, {far, far, -0.05f}, {-far, far, -0.05f});
  build.use(kSidewalk);
  for (const float side : {-1.0f, 1.0f}) {
    const float inner = side * (kHalfWidth - 2.4f), outer = side * (kHalfWidth + 1);
    build.box({-kHalfLength, std::min(inner, outer), 0}, {kHalfLength, std::max(inner, outer), 0.15f});
  }
}

void add_clutter(MeshBuilder& build, const Affine3f& frame, std::uint32_t seed) {
  const auto at = [&](float x, float y, float turn = 0) { return frame * placed({x, y, 0}, turn); };
  const auto random = [&](int i, int what) { return lattice_random(i, what, 2, seed); };
  for (int i = 0; i < 8; ++i) {
    const float x = -37 + 10.5f * static_cast<float>(i) + 2 * random(i, 0),
                y = (i % 2 ? 1.0f : -1.0f) * (5.2f + random(i, 1));
    add_tree(build, at(x, y, 6 * random(i, 2)), kBark, i % 3 ? kLeavesA : kLeavesB,
             lattice_hash(i, 3, 2, seed));
  }
  for (int i = 0; i < 10; ++i) {
    const float x = -38 + 8.4f * static_cast<float>(i);
    add_lamp_post(build, at(x, i % 2 ? -6.3f : 6.3f), kMetal, kGlobe);
    add_bollard(build, at(x + 3, i % 2 ? 6.4f : -6.4f), kStone);
    add_bollard(build, at(x + 4.4f, i % 2 ? 6.4f : -6.4f), kStone);
  }
  for (int i = 0; i < 5; ++i) {
    const float x = -34 + 15.5f * static_cast<float>(i) + 3 * random(i, 4);
    add_car(build, at(x, i % 2 ? 5.0f : -5.0f, 0.06f * random(i, 5) + (i % 2 ? 0 : 2 * kQuarter)),
            kCarA + i % 3, kGlass, kTyre);
    add_bench(build, at(x + 6, i % 2 ? -6.9f : 7.0f, i % 2 ? 2 * kQuarter : 0), kWood, kMetal);
  }
  add_fountain(build, at(2, 0.5f), kStone, kWater);
}

}  // namespace

Affine3f street_frame() { return placed(Vector3f::Zero(), -0.19f); }

void build_street_block(World& world, std::uint32_t seed) {
  const Affine3f frame = street_frame();
  world.outdoors = true;
  for (const Texture& texture : street_textures(seed)) world.materials.push_back(in_frame(texture, frame));
  MeshBuilder build(world.mesh);
  constexpr float l = kHalfLength, w = kHalfWidth;
  add_row(build, 2 * l, 0, frame * placed({-l, w, 0}), seed);
  add_row(build, 2 * l, 20, frame * placed({l, -w, 0}, 2 * kQuarter), seed);
  add_row(build, 2 * w, 41, frame * placed({l + 1, w, 0}, -kQuarter), seed);
  add_row(build, 2 * w, 52, frame * placed({-l - 1, -w, 0}, kQuarter), seed);
  add_clutter(build, frame, seed);
  Eigen::AlignedBox3d block;
  for (const Vector3f& v : world.mesh.vertices) block.extend(v.cast<double>());
  world.bounds = {block.min() - Vector3d(0.5, 0.5, 0.3), block.max() + Vector3d::Constant(0.5)};
  add_ground(build, frame);
  for (const float side : {-1.0f, 1.0f}) {
    const Vector3f middle = frame * Vector3f(20 * side, 0, 0);
    world.stages.push_back({middle - Vector3f(17, 1.5f, 0), middle + Vector3f(17, 1.5f, 0)});
  }
  world.transient_size = 1.75f;
}

}  // namespace roxel
