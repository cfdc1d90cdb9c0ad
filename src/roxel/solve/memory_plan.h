#pragma once
/// How the memory of a run is shared out between what it must hold and what only saves time. No result
/// depends on it.

#include <cstdint>
#include <limits>

namespace roxel {

struct MemoryPlan {
  /// Samples of photographs that stay in memory within a level; those of others are made anew, from the
  /// image file, in each half of a pass.
  double sample_bytes = std::numeric_limits<double>::infinity();
  std::int64_t kept_color_bytes = std::int64_t{1} << 30;  ///< see KeptColors
  int workers = std::numeric_limits<int>::max();          ///< threads that march at once; see PassOptions
  double limit_bytes = 0;                                 ///< what was to be kept to
  double peak_bytes = 0;  ///< expected resident memory of the process, at most
  bool fits = true;       ///< peak_bytes <= limit_bytes
};

/// What other programs leave of the machine's memory, in bytes; also of the control group that this one runs
/// in. A large number where neither is known.
double memory_at_hand();

/// Resident memory of this process now, in bytes; 0 where the system does not say.
double resident_bytes();

}  // namespace roxel
