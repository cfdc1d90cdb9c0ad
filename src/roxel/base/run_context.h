#pragma once
/// What a long computation is given by whoever started it: a way to be told to stop, and someone to report
/// progress to. cancel() may be called from any thread or from a signal handler.

#include <atomic>
#include <functional>
#include <string>

namespace roxel {

/// Where a computation stands. `fraction` is of the whole command, monotone from 0 to 1.
struct Progress {
  std::string stage;  ///< e.g. "volume", "depth"
  int level = 0;      ///< 1-based; 0 where levels mean nothing
  int level_count = 0;
  int pass = 0;  ///< 1-based; 0 where passes mean nothing
  int pass_limit = 0;
  double fraction = 0;
};

/// Shared by all threads of one run; not copyable. Reports are serialised and never go backwards.
class RunContext {
 public:
  using Listener = std::function<void(const Progress&)>;

  explicit RunContext(int thread_count = 0, Listener listener = nullptr);
  RunContext(const RunContext&) = delete;
  RunContext& operator=(const RunContext&) = delete;

  /// Worker threads to use, at least 1. Results never depend on it.
  int thread_count() const { return thread_count_; }

  void cancel() noexcept { cancelled_.store(true, std::memory_order_relaxed); }
  bool cancelled() const noexcept { return cancelled_.load(std::memory_order_relaxed); }
  /// Throws Cancelled after cancel() was called. Cheap: call it once per image row or brick.
  void throw_if_cancelled() const;

  /// Passes `progress` to the listener; a fraction below an earlier one (or NaN) is raised to it. The
  /// listener must not report itself.
  void report(Progress progress);

 private:
  int thread_count_;
  Listener listener_;
  std::atomic<bool> cancelled_{false};
  double highest_ = 0;  ///< guarded by busy_
  std::atomic_flag busy_ = ATOMIC_FLAG_INIT;
};

}  // namespace roxel
