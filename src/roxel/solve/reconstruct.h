#pragma once
/// The main job: calibrated photographs to a probabilistic volume, coarse to fine (docs/reconstruct.md).

#include "roxel/infer/run_pass.h"
#include "roxel/solve/scene.h"
#include "roxel/solve/summary.h"
#include "roxel/volume/volume.h"

namespace roxel {

struct Reconstruction {
  Volume volume;
  Scene scene;
  Summary summary;
};

/// What a caller may watch or provide. All optional.
struct ReconstructHooks {
  std::function<void(const Scene&)> after_survey;
  std::function<void(const PassRecord&)> after_pass;
  std::function<void(const Volume&, const Scene&, const Summary&)> after_level;
  /// Opacities and colours to start from (--init), as a volume of any resolution in the same colour space.
  const Volume* initial = nullptr;
  /// The skies over the photographs, where they are known.
  const Daylight* daylight = nullptr;
};

/// Throws InvalidInput for bad input or options, Cancelled when the context was cancelled. `context` gets
/// progress from 0 to `progress_share`.
Reconstruction reconstruct(const Dataset& dataset, const PhotographLoader& load,
                           const ReconstructOptions& options, RunContext& context,
                           const ReconstructHooks& hooks = {}, double progress_share = 1);

/// The pass options that a scene and its options make.
PassOptions pass_options(const Scene& scene, const ReconstructOptions& options);

/// Sets the channels of `volume` from `initial` at each voxel's centre, where that has a voxel.
void initialise_from(const Volume& initial, Volume& volume);

}  // namespace roxel
