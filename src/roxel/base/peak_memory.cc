#include "roxel/base/peak_memory.h"

#include <fcntl.h>
#ifdef __GLIBC__
#include <malloc.h>
#endif
#include <sys/resource.h>
#include <unistd.h>

#include <algorithm>
#include <fstream>
#include <limits>
#include <mutex>
#include <string>
#include <vector>

namespace roxel {
namespace {

/// The system's mark, in bytes. getrusage also remembers programs that this process was before.
std::int64_t high_water() {
  std::ifstream in("/proc/self/status");
  for (std::string name; in >> name; in.ignore(std::numeric_limits<std::streamsize>::max(), '\n'))
    if (std::int64_t kib = 0; name == "VmHWM:" && in >> kib) return 1024 * kib;
  rusage usage{};
  getrusage(RUSAGE_SELF, &usage);
  return 1024 * static_cast<std::int64_t>(usage.ru_maxrss);
}

/// Lets the mark start from what is held now; whether it could. What was freed and not yet given back goes
/// first: it is no need of what follows.
bool start_anew() {
#ifdef __GLIBC__
  malloc_trim(0);
#endif
  const int file = open("/proc/self/clear_refs", O_WRONLY | O_CLOEXEC);
  if (file < 0) return false;
  const bool done = write(file, "5", 1) == 1;
  close(file);
  return done;
}

}  // namespace

/// Of the process: who is running, and the most there ever was.
class MemoryMarks {
 public:
  static MemoryMarks& instance() {
    static MemoryMarks marks;
    return marks;
  }

  void begin(PeakMemory& stretch) {
    const std::lock_guard lock(mutex_);
    const std::int64_t mark = high_water();
    most_ = std::max(most_, mark);
    for (PeakMemory* other : running_) other->most_ = std::max(other->most_, mark);
    if (std::find(running_.begin(), running_.end(), &stretch) == running_.end()) running_.push_back(&stretch);
    stretch.known_ = start_anew();
    stretch.most_ = 0;
  }
  void end(PeakMemory& stretch) {
    const std::lock_guard lock(mutex_);
    std::erase(running_, &stretch);
  }
  std::int64_t most(const PeakMemory& stretch) {
    const std::lock_guard lock(mutex_);
    return stretch.known_ ? std::max(stretch.most_, high_water()) : 0;
  }
  std::int64_t most() {
    const std::lock_guard lock(mutex_);
    return std::max(most_, high_water());
  }

 private:
  std::mutex mutex_;
  std::vector<PeakMemory*> running_;
  std::int64_t most_ = 0;
};

PeakMemory::PeakMemory() { restart(); }
PeakMemory::~PeakMemory() { MemoryMarks::instance().end(*this); }
void PeakMemory::restart() { MemoryMarks::instance().begin(*this); }
std::int64_t PeakMemory::bytes() const { return MemoryMarks::instance().most(*this); }

std::int64_t peak_memory_bytes() { return MemoryMarks::instance().most(); }

}  // namespace roxel
