#include "roxel/synth/atmosphere.h"

#include <algorithm>
#include <cmath>

#include "roxel/base/angles.h"

namespace roxel {
namespace {

using Eigen::Vector3d;

constexpr double kGround = 6360, kDepth = 100;  // radius of the earth, height of the atmosphere, km
// Per kilometre at sea level and kilometres [Bruneton17].
const Vector3d kAirScattering(5.802e-3, 13.558e-3, 33.1e-3);
const Vector3d kOzoneAbsorption(0.650e-3, 1.881e-3, 0.085e-3);
constexpr double kAirHeight = 8, kHazeHeight = 1.2, kHazeAlbedo = 0.92, kHazeForward = 0.76;

constexpr int kHeights = 48, kAngles = 192;       // of the table of transmittance
constexpr int kSunHeights = 12, kSunAngles = 24;  // of the table of multiple scattering

double air_phase(double cosine) { return 3 / (16 * kPi) * (1 + cosine * cosine); }

// Cornette and Shanks: what air has, with a forward lobe.
double haze_phase(double cosine) {
  const double g = kHazeForward, g2 = g * g;
  return 3 / (8 * kPi) * (1 - g2) * (1 + cosine * cosine) /
         ((2 + g2) * std::pow(1 + g2 - 2 * g * cosine, 1.5));
}

/// Way from a height to the top of the atmosphere along a direction of this zenith cosine.
double way_out(double height, double mu) {
  const double r = kGround + height, top = kGround + kDepth;
  return -r * mu + std::sqrt(std::max(0.0, r * r * (mu * mu - 1) + top * top));
}

/// Way to the ground; negative where the ray misses it.
double way_down(double height, double mu) {
  const double r = kGround + height, inside = r * r * (mu * mu - 1) + kGround * kGround;
  if (mu >= 0 || inside < 0) return -1;
  return std::max(0.0, -r * mu - std::sqrt(inside));
}

struct Place {
  double height, mu_sun;
};

/// Height and zenith cosine of the sun at a way along a ray that starts at `height`.
Place along(double height, double mu, double mu_sun, double view_dot_sun, double way) {
  const double r = kGround + height, radius = std::sqrt(r * r + way * way + 2 * r * way * mu);
  return {radius - kGround, (r * mu_sun + way * view_dot_sun) / radius};
}

/// Tables are even in the square root of height and, for angles, densest at the horizon.
double height_coordinate(double height, int count) {
  return std::sqrt(std::clamp(height / kDepth, 0.0, 1.0)) * (count - 1);
}
double height_at(int i, int count) {
  const double t = static_cast<double>(i) / (count - 1);
  return t * t * kDepth;
}
double angle_coordinate(double mu, int count) {
  const double s = std::copysign(std::sqrt(std::min(std::abs(mu), 1.0)), mu);
  return (0.5 + 0.5 * s) * (count - 1);
}
double angle_at(int i, int count) {
  const double s = 2.0 * i / (count - 1) - 1;
  return std::copysign(s * s, s);
}

Vector3d look_up(const std::vector<Vector3d>& table, int columns, double x, double y) {
  const int rows = static_cast<int>(table.size()) / columns;
  const int i = std::min(static_cast<int>(x), columns - 2), j = std::min(static_cast<int>(y), rows - 2);
  const double s = x - i, t = y - j;
  const auto at = [&](int column, int row) -> const Vector3d& { return table[row * columns + column]; };
  return (1 - t) * ((1 - s) * at(i, j) + s * at(i + 1, j)) +
         t * ((1 - s) * at(i, j + 1) + s * at(i + 1, j + 1));
}

}  // namespace

/// Per kilometre, at one height.
struct Atmosphere::Medium {
  Vector3d air;         // scattering
  double haze;          // scattering
  Vector3d extinction;  // all together
};

Atmosphere::Atmosphere(double haze_depth)
    : haze_scattering_(kHazeAlbedo * haze_depth / kHazeHeight), haze_extinction_(haze_depth / kHazeHeight) {
  tabulate_transmittance();
  tabulate_multiple();
}

Atmosphere::Medium Atmosphere::medium(double height) const {
  const double air = std::exp(-height / kAirHeight), haze = std::exp(-height / kHazeHeight);
  const double ozone = std::max(0.0, 1 - std::abs(height - 25) / 15);
  const Vector3d air_scattering = air * kAirScattering;
  return {air_scattering, haze * haze_scattering_,
          air_scattering + Vector3d::Constant(haze * haze_extinction_) + ozone * kOzoneAbsorption};
}

Vector3d Atmosphere::march_transmittance(double height, double mu) const {
  if (way_down(height, mu) >= 0) return Vector3d::Zero();
  constexpr int kSteps = 96;
  const double way = way_out(height, mu);
  Vector3d depth = Vector3d::Zero();
  double before = 0;
  for (int i = 0; i < kSteps; ++i) {
    const double t = (i + 1.0) / kSteps, after = way * t * t;
    depth += (after - before) * medium(along(height, mu, 0, 0, 0.5 * (before + after)).height).extinction;
    before = after;
  }
  return (-depth).array().exp();
}

void Atmosphere::tabulate_transmittance() {
  transmittance_.resize(kHeights * kAngles);
  for (int j = 0; j < kHeights; ++j)
    for (int i = 0; i < kAngles; ++i)
      transmittance_[j * kAngles + i] = march_transmittance(height_at(j, kHeights), angle_at(i, kAngles));
}

Vector3d Atmosphere::transmittance(double height, double mu) const {
  return look_up(transmittance_, kAngles, angle_coordinate(mu, kAngles), height_coordinate(height, kHeights));
}

// One direction's share of the light that reaches a point after one scattering elsewhere, and of what an
// evenly bright world would send there: the two numbers of [Hillaire20] eq. 5 and 7.
void Atmosphere::march_multiple(double height, double mu_sun, Vector3d& once, Vector3d& again) const {
  constexpr int kRows = 8, kTurns = 8, kSteps = 20;
  constexpr double kEven = 1 / (4 * kPi);
  once = again = Vector3d::Zero();
  for (int row = 0; row < kRows; ++row)
    for (int turn = 0; turn < kTurns; ++turn) {
      const double mu = 2 * (row + 0.5) / kRows - 1, azimuth = 2 * kPi * (turn + 0.5) / kTurns;
      const double view_dot_sun =
          mu * mu_sun + std::sqrt((1 - mu * mu) * std::max(0.0, 1 - mu_sun * mu_sun)) * std::cos(azimuth);
      const double down = way_down(height, mu), way = down >= 0 ? down : way_out(height, mu);
      Vector3d clear = Vector3d::Ones();
      for (int i = 0; i < kSteps; ++i) {
        const double from = way * i * i / (kSteps * kSteps), to = way * (i + 1) * (i + 1) / (kSteps * kSteps);
        const Place place = along(height, mu, mu_sun, view_dot_sun, 0.5 * (from + to));
        const Medium here = medium(place.height);
        const Vector3d step = (-(to - from) * here.extinction).array().exp();
        const Vector3d scattering = here.air + Vector3d::Constant(here.haze);
        const Vector3d gathered =
            clear.cwiseProduct((Vector3d::Ones() - step).cwiseQuotient(here.extinction));
        const Vector3d sun = transmittance(place.height, place.mu_sun);
        once += kEven * gathered.cwiseProduct(scattering).cwiseProduct(sun);
        again += gathered.cwiseProduct(scattering);
        clear = clear.cwiseProduct(step);
      }
    }
  once /= kRows * kTurns;
  again /= kRows * kTurns;
}

void Atmosphere::tabulate_multiple() {
  multiple_.resize(kSunHeights * kSunAngles);
  for (int j = 0; j < kSunHeights; ++j)
    for (int i = 0; i < kSunAngles; ++i) {
      Vector3d once, again;
      march_multiple(height_at(j, kSunHeights), angle_at(i, kSunAngles), once, again);
      multiple_[j * kSunAngles + i] = once.cwiseQuotient(Vector3d::Ones() - again);
    }
}

Vector3d Atmosphere::multiple(double height, double mu_sun) const {
  return look_up(multiple_, kSunAngles, angle_coordinate(mu_sun, kSunAngles),
                 height_coordinate(height, kSunHeights));
}

Vector3d Atmosphere::radiance(const Vector3d& direction, const Vector3d& to_sun) const {
  constexpr int kSteps = 40;
  const double mu = std::max(direction.z(), 0.0), cosine = direction.dot(to_sun);
  const double air = air_phase(cosine), haze = haze_phase(cosine), way = way_out(0, mu);
  Vector3d light = Vector3d::Zero(), clear = Vector3d::Ones();
  for (int i = 0; i < kSteps; ++i) {
    const double from = way * i * i / (kSteps * kSteps), to = way * (i + 1) * (i + 1) / (kSteps * kSteps);
    const Place place = along(0, mu, to_sun.z(), cosine, 0.5 * (from + to));
    const Medium here = medium(place.height);
    const Vector3d step = (-(to - from) * here.extinction).array().exp();
    const Vector3d gathered = clear.cwiseProduct((Vector3d::Ones() - step).cwiseQuotient(here.extinction));
    const Vector3d once = transmittance(place.height, place.mu_sun)
                              .cwiseProduct(air * here.air + Vector3d::Constant(haze * here.haze));
    const Vector3d often =
        multiple(place.height, place.mu_sun).cwiseProduct(here.air + Vector3d::Constant(here.haze));
    light += gathered.cwiseProduct(once + often);
    clear = clear.cwiseProduct(step);
  }
  return light;
}

}  // namespace roxel
