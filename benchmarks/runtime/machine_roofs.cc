#include "machine_roofs.h"

#include <algorithm>
#include <atomic>
#include <chrono>
#include <thread>
#include <vector>

namespace roxel {

Lines::Lines(std::int64_t count) : count_(count), lines_(new Line[count]) {
  for (std::int64_t i = 0; i < count_; ++i) std::fill(lines_[i].value, lines_[i].value + 16, 1.0f);
}

void Lines::stream() {
  for (std::int64_t i = 0; i < count_; ++i)
    for (float& value : lines_[i].value) value = 0.5f * value + 1;
}

void Lines::gather(std::int64_t lines) {
  // xorshift: addresses come from registers alone, so that many lines are on their way at once.
  std::uint64_t state = 88172645463325252u;
  for (std::int64_t n = 0; n < lines; ++n) {
    state ^= state << 13, state ^= state >> 7, state ^= state << 17;
    Line& line = lines_[static_cast<std::uint64_t>(
        static_cast<unsigned __int128>(state) * static_cast<std::uint64_t>(count_) >> 64)];
    for (float& value : line.value) value = 0.5f * value + 1;
  }
}

double register_loop_seconds(int threads) {
  std::atomic<std::uint64_t> used{0};
  const auto work = [&used] {
    std::uint64_t a = 1, b = 2, c = 3, d = 4;
    for (int i = 0; i < 100'000'000; ++i) {
      a ^= a << 13, b ^= b << 13, c ^= c << 13, d ^= d << 13;
      a += 0x9e3779b97f4a7c15u, b += 0x9e3779b97f4a7c15u, c += 0x9e3779b97f4a7c15u, d += 0x9e3779b97f4a7c15u;
    }
    used += a + b + c + d;
  };
  const auto start = std::chrono::steady_clock::now();
  std::vector<std::jthread> workers;
  for (int t = 1; t < threads; ++t) workers.emplace_back(work);
  work();
  workers.clear();
  return std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
}

}  // namespace roxel
