#pragma once
/// The text files of a synthetic data set: cameras, sparse points, illumination.

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "roxel/camera/camera.h"
#include "roxel/synth/sparse_points.h"

namespace roxel {

/// One photograph: images/NAME + image_suffix, depth/NAME.exr, and so on.
struct SyntheticFrame {
  std::string name;
  PinholeCamera camera;
  std::optional<int> node;    ///< given where photographs share an optical centre
  std::string time_utc = {};  ///< "2023-06-15T07:00:00Z"; empty = not given
  std::string sky = {};       ///< sky/SKY.exr is its light; empty = not given
};

/// Cameras that share one set of intrinsics without skew.
struct SyntheticCameras {
  std::vector<SyntheticFrame> frames;
  Eigen::AlignedBox3d bounds;
  std::string image_suffix = ".png";
  bool masked = true;            ///< there is mask/NAME.png
  bool with_surfaces = false;    ///< there are albedo/NAME.exr and normal/NAME.exr
  bool with_transients = false;  ///< there is transient/NAME.png
  struct Place {
    double latitude_deg, longitude_deg;
  };
  std::optional<Place> place = {};
};

/// What transforms.json has as its generator: such a data set may be replaced by another one.
inline constexpr const char* kSyntheticGenerator = "roxel synth";

/// A transforms.json: OpenGL camera-to-world matrices (x right, y up, looking along -z).
void write_synthetic_transforms(const std::filesystem::path& file, const SyntheticCameras& set);

/// FOLDER/sparse/0/cameras.txt, images.txt, points3D.txt.
void write_synthetic_colmap(const std::filesystem::path& folder, const SyntheticCameras& set,
                            const std::vector<SparsePoint>& points);

/// "2023-06-15T07:00:00Z" of seconds since 1970-01-01T00:00:00Z, rounded down.
std::string utc_text(double time_utc_s);

}  // namespace roxel
