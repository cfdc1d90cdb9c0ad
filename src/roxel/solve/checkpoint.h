#pragma once
/// Where a reconstruction stands between two passes: all that it needs to go on to the same bits.

#include <array>
#include <vector>

#include "roxel/infer/acceleration.h"
#include "roxel/solve/light.h"
#include "roxel/solve/summary.h"
#include "roxel/volume/volume.h"

namespace roxel {

/// What has been done, and what the passes so far have decided about those to come.
struct PassState {
  int level = 1;             ///< 1-based
  int passes = 0;            ///< of this level that are done
  int draft_passes = 0;      ///< of this level, done or to come
  bool resting = false;      ///< opacities rest: one plain pass is left
  bool light_rests = false;  ///< the light is no longer fitted in this level
  bool level_done = false;   ///< all of its passes; what is done between levels is not
  LightSource light_from = LightSource::kNone;
  double level_seconds = 0;           ///< spent on this level
  std::int64_t level_peak_bytes = 0;  ///< held for it; 0: not known
};

/// A checkpoint that has been read: it owns what it holds.
struct Checkpoint {
  PassState state;
  Summary summary;                              ///< `seconds` so far; its stages are those before the passes
  std::vector<std::array<float, 3>> light;      ///< Light::of_views
  std::vector<Acceleration::Step> accelerated;  ///< Acceleration::memory()
  Volume volume;
};

/// A running reconstruction as it may be written.
struct CheckpointView {
  const PassState& state;
  const Summary& summary;
  const std::vector<std::array<float, 3>>& light;
  const std::vector<Acceleration::Step>& accelerated;
  const Volume& volume;
};

}  // namespace roxel
