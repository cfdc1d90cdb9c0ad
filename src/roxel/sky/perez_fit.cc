#include "roxel/sky/perez_fit.h"

#include <ceres/ceres.h>

#include <numeric>

#include "roxel/base/error.h"
#include "roxel/base/median.h"

namespace roxel {
namespace {

/// log L_z, a, b, c, d, e, h.
constexpr int kParameters = 7;
using Parameters = std::array<double, kParameters>;
constexpr Parameters kLow{-50, -5, -20, -0.99, -60, -2, 0.2}, kHigh{50, 50, 0, 1000, 0, 20, 3};
constexpr int kStartSamples = 500;

struct Seen {
  double cos_theta, phi, radiance, weight;
};

/// sqrt(weight) (model / seen - 1).
struct RelativeError {
  Seen seen;
  double root_weight;

  template <class T>
  bool operator()(const T* p, T* residual) const {
    using std::exp;
    residual[0] =
        root_weight * (exp(p[0]) * perez_relative(p + 1, seen.cos_theta, seen.phi) / seen.radiance - 1.0);
    return true;
  }
};

/// What skies are like where no sample says it, that is near the horizon. Clear: 1 - exp(b / cos theta), a =
/// -1, is sunlight scattered once in air of optical depth -b; more of it is lost again in thicker air, and
/// skies computed from first principles have a = -1.01 - 0.25 b^2 within 0.02. Overcast: as CIE's [CIE03].
struct PriorError {
  bool clear;  ///< darker at the zenith than at the horizon, but for the sun
  double strength;

  template <class T>
  bool operator()(const T* p, T* residual) const {
    const double root = std::sqrt(2 * strength);
    residual[0] = root * (clear ? (p[1] + 1.01 + 0.25 * p[2] * p[2]) / 0.01 : (p[1] - 4.0) / 0.6);
    residual[1] = root * (clear ? (p[2] + 0.3) / 0.3 : (p[2] + 0.7) / 0.06);
    residual[2] = root * (clear ? (p[3] - 15.0) / 100.0 : p[3] / 0.1);
    residual[3] = root * (clear ? (p[4] + 5.0) / 20.0 : (p[4] + 1.0) / 1.0);
    residual[4] = root * (clear ? (p[5] - 1.0) / 5.0 : p[5] / 0.06);
    return true;
  }
};

Parameters parameters_of(const PerezShape& s, double scale) {
  Parameters p{std::log(std::max(scale, 1e-20)), s.a, s.b, s.c, s.d, s.e, s.h};
  for (int i = 0; i < kParameters; ++i) p[i] = std::clamp(p[i], kLow[i], kHigh[i]);
  return p;
}

PerezChannel channel_of(const Parameters& p) {
  return {{p[1], p[2], p[3], p[4], p[5], p[6]}, std::exp(p[0])};
}

double relative(const PerezShape& s, const Seen& seen) {
  const double abcdeh[6] = {s.a, s.b, s.c, s.d, s.e, s.h};
  return perez_relative(abcdeh, seen.cos_theta, seen.phi);
}

/// Median of seen over model: the scale of a shape.
double scale_of(const PerezShape& shape, const std::vector<Seen>& seen) {
  std::vector<double> ratios;
  for (const Seen& s : seen)
    if (const double f = relative(shape, s); f > 1e-9) ratios.push_back(s.radiance / f);
  return ratios.empty() ? 1 : median(ratios);
}

double mean_error(const PerezChannel& channel, const std::vector<Seen>& seen) {
  double error = 0, weight = 0;
  for (const Seen& s : seen) {
    error += s.weight * std::abs(channel.scale * relative(channel.shape, s) / s.radiance - 1);
    weight += s.weight;
  }
  return error / weight;
}

std::vector<int> fixed_parameters(PerezFreedom freedom) {
  switch (freedom) {
    case PerezFreedom::kGradation:
      return {3, 4, 5, 6};
    case PerezFreedom::kExponent:
      return {};
    default:
      return {6};
  }
}

/// Runs Ceres from `p`; returns the robust cost per weight.
double minimise(const std::vector<Seen>& seen, const PerezFitOptions& options, int iterations,
                Parameters& p) {
  ceres::Problem problem;
  double total = 0;
  for (const Seen& s : seen) total += s.weight;
  // The loss sees relative errors as they are; weights come after it.
  for (const Seen& s : seen)
    problem.AddResidualBlock(
        new ceres::AutoDiffCostFunction<RelativeError, 1, kParameters>(new RelativeError{s, 1.0}),
        new ceres::ScaledLoss(new ceres::CauchyLoss(options.loss_scale), s.weight / total,
                              ceres::TAKE_OWNERSHIP),
        p.data());
  if (options.prior_strength > 0)
    problem.AddResidualBlock(new ceres::AutoDiffCostFunction<PriorError, 5, kParameters>(
                                 new PriorError{p[1] < 0, options.prior_strength}),
                             nullptr, p.data());
  for (int i = 0; i < kParameters; ++i) {
    problem.SetParameterLowerBound(p.data(), i, kLow[i]);
    problem.SetParameterUpperBound(p.data(), i, kHigh[i]);
  }
  if (const std::vector<int> fixed = fixed_parameters(options.freedom); !fixed.empty())
    problem.SetManifold(p.data(), new ceres::SubsetManifold(kParameters, fixed));
  ceres::Solver::Options solver;
  solver.linear_solver_type = ceres::DENSE_QR;
  solver.max_num_iterations = iterations;
  solver.num_threads = 1;
  solver.logging_type = ceres::SILENT;
  solver.function_tolerance = 1e-7;
  ceres::Solver::Summary summary;
  ceres::Solve(solver, &problem, &summary);
  return summary.IsSolutionUsable() ? summary.final_cost : std::numeric_limits<double>::infinity();
}

std::vector<Seen> thinned(const std::vector<Seen>& seen, int most) {
  if (static_cast<int>(seen.size()) <= most) return seen;
  std::vector<Seen> kept;
  for (int i = 0; i < most; ++i) kept.push_back(seen[static_cast<std::size_t>(i) * seen.size() / most]);
  return kept;
}

std::vector<Seen> seen_of(const std::vector<SkySample>& samples, int channel, const Eigen::Vector3d& sun) {
  std::vector<Seen> seen;
  for (const SkySample& s : samples)
    if (s.radiance[channel] > 0 && s.weight > 0)
      seen.push_back({s.direction.z(), std::acos(std::clamp(s.direction.dot(sun), -1.0, 1.0)),
                      s.radiance[channel], s.weight});
  return seen;
}

PerezShape start_shape(PerezShape shape, PerezFreedom freedom) {
  if (freedom == PerezFreedom::kGradation) shape.c = 0, shape.e = 0, shape.d = -1;
  if (freedom != PerezFreedom::kExponent && freedom != PerezFreedom::kScaleOnly) shape.h = 1;
  return shape;
}

}  // namespace

PerezFit fit_perez(const std::vector<SkySample>& samples, int channel, const Eigen::Vector3d& sun,
                   const PerezFitOptions& options) {
  ROXEL_CHECK(!options.starts.empty());
  const std::vector<Seen> all = seen_of(samples, channel, sun);
  ROXEL_CHECK(!all.empty());
  const std::vector<Seen> few = thinned(all, kStartSamples), many = thinned(all, options.most_samples);
  PerezFit best;
  double best_cost = std::numeric_limits<double>::infinity();
  Parameters best_parameters{};
  for (std::size_t i = 0; i < options.starts.size(); ++i) {
    const PerezShape shape = start_shape(options.starts[i], options.freedom);
    Parameters p = parameters_of(shape, scale_of(shape, few));
    const double cost = options.freedom == PerezFreedom::kScaleOnly
                            ? mean_error(channel_of(p), few)
                            : minimise(few, options, options.iterations / 2, p);
    if (cost < best_cost || i == 0) best_cost = cost, best_parameters = p, best.start = static_cast<int>(i);
  }
  if (options.freedom == PerezFreedom::kScaleOnly)
    best_parameters[0] = std::log(scale_of(channel_of(best_parameters).shape, many));
  else
    minimise(many, options, options.iterations, best_parameters);
  best.channel = channel_of(best_parameters);
  best.mean_error = mean_error(best.channel, all);
  return best;
}

std::vector<PerezShape> published_starts(const Eigen::Vector3d& sun) {
  const double zenith = std::acos(std::clamp(sun.z(), 0.0, 1.0));
  std::vector<PerezShape> starts;
  for (int bin = 0; bin < kClearnessBins; ++bin)
    starts.push_back(published_perez(bin, zenith, usual_brightness(bin)));
  starts.push_back({4, -0.7, 0, -1, 0, 1});        // CIE 1: overcast, three times brighter at the zenith
  starts.push_back({0, -1, 0, -1, 0, 1});          // CIE 5: uniform
  starts.push_back({-1, -0.32, 10, -3, 0.45, 1});  // CIE 12: clear, clean air
  return starts;
}

}  // namespace roxel
