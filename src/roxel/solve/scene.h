#pragma once
/// What is decided once about a data set, before the first pass: box, scales, colours, background.

#include "roxel/base/run_context.h"
#include "roxel/dataset/bounds.h"
#include "roxel/solve/daylight.h"
#include "roxel/solve/memory_plan.h"
#include "roxel/solve/options.h"

namespace roxel {

struct Scene {
  SceneBounds bounds;
  double voxel_size = 0;          ///< finest level, world units
  int surround_count = 0;         ///< lattices around the box
  bool seen_from_inside = false;  ///< a camera stands in the box
  ColorTransform transform;       ///< linear RGB / exposure <-> matching space
  double exposure = 1;            ///< radiance that counts as display white; 1 for 8- and 16-bit images
  Light light;                    ///< divided out of the photographs
  MatchModel model;
  Background background;
  std::vector<std::uint8_t> masked;  ///< one a view, 1: its photograph has a mask of what is background
  MemoryPlan memory;
  std::vector<std::string> notes;     ///< what was chosen and why, for people
  std::vector<std::string> warnings;  ///< what is likely to be a mistake, and what to change

  /// Whether rays of some view may end in anything: no background, one of any colour, or no mask.
  bool has_open_ends() const;
};

/// Reads every image once. `daylight` where it is known, else null. Throws InvalidInput for options that do
/// not fit the data set.
Scene survey(const Dataset& dataset, const PhotographLoader& load, const ReconstructOptions& options,
             const RunContext& context, const Daylight* daylight = nullptr);

/// The box, far distances and voxel size alone: no image is read (masks are, where they tighten the box and
/// `load` is given). For `roxel info` and dry runs, and the first step of survey().
Scene lay_out(const Dataset& dataset, const PhotographLoader& load, const ReconstructOptions& options);

/// The most passes of a level, from 1. Levels before the last have options.coarse_passes; where that is 0 as
/// many as the last, and twice as many where masks of objects, not of the sky, say what is background: where
/// cameras stand in the box or rays go on beyond it, more passes there do harm (docs/passes.md).
int most_passes(const Scene& scene, const ReconstructOptions& options, int level);

/// How many of these are drafts.
int most_drafts(const Scene& scene, const ReconstructOptions& options, int level);

/// The frames of the coarsest level's lattices: box first, then surround.
std::vector<LatticeFrame> frames_of_first_level(const Scene& scene, const ReconstructOptions& options);

/// Which of a photograph's colours samples hold: those that rays and voxels are compared by, or those that
/// voxels are painted with, or linear RGB over the exposure, whatever the sky's light: over their gain where
/// views have one.
enum class SampleColors { kMatching, kCanonical, kRadiance };

/// Prepares the samples of all views for voxels of `voxel_size`. Those that scene.memory has no room for come
/// without pyramids and make them when asked: they need `dataset`, `load` and `scene` to stay as they are.
std::vector<SampleNode> make_samples(const Dataset& dataset, const PhotographLoader& load, const Scene& scene,
                                     double voxel_size, const ReconstructOptions& options,
                                     const RunContext& context,
                                     SampleColors colors = SampleColors::kMatching);

/// The same nodes with their draft plans as plans.
std::vector<SampleNode> drafts_of(std::vector<SampleNode> nodes);

/// One view in the matching space, all pixels: what depth and error maps are made from.
SampleView make_full_view(const Dataset& dataset, int view_idx, const Photograph& photo, const Scene& scene);

/// The depths that rays of a view cover.
Stretch view_range(const Scene& scene, const Dataset& dataset, int view_idx);

}  // namespace roxel
