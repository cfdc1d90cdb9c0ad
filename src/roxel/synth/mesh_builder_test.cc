#include "roxel/synth/mesh_builder.h"

#include <gtest/gtest.h>

#include <cmath>
#include <map>
#include <numbers>

namespace roxel {
namespace {

using Eigen::Vector2f;
using Eigen::Vector3f;

double area(const TriangleMesh& mesh) {
  double sum = 0;
  for (const auto& t : mesh.triangles) {
    const Vector3f &a = mesh.vertices[t[0]], &b = mesh.vertices[t[1]], &c = mesh.vertices[t[2]];
    sum += 0.5 * (b - a).cross(c - a).norm();
  }
  return sum;
}

TEST(MeshBuilder, ABoxHasItsSixSides) {
  TriangleMesh mesh;
  MeshBuilder build(mesh);
  build.use(3);
  build.box({-1, 0, 2}, {1, 3, 6});
  EXPECT_EQ(mesh.triangles.size(), 12u);
  EXPECT_NEAR(area(mesh), 2 * (2 * 3 + 2 * 4 + 3 * 4), 1e-5);
  EXPECT_EQ(mesh.bounds().min(), Vector3f(-1, 0, 2));
  EXPECT_EQ(mesh.bounds().max(), Vector3f(1, 3, 6));
  for (std::uint16_t material : mesh.materials) EXPECT_EQ(material, 3);
}

TEST(MeshBuilder, TurnedAndSweptThingsHaveTheirAreas) {
  constexpr double kPi = std::numbers::pi;
  TriangleMesh ball, rod, cone;
  MeshBuilder(ball).ellipsoid({1, 2, 3}, Vector3f::Constant(2), 128);
  EXPECT_NEAR(area(ball) / (16 * kPi), 1, 2e-3);
  MeshBuilder(rod).cylinder({0, 0, 0}, {0, 3, 4}, 0.5f, 128);
  EXPECT_NEAR(area(rod) / (2 * kPi * 0.5 * 5 + 2 * kPi * 0.25), 1, 2e-3);
  const Vector2f profile[] = {{0, 4}, {3, 0}};
  MeshBuilder(cone).lathe(profile, 128);
  EXPECT_NEAR(area(cone) / (kPi * 3 * 5), 1, 2e-3);
}

TEST(MeshBuilder, ARingOfSurfaceCellsHasNoOpenEdge) {
  TriangleMesh torus;
  MeshBuilder(torus).surface(12, 8,
                             [](float u, float v) {
                               const float a = 6.2831853f * u, b = 6.2831853f * v, r = 2 + std::cos(b);
                               return Vector3f(r * std::cos(a), r * std::sin(a), std::sin(b));
                             },
                             {true, true});
  std::map<std::pair<std::uint32_t, std::uint32_t>, int> edges;
  for (const auto& t : torus.triangles)
    for (int i = 0; i < 3; ++i) ++edges[std::minmax(t[i], t[(i + 1) % 3])];
  for (const auto& [edge, count] : edges) EXPECT_EQ(count, 2);
}

TEST(MeshBuilder, PlacesWhatFollows) {
  TriangleMesh mesh;
  MeshBuilder build(mesh);
  build.place(placed({5, 0, 1}, std::numbers::pi_v<float> / 2));
  build.triangle({1, 0, 0}, {2, 0, 0}, {1, 1, 0});
  EXPECT_LT((mesh.vertices[0] - Vector3f(5, 1, 1)).norm(), 1e-6);
  EXPECT_LT((mesh.vertices[2] - Vector3f(4, 1, 1)).norm(), 1e-6);
}

TEST(SmoothProfile, GoesThroughItsKnots) {
  const Vector2f knots[] = {{0, 0}, {1, 0.5f}, {0.5f, 2}, {0.7f, 3}};
  const auto curve = smooth_profile(knots, 5);
  ASSERT_EQ(curve.size(), 16u);
  for (int i = 0; i < 4; ++i) EXPECT_LT((curve[5 * i] - knots[i]).norm(), 1e-6);
}

TEST(PlyBytes, AreAHeaderAndFixedRows) {
  TriangleMesh mesh;
  MeshBuilder(mesh).box({0, 0, 0}, {1, 1, 1});
  const std::string bytes = ply_bytes(mesh);
  EXPECT_TRUE(bytes.starts_with("ply\nformat binary_little_endian 1.0\nelement vertex 24\n"));
  const std::size_t header = bytes.find("end_header\n") + 11;
  EXPECT_EQ(bytes.size() - header, 24u * 12 + 12u * 13);
}

}  // namespace
}  // namespace roxel
