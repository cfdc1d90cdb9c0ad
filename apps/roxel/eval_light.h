#pragma once
/// Measures what a run's light makes of its photographs, beside what the true light would.

#include "eval_source.h"
#include "roxel/report/light_measures.h"

namespace roxel::cli {

/// True depth maps of the views of these names, by index; empty where none is known.
using TrueDepths = std::vector<Image>;

/// The photographs as they are, over the run's light, and, where illumination.json and mesh.ply are known,
/// over the light of the true domes and the true light on the true surface. Empty where no place is seen
/// from three nodes, or no true depth is known.
std::vector<LightMeasure> measure_light(const EvalSource& source, const TrueDepths& depths, Session& session);

}  // namespace roxel::cli
