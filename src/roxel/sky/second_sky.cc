#include "roxel/sky/second_sky.h"

#include <algorithm>

#include "roxel/base/error.h"
#include "roxel/base/formatted.h"

namespace roxel {
namespace {

constexpr double kMoreSky = 0.002;  ///< of a node's pixels: less is not worth another light
constexpr double kKept = 0.95;
constexpr double kWorse = 1.3;

}  // namespace

void SkyKept::add(const Mask& first, const Mask& second) {
  if (first.empty()) return;
  ROXEL_CHECK(second.empty() || second.data().size() == first.data().size());
  for (std::size_t i = 0; i < first.data().size(); ++i) {
    first_ += first.data()[i];
    if (!second.empty()) kept_ += std::min(first.data()[i], second.data()[i]);
  }
}

std::string why_refused(const SkyOutcome& first, const SkyOutcome& second, double kept) {
  if (second.model == SkyModel::kNone) return "it has no light";
  if (!(second.mask_share > first.mask_share + kMoreSky)) return "hardly more sky";
  if (kept < kKept) return formatted("it has but %.0f %% of the sky of the first", 100 * kept);
  if (second.model < first.model) return std::string("its model is but ") + to_string(second.model);
  if (first.model != SkyModel::kNone && second.error > kWorse * first.error)
    return formatted("its fit is worse: %.1f instead of %.1f %%", 100 * second.error, 100 * first.error);
  return {};
}

}  // namespace roxel
