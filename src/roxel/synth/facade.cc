#include "roxel/synth/facade.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "roxel/synth/noise.h"

namespace roxel {
namespace {

using Eigen::Vector3f;

constexpr float kReveal = 0.28f;  // how deep windows lie in the wall

/// A hole in a panel of wall, in the panel's own coordinates; an arched one has a half circle on top.
struct Opening {
  float left, right, bottom, top;
  bool arched;
};

/// Height of the opening's upper edge at x.
float upper_edge(const Opening& o, float x) {
  if (!o.arched) return o.top;
  const float radius = 0.5f * (o.right - o.left), from_middle = x - 0.5f * (o.left + o.right);
  return o.top - radius + std::sqrt(std::max(0.0f, radius * radius - from_middle * from_middle));
}

/// Positions along the upper edge: dense where an arch is steep.
std::vector<float> edge_stops(const Opening& o) {
  if (!o.arched) return {o.left, o.right};
  constexpr int kSteps = 12;
  std::vector<float> stops;
  for (int i = 0; i <= kSteps; ++i) {
    const float turn = std::numbers::pi_v<float> * static_cast<float>(i) / kSteps;
    stops.push_back(0.5f * (o.left + o.right) - 0.5f * (o.right - o.left) * std::cos(turn));
  }
  return stops;
}

/// A part of the front, x0 to x1 and z0 to z1, with a hole.
struct Panel {
  float x0, x1, z0, z1;
  Opening hole;
};

void add_wall_around(MeshBuilder& build, const Panel& p) {
  const Opening& o = p.hole;
  build.quad({p.x0, 0, p.z0}, {o.left, 0, p.z0}, {o.left, 0, p.z1}, {p.x0, 0, p.z1});
  build.quad({o.right, 0, p.z0}, {p.x1, 0, p.z0}, {p.x1, 0, p.z1}, {o.right, 0, p.z1});
  if (o.bottom > p.z0)
    build.quad({o.left, 0, p.z0}, {o.right, 0, p.z0}, {o.right, 0, o.bottom}, {o.left, 0, o.bottom});
  const std::vector<float> stops = edge_stops(o);
  for (std::size_t i = 0; i + 1 < stops.size(); ++i) {
    const float a = stops[i], b = stops[i + 1];
    build.quad({a, 0, upper_edge(o, a)}, {b, 0, upper_edge(o, b)}, {b, 0, p.z1}, {a, 0, p.z1});
  }
}

void add_reveal(MeshBuilder& build, const Opening& o, float depth) {
  const auto strip = [&](const Vector3f& a, const Vector3f& b) {
    build.quad(a, b, b + Vector3f(0, depth, 0), a + Vector3f(0, depth, 0));
  };
  const std::vector<float> stops = edge_stops(o);
  strip({o.left, 0, o.bottom}, {o.right, 0, o.bottom});
  strip({o.left, 0, o.bottom}, {o.left, 0, upper_edge(o, o.left)});
  strip({o.right, 0, o.bottom}, {o.right, 0, upper_edge(o, o.right)});
  for (std::size_t i = 0; i + 1 < stops.size(); ++i)
    strip({stops[i], 0, upper_edge(o, stops[i])}, {stops[i + 1], 0, upper_edge(o, stops[i + 1])});
}

/// What closes the hole at the reveal's end.
void add_back(MeshBuilder& build, const Opening& o, float depth) {
  build.quad({o.left, depth, o.bottom}, {o.right, depth, o.bottom}, {o.right, depth, o.top},
             {o.left, depth, o.top});
}

void add_frame(MeshBuilder& build, const Opening& o) {
  const float y0 = kReveal - 0.07f, y1 = kReveal - 0.01f, middle = 0.5f * (o.left + o.right);
  const auto bar = [&](float x0, float x1, float z0, float z1) { build.box({x0, y0, z0}, {x1, y1, z1}); };
  constexpr float w = 0.06f;
  bar(o.left, o.left + w, o.bottom, o.top);
  bar(o.right - w, o.right, o.bottom, o.top);
  bar(middle - 0.5f * w, middle + 0.5f * w, o.bottom, o.top);
  bar(o.left, o.right, o.bottom, o.bottom + w);
  const float across = o.bottom + 0.62f * (o.top - o.bottom);
  bar(o.left, o.right, across, across + w);
}

void add_window(MeshBuilder& build, const Panel& panel, const FacadeMaterials& of) {
  const Opening& o = panel.hole;
  build.use(of.wall);
  add_wall_around(build, panel);
  build.use(of.trim);
  add_reveal(build, o, kReveal);
  build.box({o.left - 0.12f, -0.14f, o.bottom - 0.1f}, {o.right + 0.12f, 0, o.bottom});  // sill
  if (!o.arched) build.box({o.left - 0.1f, -0.06f, o.top}, {o.right + 0.1f, 0, o.top + 0.16f});
  build.use(of.glass);
  add_back(build, o, kReveal);
  build.use(of.frame);
  add_frame(build, o);
}

void add_ground_opening(MeshBuilder& build, const Panel& panel, bool arcade, const FacadeMaterials& of) {
  const float depth = arcade ? 1.6f : 0.35f;
  build.use(of.wall);
  add_wall_around(build, panel);
  build.use(of.trim);
  add_reveal(build, panel.hole, depth);
  build.use(arcade ? of.wall : panel.hole.bottom > panel.z0 ? of.glass : of.door);
  add_back(build, panel.hole, depth);
}

Panel ground_panel(const Facade& f, float x0, float x1, int column) {
  const float w = x1 - x0;
  if (f.arcade)
    return {x0, x1, 0, f.ground_height, {x0 + 0.16f * w, x1 - 0.16f * w, 0, 0.86f * f.ground_height, true}};
  const bool door = lattice_hash(column, 5, 0, f.seed) % 3 == 0;
  const float side = door ? 0.3f : 0.16f;
  return {x0,
          x1,
          0,
          f.ground_height,
          {x0 + side * w, x1 - side * w, door ? 0.0f : 0.7f, 0.74f * f.ground_height, false}};
}

Panel window_panel(const Facade& f, float x0, float x1, int floor) {
  const float w = x1 - x0, z0 = f.ground_height + f.floor_height * static_cast<float>(floor);
  return {x0,
          x1,
          z0,
          z0 + f.floor_height,
          {x0 + 0.26f * w, x1 - 0.26f * w, z0 + 0.28f * f.floor_height, z0 + 0.84f * f.floor_height,
           f.arched_windows && floor == 0}};
}

void add_ledges(MeshBuilder& build, const Facade& f) {
  build.use(f.materials.trim);
  build.box({-0.05f, -0.2f, f.ground_height - 0.24f}, {f.width + 0.05f, 0, f.ground_height});
  for (int floor = 1; floor < f.floors; ++floor) {
    const float z = f.ground_height + f.floor_height * static_cast<float>(floor);
    build.box({-0.03f, -0.09f, z - 0.06f}, {f.width + 0.03f, 0, z + 0.06f});
  }
  const float top = f.height();
  build.box({-0.1f, -0.22f, top - 0.35f}, {f.width + 0.1f, 0, top - 0.18f});
  build.box({-0.2f, -0.42f, top - 0.18f}, {f.width + 0.2f, 0, top});
}

}  // namespace

void add_facade(MeshBuilder& build, const Facade& f, const Eigen::Affine3f& place) {
  build.place(place);
  const int columns = std::max(1, static_cast<int>(std::lround(f.width / f.window_spacing)));
  for (int i = 0; i < columns; ++i) {
    const float x0 = f.width * static_cast<float>(i) / static_cast<float>(columns);
    const float x1 = f.width * static_cast<float>(i + 1) / static_cast<float>(columns);
    add_ground_opening(build, ground_panel(f, x0, x1, i), f.arcade, f.materials);
    for (int floor = 0; floor < f.floors; ++floor)
      add_window(build, window_panel(f, x0, x1, floor), f.materials);
  }
  add_ledges(build, f);
}

}  // namespace roxel
