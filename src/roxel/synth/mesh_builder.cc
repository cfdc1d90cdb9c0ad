#include "roxel/synth/mesh_builder.h"

#include <cmath>
#include <numbers>

#include "roxel/base/angles.h"
#include "roxel/base/error.h"
#include "roxel/synth/blend.h"

namespace roxel {
namespace {

using Eigen::Vector2f;
using Eigen::Vector3f;

constexpr float kTurn = 2 * kPiFloat;

}  // namespace

std::uint32_t MeshBuilder::vertex(const Vector3f& p) {
  mesh_.vertices.push_back(world_from_object_ * p);
  return static_cast<std::uint32_t>(mesh_.vertices.size() - 1);
}

void MeshBuilder::face(std::uint32_t a, std::uint32_t b, std::uint32_t c) {
  const Vector3f u = mesh_.vertices[b] - mesh_.vertices[a], v = mesh_.vertices[c] - mesh_.vertices[a];
  if (!(u.cross(v).squaredNorm() > 0)) return;  // at a pole of a grid
  mesh_.triangles.push_back({a, b, c});
  mesh_.materials.push_back(material_);
}

void MeshBuilder::triangle(const Vector3f& a, const Vector3f& b, const Vector3f& c) {
  const std::uint32_t first = vertex(a);
  vertex(b);
  vertex(c);
  face(first, first + 1, first + 2);
}

void MeshBuilder::quad(const Vector3f& a, const Vector3f& b, const Vector3f& c, const Vector3f& d) {
  const std::uint32_t first = vertex(a);
  vertex(b);
  vertex(c);
  vertex(d);
  face(first, first + 1, first + 2);
  face(first, first + 2, first + 3);
}

void MeshBuilder::box(const Vector3f& low, const Vector3f& high) {
  const auto corner = [&](int i) {
    return Vector3f(i & 1 ? high.x() : low.x(), i & 2 ? high.y() : low.y(), i & 4 ? high.z() : low.z());
  };
  static constexpr int kSides[6][4] = {{0, 2, 3, 1}, {4, 5, 7, 6}, {0, 1, 5, 4},
                                       {2, 6, 7, 3}, {0, 4, 6, 2}, {1, 3, 7, 5}};
  for (const auto& side : kSides) quad(corner(side[0]), corner(side[1]), corner(side[2]), corner(side[3]));
}

void MeshBuilder::surface(int nu, int nv, const std::function<Vector3f(float, float)>& point, Rings rings) {
  const int columns = rings.u ? nu : nu + 1, rows = rings.v ? nv : nv + 1;
  const auto first = static_cast<std::uint32_t>(mesh_.vertices.size());
  for (int j = 0; j < rows; ++j)
    for (int i = 0; i < columns; ++i)
      vertex(point(static_cast<float>(i) / static_cast<float>(nu),
                   static_cast<float>(j) / static_cast<float>(nv)));
  const auto at = [&](int i, int j) {
    return first + static_cast<std::uint32_t>((j % rows) * columns + i % columns);
  };
  for (int j = 0; j < nv; ++j)
    for (int i = 0; i < nu; ++i) {
      face(at(i, j), at(i + 1, j), at(i + 1, j + 1));
      face(at(i, j), at(i + 1, j + 1), at(i, j + 1));
    }
}

void MeshBuilder::lathe(std::span<const Vector2f> profile, int segments) {
  const int last = static_cast<int>(profile.size()) - 1;
  ROXEL_CHECK_GE(last, 1);
  surface(segments, last,
          [&](float u, float v) {
            const Vector2f& p = profile[static_cast<std::size_t>(std::lround(v * static_cast<float>(last)))];
            return Vector3f(p.x() * std::cos(kTurn * u), p.x() * std::sin(kTurn * u), p.y());
          },
          {true, false});
}

// Each ring's frame is the one before it turned as little as possible.
void MeshBuilder::tube(std::span<const Vector3f> path, float radius, int segments) {
  const int last = static_cast<int>(path.size()) - 1;
  ROXEL_CHECK_GE(last, 1);
  std::vector<Vector3f> u(path.size()), v(path.size());
  for (int k = 0; k <= last; ++k) {
    const Vector3f along = (path[std::min(k + 1, last)] - path[std::max(k - 1, 0)]).normalized();
    if (k == 0) {
      frame_about(along, u[k], v[k]);
    } else {
      u[k] = (u[k - 1] - along.dot(u[k - 1]) * along).normalized();
      v[k] = along.cross(u[k]);
    }
  }
  // Ring -1 and ring last + 1 are the middles of the ends.
  surface(segments, last + 2,
          [&](float s, float t) {
            const int ring = static_cast<int>(std::lround(t * static_cast<float>(last + 2))) - 1;
            if (ring < 0) return path.front();
            if (ring > last) return path.back();
            return Vector3f(path[ring] +
                            radius * (std::cos(kTurn * s) * u[ring] + std::sin(kTurn * s) * v[ring]));
          },
          {true, false});
}

void MeshBuilder::cylinder(const Vector3f& from, const Vector3f& to, float radius, int segments) {
  const Vector3f path[] = {from, to};
  tube(path, radius, segments);
}

void MeshBuilder::ellipsoid(const Vector3f& centre, const Vector3f& radii, int segments) {
  surface(segments, segments / 2,
          [&](float u, float v) {
            const float polar = 0.5f * kTurn * v;
            const Vector3f unit(std::sin(polar) * std::cos(kTurn * u), std::sin(polar) * std::sin(kTurn * u),
                                std::cos(polar));
            return Vector3f(centre + radii.cwiseProduct(unit));
          },
          {true, false});
}

std::vector<Vector2f> smooth_profile(std::span<const Vector2f> knots, int steps) {
  std::vector<Vector2f> curve;
  const int last = static_cast<int>(knots.size()) - 1;
  for (int k = 0; k < last; ++k) {
    const Vector2f &a = knots[std::max(k - 1, 0)], &b = knots[k], &c = knots[k + 1],
                   &d = knots[std::min(k + 2, last)];
    for (int i = 0; i < steps; ++i) {
      const float t = static_cast<float>(i) / static_cast<float>(steps);
      curve.push_back(0.5f * (2 * b + t * (c - a) + t * t * (2 * a - 5 * b + 4 * c - d) +
                              t * t * t * (3 * b - 3 * c + d - a)));
      curve.back().x() = std::max(curve.back().x(), 0.0f);
    }
  }
  curve.push_back(knots[last]);
  return curve;
}

Eigen::Affine3f placed(const Vector3f& offset, float turn_rad) {
  return Eigen::Translation3f(offset) * Eigen::AngleAxisf(turn_rad, Vector3f::UnitZ());
}

}  // namespace roxel
