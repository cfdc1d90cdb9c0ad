#pragma once
/// Colour spaces that voxels can be compared in. Photographs are linear RGB (Rec. 709 primaries, D65 white,
/// 1 = display white or the data set's exposure, unbounded above); the march works on three plain floats in
/// one "matching space", which ColorTransform makes from linear RGB and back.
///
///     space   components        of linear RGB in [0, 1]^3
///     rgb     R, G, B           itself
///     srgb    R', G', B'        [0, 1]^3, the transfer curve of IEC 61966-2-1, continued above 1
///     hsv     C cos H, C sin H, V   a cone: 0 <= V <= 1, C = S V <= V (of R'G'B')
///     luv     L*, u*, v*        CIE 1976: L* 0..100, u* about -83..175, v* about -134..107
///
/// HSV is used as a cone because a Gaussian needs a space without a seam or a pole: with (H, S, V) themselves
/// the hue of red jumps from 1 to 0 and the hue of grey is noise [Jethwa04] §4.3.2. In the cone two colours
/// of equal C and V differ by 2 C sin(dH/2), dH the hue difference wrapped to half a turn.

#include <cstddef>
#include <string>

#include "roxel/color/white_point.h"

namespace roxel {

enum class ColorSpace { kRgb, kSrgb, kHsv, kLuv };

/// Reads "rgb", "srgb", "hsv" or "luv"; throws InvalidInput otherwise, naming `where`.
ColorSpace parse_color_space(const std::string& text, const std::string& where = "colour space");
std::string to_string(ColorSpace space);

/// Linear light, Rec. 709 primaries.
struct LinearRgb {
  double r, g, b;
};
/// Display-encoded light (sRGB transfer curve), 1 = white.
struct EncodedRgb {
  double r, g, b;
};
/// Relative tristimulus values, Y = 1 for white.
struct Xyz {
  double x, y, z;
};
/// CIE 1976 (L*, u*, v*).
struct Luv {
  double l, u, v;
};
/// Hue in turns [0, 1), red = 0, green = 1/3 (0 for grey); saturation [0, 1]; value.
struct Hsv {
  double h, s, v;
};

/// The sRGB transfer curve: linear below 0.0031308, power 1/2.4 above; odd for negative light.
float srgb_encode(float linear);
/// Inverse of srgb_encode.
float srgb_decode(float encoded);
EncodedRgb encode(const LinearRgb& color);
LinearRgb decode(const EncodedRgb& color);

Xyz xyz_from_rgb(const LinearRgb& color);
LinearRgb rgb_from_xyz(const Xyz& color);

/// Below Y = 0.008856, L* = 903.3 Y (missing in [Jethwa04] A.3); black has u = v = 0.
Luv luv_from_xyz(const Xyz& color, const WhitePoint& white = kWhiteD65);
Xyz xyz_from_luv(const Luv& color, const WhitePoint& white = kWhiteD65);

Hsv hsv_from_encoded(const EncodedRgb& color);
EncodedRgb encoded_from_hsv(const Hsv& color);
/// Signed hue difference a - b in turns, wrapped to [-1/2, 1/2).
double hue_difference(double a, double b);

/// Linear RGB <-> one matching space, in floats and fast (tens of nanoseconds a pixel). Negative light counts
/// as black in hsv and luv. A value type: copy it into the inner loop's state.
class ColorTransform {
 public:
  explicit ColorTransform(ColorSpace space = ColorSpace::kLuv, const WhitePoint& white = kWhiteD65);

  ColorSpace space() const { return space_; }
  const WhitePoint& white() const { return white_; }

  /// `rgb` and `out` may be the same three floats.
  void from_rgb(const float rgb[3], float out[3]) const;
  /// Components outside the gamut come back as they fall out (possibly negative); never NaN for finite input.
  void to_rgb(const float color[3], float rgb[3]) const;
  /// Converts `count` interleaved triples in place.
  void from_rgb_in_place(float* pixels, std::size_t count) const;
  void to_rgb_in_place(float* pixels, std::size_t count) const;

 private:
  ColorSpace space_;
  WhitePoint white_;
  float u_white_;
  float v_white_;
};

/// Volume that linear RGB in [0, 1]^3 fills in a space: 1 for rgb and srgb, pi/3 for hsv (the cone), about
/// 1.33 million for luv under any white point (derivation in the .cc).
double gamut_volume(ColorSpace space);

/// Largest distance between two colours of the gamut: sqrt(3) for rgb and srgb, 2 for hsv; for luv that of
/// two corners of the RGB cube. d_max of linear agreement.
double gamut_diameter(ColorSpace space);

/// Standard deviation per component of the noise that is always granted (Sigma_min = noise^2 I): 3 in luv;
/// elsewhere the deviation that is the same share of the gamut,
/// 3 (gamut_volume(space) / gamut_volume(luv))^(1/3), so that "unknown colour" is worth the same in every
/// space.
double default_noise(ColorSpace space);

/// Likelihood, relative to perfect agreement, of a colour about which nothing is known: uniform over the
/// gamut, p = (2 pi)^(3/2) noise^3 / gamut_volume; 0.00032 for the default noise,
/// 0.0015 for 5 Luv units.
double unknown_color_likelihood(ColorSpace space, double noise);

}  // namespace roxel
