#pragma once
/// Joins volumes that were made apart: of neighbouring boxes, or of the same box from other photographs.

#include <optional>
#include <vector>

#include "roxel/volume/volume.h"

namespace roxel {

/// What the two numbers of Volume::support mean: the update rule that the volumes were made with.
enum class SupportRule {
  kPosterior,  ///< tau = (sum r + beta tau_0) / (exposure + beta)
  kRoxels,     ///< alpha = (sum r alpha_s) / (sum r), second number over first
};

struct MergeOptions {
  SupportRule rule = SupportRule::kPosterior;
  double prior_strength = 1;  ///< beta of the passes that made the volumes, >= 0
  /// alpha_0 in [0, 1). Unset: the prior that is in the volumes, which their tau and support give away
  /// (it differs from voxel to voxel when it came from the neighbours); the mean where volumes differ.
  std::optional<double> prior_opacity = std::nullopt;
};

/// The union of the voxels. Where one volume has a voxel, it is copied; where several do, colours merge by
/// weight
/// ([Jethwa04] eq. (4.3), (4.4)), supports add and give the opacity again, and confidence adds as
/// n = 2 c / (1 - c): what one joint pass over all evidence would sum, as long as no photograph is in two
/// volumes. All must have one matching colour space. Boxes may differ if their voxels have one size and their
/// voxel planes coincide; then the box is the union, in the first one's brick planes, and surround is left
/// out, which would not fit. Otherwise throws InvalidInput, counting volumes from 1. `threads` does not
/// change the result.
Volume merge(const std::vector<const Volume*>& volumes, const MergeOptions& options, int threads = 1);

}  // namespace roxel
