#pragma once
/// Options that were set and cannot act with the others, or on these photographs: said instead of left in
/// silence.

#include "roxel/solve/scene.h"

namespace roxel {

/// One warning for each option that differs from its default and cannot act. `scene`: its model, background
/// and light are chosen.
std::vector<std::string> idle_options(const ReconstructOptions& options, const Scene& scene);

}  // namespace roxel
