#pragma once
/// How different two colours look: CIE L*a*b* and the colour difference CIEDE2000.

#include "roxel/color/color_space.h"

namespace roxel {

/// CIE 1976 (L*, a*, b*).
struct Lab {
  double l, a, b;
};

/// Tristimulus values of the same kind of white: [CIE04]. Negative values count as they are.
Lab lab_from_xyz(const Xyz& color, const WhitePoint& white = kWhiteD65);

/// CIEDE2000 with unit weights [Sharma05]; about 1 where a difference is just noticed, 100 from black to
/// white.
double delta_e_2000(const Lab& a, const Lab& b);

}  // namespace roxel
