#pragma once
/// All that `roxel eval` measures of a run, and as JSON, CSV and text. docs/evaluation.md says what each
/// figure is.

#include <Eigen/Geometry>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <vector>

#include "roxel/eval/color_accuracy.h"
#include "roxel/eval/depth_accuracy.h"
#include "roxel/eval/image_quality.h"
#include "roxel/eval/reliability.h"
#include "roxel/eval/section.h"
#include "roxel/eval/sky_debris.h"
#include "roxel/eval/surface_accuracy.h"
#include "roxel/eval/volume_accuracy.h"
#include "roxel/report/light_measures.h"
#include "roxel/report/sky_measures.h"

namespace roxel {

struct NamedSurfaceAccuracy {
  std::string name;  ///< what was measured: "depth points", "voxels", the estimate's file
  SurfaceAccuracy accuracy;
  int pixel_stride =
      0;  ///< of depth points by pixel: between those of rows and of columns that count; else 0

  /// With the share of pixels, where not all count: "depth points by pixel, 1 in 9".
  std::string title() const;
};

struct NamedImageQuality {
  std::string name;
  ImageQuality object;  ///< over the pixels that show the object
  ImageQuality all;     ///< over all valid pixels
};

/// Parts that could not be measured are empty; `notes` says why.
struct RunMeasures {
  std::string run;
  std::optional<std::string> truth;
  double voxel_size = 0;
  Eigen::AlignedBox3d box;                         ///< of the run; surfaces count inside it
  std::optional<double> reprojection_rms_percent;  ///< of summary.json, as are the next
  std::vector<std::pair<std::string, double>> reprojection;

  std::vector<NamedDepthAccuracy> depth;
  /// All views together, from the volume, after belief propagation ("bp") and refinement ("refined"): those
  /// that the run has.
  std::vector<NamedDepthAccuracy> depth_methods;
  std::optional<Reliability> opacity_reliability;
  std::int64_t surface_samples = 0;  ///< of the true surface in the box
  double surface_seen = 0;           ///< share of them that two views see
  std::vector<NamedSurfaceAccuracy> surfaces;
  std::optional<VolumeAccuracy> volume;
  double opacity_threshold = 0;     ///< of the voxels that count in `volume`
  double confidence_threshold = 0;  ///< of the same voxels
  std::vector<SkyDebris> debris;    ///< of the same voxels, and of opaquer ones; empty: no skies
  std::vector<NamedImageQuality> images;
  std::vector<NamedImageQuality> held_out;  ///< views that the run has not seen
  std::optional<ColorAccuracy> color;
  std::vector<Section> sections;    ///< with the true outline
  std::vector<LightMeasure> light;  ///< of the photographs, divided by one kind of light after the other
  std::vector<SkyMeasure> skies;
  std::vector<std::string> notes;

  double box_diagonal() const { return box.isEmpty() ? 0.0 : box.diagonal().norm(); }
  bool empty() const;
};

/// Of all views together.
DepthAccuracy total_depth(const std::vector<NamedDepthAccuracy>& views);
NamedImageQuality total_quality(const std::vector<NamedImageQuality>& views);

nlohmann::ordered_json to_json(const RunMeasures& measures);

/// Name of a file and its content: one table each, comma-separated, with a line of headings.
std::vector<std::pair<std::string, std::string>> csv_tables(const RunMeasures& measures);

/// For a terminal; views are listed up to `most_views`.
std::string to_text(const RunMeasures& measures, std::size_t most_views = 32);

}  // namespace roxel
