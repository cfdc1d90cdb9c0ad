#pragma once
/// Parallel loops whose results cannot depend on the number of threads, as long as the body of one index
/// touches only what belongs to that index (or adds to exact accumulators).

#include <algorithm>
#include <cstdint>
#include <functional>
#include <optional>
#include <utility>
#include <vector>

namespace roxel {

/// Calls body(index, worker) for every index in [0, count), on at most `threads` workers; `worker` is in
/// [0, threads) and never used by two calls at once (use it to pick scratch memory). Indices are handed out
/// in ascending order, one at a time. The first exception of a body is rethrown after all workers stopped.
void parallel_for(std::int64_t count, int threads,
                  const std::function<void(std::int64_t index, int worker)>& body);

/// The same in blocks of `grain` consecutive indices: body(begin, end, worker).
void parallel_for_blocks(std::int64_t count, std::int64_t grain, int threads,
                         const std::function<void(std::int64_t begin, std::int64_t end, int worker)>& body);

/// Calls visit(index, thing) for every index in [0, count) in order, on the calling thread, with what
/// prepare(index) made of it on any of at most `threads` threads. Holds at most `most_held` things.
template <class Prepare, class Visit>
void for_each_prepared(std::int64_t count, int most_held, int threads, const Prepare& prepare,
                       const Visit& visit) {
  const int at_once = std::max(1, std::min(most_held, threads));
  std::vector<std::optional<decltype(prepare(std::int64_t{0}))>> things(at_once);
  for (std::int64_t begin = 0; begin < count; begin += at_once) {
    const std::int64_t here = std::min<std::int64_t>(at_once, count - begin);
    parallel_for(here, threads, [&](std::int64_t i, int) { things[i].emplace(prepare(begin + i)); });
    for (std::int64_t i = 0; i < here; ++i) {
      visit(begin + i, std::as_const(*things[i]));
      things[i].reset();
    }
  }
}

}  // namespace roxel
