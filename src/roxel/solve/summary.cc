#include "roxel/solve/summary.h"

#include <cstdio>

namespace roxel {

std::string Summary::brief() const {
  if (levels.empty() || passes.empty()) return "nothing was reconstructed";
  char text[256];
  std::snprintf(
      text, sizeof text,
      "%zu levels, %zu passes (%s), %lld voxels of %.4g, mean log-likelihood %.3f, %.1f s, %.2f GiB",
      levels.size(), passes.size(), termination.c_str(), static_cast<long long>(levels.back().voxels_in_box),
      levels.back().voxel_size, passes.back().mean_log_likelihood, seconds,
      static_cast<double>(peak_memory_bytes) / (1 << 30));
  return text;
}

}  // namespace roxel
