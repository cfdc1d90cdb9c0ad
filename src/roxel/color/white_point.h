#pragma once
/// Reference whites of CIE Luv, as chromaticities of the CIE 1931 2-degree observer.

#include <string>

namespace roxel {

/// Chromaticity (x, y) of the light that shall count as colourless; 0 < x, 0 < y, x + y < 1.
struct WhitePoint {
  double x;
  double y;

  /// CIE 1976 coordinates u' = 4x/(-2x+12y+3), v' = 9y/(-2x+12y+3) [Jethwa04] appendix A.3.
  double u_prime() const { return 4 * x / (-2 * x + 12 * y + 3); }
  double v_prime() const { return 9 * y / (-2 * x + 12 * y + 3); }
  bool operator==(const WhitePoint&) const = default;
};

/// D65, the white of sRGB and of the matrix in [Jethwa04] appendix A: u' = 0.19784, v' = 0.46834.
inline constexpr WhitePoint kWhiteD65{0.31272, 0.32903};
/// Incandescent light (CIE illuminant A).
inline constexpr WhitePoint kWhiteA{0.44757, 0.40745};
/// CIE illuminant C, whose u' = 0.2009, v' = 0.4610 [Jethwa04] prints beside a D65 matrix.
inline constexpr WhitePoint kWhiteC{0.31006, 0.31616};

/// Reads "D65", "A", "C" (any case) or "x,y"; throws InvalidInput otherwise, naming `where`.
WhitePoint parse_white_point(const std::string& text, const std::string& where = "white point");
/// "D65", "A", "C" or "x,y": what parse_white_point reads back.
std::string to_string(const WhitePoint& white);

}  // namespace roxel
