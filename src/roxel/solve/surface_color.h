#pragma once
/// The colour of one piece of surface from what several photographs show of it, each in its own light, where
/// it is not sure whether the sun got there.

#include <array>
#include <vector>

namespace roxel {

/// What one node shows of the surface.
struct LitColor {
  std::array<float, 3> seen = {0, 0, 0};     ///< linear RGB, any unit
  float weight = 1;                          ///< of the observation, > 0
  std::array<float, 3> diffuse = {1, 1, 1};  ///< light without the sun's
  std::array<float, 3> sun = {0, 0, 0};      ///< the sun's light where it arrives
  float sunlit = 1;                          ///< expected share of it that arrives, 0 to 1
};

struct SurfaceColor {
  std::array<float, 3> albedo = {0, 0, 0};  ///< seen = albedo x light
  std::vector<float> sunlit;                ///< of each observation, given all of them
};

/// The most probable albedo. An observation's log colour is log albedo + log(diffuse + v sun) with a
/// deviation of kColorSigma, v one of five shares, expected near `sunlit` (deviation kSunlitSigma) or,
/// rarely, anywhere; a few observations are of something else. Expectation maximisation from the best of
/// several starts.
SurfaceColor surface_color(const std::vector<LitColor>& observations);
inline constexpr double kColorSigma = 0.15;
inline constexpr double kSunlitSigma = 0.3;

}  // namespace roxel
