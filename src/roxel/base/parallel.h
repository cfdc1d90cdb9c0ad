#pragma once
/// Parallel loops whose results cannot depend on the number of threads, as long as the body of one index
/// touches only what belongs to that index (or adds to exact accumulators).

#include <cstdint>
#include <functional>

namespace roxel {

/// Calls body(index, worker) for every index in [0, count), on at most `threads` workers; `worker` is in
/// [0, threads) and never used by two calls at once (use it to pick scratch memory). Indices are handed out
/// in ascending order, one at a time. The first exception of a body is rethrown after all workers stopped.
void parallel_for(std::int64_t count, int threads,
                  const std::function<void(std::int64_t index, int worker)>& body);

/// The same in blocks of `grain` consecutive indices: body(begin, end, worker).
void parallel_for_blocks(std::int64_t count, std::int64_t grain, int threads,
                         const std::function<void(std::int64_t begin, std::int64_t end, int worker)>& body);

}  // namespace roxel
