#include "roxel/base/run_context.h"

#include <algorithm>
#include <thread>

#include "roxel/base/error.h"

namespace roxel {
namespace {

/// Lets the next report in, also when the listener throws.
struct Release {
  std::atomic_flag& busy;
  ~Release() { busy.clear(std::memory_order_release); }
};

}  // namespace

RunContext::RunContext(int thread_count, Listener listener)
    : thread_count_(thread_count > 0 ? thread_count : std::max(1u, std::thread::hardware_concurrency())),
      listener_(std::move(listener)) {}

void RunContext::throw_if_cancelled() const {
  if (cancelled()) throw Cancelled();
}

void RunContext::report(Progress progress) {
  if (!listener_) return;
  while (busy_.test_and_set(std::memory_order_acquire)) std::this_thread::yield();
  const Release release{busy_};
  // Written so that NaN, too, becomes the highest fraction so far.
  if (!(progress.fraction >= highest_)) progress.fraction = highest_;
  progress.fraction = std::min(progress.fraction, 1.0);
  highest_ = progress.fraction;
  listener_(progress);
}

}  // namespace roxel
