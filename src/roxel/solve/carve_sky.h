#pragma once
/// What a photograph shows as sky, and nothing but sky, is empty: space carving [Kutulakos00] by sky masks
/// (docs/light.md).

#include <cstdint>
#include <vector>

#include "roxel/base/run_context.h"
#include "roxel/dataset/dataset.h"
#include "roxel/infer/passes.h"
#include "roxel/volume/volume.h"

namespace roxel {

/// Empties every voxel whose footprint is sky (Photograph::sky) in photographs of two nodes, or in two of one
/// node where no other knows its sky, or, with an opacity below 0.5, in one photograph. A footprint is the
/// rectangle around the voxel's eight corners, as far as it is in the image, where its centre must be; the
/// mean of the mask there must be at least 0.9, pixels that are not valid count 0. One mask that is wrong
/// thus empties nothing of an opacity of 0.5 or more, and what is thin before the sky stays where it fills a
/// tenth of a voxel. `sky_masked`, one a view, 1: it has a mask of the sky; others are not looked at. An
/// emptied voxel has tau 0 and no hits; colours and confidence stay. Returns how many had any opacity. The
/// same for any number of threads.
std::int64_t carve_sky(const Dataset& dataset, const PhotographLoader& load,
                       const std::vector<std::uint8_t>& sky_masked, UpdateRule rule,
                       const RunContext& context, Volume& volume);

}  // namespace roxel
