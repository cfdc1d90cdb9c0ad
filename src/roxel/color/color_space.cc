#include "roxel/color/color_space.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <utility>

#include "roxel/base/error.h"

namespace roxel {
namespace {

using Matrix3 = std::array<std::array<double, 3>, 3>;

constexpr Matrix3 inverse(const Matrix3& m) {
  Matrix3 adjugate{};
  for (int i = 0; i < 3; ++i)
    for (int j = 0; j < 3; ++j) {
      const int a = (j + 1) % 3, b = (j + 2) % 3, c = (i + 1) % 3, d = (i + 2) % 3;
      adjugate[i][j] = m[a][c] * m[b][d] - m[a][d] * m[b][c];
    }
  const double determinant = m[0][0] * adjugate[0][0] + m[0][1] * adjugate[1][0] + m[0][2] * adjugate[2][0];
  for (auto& row : adjugate)
    for (double& value : row) value /= determinant;
  return adjugate;
}

constexpr std::array<double, 3> product(const Matrix3& m, const std::array<double, 3>& v) {
  std::array<double, 3> out{};
  for (int i = 0; i < 3; ++i) out[i] = m[i][0] * v[0] + m[i][1] * v[1] + m[i][2] * v[2];
  return out;
}

// The matrix follows from the primaries and the white: its columns are the primaries' (x, y, z), scaled so
// that R = G = B = 1 gives the white with Y = 1. It agrees with [Jethwa04] eq. (A.1) to three digits, and
// makes every grey exactly colourless in Luv under D65.
constexpr Matrix3 xyz_from_rgb_matrix() {
  constexpr double x[3] = {0.64, 0.30, 0.15}, y[3] = {0.33, 0.60, 0.06};  // Rec. 709
  Matrix3 primaries{};
  for (int i = 0; i < 3; ++i) {
    primaries[0][i] = x[i];
    primaries[1][i] = y[i];
    primaries[2][i] = 1 - x[i] - y[i];
  }
  const std::array<double, 3> white{kWhiteD65.x / kWhiteD65.y, 1.0,
                                    (1 - kWhiteD65.x - kWhiteD65.y) / kWhiteD65.y};
  const auto scale = product(inverse(primaries), white);
  for (auto& row : primaries)
    for (int i = 0; i < 3; ++i) row[i] *= scale[i];
  return primaries;
}

constexpr Matrix3 kXyzFromRgb = xyz_from_rgb_matrix();
constexpr Matrix3 kRgbFromXyz = inverse(kXyzFromRgb);

constexpr double kLightnessKnee = 0.008856;  // CIE 1976: L* is linear below this Y / Y_n
constexpr double kLightnessSlope = 903.3;

template <class T>
T lightness(T y) {
  return y > T(kLightnessKnee) ? T(116) * std::cbrt(y) - T(16) : T(kLightnessSlope) * y;
}

template <class T>
T luminance(T l) {
  if (l <= T(kLightnessSlope * kLightnessKnee)) return l / T(kLightnessSlope);
  const T root = (l + T(16)) / T(116);
  return root * root * root;
}

template <class T>
void luv_from_xyz(T x, T y, T z, T u_white, T v_white, T out[3]) {
  const T denominator = x + 15 * y + 3 * z;
  if (!(y > 0) || !(denominator > 0)) {
    out[0] = out[1] = out[2] = 0;
    return;
  }
  out[0] = lightness(y);
  out[1] = 13 * out[0] * (4 * x / denominator - u_white);
  out[2] = 13 * out[0] * (9 * y / denominator - v_white);
}

// X and Z solve u' = 4X / D, v' = 9Y / D, D = X + 15Y + 3Z. No real colour has v' <= 0, but a mean of noise
// may: it is held just above.
template <class T>
void xyz_from_luv(const T luv[3], T u_white, T v_white, T out[3]) {
  if (!(luv[0] > 0)) {
    out[0] = out[1] = out[2] = 0;
    return;
  }
  const T u = luv[1] / (13 * luv[0]) + u_white;
  const T v = std::max(luv[2] / (13 * luv[0]) + v_white, T(1e-3));
  const T y = luminance(luv[0]);
  out[0] = y * 9 * u / (4 * v);
  out[1] = y;
  out[2] = y * (12 - 3 * u - 20 * v) / (4 * v);
}

template <class T>
T encode_component(T linear) {
  const T light = std::abs(linear);
  const T code = light <= T(0.0031308) ? T(12.92) * light : T(1.055) * std::pow(light, T(1 / 2.4)) - T(0.055);
  return std::copysign(code, linear);
}

template <class T>
T decode_component(T encoded) {
  const T code = std::abs(encoded);
  const T light = code <= T(0.04045) ? code / T(12.92) : std::pow((code + T(0.055)) / T(1.055), T(2.4));
  return std::copysign(light, encoded);
}

// Hue in sixths of a turn, [0, 6); 0 for grey.
template <class T>
T hue_sextant(T r, T g, T b, T largest, T chroma) {
  if (!(chroma > 0)) return 0;
  T hue;
  if (largest == r)
    hue = (g - b) / chroma;
  else if (largest == g)
    hue = (b - r) / chroma + 2;
  else
    hue = (r - g) / chroma + 4;
  return hue < 0 ? hue + 6 : hue;
}

// R'G'B' of hue (in turns), chroma C and value V: each component is V - C max(0, min(k, 4 - k, 1)) with
// k = (n + 6 hue) mod 6, n = 5, 3, 1.
template <class T>
void encoded_from_hue(T hue, T chroma, T value, T out[3]) {
  constexpr T kOffset[3] = {5, 3, 1};
  for (int i = 0; i < 3; ++i) {
    const T k = std::fmod(kOffset[i] + 6 * hue, T(6));
    out[i] = value - chroma * std::max(T(0), std::min({k, 4 - k, T(1)}));
  }
}

void cone_from_rgb(const float rgb[3], float out[3]) {
  const float r = srgb_encode(std::max(rgb[0], 0.0f));
  const float g = srgb_encode(std::max(rgb[1], 0.0f));
  const float b = srgb_encode(std::max(rgb[2], 0.0f));
  const float value = std::max({r, g, b});
  const float chroma = value - std::min({r, g, b});
  const float angle = hue_sextant(r, g, b, value, chroma) * (std::numbers::pi_v<float> / 3);
  out[0] = chroma * std::cos(angle);
  out[1] = chroma * std::sin(angle);
  out[2] = value;
}

void rgb_from_cone(const float cone[3], float rgb[3]) {
  const float chroma = std::hypot(cone[0], cone[1]);
  float hue = chroma > 0 ? std::atan2(cone[1], cone[0]) / (2 * std::numbers::pi_v<float>) : 0.0f;
  if (hue < 0) hue += 1;
  float encoded[3];
  encoded_from_hue(hue, chroma, cone[2], encoded);
  for (int i = 0; i < 3; ++i) rgb[i] = srgb_decode(encoded[i]);
}

void apply(const Matrix3& m, const float in[3], float out[3]) {
  const float a = in[0], b = in[1], c = in[2];
  for (int i = 0; i < 3; ++i)
    out[i] =
        static_cast<float>(m[i][0]) * a + static_cast<float>(m[i][1]) * b + static_cast<float>(m[i][2]) * c;
}

// |d(L*, u*, v*) / d(X, Y, Z)|. At fixed Y, L* is fixed and (u', v') is a map of (X, Z) with determinant
// -108 Y / D^3, D = X + 15 Y + 3 Z; (u*, v*) = 13 L* (u' - u'_n, v' - v'_n) multiplies it by 169 L*^2, and
// dL*/dY completes the triangular determinant. The white only shears the space, so it does not appear.
double luv_volume_element(const std::array<double, 3>& xyz) {
  const double y = xyz[1];
  const double denominator = xyz[0] + 15 * y + 3 * xyz[2];
  const double slope = y > kLightnessKnee ? 116.0 / 3 / std::cbrt(y * y) : kLightnessSlope;
  const double l = lightness(y);
  return slope * 169 * l * l * 108 * y / (denominator * denominator * denominator);
}

// Midpoint rule over the RGB cube with R = t^3 (and so on), which removes the singular derivative at black.
double luv_gamut_volume() {
  constexpr int n = 48;
  const auto& m = kXyzFromRgb;
  const double determinant = m[0][0] * (m[1][1] * m[2][2] - m[1][2] * m[2][1]) -
                             m[0][1] * (m[1][0] * m[2][2] - m[1][2] * m[2][0]) +
                             m[0][2] * (m[1][0] * m[2][1] - m[1][1] * m[2][0]);
  double node[n], weight[n];
  for (int i = 0; i < n; ++i) {
    const double t = (i + 0.5) / n;
    node[i] = t * t * t;
    weight[i] = 3 * t * t / n;
  }
  double sum = 0;
  for (int i = 0; i < n; ++i)
    for (int j = 0; j < n; ++j)
      for (int k = 0; k < n; ++k)
        sum += weight[i] * weight[j] * weight[k] *
               luv_volume_element(product(kXyzFromRgb, {node[i], node[j], node[k]}));
  return determinant * sum;
}

constexpr std::array<std::pair<const char*, ColorSpace>, 4> kSpaceNames{{{"rgb", ColorSpace::kRgb},
                                                                         {"srgb", ColorSpace::kSrgb},
                                                                         {"hsv", ColorSpace::kHsv},
                                                                         {"luv", ColorSpace::kLuv}}};

}  // namespace

ColorSpace parse_color_space(const std::string& text, const std::string& where) {
  for (const auto& [name, space] : kSpaceNames)
    if (text == name) return space;
  throw_invalid(where, "'" + text + "'", "rgb, srgb, hsv or luv");
}

std::string to_string(ColorSpace space) { return kSpaceNames[static_cast<int>(space)].first; }

float srgb_encode(float linear) { return encode_component(linear); }
float srgb_decode(float encoded) { return decode_component(encoded); }

EncodedRgb encode(const LinearRgb& c) {
  return {encode_component(c.r), encode_component(c.g), encode_component(c.b)};
}

LinearRgb decode(const EncodedRgb& c) {
  return {decode_component(c.r), decode_component(c.g), decode_component(c.b)};
}

Xyz xyz_from_rgb(const LinearRgb& c) {
  const auto xyz = product(kXyzFromRgb, {c.r, c.g, c.b});
  return {xyz[0], xyz[1], xyz[2]};
}

LinearRgb rgb_from_xyz(const Xyz& c) {
  const auto rgb = product(kRgbFromXyz, {c.x, c.y, c.z});
  return {rgb[0], rgb[1], rgb[2]};
}

Luv luv_from_xyz(const Xyz& c, const WhitePoint& white) {
  double out[3];
  luv_from_xyz(c.x, c.y, c.z, white.u_prime(), white.v_prime(), out);
  return {out[0], out[1], out[2]};
}

Xyz xyz_from_luv(const Luv& c, const WhitePoint& white) {
  const double luv[3] = {c.l, c.u, c.v};
  double out[3];
  xyz_from_luv(luv, white.u_prime(), white.v_prime(), out);
  return {out[0], out[1], out[2]};
}

Hsv hsv_from_encoded(const EncodedRgb& c) {
  const double value = std::max({c.r, c.g, c.b});
  const double chroma = value - std::min({c.r, c.g, c.b});
  return {hue_sextant(c.r, c.g, c.b, value, chroma) / 6, value > 0 ? chroma / value : 0.0, value};
}

EncodedRgb encoded_from_hsv(const Hsv& c) {
  double out[3];
  encoded_from_hue(c.h - std::floor(c.h), c.s * c.v, c.v, out);
  return {out[0], out[1], out[2]};
}

double hue_difference(double a, double b) {
  const double difference = a - b;
  return difference - std::floor(difference + 0.5);
}

ColorTransform::ColorTransform(ColorSpace space, const WhitePoint& white)
    : space_(space),
      white_(white),
      u_white_(static_cast<float>(white.u_prime())),
      v_white_(static_cast<float>(white.v_prime())) {}

void ColorTransform::from_rgb(const float rgb[3], float out[3]) const {
  switch (space_) {
    case ColorSpace::kRgb:
      std::copy(rgb, rgb + 3, out);
      return;
    case ColorSpace::kSrgb:
      for (int i = 0; i < 3; ++i) out[i] = srgb_encode(rgb[i]);
      return;
    case ColorSpace::kHsv:
      cone_from_rgb(rgb, out);
      return;
    case ColorSpace::kLuv: {
      float xyz[3] = {std::max(rgb[0], 0.0f), std::max(rgb[1], 0.0f), std::max(rgb[2], 0.0f)};
      apply(kXyzFromRgb, xyz, xyz);
      luv_from_xyz(xyz[0], xyz[1], xyz[2], u_white_, v_white_, out);
      return;
    }
  }
}

void ColorTransform::to_rgb(const float color[3], float rgb[3]) const {
  switch (space_) {
    case ColorSpace::kRgb:
      std::copy(color, color + 3, rgb);
      return;
    case ColorSpace::kSrgb:
      for (int i = 0; i < 3; ++i) rgb[i] = srgb_decode(color[i]);
      return;
    case ColorSpace::kHsv:
      rgb_from_cone(color, rgb);
      return;
    case ColorSpace::kLuv: {
      float xyz[3];
      xyz_from_luv(color, u_white_, v_white_, xyz);
      apply(kRgbFromXyz, xyz, rgb);
      return;
    }
  }
}

void ColorTransform::from_rgb_in_place(float* pixels, std::size_t count) const {
  if (space_ == ColorSpace::kRgb) return;
  for (std::size_t i = 0; i < count; ++i, pixels += 3) from_rgb(pixels, pixels);
}

void ColorTransform::to_rgb_in_place(float* pixels, std::size_t count) const {
  if (space_ == ColorSpace::kRgb) return;
  for (std::size_t i = 0; i < count; ++i, pixels += 3) to_rgb(pixels, pixels);
}

double gamut_volume(ColorSpace space) {
  static const double luv = luv_gamut_volume();
  switch (space) {
    case ColorSpace::kHsv:
      return std::numbers::pi / 3;  // integral of pi V^2 over V in [0, 1]
    case ColorSpace::kLuv:
      return luv;
    default:
      return 1;
  }
}

double gamut_diameter(ColorSpace space) {
  if (space == ColorSpace::kHsv) return 2;  // opposite hues on the cone's rim
  if (space != ColorSpace::kLuv) return std::sqrt(3.0);
  Luv corner[8];
  for (int i = 0; i < 8; ++i)
    corner[i] = luv_from_xyz(xyz_from_rgb({double(i & 1), double(i >> 1 & 1), double(i >> 2)}));
  double largest = 0;
  for (const Luv& a : corner)
    for (const Luv& b : corner) largest = std::max(largest, std::hypot(a.l - b.l, a.u - b.u, a.v - b.v));
  return largest;
}

double default_noise(ColorSpace space) {
  return 3 * std::cbrt(gamut_volume(space) / gamut_volume(ColorSpace::kLuv));
}

double unknown_color_likelihood(ColorSpace space, double noise) {
  return std::pow(2 * std::numbers::pi, 1.5) * noise * noise * noise / gamut_volume(space);
}

}  // namespace roxel
