#pragma once
/// Fewer triangles for the same shape: edges are collapsed in the order of what that does to the shape
/// [Garland97], by meshoptimizer.

#include <optional>

#include "roxel/surface/surface.h"

namespace roxel {

struct SimplificationOptions {
  std::optional<std::int64_t> triangles;  ///< most that are left; none: as few as the error allows
  double error = 0;  ///< how far the surface may move, world units; not asked for with a target
};

/// Points that stay keep their place and attributes. Throws InvalidInput where the target cannot be reached:
/// a closed surface needs some triangles a part. The same for any number of threads.
Surface simplified(const Surface& surface, const SimplificationOptions& options);

}  // namespace roxel
