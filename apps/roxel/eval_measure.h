#pragma once
/// Takes the measures of a run, one after the other.

#include "eval_source.h"
#include "roxel/report/run_measures.h"

namespace roxel::cli {

struct MeasureOptions {
  std::vector<double> depth_within;  ///< world units
  std::vector<double> distances;     ///< of precision and recall, world units; empty: see default_distances
  double opacity_threshold = 0.04;   ///< of voxels that count as saved
  double confidence_threshold = 0.001;  ///< of these, too
  int views_agree = 2;                  ///< for the second set of depth points
  double sure_within = 4;               ///< voxels: most deviation of depth of the third set
  int samples = 200000;                 ///< of the true surface
  std::uint64_t seed = 1;
  std::optional<std::array<double, 3>> section;  ///< point that the sections go through
};

/// 0.5 % and 1 % of the box's diagonal, and 1, 2 and 4 voxels; ascending.
std::vector<double> default_distances(double diagonal, double voxel_size);

/// True depth of a view, 0 where its surface lies outside the run's lattice; empty where it is not known.
Image true_depth_of(const EvalSource& source, const std::string& view_name);

/// Throws InvalidInput for truth that does not fit the run.
RunMeasures measure(const EvalSource& source, const MeasureOptions& options, Session& session);

}  // namespace roxel::cli
