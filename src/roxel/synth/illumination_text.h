#pragma once
/// The file that says what light a synthetic world's photographs were taken in.

#include <string>

#include "roxel/synth/lights.h"

namespace roxel {

/// illumination.json (docs/synthetic.md): per light the sun's direction, irradiances, maps and exposure.
std::string illumination_json(const World& world, const Lights& lights);

}  // namespace roxel
