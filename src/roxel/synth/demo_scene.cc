#include "roxel/synth/demo_scene.h"

#include <algorithm>
#include <cmath>

#include "roxel/base/angles.h"
#include "roxel/synth/demo_textures.h"
#include "roxel/synth/noise.h"
#include "roxel/synth/shapes.h"

namespace roxel {
namespace {

using Eigen::Vector2f;
using Eigen::Vector3f;

constexpr int kColumnCount = 8;
constexpr float kColumnRing = 0.55f;

const std::array<Vector2f, kColumnCount> kColumnDirections = [] {
  std::array<Vector2f, kColumnCount> directions;
  for (int i = 0; i < kColumnCount; ++i) {
    const float angle = static_cast<float>(i) * 2 * kPiFloat / kColumnCount;
    directions[i] = {std::cos(angle), std::sin(angle)};
  }
  return directions;
}();

// Stacked from the lawn up: three steps, columns, beam, drum, dome, finial.
constexpr float kFloor = 0.18f;
constexpr float kBeamBottom = 0.88f;
constexpr float kBeamTop = 1.0f;
constexpr float kDrumTop = 1.08f;
constexpr float kDomeRadius = 0.52f;

void offer(DemoScene::Nearest& best, float distance, DemoPart part, int index = 0) {
  if (distance < best.distance) best = {distance, part, index};
}

Vector3f at(const Vector3f& p, float x, float y, float z) { return p - Vector3f(x, y, z); }

/// Whether a ball about the origin could be nearer to q than what is known.
bool worth_a_look(const Vector3f& q, float radius, const DemoScene::Nearest& best) {
  const float reach = best.distance + radius;
  return reach > 0 && q.squaredNorm() < reach * reach;
}

float smooth_step(float from, float to, float x) {
  const float t = std::clamp((x - from) / (to - from), 0.0f, 1.0f);
  return t * t * (3 - 2 * t);
}

}  // namespace

DemoScene::DemoScene(std::uint32_t seed) : seed_(seed) {
  const auto random = [seed](int item, int what) { return lattice_random(item, what, 0, seed ^ 0x7ee5u); };
  for (int i = 0; i < static_cast<int>(trees_.size()); ++i) {
    const float angle = (i + 0.25f + 0.3f * random(i, 0)) * 2 * kPiFloat / trees_.size();
    const float radius = 1.06f + 0.04f * random(i, 1);
    const float crown = 0.16f + 0.06f * random(i, 3);
    trees_[i] = {Vector2f(radius * std::cos(angle), radius * std::sin(angle)), 0.34f + 0.16f * random(i, 2),
                 crown, Ellipsoid(crown, crown, 0.9f * crown)};
  }
  for (int i = 0; i < static_cast<int>(boulders_.size()); ++i) {
    const float angle = (i + 0.5f * random(i, 4)) * 2 * kPiFloat / boulders_.size() + 0.15f;
    const float radius = 1.0f + 0.17f * random(i, 5);
    const float size = 0.05f + 0.05f * random(i, 6);
    boulders_[i] = {
        Vector3f(radius * std::cos(angle), radius * std::sin(angle), 0.01f),
        Ellipsoid(size, size * (0.7f + 0.5f * random(i, 7)), size * (0.6f + 0.4f * random(i, 8)))};
  }
}

Eigen::AlignedBox3f DemoScene::bounds() {
  return {Vector3f(-1.5f, -1.5f, -1.2f), Vector3f(1.5f, 1.5f, 1.8f)};
}

// Three lobes of rock, cut flat at the lawn, roughened below it. Roughness bends the distance field, hence
// the factor that shortens steps; where the surface is far, a box around it or its smooth shape will do.
float DemoScene::island(const Vector3f& p) const {
  static const Ellipsoid kDisc(1.36f, 1.36f, 0.55f), kRoot(0.72f, 0.66f, 0.72f), kSide(0.3f, 0.34f, 0.42f);
  constexpr float kRough = 0.13f;
  const float around = cylinder_distance(p, 1.45f, -1.16f, 0.02f);
  if (around > kRough) return around;
  const float disc = kDisc.distance(at(p, 0, 0, 0.05f));
  const float root = kRoot.distance(at(p, 0.1f, -0.06f, -0.25f));
  const float side = kSide.distance(at(p, -0.66f, 0.3f, -0.3f));
  const float rock = smooth_union(smooth_union(disc, root, 0.25f), side, 0.2f);
  const float smooth = smooth_intersection(rock, p.z(), 0.06f);
  if (std::abs(smooth) > 2 * kRough) return smooth - kRough;
  const float height = kRough * smooth_step(-0.01f, -0.22f, p.z());
  if (smooth > height + 0.01f) return smooth - height;
  if (height <= 0) return smooth;
  const Vector3f stretched(3.0f * p.x(), 3.0f * p.y(), 1.8f * p.z());
  return 0.6f * (smooth - height * fractal_noise(stretched, 4, seed_ + 11));
}

void DemoScene::add_columns(const Vector3f& p, Nearest& best) const {
  // The column in whose sector p is: the one whose direction has the largest dot product.
  int index = 0;
  float along = -1;
  for (int i = 0; i < kColumnCount; ++i) {
    const float dot = kColumnDirections[i].dot(p.head<2>());
    if (dot > along) along = dot, index = i;
  }
  const Vector2f& direction = kColumnDirections[index];
  const Vector3f q(along - kColumnRing, direction.x() * p.y() - direction.y() * p.x(), p.z());
  // Entasis: the shaft tapers towards the top.
  const float t = (p.z() - kFloor) / (kBeamBottom - kFloor);
  const float radius = 0.062f - 0.012f * smooth_step(0.2f, 1.0f, t);
  offer(best, 0.95f * cylinder_distance(q, radius, kFloor, kBeamBottom), DemoPart::kColumn, index);
  const Vector3f plate(0.085f, 0.085f, 0.02f);
  offer(best, box_distance(at(q, 0, 0, kBeamBottom - 0.02f), plate), DemoPart::kCapital, index);
  offer(best, torus_distance(at(q, 0, 0, kBeamBottom - 0.055f), 0.052f, 0.018f), DemoPart::kCapital, index);
  offer(best, torus_distance(at(q, 0, 0, kFloor + 0.02f), 0.066f, 0.022f), DemoPart::kCapital, index);
}

void DemoScene::add_vase(const Vector3f& p, Nearest& best) const {
  static const Ellipsoid kBody(0.135f, 0.135f, 0.15f);
  if (!worth_a_look(at(p, 0, 0, 0.45f), 0.33f, best)) return;
  offer(best, box_distance(at(p, 0, 0, kFloor + 0.09f), Vector3f(0.13f, 0.13f, 0.09f)), DemoPart::kPedestal);
  const float body = kBody.distance(at(p, 0, 0, 0.5f));
  const float neck = cylinder_distance(p, 0.045f, 0.5f, 0.7f);
  const float lip = torus_distance(at(p, 0, 0, 0.7f), 0.055f, 0.02f);
  offer(best, smooth_union(smooth_union(body, neck, 0.06f), lip, 0.04f), DemoPart::kVase);
}

void DemoScene::add_temple(const Vector3f& p, Nearest& best) const {
  if (cylinder_distance(p, 0.84f, 0.0f, 1.78f) >= best.distance) return;
  for (int step = 0; step < 3; ++step)
    offer(best, cylinder_distance(p, 0.83f - 0.08f * step, -0.05f, 0.06f * (step + 1)), DemoPart::kSteps,
          step);
  if (cylinder_distance(p, 0.67f, 0.0f, kBeamBottom) < best.distance) {
    add_columns(p, best);
    add_vase(p, best);
  }
  if (cylinder_distance(p, 0.68f, kBeamBottom, 1.78f) >= best.distance) return;
  offer(best, cylinder_distance(p, 0.64f, kBeamBottom, kBeamTop), DemoPart::kBeam);
  offer(best, cylinder_distance(p, 0.67f, kBeamTop - 0.025f, kBeamTop + 0.005f), DemoPart::kCapital);
  offer(best, cylinder_distance(p, kDomeRadius + 0.03f, kBeamTop, kDrumTop), DemoPart::kBeam, 1);
  static const Ellipsoid kShell(kDomeRadius, kDomeRadius, 0.5f);
  const float shell = kShell.distance(at(p, 0, 0, kDrumTop));
  offer(best, std::max(shell, kDrumTop - p.z()), DemoPart::kDome);
  offer(best, sphere_distance(at(p, 0, 0, kDrumTop + 0.55f), 0.07f), DemoPart::kFinial);
  offer(best, sphere_distance(at(p, 0, 0, kDrumTop + 0.64f), 0.035f), DemoPart::kFinial);
}

void DemoScene::add_tree(const Vector3f& p, int index, Nearest& best) const {
  const Tree& tree = trees_[index];
  const Vector3f q = at(p, tree.foot.x(), tree.foot.y(), 0);
  const Vector3f crown = at(q, 0, 0, tree.height);
  if (!worth_a_look(crown, tree.height + 0.1f, best)) return;
  offer(best, rod_distance(q, tree.height, 0.026f), DemoPart::kTrunk, index);
  const float r = tree.crown_radius;
  float leaves = tree.crown.distance(crown);
  leaves = smooth_union(leaves, sphere_distance(at(crown, 0.6f * r, 0.2f * r, 0.55f * r), 0.6f * r), 0.05f);
  leaves = smooth_union(leaves, sphere_distance(at(crown, -0.5f * r, -0.45f * r, 0.3f * r), 0.6f * r), 0.05f);
  constexpr float kRough = 0.035f;
  leaves = std::abs(leaves) > 2 * kRough
               ? leaves - kRough
               : 0.6f * (leaves - kRough * fractal_noise(11 * p, 2, seed_ + 31 + index));
  offer(best, leaves, DemoPart::kLeaves, index);
}

void DemoScene::add_boulder(const Vector3f& p, int index, Nearest& best) const {
  const Boulder& boulder = boulders_[index];
  const Vector3f q = p - boulder.centre;
  if (!worth_a_look(q, 0.15f, best)) return;
  const float smooth = boulder.shape.distance(q);
  offer(best, 0.7f * (smooth - 0.012f * fractal_noise(18 * p, 2, seed_ + 41)), DemoPart::kBoulder, index);
}

DemoScene::Nearest DemoScene::nearest(const Vector3f& p) const {
  Nearest best{island(p), DemoPart::kIsland, 0};
  add_temple(p, best);
  // Trees and boulders stand on a ring around the temple.
  if (rectangle_distance(length2(p.x(), p.y()) - 1.07f, p.z() - 0.42f, 0.34f, 0.54f) >= best.distance)
    return best;
  for (int i = 0; i < static_cast<int>(trees_.size()); ++i) add_tree(p, i, best);
  for (int i = 0; i < static_cast<int>(boulders_.size()); ++i) add_boulder(p, i, best);
  return best;
}

// Four taps at the corners of a tetrahedron: their weighted sum is the gradient to second order.
Vector3f DemoScene::normal(const Vector3f& p, float step) const {
  static const Vector3f kCorners[4] = {{1, -1, -1}, {-1, -1, 1}, {-1, 1, -1}, {1, 1, 1}};
  Vector3f gradient = Vector3f::Zero();
  for (const Vector3f& corner : kCorners) gradient += corner * distance(p + step * corner);
  const float length = gradient.norm();
  return length > 0 ? Vector3f(gradient / length) : Vector3f::UnitZ();
}

Vector3f DemoScene::albedo(const Vector3f& p, const Vector3f& normal) const {
  const Nearest found = nearest(p);
  return demo_texture(found.part, found.index, p, normal, seed_);
}

}  // namespace roxel
