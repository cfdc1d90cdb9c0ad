/// A still life with hollow and thin things on a table in a furnished room, photographed from all around at
/// three heights: a scene that goes on beyond the box. Metres, the floor at z = 0; the room is open above.

#include <cmath>
#include <numbers>

#include "roxel/synth/camera_paths.h"
#include "roxel/synth/mesh_builder.h"
#include "roxel/synth/noise.h"
#include "roxel/synth/world.h"

namespace roxel {
namespace {

using Eigen::Vector2f;
using Eigen::Vector3d;
using Eigen::Vector3f;

constexpr float kTop = 0.75f;                                // of the table
constexpr float kHalfX = 2.6f, kHalfY = 2.3f, kWall = 3.4f;  // of the room

enum TableStuff {
  kTableWood,
  kCloth,
  kCup,
  kBowl,
  kApple,
  kPear,
  kVase,
  kTwig,
  kCard,
  kBookA,
  kBookB,
  kBookC,
  kPages,
  kBrass,
  kWax,
  kFloor,
  kCarpet,
  kPaperA,
  kPaperB,
  kBricks,
  kPanels,
  kPoster,
  kPosterB,
  kFurniture,
  kFabric,
};

std::vector<Texture> table_textures(std::uint32_t seed) {
  return {
      planks(0x4a2f1c, 0xa9743f, 0.11f, seed),
      tiles({{0xe9dfc9, 0xb5452f, 0xe9dfc9, 0x2d4a7c, 0xd9a441}, 0xf4efe6, 0.035f, 0.035f, 0.004f, 0},
            seed + 1),
      banded({0xd9702e, 0x1f5f8b, 0xe9dfc9, 0x2f7d5b}, 0.022f, seed + 2),
      grained(banded({0x14506b, 0x39aa9a, 0xe8dcc4, 0x1c7f9c}, 0.018f, seed + 3), 0.02f, 0.4f, seed + 4),
      mottled(0xa01a1a, 0xd9b23a, 0.03f, seed + 5),
      mottled(0x8a9a2a, 0xd9c24a, 0.025f, seed + 6),
      collage(0x22577a, {0xe9dfc9, 0xd8b04a, 0x9e2f25, 0x1a2f4a}, 0.05f, seed + 7),
      grained(uniform_paint(0x5d4330), 0.01f, 0.6f, seed + 8),
      collage(0xb99a6a, {0x8a2c4e, 0x33312f, 0xe9dfc9, 0x2f7d5b}, 0.06f, seed + 9),
      collage(0x8a2c2c, {0xe0b040, 0xf4efe6, 0x33312f}, 0.07f, seed + 10),
      collage(0x2f5a3a, {0xe9dfc9, 0xd9a441, 0x1a1a1a}, 0.06f, seed + 11),
      collage(0xd8c49a, {0x1f5f8b, 0xb23a2a, 0x33312f}, 0.08f, seed + 12),
      planks(0xcfc4a8, 0xf2ead6, 0.004f, seed + 13),
      mottled(0x8a6a1c, 0xe2b64a, 0.012f, seed + 14),
      mottled(0xf0e8d8, 0xd8ccb0, 0.01f, seed + 15),
      planks(0x6a4a2c, 0xb98a52, 0.16f, seed + 16),
      collage(0x7a2a2a, {0xd9a441, 0x22324a, 0xe0cfae, 0x3a6a5a}, 0.3f, seed + 17),
      collage(0xd8cfb8, {0x8aa08a, 0xb58a6a, 0x6f7d86, 0xc9b06a}, 0.22f, seed + 18),
      tiles({{0xc9d2d8, 0xa9bcc8, 0xdcdcd2, 0x9fb0bc}, 0xe4e0d4, 0.3f, 0.3f, 0.03f, 0.5f}, seed + 19),
      tiles({{0x9a4a34, 0xb5654a, 0x7d3a2c, 0xa9583c}, 0xc9c0b0, 0.24f, 0.08f, 0.012f, 0.5f}, seed + 20),
      planks(0x6a8a74, 0xb8ccb0, 0.14f, seed + 21),
      collage(0xf0e8d8, {0xb23a2a, 0x1f5f8b, 0xe0b040, 0x2f7d5b, 0x33312f}, 0.35f, seed + 22),
      mottled(0x1f3f6b, 0xe0a45a, 0.3f, seed + 23),
      planks(0x2f1f14, 0x7d5233, 0.09f, seed + 24),
      grained(banded({0x8a2c4e, 0xd9a441, 0x2d4a7c, 0xe9dfc9}, 0.06f, seed + 25), 0.02f, 0.4f, seed + 26),
  };
}

/// A turned thing with a wall: outside up, rim, inside down.
void hollow(MeshBuilder& build, std::vector<Vector2f> outside, float wall) {
  std::vector<Vector2f> profile = outside;
  for (std::size_t i = outside.size() - 1; i > 0; --i) {
    const Vector2f& p = outside[i];
    profile.emplace_back(std::max(p.x() - wall, 0.0f),
                         i == outside.size() - 1 ? p.y() : std::max(p.y(), wall));
  }
  profile.emplace_back(0, wall);
  build.lathe(profile, 72);
}

void add_cup(MeshBuilder& build) {
  build.place(placed({-0.24f, -0.10f, kTop + 0.0015f}, 2.4f));
  build.use(kCup);
  hollow(build, {{0, 0}, {0.032f, 0}, {0.038f, 0.008f}, {0.041f, 0.05f}, {0.043f, 0.095f}}, 0.004f);
  std::vector<Vector3f> path;
  for (int i = 0; i <= 20; ++i) {
    const float turn = std::numbers::pi_v<float> * (0.5f - static_cast<float>(i) / 20);
    path.emplace_back(0.039f + 0.034f * std::cos(turn), 0, 0.052f + 0.03f * std::sin(turn));
  }
  build.tube(path, 0.0055f, 14);
}

void add_bowl(MeshBuilder& build) {
  build.place(placed({0.17f, 0.15f, kTop + 0.0015f}));
  build.use(kBowl);
  const Vector2f knots[] = {{0.0f, 0.0f},   {0.045f, 0.002f}, {0.05f, 0.012f},
                            {0.09f, 0.04f}, {0.115f, 0.075f}, {0.12f, 0.085f}};
  hollow(build, smooth_profile(knots, 5), 0.006f);
  build.use(kApple);
  build.ellipsoid({-0.035f, 0.02f, 0.06f}, {0.038f, 0.038f, 0.035f}, 48);
  build.ellipsoid({0.042f, 0.03f, 0.062f}, {0.036f, 0.037f, 0.034f}, 48);
  build.use(kPear);
  build.ellipsoid({0.0f, -0.048f, 0.062f}, {0.034f, 0.034f, 0.04f}, 48);
  build.use(kTwig);
  build.cylinder({-0.035f, 0.02f, 0.092f}, {-0.03f, 0.024f, 0.115f}, 0.0018f, 8);
}

void add_vase(MeshBuilder& build, std::uint32_t seed) {
  build.place(placed({0.0f, -0.01f, kTop + 0.0015f}));
  build.use(kVase);
  const Vector2f knots[] = {{0.0f, 0.0f},   {0.04f, 0.0f},  {0.065f, 0.05f}, {0.06f, 0.12f},
                            {0.03f, 0.18f}, {0.028f, 0.2f}, {0.042f, 0.235f}};
  hollow(build, smooth_profile(knots, 6), 0.005f);
  build.use(kTwig);
  for (int i = 0; i < 5; ++i) {
    const auto random = [&](int what) { return lattice_random(i, what, 4, seed); };
    const float turn = 1.2566f * (static_cast<float>(i) + 0.4f * random(0)), lean = 0.05f + 0.07f * random(1);
    std::vector<Vector3f> path;
    for (int k = 0; k <= 10; ++k) {
      const float t = static_cast<float>(k) / 10;
      path.emplace_back(lean * t * t * std::cos(turn + 0.6f * t), lean * t * t * std::sin(turn + 0.6f * t),
                        0.03f + (0.36f + 0.06f * random(2)) * t);
    }
    build.tube(path, 0.0028f, 8);
    build.ellipsoid(path.back(), Vector3f::Constant(0.009f), 12);
    const Vector3f side = path[7] + Vector3f(0.03f * std::cos(turn + 2), 0.03f * std::sin(turn + 2), 0.04f);
    build.cylinder(path[7], side, 0.002f, 8);
    build.ellipsoid(side, Vector3f::Constant(0.007f), 12);
  }
}

void add_open_box(MeshBuilder& build) {
  build.place(placed({-0.18f, 0.19f, kTop + 0.0015f}, 0.5f));
  build.use(kCard);
  constexpr float x = 0.09f, y = 0.06f, z = 0.08f, w = 0.004f;
  build.box({-x, -y, 0}, {x, y, w});
  build.box({-x, -y, w}, {x, -y + w, z});
  build.box({-x, y - w, w}, {x, y, z});
  build.box({-x, -y + w, w}, {-x + w, y - w, z});
  build.box({x - w, -y + w, w}, {x, y - w, z});
}

void add_books(MeshBuilder& build) {
  struct Book {
    int cover;
    Vector3f half;
    float turn;
  };
  float z = kTop + 0.0015f;
  for (const Book& book :
       {Book{kBookA, {0.10f, 0.07f, 0.014f}, 0.35f}, Book{kBookB, {0.085f, 0.062f, 0.011f}, -0.1f},
        Book{kBookC, {0.07f, 0.05f, 0.009f}, 0.8f}}) {
    const Vector3f& h = book.half;
    constexpr float kCover = 0.002f;
    build.place(placed({0.22f, -0.17f, z}, book.turn));
    build.use(book.cover);
    build.box({-h.x(), -h.y(), 0}, {h.x(), h.y(), kCover});
    build.box({-h.x(), -h.y(), 2 * h.z() - kCover}, {h.x(), h.y(), 2 * h.z()});
    build.box({-h.x(), -h.y(), kCover}, {h.x(), -h.y() + kCover, 2 * h.z() - kCover});
    build.use(kPages);
    build.box({-h.x() + 0.004f, -h.y() + kCover, kCover},
              {h.x() - 0.004f, h.y() - 0.004f, 2 * h.z() - kCover});
    z += 2 * h.z();
  }
}

void add_candle(MeshBuilder& build) {
  build.place(placed({-0.05f, -0.23f, kTop + 0.0015f}));
  build.use(kBrass);
  const Vector2f foot[] = {{0, 0},           {0.045f, 0},      {0.045f, 0.006f},
                           {0.012f, 0.014f}, {0.006f, 0.03f},  {0.006f, 0.12f},
                           {0.016f, 0.13f},  {0.016f, 0.145f}, {0, 0.145f}};
  build.lathe(foot, 40);
  build.use(kWax);
  build.cylinder({0, 0, 0.14f}, {0, 0, 0.27f}, 0.009f, 24);
}

/// A cube of wire.
void add_wire_cube(MeshBuilder& build) {
  build.place(placed({0.36f, 0.03f, kTop + 0.0045f}, 0.6f));
  build.use(kBrass);
  constexpr float e = 0.055f, r = 0.003f;
  for (float a : {-e, e})
    for (float b : {-e, e}) {
      build.cylinder({-e, a, b + e}, {e, a, b + e}, r, 10);
      build.cylinder({a, -e, b + e}, {a, e, b + e}, r, 10);
      build.cylinder({a, b, 0}, {a, b, 2 * e}, r, 10);
    }
}

void add_table(MeshBuilder& build) {
  build.place(Eigen::Affine3f::Identity());
  build.use(kTableWood);
  build.box({-0.72f, -0.5f, kTop - 0.035f}, {0.72f, 0.5f, kTop});
  for (float x : {-0.64f, 0.64f})
    for (float y : {-0.42f, 0.42f})
      build.box({x - 0.03f, y - 0.03f, 0}, {x + 0.03f, y + 0.03f, kTop - 0.035f});
  build.use(kCloth);
  build.box({-0.46f, -0.3f, kTop}, {0.46f, 0.3f, kTop + 0.0015f});
}

void add_walls(MeshBuilder& build) {
  build.place(Eigen::Affine3f::Identity());
  constexpr float x = kHalfX, y = kHalfY, w = 0.1f;
  build.use(kFloor);
  build.box({-x, -y, -w}, {x, y, 0});
  build.use(kPaperA);
  build.box({-x, y, 0}, {x, y + w, kWall});
  build.use(kPaperB);
  build.box({-x, -y - w, 0}, {x, -y, kWall});
  build.use(kBricks);
  build.box({x, -y, 0}, {x + w, y, kWall});
  build.use(kPanels);
  build.box({-x - w, -y, 0}, {-x, y, kWall});
  build.use(kCarpet);
  build.box({-1.5f, -1.2f, 0}, {1.5f, 1.2f, 0.01f});
}

void add_shelf(MeshBuilder& build, std::uint32_t seed) {
  build.place(placed({0.3f, kHalfY - 0.17f, 0}));
  build.use(kFurniture);
  for (int level = 0; level < 5; ++level)
    build.box({-0.8f, -0.15f, 0.4f * level + 0.05f}, {0.8f, 0.17f, 0.4f * level + 0.08f});
  for (float x : {-0.82f, 0.8f}) build.box({x, -0.16f, 0}, {x + 0.02f, 0.17f, 1.75f});
  for (int level = 0; level < 5; ++level)
    for (int i = 0; i < 24; ++i) {
      const auto random = [&](int what) { return lattice_random(i, level, what, seed + 40); };
      if (random(0) < 0.2f) continue;
      const float at = -0.77f + 0.063f * static_cast<float>(i), z = 0.4f * static_cast<float>(level) + 0.08f;
      build.use(kBookA + static_cast<int>(3 * random(1)));
      build.box({at, -0.12f + 0.06f * random(2), z},
                {at + 0.035f + 0.024f * random(3), 0.12f, z + 0.18f + 0.12f * random(4)});
    }
}

void add_chair(MeshBuilder& build, const Vector3f& at, float turn) {
  build.place(placed(at, turn));
  build.use(kFurniture);
  for (float x : {-0.2f, 0.2f}) {
    build.box({x - 0.02f, -0.22f, 0}, {x + 0.02f, -0.18f, 0.44f});
    build.box({x - 0.02f, 0.18f, 0}, {x + 0.02f, 0.22f, 0.95f});
  }
  for (int i = 0; i < 3; ++i)
    build.box({-0.18f, 0.19f, 0.56f + 0.13f * i}, {0.18f, 0.21f, 0.62f + 0.13f * i});
  build.use(kFabric);
  build.box({-0.23f, -0.23f, 0.44f}, {0.23f, 0.23f, 0.49f});
}

void add_room(MeshBuilder& build, std::uint32_t seed) {
  add_walls(build);
  add_shelf(build, seed);
  add_chair(build, {-2.1f, -1.7f, 0}, 2.3f);
  add_chair(build, {2.1f, -1.5f, 0}, 4.0f);
  add_chair(build, {-2.0f, 1.6f, 0}, 0.8f);
  build.place(Eigen::Affine3f::Identity());
  build.use(kPoster);
  build.box({-1.5f, -kHalfY, 1.0f}, {-0.4f, -kHalfY + 0.02f, 1.9f});
  build.box({kHalfX - 0.02f, -0.9f, 1.0f}, {kHalfX, 0.2f, 1.8f});
  build.use(kPosterB);
  build.box({0.4f, -kHalfY, 1.1f}, {1.3f, -kHalfY + 0.02f, 1.8f});
  build.box({-kHalfX, 0.1f, 0.9f}, {-kHalfX + 0.02f, 1.2f, 1.9f});
  build.use(kFurniture);
  build.box({kHalfX - 0.5f, 0.7f, 0}, {kHalfX - 0.02f, 1.9f, 0.9f});
  build.box({-1.7f, -kHalfY + 0.02f, 0}, {-0.5f, -kHalfY + 0.42f, 0.7f});
}

void add_table_shots(World& world, const WorldRequest& request) {
  const Vector3d target(0, 0, kTop + 0.11);
  const Intrinsics intrinsics = simple_intrinsics(request.width, request.height, 1.25);
  constexpr double kElevations[] = {12, 30, 52};
  for (int i = 0; i < request.images; ++i) {
    const int ring = i % 3;
    const double azimuth = 360.0 * i / request.images + 7;
    const Vector3d centre = around(target, 1.2 - 0.05 * ring, azimuth, kElevations[ring]);
    world.shots.push_back({shot_name(i), {intrinsics, looking_at(centre, target)}});
  }
}

}  // namespace

World table_world(const WorldRequest& request) {
  World world;
  world.bounds = {Vector3d(-0.46, -0.36, kTop - 0.01), Vector3d(0.46, 0.36, kTop + 0.48)};
  world.masked = false;
  world.lamp_direction = Vector3f(-0.25f, -0.32f, 0.9f);
  world.surround = 2.2f;
  world.skylight = Skylight{{Vector2f(-kHalfX, -kHalfY), Vector2f(kHalfX, kHalfY)}, kWall};
  world.stages = {{Vector3f(-0.66f, -0.42f, kTop), Vector3f(-0.54f, 0.42f, kTop)},
                  {Vector3f(0.54f, -0.42f, kTop), Vector3f(0.66f, 0.42f, kTop)}};
  world.transient_size = 0.14f;
  world.materials = table_textures(request.seed);
  MeshBuilder build(world.mesh);
  add_table(build);
  add_cup(build);
  add_bowl(build);
  add_vase(build, request.seed);
  add_open_box(build);
  add_books(build);
  add_candle(build);
  add_wire_cube(build);
  add_room(build, request.seed);
  add_table_shots(world, request);
  give_each_shot_its_occasion(world);
  return world;
}

}  // namespace roxel
