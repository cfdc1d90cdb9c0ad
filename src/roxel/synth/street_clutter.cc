#include "roxel/synth/street_clutter.h"

#include <cmath>

#include "roxel/synth/noise.h"

namespace roxel {
namespace {

using Eigen::Vector2f;
using Eigen::Vector3f;

/// Random numbers of one tree, in the order in which they are asked for.
class Dice {
 public:
  explicit Dice(std::uint32_t seed) : seed_(seed) {}
  float operator()(float from, float to) {
    return from + (to - from) * lattice_random(++count_, 0, 0, seed_);
  }
  Vector3f direction() {
    const float z = (*this)(-1, 1), turn = (*this)(0, 6.2832f), flat = std::sqrt(1 - z * z);
    return {flat * std::cos(turn), flat * std::sin(turn), z};
  }

 private:
  std::uint32_t seed_;
  int count_ = 0;
};

void add_leaf(MeshBuilder& build, const Vector3f& at, Dice& dice) {
  const Vector3f normal = dice.direction(), u = normal.cross(dice.direction()).normalized();
  const Vector3f v = normal.cross(u);
  const float length = dice(0.12f, 0.26f), width = dice(0.07f, 0.14f);
  build.quad(at - length * u, at - width * v, at + length * u, at + width * v);
}

}  // namespace

void add_tree(MeshBuilder& build, const Eigen::Affine3f& place, int bark, int leaves, std::uint32_t seed) {
  Dice dice(seed);
  build.place(place);
  const float height = dice(2.6f, 3.6f), spread = dice(1.5f, 2.1f);
  const Vector3f trunk[] = {{0, 0, 0}, {dice(-0.1f, 0.1f), dice(-0.1f, 0.1f), 0.5f * height}, {0, 0, height}};
  build.use(bark);
  build.tube(trunk, 0.17f, 12);
  constexpr int kBranches = 9, kLeaves = 130;
  for (int i = 0; i < kBranches; ++i) {
    const float turn = 6.2832f * static_cast<float>(i) / kBranches + dice(-0.3f, 0.3f);
    const float out = spread * dice(0.35f, 1), up = dice(0.6f, 3.6f);
    const Vector3f tip(out * std::cos(turn), out * std::sin(turn), height + up);
    build.use(bark);
    build.cylinder({0, 0, height - 0.2f}, tip, 0.045f, 6);
    build.use(leaves);
    for (int k = 0; k < kLeaves; ++k) {
      const Vector3f within = dice.direction() * dice(0.2f, 1.15f);
      add_leaf(build, tip + Vector3f(within.x(), within.y(), 0.8f * within.z()), dice);
    }
  }
}

void add_lamp_post(MeshBuilder& build, const Eigen::Affine3f& place, int metal, int globe) {
  build.place(place);
  build.use(metal);
  const Vector2f shaft[] = {{0, 0},         {0.14f, 0},    {0.14f, 0.25f}, {0.06f, 0.5f},
                            {0.045f, 3.8f}, {0.09f, 3.9f}, {0, 3.9f}};
  build.lathe(shaft, 12);
  build.use(globe);
  build.ellipsoid({0, 0, 4.12f}, Vector3f::Constant(0.22f), 20);
}

void add_car(MeshBuilder& build, const Eigen::Affine3f& place, int body, int glass, int tyre) {
  build.place(place);
  build.use(body);
  build.box({-2.1f, -0.85f, 0.3f}, {2.1f, 0.85f, 0.85f});
  build.box({-1.0f, -0.72f, 1.38f}, {0.9f, 0.72f, 1.44f});
  build.use(glass);
  // A cabin that narrows upwards.
  const auto ring = [](int i, bool top) {
    const float x = top ? (i == 0 || i == 3 ? -1.0f : 0.9f) : (i == 0 || i == 3 ? -1.45f : 1.35f);
    const float y = (i < 2 ? -1.0f : 1.0f) * (top ? 0.7f : 0.8f);
    return Vector3f(x, y, top ? 1.38f : 0.85f);
  };
  for (int i = 0; i < 4; ++i)
    build.quad(ring(i, false), ring((i + 1) % 4, false), ring((i + 1) % 4, true), ring(i, true));
  build.use(tyre);
  for (const float x : {-1.35f, 1.35f})
    for (const float y : {-0.87f, 0.67f}) build.cylinder({x, y, 0.32f}, {x, y + 0.2f, 0.32f}, 0.32f, 20);
}

void add_bench(MeshBuilder& build, const Eigen::Affine3f& place, int wood, int metal) {
  build.place(place);
  build.use(wood);
  for (int i = 0; i < 3; ++i) build.box({-0.9f, -0.2f + 0.16f * i, 0.42f}, {0.9f, -0.08f + 0.16f * i, 0.46f});
  for (int i = 0; i < 2; ++i) build.box({-0.9f, 0.3f, 0.56f + 0.17f * i}, {0.9f, 0.34f, 0.68f + 0.17f * i});
  build.use(metal);
  for (const float x : {-0.75f, 0.7f}) {
    build.box({x, -0.2f, 0}, {x + 0.05f, -0.15f, 0.42f});
    build.box({x, 0.28f, 0}, {x + 0.05f, 0.33f, 0.85f});
  }
}

void add_bollard(MeshBuilder& build, const Eigen::Affine3f& place, int stone) {
  build.place(place);
  build.use(stone);
  const Vector2f profile[] = {{0, 0}, {0.13f, 0}, {0.1f, 0.7f}, {0.13f, 0.78f}, {0.09f, 0.9f}, {0, 0.93f}};
  build.lathe(profile, 16);
}

void add_fountain(MeshBuilder& build, const Eigen::Affine3f& place, int stone, int water) {
  build.place(place);
  build.use(stone);
  const Vector2f basin[] = {{2.2f, 0}, {2.2f, 0.65f}, {2.3f, 0.7f}, {2.0f, 0.7f}, {1.95f, 0.3f}, {0, 0.3f}};
  build.lathe(basin, 40);
  const Vector2f knots[] = {{0.5f, 0.3f},  {0.45f, 0.6f}, {0.22f, 0.9f}, {0.25f, 1.6f},
                            {0.18f, 2.2f}, {0.8f, 2.6f},  {0.85f, 2.7f}, {0.1f, 2.6f},
                            {0.14f, 3.1f}, {0.25f, 3.4f}, {0, 3.7f}};
  build.lathe(smooth_profile(knots, 3), 28);
  build.use(water);
  const Vector2f surface[] = {{1.97f, 0.5f}, {0, 0.5f}};
  build.lathe(surface, 40);
}

}  // namespace roxel
