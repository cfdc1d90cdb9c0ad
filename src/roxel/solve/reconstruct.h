#pragma once
/// The main job: calibrated photographs to a probabilistic volume, coarse to fine (docs/reconstruct.md).

#include "roxel/infer/run_pass.h"
#include "roxel/solve/checkpoint.h"
#include "roxel/solve/scene.h"
#include "roxel/solve/summary.h"
#include "roxel/solve/surface_light.h"
#include "roxel/volume/volume.h"

namespace roxel {

struct Reconstruction {
  Volume volume;
  Scene scene;
  std::optional<SurfaceLight> surface_light;  ///< where the light on voxels' own surfaces was divided out
  Summary summary;
};

/// What a caller may watch or provide. All optional.
struct ReconstructHooks {
  std::function<void(const Scene&)> after_survey;
  std::function<void(const PassRecord&)> after_pass;
  std::function<void(const Volume&, const Scene&, const Summary&)> after_level;
  /// Between two passes, and after each level: what to write for going on from there.
  std::function<void(const CheckpointView&)> checkpoint;
  /// To go on from, instead of from nothing: of the same data set and options. Its parts are moved out.
  Checkpoint* resume = nullptr;
  /// Opacities and colours to start from (--init), as a volume of any resolution in the same colour space.
  const Volume* initial = nullptr;
  /// The skies over the photographs, where they are known.
  const Daylight* daylight = nullptr;
  /// Asked after the first of several levels: skies that are fitted again, knowing what the volume leaves
  /// unexplained, or nothing. From then on photographs may come with other
  /// masks of the sky.
  std::function<std::optional<Daylight>(const Volume&, const Scene&)> look_at_skies_again;
  /// What that found, for a run that goes on from a later level; from then on it is as if it had been called.
  std::function<Daylight()> recall_skies;
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
