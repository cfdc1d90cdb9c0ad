#pragma once
/// A cross-section as a picture: opacities in grey, black = opaque, and the true outline in red.

#include <string>

#include "roxel/eval/section.h"

namespace roxel {

/// An <svg> element with the opacities as a picture inside; it scales with its surroundings.
std::string section_svg(const Section& section);

/// "z = 0.25": the plane.
std::string section_name(const Section& section);

}  // namespace roxel
