#pragma once
/// The plots of a run and of its measures.

#include <nlohmann/json_fwd.hpp>
#include <string>
#include <vector>

#include "roxel/report/run_measures.h"
#include "roxel/report/svg_plot.h"

namespace roxel {

struct NamedPlot {
  std::string name;  ///< of a file, without suffix
  Plot plot;
};

/// Surfaces, voxels, calibration and images: those that were measured.
std::vector<NamedPlot> measure_plots(const RunMeasures& measures);

/// How the passes converged, from summary.json.
std::vector<NamedPlot> convergence_plots(const nlohmann::ordered_json& summary);

/// Voxels of the box by opacity.
NamedPlot opacity_plot(const std::vector<float>& opacities);

}  // namespace roxel
