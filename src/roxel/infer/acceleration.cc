#include "roxel/infer/acceleration.h"

#include <algorithm>
#include <cmath>

namespace roxel {

double Acceleration::operator()(std::uint32_t slot, double before, double em, double prior_share) {
  if (last_.empty()) return em;
  Step& last = last_[slot];
  if (!(before > 0) || !(em > 0)) {
    last = {};
    return em;
  }
  const double step = std::log(em / before);
  double factor = kFirst;
  if (last.made != 0) {
    const double drop = (last.em - step) / last.made;  // of the EM step, per length of the step made
    factor = drop > 1 / limit_ ? 1 / drop : limit_;
    if (step * last.em < 0) factor = 1;  // it went past
  }
  if (step > 0 && which_ == Accelerate::kFalling) factor = 1;
  const double farthest = std::max(kFarthest, std::abs(step));
  const double longest = std::min(limit_, 1 + kPerEvidence * (1 / std::max(prior_share, 1e-9) - 1));
  const double made = std::clamp(std::clamp(factor, 1.0, longest) * step, -farthest, farthest);
  last = {static_cast<float>(step), static_cast<float>(made)};
  return before * std::exp(made);
}

}  // namespace roxel
