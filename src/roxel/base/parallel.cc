#include "roxel/base/parallel.h"

#include <tbb/task_arena.h>
#include <tbb/task_group.h>

#include <algorithm>
#include <atomic>
#include <exception>
#include <mutex>

namespace roxel {

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
  tbb::task_arena arena(workers);
  arena.execute([&] {
    tbb::task_group group;
    for (int worker = 1; worker < workers; ++worker) group.run([&work, worker] { work(worker); });
    work(0);
    group.wait();
  });
  if (failure) std::rethrow_exception(failure);
}

void parallel_for_blocks(std::int64_t count, std::int64_t grain, int threads,
                         const std::function<void(std::int64_t, std::int64_t, int)>& body) {
  const std::int64_t blocks = (count + grain - 1) / grain;
  parallel_for(blocks, threads, [&](std::int64_t block, int worker) {
    body(block * grain, std::min(count, (block + 1) * grain), worker);
  });
}

}  // namespace roxel
