#pragma once
/// Synthetic worlds of triangles: what stands in them, what it is painted with, and who photographs it when.

#include <Eigen/Geometry>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "roxel/camera/camera.h"
#include "roxel/synth/path_renderer.h"
#include "roxel/synth/texture.h"
#include "roxel/synth/triangle_mesh.h"

namespace roxel {

enum class WorldKind { kPlane, kHead, kMug, kTable, kStreet, kFlights };

/// What the light is made of.
///     constant  the same for all photographs: a large lamp and a bright surround; outdoors one clear noon
///     daylight  a clear sky with more or less haze, at each occasion's own date and time
///     overcast  a closed layer of cloud, brighter or darker by occasion
///     mix       occasions are clear, partly cloudy or overcast in turn
enum class LightKind { kConstant, kDaylight, kOvercast, kMix };

/// A photograph to be taken.
struct Shot {
  std::string name;  ///< of its files, without suffix
  PinholeCamera camera;
  int occasion = 0;  ///< index into World::times_utc_s
};

/// What the caller chooses about a world.
struct WorldRequest {
  int images = 0;
  int width = 0;
  int height = 0;
  std::uint32_t seed = 1;
};

/// Seconds since 1970-01-01T00:00:00Z.
using UtcSeconds = double;

struct World {
  TriangleMesh mesh;
  std::vector<Texture> materials;
  std::vector<Shot> shots;
  Eigen::AlignedBox3d bounds;           ///< the box worth reconstructing
  std::vector<UtcSeconds> times_utc_s;  ///< of each occasion: a time at which one or more shots are taken
  bool occasions_are_nodes = false;     ///< shots of one occasion have one optical centre
  bool outdoors = false;                ///< constant light is a clear noon instead of a studio
  Eigen::Vector3f lamp_direction = {-0.45f, -0.65f, 0.62f};  ///< to the studio's lamp, any length
  float surround = 1;                                        ///< brightness of the studio's surround
  std::optional<Skylight> skylight = {};
  bool environment_seen = true;             ///< cameras see the sky where nothing stands; else black
  bool masked = true;                       ///< masks belong to the data set
  bool high_dynamic_range = false;          ///< photographs are radiance in EXR files, not 8-bit PNG
  std::vector<Eigen::AlignedBox3f> stages;  ///< where nothing stands and passing things may
  float transient_size = 0.3f;              ///< height of a passing thing, world units
};

/// Where all worlds are.
constexpr double kWorldLatitudeDeg = 48.137, kWorldLongitudeDeg = 11.575;

/// Reads "plane", "head", ...; nothing for another name.
std::optional<WorldKind> find_world(const std::string& name);

/// Images and size that a world has by default, and its kind of light.
struct WorldDefaults {
  int images, width, height;
  LightKind light;
  int samples;
  int most_images = 999;
};
WorldDefaults world_defaults(WorldKind kind);

World make_world(WorldKind kind, const WorldRequest& request);

// One file each.
World plane_world(const WorldRequest& request);
World head_world(const WorldRequest& request);
World mug_world(const WorldRequest& request);
World table_world(const WorldRequest& request);
World street_world(const WorldRequest& request);
World flights_world(const WorldRequest& request);

/// "000", "001", ...
std::string shot_name(int index);

/// One occasion a shot, an hour and a day after each other, in the daylight of a summer.
void give_each_shot_its_occasion(World& world);

}  // namespace roxel
