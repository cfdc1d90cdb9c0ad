#include "roxel/surface/texture.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

#include "roxel/base/error.h"
#include "roxel/surface/atlas.h"
#include "roxel/surface/seam_levelling.h"
#include "roxel/surface/surface_fixture.h"

namespace roxel {
namespace {

using Eigen::Vector3d;

constexpr double kTolerance = 0.02;

struct Ball {
  Surface mesh = fixture::ball_mesh(10);
  std::vector<TextureView> views;
  explicit Ball(std::vector<float> lights = std::vector<float>(8, 1.0f)) {
    const auto cameras = fixture::cameras_around(8, 160);
    for (std::size_t v = 0; v < cameras.size(); ++v)
      views.push_back(fixture::ball_photograph(cameras[v], lights[v]));
  }
  TextureViewLoader loader() const {
    return [this](int v) { return views[v]; };
  }
  TexturedSurface textured_with(TextureOptions options, int threads = 2) const {
    options.sight_tolerance = kTolerance;
    RunContext context(threads);
    return textured(mesh, static_cast<int>(views.size()), loader(), options, context);
  }
};

/// Differences, in linear light, between the texture and the ball's colours, at triangles' middles.
std::vector<double> errors(const TexturedSurface& textured) {
  const HitColor color = texture_colors(textured);
  std::vector<double> out;
  const Mesh& mesh = textured.surface.mesh;
  for (std::uint32_t f = 0; f < mesh.triangles.size(); ++f) {
    const auto& [a, b, c] = mesh.triangles[f];
    const Rgb found = color({0, f, {1.0 / 3, 1.0 / 3, 1.0 / 3}});
    const Rgb wanted =
        fixture::color_at(((mesh.points[a] + mesh.points[b] + mesh.points[c]) / 3).normalized());
    double worst = 0;
    for (int k = 0; k < 3; ++k) worst = std::max(worst, std::abs<double>(found[k] - wanted[k]));
    out.push_back(worst);
  }
  return out;
}

double worst_error(const TexturedSurface& textured) {
  const std::vector<double> all = errors(textured);
  return *std::max_element(all.begin(), all.end());
}

double wrong_triangles(const TexturedSurface& textured) {
  const std::vector<double> all = errors(textured);
  return static_cast<double>(std::count_if(all.begin(), all.end(), [](double e) { return e > 0.2; }));
}

TEST(Texture, ShowsThePhotographsColours) {
  const TexturedSurface textured = Ball().textured_with({});
  EXPECT_EQ(textured.unseen, 0);
  EXPECT_LT(textured.charts, 150);
  EXPECT_LT(worst_error(textured), 0.05);
  for (const Eigen::Vector2f& uv : textured.uvs) {
    EXPECT_GE(uv.minCoeff(), 0);
    EXPECT_LE(uv.maxCoeff(), 1);
  }
}

TEST(Texture, ChangingLightLeavesNoSeams) {
  const Ball ball({1.0f, 0.6f, 1.3f, 0.8f, 1.1f, 0.7f, 0.9f, 1.2f});
  TextureOptions options;
  const TexturedSurface matched = ball.textured_with(options);
  EXPECT_LT(worst_error(matched), 0.06);
  EXPECT_NEAR(matched.gains[1][0], 1 / 0.6, 0.05);
  options.match_light = options.level_seams = false;
  options.transient = 1;
  const TexturedSurface raw = ball.textured_with(options);
  EXPECT_GT(worst_error(raw), 0.15);
  EXPECT_GT(raw.seam_before, 10 * matched.seam_after);
  options.level_seams = true;
  EXPECT_LT(ball.textured_with(options).seam_after, 0.3 * raw.seam_after);
}

TEST(Texture, WhatPassesThroughOnePhotographIsLeftOut) {
  Ball ball;
  for (int y = 40; y < 120; ++y)
    for (int x = 40; x < 120; ++x)
      for (int c = 0; c < 3; ++c) ball.views[3].rgb.pixel(x, y)[c] = c == 1 ? 1.0f : 0.0f;
  const TexturedSurface careful = ball.textured_with({});
  EXPECT_GT(careful.transients, 0);
  TextureOptions careless;
  careless.transient = 1;
  // Not all: what only this photograph shows cannot be known to be passing.
  EXPECT_GT(wrong_triangles(ball.textured_with(careless)), 20);
  EXPECT_LT(wrong_triangles(careful), 0.2 * wrong_triangles(ball.textured_with(careless)));
}

TEST(Texture, TrianglesThatNobodySeesTakeTheirPointsColours) {
  Ball ball;
  ball.views.resize(1);
  const TexturedSurface textured = ball.textured_with({});
  EXPECT_GT(textured.unseen, 300);
  EXPECT_LT(worst_error(textured), 0.05);
}

TEST(Texture, FitsTheSideThatIsAllowed) {
  TextureOptions small;
  small.largest_side = 160;
  const TexturedSurface textured = Ball().textured_with(small);
  EXPECT_LE(std::max(textured.picture.width(), textured.picture.height()), 160);
  EXPECT_LT(textured.scale, 1);
  EXPECT_LT(worst_error(textured), 0.1);
}

TEST(Texture, ASideThatCannotHoldTheChartsIsAnErrorThatSaysWhatCan) {
  const Ball ball;
  TextureOptions options;
  options.largest_side = 16;
  const auto least_side = [&]() -> int {
    try {
      ball.textured_with(options);
    } catch (const InvalidInput& e) {
      const std::string what = e.what(), expected = "expected at least ";
      EXPECT_NE(what.find("--texture-size"), std::string::npos) << what;
      const std::size_t at = what.find(expected);
      if (at != std::string::npos) return std::stoi(what.substr(at + expected.size()));
    }
    return 0;
  };
  const int least = least_side();
  ASSERT_GT(least, 16);
  options.largest_side = least;
  const TexturedSurface textured = ball.textured_with(options);
  EXPECT_LE(std::max(textured.picture.width(), textured.picture.height()), least);
}

TEST(Texture, IsTheSameForAnyNumberOfThreads) {
  const Ball ball;
  const TexturedSurface one = ball.textured_with({}, 1);
  for (const int threads : {2, 4}) {
    const TexturedSurface other = ball.textured_with({}, threads);
    EXPECT_EQ(one.picture.data(), other.picture.data());
    EXPECT_EQ(one.uvs, other.uvs);
  }
}

TEST(TextureViews, AViewSeesItsSideOfTheBall) {
  const Ball ball;
  const MeshRays rays(ball.mesh.mesh);
  RunContext context(2);
  SightOptions sight;
  sight.tolerance = kTolerance;
  const auto views = face_views(ball.mesh.mesh, rays, 8, ball.loader(), sight, context);
  for (std::size_t f = 0; f < views.size(); ++f)
    for (const FaceView& seen : views[f])
      EXPECT_GT(
          ball.mesh.mesh.points[ball.mesh.mesh.triangles[f][0]].dot(ball.views[seen.view].camera.pose.centre),
          0);
  const std::vector<Rgb> gains(8, Rgb{1, 1, 1}), none(ball.mesh.mesh.points.size(), Rgb{});
  const auto colors = photograph_colors(ball.mesh, rays, 8, ball.loader(), gains, none, sight, context);
  for (std::size_t i = 0; i < colors.size(); ++i)
    for (int c = 0; c < 3; ++c) EXPECT_NEAR(colors[i][c], ball.mesh.colors[i][c], 0.03);
}

/// A strip of four triangles; the last is better in view 1, the others in view 0.
std::vector<std::vector<FaceView>> strip_views() {
  return {{{0, 10}, {1, 8}}, {{0, 10}, {1, 8}}, {{0, 10}, {1, 8}}, {{0, 8}, {1, 10}}};
}
const FaceNeighbours kStrip{{-1, 1, -1}, {0, 2, -1}, {1, 3, -1}, {2, -1, -1}};

TEST(ViewChoice, SeamsCostWhatTheOptionSays) {
  ViewChoiceOptions options;
  options.seam_cost = 0.1;  // less than the 0.2 that view 0 costs the last one
  EXPECT_THAT(choose_views(kStrip, strip_views(), options), testing::ElementsAre(0, 0, 0, 1));
  options.seam_cost = 1;
  EXPECT_THAT(choose_views(kStrip, strip_views(), options), testing::Each(0));
  auto views = strip_views();
  views[1].clear();
  EXPECT_EQ(choose_views(kStrip, views, options)[1], kNoView);
}

const FaceNeighbours kAlone{{-1, -1, -1}};

TEST(ViewChoice, TransientsArePatchesNotSingleTriangles) {
  // A fan: the first triangle has all others around it. View 3 is off on the first alone, view 4 on all but
  // the first.
  const FaceNeighbours fan{{1, 2, 3}, {0, -1, -1}, {0, -1, -1}, {0, -1, -1}};
  const FaceView right{0, 1, {0.5f, 0.5f, 0.5f}}, wrong{0, 1, {0.9f, 0.9f, 0.9f}};
  const auto face = [&](bool third, bool fourth) {
    std::vector<FaceView> views(5, right);
    for (int v = 0; v < 5; ++v) {
      if ((v == 3 && third) || (v == 4 && fourth)) views[v] = wrong;
      views[v].view = v;
    }
    return views;
  };
  std::vector<std::vector<FaceView>> views{face(true, false), face(false, true), face(false, true),
                                           face(false, true)};
  EXPECT_EQ(drop_transients(fan, std::vector<Rgb>(5, {1, 1, 1}), {}, {}, views), 4);
  for (const auto& of_face : views) {
    ASSERT_EQ(of_face.size(), 4u);
    EXPECT_EQ(of_face.back().view, 3);
  }
}

TEST(ViewChoice, TwoViewsThatDifferAreBothKept) {
  std::vector<std::vector<FaceView>> views{{{0, 1, {1, 1, 1}}, {1, 1, {0, 0, 0}}}};
  const std::vector<Rgb> gains(3, {1, 1, 1});
  EXPECT_EQ(drop_transients(kAlone, gains, {}, {}, views), 0);
  auto decided = views;
  EXPECT_EQ(drop_transients(kAlone, gains, {{1, 1, 0.99f}}, {}, decided), 1);  // the canonical colour decides
  EXPECT_EQ(decided[0][0].view, 0);
  views[0].push_back({2, 1, {0.001f, 0, 0}});
  EXPECT_EQ(drop_transients(kAlone, gains, {}, {}, views), 1);
  EXPECT_EQ(views[0][0].view, 1);
}

TEST(ViewChoice, BlurredPhotographsCountLess) {
  std::vector<std::vector<FaceView>> views{
      {{0, 1, {}, 0.2f}, {1, 1, {}, 0.01f}, {2, 1, {}, 0.2f}, {3, 1, {}, 5}}};
  weigh_sharpness(views, 1);
  EXPECT_NEAR(views[0][0].quality, 1, 1e-6);
  EXPECT_NEAR(views[0][1].quality, 1.0 / 3, 1e-6);
  EXPECT_NEAR(views[0][3].quality, 1.25, 1e-6);
}

TEST(SeamLevelling, BothSidesMeetHalfWay) {
  Mesh mesh;
  mesh.points = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {1, 1, 0}};
  mesh.triangles = {{0, 1, 2}, {1, 3, 2}};
  const std::vector<int> labels{0, 1};
  const ChartPoints points = chart_points(mesh, labels);
  ASSERT_EQ(points.point.size(), 6u);
  const auto found = seams(mesh, face_neighbours(mesh), labels, points);
  ASSERT_EQ(found.size(), 2u);
  std::vector<Rgb> colors(6, Rgb{});
  for (std::size_t i = 0; i < 6; ++i)
    colors[i] = points.view[i] == 0 ? Rgb{0.4f, 0.4f, 0.4f} : Rgb{0.6f, 0.4f, 0.4f};
  const std::vector<Rgb> added = seam_corrections(points, found, colors);
  for (const Seam& seam : found) {
    EXPECT_NEAR(colors[seam.a][0] + added[seam.a][0], colors[seam.b][0] + added[seam.b][0], 1e-3);
    EXPECT_NEAR(added[seam.a][1], 0, 1e-6);
  }
  for (const Rgb& value : added) EXPECT_NEAR(std::abs(value[0]), 0.1, 1e-3);
}

RC_GTEST_PROP(Atlas, RectanglesNeitherOverlapNorLeaveThePicture, ()) {
  const auto sides = *rc::gen::container<std::vector<std::pair<int, int>>>(
      rc::gen::pair(rc::gen::inRange(1, 40), rc::gen::inRange(1, 40)));
  std::vector<AtlasRect> rects;
  for (const auto& [width, height] : sides) rects.push_back({width, height});
  const AtlasSize size = pack(64, rects);
  std::vector<char> taken(static_cast<std::size_t>(64) * std::max(size.height, 1));
  for (const AtlasRect& rect : rects) {
    RC_ASSERT(rect.x >= 0 && rect.y >= 0 && rect.x + rect.width <= 64 && rect.y + rect.height <= size.height);
    for (int y = rect.y; y < rect.y + rect.height; ++y)
      for (int x = rect.x; x < rect.x + rect.width; ++x) RC_ASSERT(!taken[y * 64 + x]++);
  }
}

TEST(Atlas, WastesLittle) {
  std::vector<AtlasRect> rects;
  double area = 0;
  for (int i = 0; i < 400; ++i) {
    rects.push_back({3 + i * 7 % 23, 2 + i * 11 % 17});
    area += static_cast<double>(rects.back().width) * rects.back().height;
  }
  const AtlasSize size = pack(256, rects);
  EXPECT_GT(area / (256.0 * size.height), 0.85);
}

}  // namespace
}  // namespace roxel
