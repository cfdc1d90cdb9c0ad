#include "roxel/color/delta_e.h"

#include <cmath>

#include "roxel/base/angles.h"

namespace roxel {
namespace {

constexpr double k25To7 = 6103515625.0;  // 25^7

double compressed(double ratio) {
  constexpr double kLimit = 216.0 / 24389, kSlope = 24389.0 / 27;
  return ratio > kLimit ? std::cbrt(ratio) : (kSlope * ratio + 16) / 116;
}

double hue(double a, double b) {
  if (a == 0 && b == 0) return 0;
  const double turn = std::atan2(b, a) / kDegree;
  return turn < 0 ? turn + 360 : turn;
}

double seventh(double x) { return std::pow(x, 7); }

double mean_hue(double h1, double h2, bool grey) {
  if (grey) return h1 + h2;
  if (std::abs(h1 - h2) <= 180) return (h1 + h2) / 2;
  return h1 + h2 < 360 ? (h1 + h2 + 360) / 2 : (h1 + h2 - 360) / 2;
}

double hue_step(double h1, double h2, bool grey) {
  if (grey) return 0;
  const double step = h2 - h1;
  return step > 180 ? step - 360 : step < -180 ? step + 360 : step;
}

}  // namespace

Lab lab_from_xyz(const Xyz& color, const WhitePoint& white) {
  const double x = compressed(color.x * white.y / white.x), y = compressed(color.y),
               z = compressed(color.z * white.y / (1 - white.x - white.y));
  return {116 * y - 16, 500 * (x - y), 200 * (y - z)};
}

double delta_e_2000(const Lab& p, const Lab& q) {
  // Chroma, with a* stretched where colours are nearly grey.
  const double mean_c = (std::hypot(p.a, p.b) + std::hypot(q.a, q.b)) / 2;
  const double stretch = 1 + 0.5 * (1 - std::sqrt(seventh(mean_c) / (seventh(mean_c) + k25To7)));
  const double c1 = std::hypot(stretch * p.a, p.b), c2 = std::hypot(stretch * q.a, q.b);
  const double h1 = hue(stretch * p.a, p.b), h2 = hue(stretch * q.a, q.b);
  const bool grey = c1 * c2 == 0;
  const double step_l = q.l - p.l, step_c = c2 - c1;
  const double step_h = 2 * std::sqrt(c1 * c2) * std::sin(hue_step(h1, h2, grey) / 2 * kDegree);
  // Weights at the mean of the two.
  const double l = (p.l + q.l) / 2, c = (c1 + c2) / 2, h = mean_hue(h1, h2, grey);
  const double t = 1 - 0.17 * std::cos((h - 30) * kDegree) + 0.24 * std::cos(2 * h * kDegree) +
                   0.32 * std::cos((3 * h + 6) * kDegree) - 0.20 * std::cos((4 * h - 63) * kDegree);
  const double off_l = (l - 50) * (l - 50);
  const double s_l = 1 + 0.015 * off_l / std::sqrt(20 + off_l), s_c = 1 + 0.045 * c, s_h = 1 + 0.015 * c * t;
  const double blue = std::exp(-std::pow((h - 275) / 25, 2));
  const double rotation = -std::sin(60 * blue * kDegree) * 2 * std::sqrt(seventh(c) / (seventh(c) + k25To7));
  const double dl = step_l / s_l, dc = step_c / s_c, dh = step_h / s_h;
  return std::sqrt(dl * dl + dc * dc + dh * dh + rotation * dc * dh);
}

}  // namespace roxel
