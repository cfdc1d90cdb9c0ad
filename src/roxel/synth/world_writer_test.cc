#include "roxel/synth/world_writer.h"

#include <gtest/gtest.h>

#include <cmath>
#include <fstream>
#include <map>
#include <mutex>
#include <nlohmann/json.hpp>
#include <sstream>

#include "roxel/base/error.h"
#include "roxel/base/temp_folder.h"

namespace roxel {
namespace {

namespace fs = std::filesystem;
using Eigen::Vector3d;
using nlohmann::json;

/// A data set on disk, its pixels in memory.
class Made {
 public:
  Made(WorldKind kind, const SynthOptions& options, int threads = 2) {
    RunContext context(threads);
    const auto keep = [this](const fs::path& path, const Image& image) {
      const std::lock_guard lock(mutex_);
      images[fs::relative(path, folder_).string()] = image;
    };
    const auto keep_mask = [this](const fs::path& path, const Mask& mask) {
      const std::lock_guard lock(mutex_);
      masks[fs::relative(path, folder_).string()] = mask;
    };
    summary = write_world(folder_, kind, options, {keep, keep_mask, keep, keep}, context);
  }
  std::string text(const std::string& file) const {
    std::ifstream in(folder_ / file, std::ios::binary);
    std::stringstream text;
    text << in.rdbuf();
    return text.str();
  }
  bool has(const std::string& file) const { return fs::exists(folder_ / file); }
  json transforms() const { return json::parse(text("transforms.json")); }
  json illumination() const { return json::parse(text("illumination.json")); }

  std::map<std::string, Image> images;
  std::map<std::string, Mask> masks;
  SynthSummary summary;

 private:
  const TempFolder temporary_;
  const fs::path folder_ = temporary_ / "world";
  std::mutex mutex_;
};

SynthOptions tiny(int images = 3) {
  SynthOptions options;
  options.images = images;
  options.width = 32;
  options.height = 24;
  options.samples = 2;
  options.points = 60;
  return options;
}

std::map<std::string, std::vector<float>> pixels(const Made& made) {
  std::map<std::string, std::vector<float>> all;
  for (const auto& [path, image] : made.images) all[path] = image.data();
  return all;
}

TEST(WorldWriter, WritesThePhotographsAndTheTruth) {
  const Made made(WorldKind::kHead, tiny());
  for (const char* file : {"images/000.png", "depth/002.exr", "albedo/001.exr", "normal/000.exr",
                           "sky/n00.exr", "sky/n00_nosun.exr"})
    EXPECT_EQ(made.images.count(file), 1u) << file;
  EXPECT_EQ(made.images.size(), 3u * 4 + 2);
  EXPECT_EQ(made.masks.size(), 3u);
  for (const char* file : {"transforms.json", "illumination.json", "mesh.ply", "sparse/0/cameras.txt",
                           "sparse/0/images.txt", "sparse/0/points3D.txt"})
    EXPECT_TRUE(made.has(file)) << file;
  EXPECT_FALSE(made.has("transforms_true.json"));
  const json frame = made.transforms()["frames"][1];
  EXPECT_EQ(frame["file_path"], "images/001.png");
  EXPECT_EQ(frame["mask_path"], "mask/001.png");
  EXPECT_EQ(frame["sky_path"], "sky/n00.exr");
  EXPECT_FALSE(frame.contains("node"));
  EXPECT_FALSE(frame.contains("time_utc"));
  EXPECT_GT(made.summary.points, 20u);
}

TEST(WorldWriter, IsTheSameForAnyNumberOfThreads) {
  SynthOptions options = tiny(21);  // two nodes, the second with one photograph
  options.width = options.height = 16;
  options.noise = 0.02;
  options.transients = 2;
  const Made one(WorldKind::kStreet, options, 1), three(WorldKind::kStreet, options, 3);
  EXPECT_EQ(pixels(one), pixels(three));
  for (const char* file :
       {"transforms.json", "illumination.json", "mesh.ply", "sparse/0/images.txt", "sparse/0/points3D.txt"}) {
    EXPECT_FALSE(one.text(file).empty());
    EXPECT_EQ(one.text(file), three.text(file)) << file;
  }
}

/// Where the pixel's ray meets a surface, by the depth map.
Vector3d surface_point(const PinholeCamera& camera, const Image& depth, int x, int y) {
  const Ray ray = camera.ray(x + 0.5, y + 0.5);
  return ray.origin + *depth.pixel(x, y) * ray.direction;
}

// A vertex that its camera sees lies where the depth map says, in its pixel or, at an edge, in one beside it.
TEST(WorldWriter, VerticesOfTheMeshAgreeWithTheDepthMaps) {
  for (const WorldKind kind : {WorldKind::kHead, WorldKind::kTable, WorldKind::kFlights}) {
    SynthOptions options = tiny();
    options.width = 160, options.height = 120, options.samples = 1;
    const Made made(kind, options);
    const World world = make_world(kind, {3, 160, 120, 1});
    const RayScene scene(world.mesh);
    int seen = 0, agree = 0, in_plane = 0;
    for (const Shot& shot : world.shots) {
      const Image& depth = made.images.at("depth/" + shot.name + ".exr");
      const Image& normals = made.images.at("normal/" + shot.name + ".exr");
      for (std::size_t i = 0; i < world.mesh.vertices.size(); i += 7) {
        const Vector3d vertex = world.mesh.vertices[i].cast<double>(), pixel = shot.camera.project(vertex);
        if (!(pixel.z() > 0 && pixel.x() > 0 && pixel.y() > 0 && pixel.x() < 160 && pixel.y() < 120))
          continue;
        const Eigen::Vector3f way = (vertex - shot.camera.pose.centre).cast<float>();
        if (scene.occluded(shot.camera.pose.centre.cast<float>(), way, 0, 0.998f)) continue;
        const int x = static_cast<int>(pixel.x()), y = static_cast<int>(pixel.y());
        const double footprint = pixel.z() / shot.camera.intrinsics.fx;
        ++seen;
        double nearest = 1e9;
        for (int row = std::max(y - 1, 0); row <= std::min(y + 1, 119); ++row)
          for (int column = std::max(x - 1, 0); column <= std::min(x + 1, 159); ++column)
            nearest = std::min(nearest, (surface_point(shot.camera, depth, column, row) - vertex).norm());
        agree += nearest < 2.5 * footprint;
        // The pixel's tangent plane goes through the vertex, closer than half a pixel's error would let it.
        const Eigen::Map<const Eigen::Vector3f> normal(normals.pixel(x, y));
        const double off = normal.cast<double>().dot(surface_point(shot.camera, depth, x, y) - vertex);
        in_plane += std::abs(off) < 0.1 * footprint;
      }
    }
    EXPECT_GT(seen, 500);
    EXPECT_GT(agree, 0.94 * seen) << static_cast<int>(kind);
    // In the others much is smaller than a pixel.
    if (kind == WorldKind::kHead) {
      EXPECT_GT(in_plane, 0.9 * seen);
    }
  }
}

TEST(WorldWriter, StreetIsRadianceOfNodesWithDatesPlaceAndSkies) {
  SynthOptions options = tiny(22);
  options.width = options.height = 16;
  const Made made(WorldKind::kStreet, options);
  EXPECT_EQ(made.images.count("images/n01_01.exr"), 1u);
  const json set = made.transforms();
  EXPECT_NEAR(set["latitude"].get<double>(), 48.137, 1e-9);
  const json &first = set["frames"][0], &last = set["frames"][21];
  EXPECT_EQ(first["node"], 0);
  EXPECT_EQ(last["node"], 1);
  EXPECT_EQ(first["time_utc"], "2023-06-15T08:30:00Z");
  EXPECT_NE(first["time_utc"], last["time_utc"]);
  EXPECT_EQ(last["sky_path"], "sky/n01.exr");
  const json light = made.illumination()["nodes"];
  ASSERT_EQ(light.size(), 2u);
  EXPECT_EQ(light[0]["sky"], "clear");
  EXPECT_EQ(light[1]["sky"], "overcast");
  EXPECT_TRUE(light[0]["sun_disc"].get<bool>());
  EXPECT_FALSE(light[1]["sun_disc"].get<bool>());
  EXPECT_GT(light[0]["sun_elevation_deg"].get<double>(), 30);
  EXPECT_EQ(light[1]["center"].size(), 3u);
  // What the camera sees of the sky is what the map says, in the same units.
  const World world = make_world(WorldKind::kStreet, {22, 16, 16, 1});
  const Image &photograph = made.images.at("images/n01_00.exr"), &map = made.images.at("sky/n01.exr");
  const Mask& mask = made.masks.at("mask/n01_00.png");
  int sky_pixels = 0;
  for (int x = 0; x < 16; ++x) {
    if (mask.at(x, 0) > 0) continue;
    ++sky_pixels;
    const Eigen::Vector3f d = world.shots[20].camera.ray(x + 0.5, 0.5).direction.normalized().cast<float>();
    const Eigen::Vector2f at = map_position(map, d);
    EXPECT_NEAR(photograph.pixel(x, 0)[1] / map.pixel(static_cast<int>(at.x()), static_cast<int>(at.y()))[1],
                1, 0.1);
  }
  EXPECT_GT(sky_pixels, 8);
}

TEST(WorldWriter, PosesAloneAreMovedByPoseNoise) {
  SynthOptions options = tiny();
  const Made exact(WorldKind::kPlane, options);
  options.pose_noise = {0.5, 0.01};
  const Made moved(WorldKind::kPlane, options);
  EXPECT_EQ(pixels(exact), pixels(moved));
  EXPECT_EQ(exact.text("mesh.ply"), moved.text("mesh.ply"));
  EXPECT_EQ(exact.text("sparse/0/points3D.txt"), moved.text("sparse/0/points3D.txt"));
  EXPECT_NE(exact.text("sparse/0/images.txt"), moved.text("sparse/0/images.txt"));
  EXPECT_NE(exact.text("transforms.json"), moved.text("transforms.json"));
  EXPECT_EQ(exact.text("transforms.json"), moved.text("transforms_true.json"));
}

TEST(WorldWriter, TransientsChangeThePhotographsOfTheirOccasionAndNoTruth) {
  SynthOptions options = tiny(2);
  options.width = 64, options.height = 48;
  const Made empty(WorldKind::kPlane, options);
  options.transients = 2;
  const Made passing(WorldKind::kPlane, options);
  EXPECT_EQ(empty.masks.count("transient/000.png"), 0u);
  int covered[2] = {};
  for (int i = 0; i < 2; ++i) {
    const std::string name = "00" + std::to_string(i);
    for (const char* kind : {"depth/", "albedo/", "normal/"})
      EXPECT_EQ(empty.images.at(kind + name + ".exr").data(), passing.images.at(kind + name + ".exr").data());
    const Mask& mask = passing.masks.at("transient/" + name + ".png");
    const Image &before = empty.images.at("images/" + name + ".png"),
                &after = passing.images.at("images/" + name + ".png");
    int changed = 0;
    for (int y = 0; y < 48; ++y)
      for (int x = 0; x < 64; ++x)
        if (mask.at(x, y) == 255) ++covered[i], changed += before.pixel(x, y)[0] != after.pixel(x, y)[0];
    EXPECT_GT(covered[i], 20);
    EXPECT_GT(changed, 0.95 * covered[i]);
  }
  // The other occasion has other things.
  EXPECT_NE(passing.masks.at("transient/000.png").data(), passing.masks.at("transient/001.png").data());
  EXPECT_TRUE(passing.transforms()["frames"][0].contains("transient_path"));
}

TEST(WorldWriter, LightNoiseAndSeedChangeThePhotographsAndNotTheShape) {
  const Made plain(WorldKind::kMug, tiny(2));
  const auto changed = [&](const std::function<void(SynthOptions&)>& change) {
    SynthOptions options = tiny(2);
    change(options);
    const Made other(WorldKind::kMug, options);
    EXPECT_EQ(plain.images.at("depth/000.exr").data(), other.images.at("depth/000.exr").data());
    return plain.images.at("images/000.png").data() != other.images.at("images/000.png").data();
  };
  EXPECT_TRUE(changed([](SynthOptions& o) { o.seed = 2; }));
  EXPECT_TRUE(changed([](SynthOptions& o) { o.noise = 0.02; }));
  EXPECT_TRUE(changed([](SynthOptions& o) { o.light = LightKind::kDaylight; }));
  EXPECT_TRUE(changed([](SynthOptions& o) { o.light = LightKind::kOvercast; }));
  EXPECT_TRUE(changed([](SynthOptions& o) { o.environment_seen = true; }));
  EXPECT_FALSE(changed([](SynthOptions& o) { o.points = 3; }));
}

TEST(WorldWriter, TheTableHasNoMasks) {
  const Made made(WorldKind::kTable, tiny(2));
  EXPECT_TRUE(made.masks.empty());
  EXPECT_FALSE(made.transforms()["frames"][0].contains("mask_path"));
}

TEST(WorldWriter, RefusesOptionsOutOfRange) {
  RunContext context(1);
  const TempFolder temporary;
  const fs::path folder = temporary / "never";
  for (auto spoil :
       {+[](SynthOptions& o) { o.images = 1; }, +[](SynthOptions& o) { o.width = 4; },
        +[](SynthOptions& o) { o.samples = 0; }, +[](SynthOptions& o) { o.noise = -1; },
        +[](SynthOptions& o) { o.transients = -1; }, +[](SynthOptions& o) { o.pose_noise.rotation_deg = -1; },
        +[](SynthOptions& o) { o.points = -1; }}) {
    SynthOptions options = tiny();
    spoil(options);
    EXPECT_THROW(write_world(folder, WorldKind::kPlane, options, {}, context), InvalidInput);
  }
  SynthOptions many = tiny(281);
  EXPECT_THROW(write_world(folder, WorldKind::kStreet, many, {}, context), InvalidInput);
  EXPECT_FALSE(fs::exists(folder));
}

}  // namespace
}  // namespace roxel
