#pragma once
/// Whether a second sky of a node, fitted with what a volume leaves unexplained, may replace the first.

#include <string>

#include "roxel/image/image.h"
#include "roxel/sky/node_sky.h"

namespace roxel {

/// What of the sky of first masks is sky in second ones.
class SkyKept {
 public:
  /// Masks of one photograph, of one size; an empty one has no sky.
  void add(const Mask& first, const Mask& second);
  /// 1 where the first have none.
  double share() const { return first_ > 0 ? kept_ / first_ : 1; }

 private:
  double kept_ = 0, first_ = 0;
};

/// A node's sky as it was found, and what came of it.
struct SkyOutcome {
  SkyModel model = SkyModel::kNone;
  double mask_share = 0;  ///< of the node's pixels that are sky
  double error = 0;       ///< mean, of the fit
};

/// Why the second does not replace the first; empty where it does: with more sky by 0.2 % of the pixels, at
/// least 95 % of the first's, a model that says as much, and an error of at most 1.3 times.
std::string why_refused(const SkyOutcome& first, const SkyOutcome& second, double kept);

}  // namespace roxel
