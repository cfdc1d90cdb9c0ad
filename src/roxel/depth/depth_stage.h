#pragma once
/// From a volume's depth maps to those that are believed: belief propagation, photometric refinement,
/// agreement between views; one view after the other, with what is in memory bounded (docs/depth.md).

#include <functional>

#include "roxel/base/option_table.h"
#include "roxel/base/run_context.h"
#include "roxel/dataset/dataset.h"
#include "roxel/depth/depth_layers.h"
#include "roxel/depth/depth_map.h"
#include "roxel/depth/propagate_depth.h"
#include "roxel/depth/refine_view.h"

namespace roxel {

struct DepthStageOptions {
  DepthOptions map;  ///< for who makes the maps; the stage reads them
  bool bp = true;
  DepthPrior bp_prior = DepthPrior::kEdgeAware;
  MessageSchedule bp_schedule = MessageSchedule::kSynchronous;
  std::optional<double> bp_sigma;
  int bp_sweeps = 50;
  bool bp_fill = false;

  bool refine = true;
  std::optional<int> refine_scale;
  int refine_views = 8;
  int refine_rounds = 2;
  int refine_radius = 3;
  double refine_sigmas = 60;
  double refine_noise = 0.006;
  double refine_pixel_sigma = 0.035;
  std::int64_t seed = 1;
  bool refine_agree = true;
};

const OptionTable<DepthStageOptions>& depth_option_table();

/// Where depth maps are kept. Called from several threads, for different views.
struct DepthFiles {
  std::function<DepthLayers(int view_idx)> read;
  std::function<void(int view_idx, const DepthLayers&)> write;
  std::function<void(int view_idx, const RefinedView&)> keep;  ///< until the stage is over
  std::function<RefinedView(int view_idx)> recall;
  /// Of views that are held rather than made again, beside those that are worked on. Changes no result.
  std::size_t most_held_bytes = std::size_t{1} << 30;
};

/// What a stage did, and what it cost.
struct DepthStageFigures {
  PropagationFigures propagation;
  int refine_scale = 1;             ///< pixels that refinement took for one, along an axis
  std::int64_t refined_pixels = 0;  ///< given depth
  std::int64_t matched_pixels = 0;  ///< of these, that photographs said something of
  std::int64_t agreed_pixels = 0;   ///< that another view agrees with
  double pixels = 0;                ///< of all images
  double propagate_seconds = 0, refine_seconds = 0;
  std::int64_t propagate_peak_bytes = 0,
               refine_peak_bytes = 0;  ///< resident meanwhile; filled by who runs it

  /// Of another part of the stage, over the same views.
  void add(const DepthStageFigures& other);
};

/// What depth maps are made of, beside the photographs.
struct DepthScene {
  double white = 1;       ///< radiance that counts as white
  double voxel_size = 1;  ///< world units
};

/// Reads every view's Z, V, A; writes them with the layers that `options` ask for. Progress goes from
/// progress_begin to progress_end. Throws Cancelled.
DepthStageFigures run_depth_stage(const Dataset& dataset, const PhotographLoader& load,
                                  const DepthScene& scene, const DepthFiles& files,
                                  const DepthStageOptions& options, RunContext& context,
                                  double progress_begin = 0, double progress_end = 1);

/// The views that a view's patches are looked for in, best first: those that see the same surface at an angle
/// that fixes depth but does not change its looks. `depth`: of the view.
std::vector<int> choose_sources(const Dataset& dataset, int view_idx, const Image& depth, int most);

}  // namespace roxel
