#include "roxel/base/run_context.h"

#include <algorithm>
#include <thread>

#include "roxel/base/error.h"

namespace roxel {

RunContext::RunContext(int thread_count, Listener listener)
    : thread_count_(thread_count > 0 ? thread_count : std::max(1u, std::thread::hardware_concurrency())),
      listener_(std::move(listener)) {}

void RunContext::throw_if_cancelled() const {
  if (cancelled()) throw Cancelled();
}

void RunContext::report(Progress progress) {
  if (!listener_) return;
  while (busy_.test_and_set(std::memory_order_acquire)) std::this_thread::yield();
  progress.fraction = std::clamp(progress.fraction, highest_.load(), 1.0);
  highest_ = progress.fraction;
  listener_(progress);
  busy_.clear(std::memory_order_release);
}

}  // namespace roxel
