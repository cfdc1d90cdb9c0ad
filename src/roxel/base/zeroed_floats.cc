#include "roxel/base/zeroed_floats.h"

#include <cstdint>
#include <cstdlib>
#include <new>

#ifdef __linux__
#include <sys/mman.h>
#include <unistd.h>
#endif

namespace roxel {
namespace {

std::uintptr_t round_up(std::uintptr_t value, std::uintptr_t step) {
  return (value + step - 1) / step * step;
}

/// A wish, which the system may ignore. Only whole pages of the block are named.
void ask_for_large_pages([[maybe_unused]] void* memory, [[maybe_unused]] std::size_t bytes) {
#if defined(__linux__) && defined(MADV_HUGEPAGE)
  const auto page = static_cast<std::uintptr_t>(sysconf(_SC_PAGESIZE));
  const auto begin = round_up(reinterpret_cast<std::uintptr_t>(memory), page);
  const auto end = (reinterpret_cast<std::uintptr_t>(memory) + bytes) / page * page;
  if (end > begin) madvise(reinterpret_cast<void*>(begin), end - begin, MADV_HUGEPAGE);
#endif
}

}  // namespace

ZeroedFloats::ZeroedFloats(std::size_t count) {
  constexpr std::size_t line = kLine * sizeof(float);
  const std::size_t bytes = count * sizeof(float) + line;
  memory_.reset(std::calloc(bytes, 1));
  if (!memory_) throw std::bad_alloc();
  ask_for_large_pages(memory_.get(), bytes);
  first_ = reinterpret_cast<float*>(round_up(reinterpret_cast<std::uintptr_t>(memory_.get()), line));
}

void ZeroedFloats::Free::operator()(void* memory) const { std::free(memory); }

}  // namespace roxel
