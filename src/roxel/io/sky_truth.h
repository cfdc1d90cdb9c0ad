#pragma once
/// The true light of a data set's nodes: illumination.json and the maps it names (docs/synthetic.md).

#include <Eigen/Core>
#include <filesystem>
#include <string>
#include <vector>

#include "roxel/image/image.h"

namespace roxel {

struct SkyTruth {
  std::string node;                ///< as roxel sky names it: "n03"
  std::filesystem::path map_file;  ///< equirectangular radiance without the disc
  Eigen::Vector3d sun;             ///< unit, X east, Y north, Z up
  bool disc = false;               ///< the sun shines
  Eigen::Vector3d sun_irradiance;  ///< on a surface that faces the sun
  Eigen::Vector3d horizontal;      ///< irradiance on the horizontal, with the disc
  Eigen::Vector3d horizontal_sky;  ///< and without

  /// Throws InvalidInput.
  Image map() const;
};

bool has_sky_truth(const std::filesystem::path& folder);

/// FOLDER/illumination.json. Throws InvalidInput naming file and field.
std::vector<SkyTruth> read_sky_truth(const std::filesystem::path& folder);

}  // namespace roxel
