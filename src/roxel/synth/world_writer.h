#pragma once
/// A complete data set of a synthetic world: photographs and the truth about them (docs/synthetic.md).

#include <filesystem>
#include <functional>
#include <optional>

#include "roxel/base/run_context.h"
#include "roxel/image/image.h"
#include "roxel/synth/pose_noise.h"
#include "roxel/synth/world.h"

namespace roxel {

/// What is left out is the world's own (world_defaults).
struct SynthOptions {
  std::optional<int> images = {};
  std::optional<int> width = {}, height = {};
  std::uint32_t seed = 1;
  std::optional<LightKind> light = {};
  bool moving_shadows = true;                 ///< else all occasions have the first one's date and time
  std::optional<bool> environment_seen = {};  ///< whether cameras see the sky where nothing stands
  int transients = 0;                         ///< things at each occasion that are at no other
  double noise = 0;                           ///< add_sensor_noise; 0 = none
  PoseNoise pose_noise = {};                  ///< of the cameras that are written
  std::optional<int> samples = {};            ///< rays a pixel
  int points = 6000;                          ///< sparse points asked for
};

/// How pixels get into files: synth stands beside io and knows no image format. Called from several threads
/// at once, each time with another path, whose folder exists.
struct WorldWriters {
  using Path = std::filesystem::path;
  std::function<void(const Path&, const Image& linear_rgb)> png;  ///< 8-bit sRGB
  std::function<void(const Path&, const Mask&)> mask;             ///< 8-bit grey PNG
  std::function<void(const Path&, const Image& rgb)> half_exr;    ///< half float, channels R, G, B
  std::function<void(const Path&, const Image& depth)> depth;     ///< float EXR, channel Z
};

/// What was made.
struct SynthSummary {
  int images, width, height;
  LightKind light;
  int occasions;
  std::size_t triangles;
  std::size_t points;
};

/// Writes the data set into `folder`, which is made where missing; transforms.json comes last, so a folder
/// that has it is complete. Files are the same, byte for byte, for any number of threads. Throws InvalidInput
/// for options out of range, IoError where writing fails, Cancelled.
SynthSummary write_world(const std::filesystem::path& folder, WorldKind kind, const SynthOptions& options,
                         const WorldWriters& writers, RunContext& context);

}  // namespace roxel
