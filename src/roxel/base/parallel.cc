#include "roxel/base/parallel.h"

#include <tbb/global_control.h>
#include <tbb/task_arena.h>
#include <tbb/task_group.h>

#include <algorithm>
#include <atomic>
#include <exception>
#include <mutex>
#include <optional>
#include <thread>
#include <vector>

#include "roxel/base/error.h"

namespace roxel {
namespace {

#ifdef __SANITIZE_THREAD__
/// ThreadSanitizer cannot see into the TBB library, which is built without it; plain threads it knows.
void run_workers(int count, const std::function<void(int worker)>& work) {
  std::vector<std::jthread> threads;
  for (int worker = 1; worker < count; ++worker) threads.emplace_back(work, worker);
  work(0);
}
#else
/// TBB keeps to the number of cores unless it is told otherwise; a user who asks for more threads gets them.
void allow_threads(int count) {
  static std::mutex mutex;
  static int allowed = tbb::this_task_arena::max_concurrency();
  static std::optional<tbb::global_control> control;
  std::lock_guard lock(mutex);
  if (count <= allowed) return;
  control.reset();  // of two controls TBB obeys the smaller
  control.emplace(tbb::global_control::max_allowed_parallelism, static_cast<std::size_t>(count));
  allowed = count;
}

void run_workers(int count, const std::function<void(int worker)>& work) {
  allow_threads(count);
  tbb::task_arena arena(count);
  arena.execute([&] {
    tbb::task_group group;
    for (int worker = 1; worker < count; ++worker) group.run([&work, worker] { work(worker); });
    work(0);
    group.wait();
  });
}
#endif

}  // namespace

void parallel_for(std::int64_t count, int threads, const std::function<void(std::int64_t, int)>& body) {
  const int workers = static_cast<int>(std::clamp<std::int64_t>(count, 1, std::max(1, threads)));
  if (workers == 1) {
    for (std::int64_t i = 0; i < count; ++i) body(i, 0);
    return;
  }
  std::atomic<std::int64_t> next{0};
  std::exception_ptr failure;
  std::mutex failure_mutex;
  const auto work = [&](int worker) {
    try {
      for (std::int64_t i = next++; i < count; i = next++) body(i, worker);
    } catch (...) {
      next = count;
      std::lock_guard lock(failure_mutex);
      if (!failure) failure = std::current_exception();
    }
  };
  run_workers(workers, work);
  if (failure) std::rethrow_exception(failure);
}

void parallel_for_blocks(std::int64_t count, std::int64_t grain, int threads,
                         const std::function<void(std::int64_t, std::int64_t, int)>& body) {
  ROXEL_CHECK_GE(grain, 1);
  const std::int64_t blocks = (count + grain - 1) / grain;
  parallel_for(blocks, threads, [&](std::int64_t block, int worker) {
    body(block * grain, std::min(count, (block + 1) * grain), worker);
  });
}

}  // namespace roxel
