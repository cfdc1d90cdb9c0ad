#include "roxel/solve/surface_color.h"

#include <algorithm>
#include <cmath>

namespace roxel {
namespace {

constexpr int kShares = 5;           ///< 0, 1/4, 1/2, 3/4, 1
constexpr double kAnywhere = 0.15;   ///< of the prior of a share: the volume's shadow may be wrong
constexpr double kElsewhere = 1e-3;  ///< likelihood of a colour that is not this surface's
constexpr int kRounds = 6;
constexpr std::size_t kMostStarts =
    24;                               ///< observations that are tried as the truth: each costs a look at all
constexpr float kLeastLight = 1e-4f;  ///< of light and colour: keeps logarithms finite

using Log = std::array<double, 3>;

/// One observation's log albedo under each share, and how probable the shares are beforehand.
struct Hypotheses {
  std::array<Log, kShares> albedo;
  std::array<double, kShares> prior;
  double weight;
};

Hypotheses hypotheses(const LitColor& seen) {
  Hypotheses h;
  h.weight = seen.weight;
  double sum = 0;
  for (int v = 0; v < kShares; ++v) {
    const double share = static_cast<double>(v) / (kShares - 1);
    const double off = (share - seen.sunlit) / kSunlitSigma;
    sum += h.prior[v] = std::exp(-0.5 * off * off);
    for (int c = 0; c < 3; ++c) {
      const double light = seen.diffuse[c] + share * seen.sun[c];
      h.albedo[v][c] =
          std::log(std::max(seen.seen[c], kLeastLight)) - std::log(std::max<double>(light, kLeastLight));
    }
  }
  for (double& p : h.prior) p = (1 - kAnywhere) * p / sum + kAnywhere / kShares;
  return h;
}

/// Joint likelihood of the colour and each share, given log albedo.
std::array<double, kShares> joint(const Hypotheses& h, const Log& albedo) {
  std::array<double, kShares> p;
  for (int v = 0; v < kShares; ++v) {
    double squares = 0;
    for (int c = 0; c < 3; ++c) squares += std::pow((h.albedo[v][c] - albedo[c]) / kColorSigma, 2);
    p[v] = h.prior[v] * std::exp(-0.5 * squares);
  }
  return p;
}

double total(const std::array<double, kShares>& p) { return p[0] + p[1] + p[2] + p[3] + p[4]; }

double log_likelihood(const std::vector<Hypotheses>& all, const Log& albedo) {
  double sum = 0;
  for (const Hypotheses& h : all) sum += h.weight * std::log(total(joint(h, albedo)) + kElsewhere);
  return sum;
}

Log mean_of(const std::vector<Hypotheses>& all) {
  Log mean{0, 0, 0};
  double weights = 0;
  for (const Hypotheses& h : all) {
    weights += h.weight;
    for (int v = 0; v < kShares; ++v)
      for (int c = 0; c < 3; ++c) mean[c] += h.weight * h.prior[v] * h.albedo[v][c];
  }
  for (double& value : mean) value /= weights;
  return mean;
}

/// The observations that weigh most, in their order.
std::vector<const Hypotheses*> heaviest(const std::vector<Hypotheses>& all) {
  std::vector<const Hypotheses*> found;
  for (const Hypotheses& h : all) found.push_back(&h);
  if (found.size() <= kMostStarts) return found;
  std::stable_sort(found.begin(), found.end(),
                   [](const Hypotheses* a, const Hypotheses* b) { return a->weight > b->weight; });
  found.resize(kMostStarts);
  std::sort(found.begin(), found.end());
  return found;
}

/// The mean under what is expected, and each of the heaviest observations by itself: in the sun, in the
/// shade, as expected.
Log best_start(const std::vector<Hypotheses>& all) {
  Log best = mean_of(all);
  double most = log_likelihood(all, best);
  for (const Hypotheses* h : heaviest(all)) {
    const auto likely = std::max_element(h->prior.begin(), h->prior.end()) - h->prior.begin();
    for (const auto v : {std::ptrdiff_t{0}, likely, std::ptrdiff_t{kShares - 1}})
      if (const double now = log_likelihood(all, h->albedo[v]); now > most) most = now, best = h->albedo[v];
  }
  return best;
}

Log improved(const std::vector<Hypotheses>& all, const Log& albedo) {
  Log sum{0, 0, 0};
  double weights = 0;
  for (const Hypotheses& h : all) {
    const std::array<double, kShares> p = joint(h, albedo);
    const double scale = h.weight / (total(p) + kElsewhere);
    for (int v = 0; v < kShares; ++v) {
      weights += scale * p[v];
      for (int c = 0; c < 3; ++c) sum[c] += scale * p[v] * h.albedo[v][c];
    }
  }
  if (!(weights > 1e-9)) return albedo;
  for (double& value : sum) value /= weights;
  return sum;
}

}  // namespace

SurfaceColor surface_color(const std::vector<LitColor>& observations) {
  std::vector<Hypotheses> all;
  for (const LitColor& seen : observations) all.push_back(hypotheses(seen));
  SurfaceColor found;
  if (all.empty()) return found;
  Log albedo = best_start(all);
  for (int round = 0; round < kRounds; ++round) albedo = improved(all, albedo);
  for (int c = 0; c < 3; ++c) found.albedo[c] = static_cast<float>(std::exp(albedo[c]));
  for (const Hypotheses& h : all) {
    // What is likelier something else says nothing of the sun: it keeps what was expected.
    std::array<double, kShares> p = joint(h, albedo);
    double sum = 0, mean = 0;
    for (int v = 0; v < kShares; ++v) {
      p[v] += kElsewhere * h.prior[v];
      sum += p[v], mean += p[v] * v / (kShares - 1);
    }
    found.sunlit.push_back(static_cast<float>(mean / sum));
  }
  return found;
}

}  // namespace roxel
