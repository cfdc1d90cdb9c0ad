#include "roxel/synth/demo_world.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <fstream>
#include <map>
#include <mutex>
#include <sstream>

#include "roxel/base/error.h"
#include "roxel/base/temp_folder.h"

namespace roxel {
namespace {

namespace fs = std::filesystem;
using Eigen::Vector3d;
using Eigen::Vector3f;

/// Everything that a run hands to its writers, by the path below the data set.
struct Written {
  std::map<std::string, std::vector<float>> floats;
  std::map<std::string, std::vector<std::uint8_t>> masks;
  std::mutex mutex;

  DemoWorldWriters writers(const fs::path& folder) {
    const auto keep = [this, folder](const fs::path& path, const Image& image) {
      const std::lock_guard lock(mutex);
      floats[fs::relative(path, folder).string()] = image.data();
    };
    return {keep,
            [this, folder](const fs::path& path, const Mask& mask) {
              const std::lock_guard lock(mutex);
              masks[fs::relative(path, folder).string()] = mask.data();
            },
            keep};
  }
};

DemoWorldOptions small_world() {
  DemoWorldOptions options;
  options.images = 6;
  options.width = 48;
  options.height = 36;
  options.points = 60;
  return options;
}

std::string text_of(const fs::path& path) {
  std::ifstream in(path, std::ios::binary);
  std::stringstream text;
  text << in.rdbuf();
  return text.str();
}

struct WorldOnDisk {
  WorldOnDisk(const DemoWorldOptions& options, int threads) {
    RunContext context(threads);
    write_demo_world(folder.path(), options, written.writers(folder.path()), context);
  }
  std::string text(const char* file) const { return text_of(folder.path() / file); }

  const TempFolder folder;
  Written written;
};

TEST(DemoScene, IsAllInsideItsBoundsForAnySeed) {
  const Eigen::AlignedBox3f box = DemoScene::bounds();
  for (std::uint32_t seed = 0; seed < 12; ++seed) {
    const DemoScene scene(seed);
    for (int axis = 0; axis < 3; ++axis)
      for (float side : {0.0f, 1.0f})
        for (float s = 0; s <= 1; s += 0.02f)
          for (float t = 0; t <= 1; t += 0.02f) {
            Vector3f u;
            u[axis] = side;
            u[(axis + 1) % 3] = s;
            u[(axis + 2) % 3] = t;
            ASSERT_GT(scene.distance(box.min() + u.cwiseProduct(box.sizes())), 0.0f) << seed;
          }
  }
}

TEST(DemoScene, AlbedoIsAReflectanceAndVaries) {
  const DemoScene scene(1);
  const DemoRenderer renderer(scene, DemoBackground::kBlack, 1);
  float low = 1, high = 0;
  for (int i = 0; i < 400; ++i) {
    const Vector3f origin(-4, -1.4f + 0.14f * (i % 20), -0.9f + 0.13f * (i / 20));
    const auto t = renderer.trace(origin, Vector3f::UnitX(), 0, 10);
    if (!t) continue;
    const Vector3f p = origin + *t * Vector3f::UnitX();
    const Vector3f albedo = scene.albedo(p, scene.normal(p, 1e-3f));
    ASSERT_TRUE((albedo.array() >= 0).all() && (albedo.array() <= 1).all());
    low = std::min(low, albedo.sum() / 3);
    high = std::max(high, albedo.sum() / 3);
  }
  EXPECT_LT(low, 0.1f);
  EXPECT_GT(high, 0.5f);
}

TEST(DemoRenderer, StopsAtTheFirstSurface) {
  const DemoScene scene(5);
  const DemoRenderer renderer(scene, DemoBackground::kBlack, 1);
  int hits = 0, crossings = 0;
  for (int i = 0; i < 300; ++i) {
    const Vector3f origin(-1.3f + 0.173f * (i % 16), -4, -0.8f + 0.12f * (i / 16));
    const auto t = renderer.trace(origin, Vector3f::UnitY(), 0, 10);
    const float end = t ? *t - 2e-3f : 8.0f;
    // A march in steps that know nothing of distances finds nothing solid before.
    for (float s = 2.5f; s < end; s += 2e-3f)
      crossings += scene.distance(origin + s * Vector3f::UnitY()) < -1e-4f;
    hits += t.has_value();
    if (t) {
      EXPECT_LT(std::abs(scene.distance(origin + *t * Vector3f::UnitY())), 3e-4f);
    }
  }
  EXPECT_GT(hits, 150);
  EXPECT_EQ(crossings, 0);
}

TEST(DemoRenderer, TilesSeeWhatSingleRaysSee) {
  const DemoScene scene(1);
  const DemoRenderer renderer(scene, DemoBackground::kBlack, 1);
  DemoWorldOptions options = small_world();
  options.width = 61;  // not a whole number of tiles
  const RunContext context(1);
  for (const PinholeCamera& camera : demo_cameras(options)) {
    const DemoPicture picture = renderer.render(camera, context);
    for (int y = 0; y < options.height; ++y)
      for (int x = 0; x < options.width; ++x) {
        const Ray ray = camera.ray(x + 0.5, y + 0.5);
        const double length = ray.direction.norm();
        const auto t =
            renderer.trace(ray.origin.cast<float>(), (ray.direction / length).cast<float>(), 0, 100);
        const float depth = *picture.depth.pixel(x, y);
        ASSERT_EQ(t.has_value(), depth > 0) << x << " " << y;
        // Surfaces that are grazed are where 2e-4 of clearance is a longer way along the ray.
        if (t) {
          ASSERT_NEAR(depth, *t / length, 5e-3) << x << " " << y;
        }
      }
  }
}

TEST(DemoCameras, SeeTheWholeBoxesContent) {
  const DemoScene scene(1);
  const DemoRenderer renderer(scene, DemoBackground::kBlack, 1);
  const RunContext context(1);
  for (const PinholeCamera& camera : demo_cameras(small_world())) {
    const DemoPicture picture = renderer.render(camera, context);
    int inside = 0;
    for (int y = 0; y < 36; ++y)
      for (int x = 0; x < 48; ++x) {
        const bool border = x == 0 || y == 0 || x == 47 || y == 35;
        if (border) {
          EXPECT_EQ(picture.mask.at(x, y), 0);
        }
        inside += picture.mask.at(x, y) > 0;
      }
    EXPECT_GT(inside, 36 * 48 / 5);
    const Eigen::Matrix3d& r = camera.pose.rotation;
    EXPECT_LT((r * r.transpose() - Eigen::Matrix3d::Identity()).norm(), 1e-12);
    EXPECT_NEAR(r.determinant(), 1, 1e-12);
    EXPECT_LT(r(1, 2), 0);  // the image's down is the world's down
  }
}

TEST(DemoWorld, IsTheSameForAnyNumberOfThreads) {
  const WorldOnDisk one(small_world(), 1), three(small_world(), 3);
  EXPECT_EQ(one.written.floats.size(), 12u);
  EXPECT_EQ(one.written.masks.size(), 6u);
  EXPECT_EQ(one.written.floats, three.written.floats);
  EXPECT_EQ(one.written.masks, three.written.masks);
  for (const char* file :
       {"transforms.json", "sparse/0/cameras.txt", "sparse/0/images.txt", "sparse/0/points3D.txt"}) {
    EXPECT_FALSE(one.text(file).empty()) << file;
    EXPECT_EQ(one.text(file), three.text(file)) << file;
  }
}

TEST(DemoWorld, SeedsDiffer) {
  DemoWorldOptions options = small_world();
  options.images = 2;
  const WorldOnDisk first(options, 1);
  options.seed = 2;
  const WorldOnDisk second(options, 1);
  EXPECT_NE(first.written.floats.at("images/000.png"), second.written.floats.at("images/000.png"));
  EXPECT_NE(first.written.floats.at("depth/000.exr"), second.written.floats.at("depth/000.exr"));
}

TEST(DemoWorld, SkyIsBrightAndBlackIsBlackBehindTheSameIsland) {
  DemoWorldOptions options = small_world();
  options.images = 2;
  const WorldOnDisk black(options, 1);
  options.background = DemoBackground::kSky;
  const WorldOnDisk sky(options, 1);
  const auto& dark = black.written.floats.at("images/000.png");
  const auto& bright = sky.written.floats.at("images/000.png");
  const auto& mask = black.written.masks.at("mask/000.png");
  EXPECT_EQ(mask, sky.written.masks.at("mask/000.png"));
  for (std::size_t i = 0; i < mask.size(); ++i) {
    if (mask[i] == 255) {
      EXPECT_EQ(dark[3 * i], bright[3 * i]);
    }
    if (mask[i] == 0) {
      EXPECT_EQ(dark[3 * i], 0);
    }
    if (mask[i] == 0) {
      EXPECT_GT(bright[3 * i + 2], 0.3f);
    }
  }
}

/// The numbers of a line.
std::vector<double> numbers(const std::string& line) {
  std::istringstream in(line);
  std::vector<double> values;
  for (double value; in >> value;) values.push_back(value);
  return values;
}

TEST(DemoWorld, SparsePointsLieWhereTheirImagesSeeThem) {
  const DemoWorldOptions options = small_world();
  const WorldOnDisk run(options, 2);
  const auto cameras = demo_cameras(options);

  std::vector<std::vector<double>> seen;  // per image: u, v, point id, ...
  std::istringstream images(run.text("sparse/0/images.txt"));
  for (std::string line; std::getline(images, line);) {
    if (line.starts_with("#")) continue;
    std::getline(images, line);
    seen.push_back(numbers(line));
  }
  ASSERT_EQ(seen.size(), cameras.size());

  int points = 0, observations = 0;
  std::istringstream rows(run.text("sparse/0/points3D.txt"));
  for (std::string line; std::getline(rows, line);) {
    if (line.starts_with("#")) continue;
    const std::vector<double> row = numbers(line);
    ++points;
    ASSERT_GE(row.size(), 12u);
    for (std::size_t i = 8; i < row.size(); i += 2) {
      const int image = int(row[i]) - 1, index = int(row[i + 1]);
      ASSERT_EQ(seen[image].at(3 * index + 2), row[0]);
      const Vector3d pixel = cameras[image].project({row[1], row[2], row[3]});
      EXPECT_NEAR(pixel.x(), seen[image][3 * index], 1e-3);
      EXPECT_NEAR(pixel.y(), seen[image][3 * index + 1], 1e-3);
      ++observations;
    }
  }
  EXPECT_GT(points, 40);
  EXPECT_GE(observations, 2 * points);
}

TEST(DemoWorld, RefusesOptionsOutOfRange) {
  RunContext context(1);
  Written written;
  const TempFolder temporary;
  const fs::path folder = temporary / "bad";
  for (auto spoil :
       {+[](DemoWorldOptions& o) { o.images = 1; }, +[](DemoWorldOptions& o) { o.width = 4; },
        +[](DemoWorldOptions& o) { o.samples_per_axis = 0; }, +[](DemoWorldOptions& o) { o.points = -1; }}) {
    DemoWorldOptions options = small_world();
    spoil(options);
    EXPECT_THROW(write_demo_world(folder, options, written.writers(folder), context), InvalidInput);
  }
  EXPECT_FALSE(fs::exists(folder));
  EXPECT_THROW(parse_demo_background("green"), InvalidInput);
  EXPECT_EQ(parse_demo_background("sky"), DemoBackground::kSky);
}

TEST(DemoWorld, StopsWhenCancelledAndLeavesNoCameras) {
  RunContext context(2);
  context.cancel();
  Written written;
  const TempFolder folder;
  EXPECT_THROW(write_demo_world(folder.path(), small_world(), written.writers(folder.path()), context),
               Cancelled);
  EXPECT_FALSE(fs::exists(folder.path() / "transforms.json"));
}

}  // namespace
}  // namespace roxel
