#pragma once
/// Processor time: what a shared machine does meanwhile does not count.

#include <time.h>

namespace roxel {

/// Of all threads of this process so far, in seconds.
inline double processor_seconds() {
  timespec now{};
  clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &now);
  return static_cast<double>(now.tv_sec) + 1e-9 * static_cast<double>(now.tv_nsec);
}

}  // namespace roxel
