#pragma once
/// A complete data set from a world built into the library: photographs with exact cameras and the truth.
///
///     images/000.png ...    8-bit sRGB
///     mask/000.png ...      8 bit: 255 surface, 0 background, between: partly covered
///     depth/000.exr ...     float, one channel Z: distance along the optical axis through the pixel's
///     centre,
///                           world units, 0 = no surface
///     transforms.json       OpenGL camera-to-world; scene_bounds
///     sparse/0/*.txt        COLMAP text: the same cameras, and points on the surface with where they are
///     seen

#include <Eigen/Geometry>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <string>
#include <vector>

#include "roxel/base/run_context.h"
#include "roxel/camera/camera.h"
#include "roxel/image/image.h"
#include "roxel/synth/demo_renderer.h"

namespace roxel {

struct DemoWorldOptions {
  int images = 24;  ///< on three rings: below, level with and above the lawn; at least 2
  int width = 320;  ///< pixels, at least 16
  int height = 240;
  std::uint32_t seed = 1;
  DemoBackground background = DemoBackground::kBlack;
  int samples_per_axis = 2;  ///< squared: rays a pixel, 1 to 8
  int points = 3000;         ///< sparse points asked for; those that fewer than two images see are dropped
};

/// Reads "black" or "sky"; throws InvalidInput otherwise, naming `where`.
DemoBackground parse_demo_background(const std::string& text, const std::string& where = "background");

/// The cameras that write_demo_world photographs with, in the order of the images.
std::vector<PinholeCamera> demo_cameras(const DemoWorldOptions& options);

/// The box worth reconstructing.
Eigen::AlignedBox3d demo_bounds();

/// How pixels get into files: synth stands beside io and knows no image format. Called from several threads
/// at once, each time with another path, whose folder exists.
struct DemoWorldWriters {
  std::function<void(const std::filesystem::path&, const Image& linear_rgb)> photograph;  ///< 8-bit sRGB PNG
  std::function<void(const std::filesystem::path&, const Mask&)> mask;                    ///< 8-bit grey PNG
  std::function<void(const std::filesystem::path&, const Image& depth)> depth;  ///< float EXR, channel Z
};

/// Writes the data set into `folder`, which is made where missing; the cameras come last, so a folder with
/// transforms.json is complete. Files are the same, byte for byte, for any number of threads. Throws
/// InvalidInput for options out of range, IoError where writing fails, Cancelled.
void write_demo_world(const std::filesystem::path& folder, const DemoWorldOptions& options,
                      const DemoWorldWriters& writers, RunContext& context);

}  // namespace roxel
