#pragma once
/// Text by printf's patterns, checked by the compiler.

#include <string>

namespace roxel {

/// What printf(pattern, ...) would print, however long.
__attribute__((format(printf, 1, 2))) std::string formatted(const char* pattern, ...);

}  // namespace roxel
