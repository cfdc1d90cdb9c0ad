#pragma once
/// Errors by cause. The command line maps InvalidInput to exit code 2, Cancelled to 130, everything else
/// to 1.

#include <sstream>
#include <stdexcept>
#include <string>

namespace roxel {

/// The caller's files, options or data are wrong. The message names where (file, line or field), what was
/// found and what was expected.
class InvalidInput : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

/// Reading or writing failed for a reason outside the input itself (disc full, no permission).
class IoError : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

/// A computation left its domain (singular matrix, overflow of an accumulator).
class NumericalError : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

/// The user asked to stop (RunContext::cancel).
class Cancelled : public std::runtime_error {
 public:
  Cancelled() : std::runtime_error("interrupted") {}
};

/// Throws InvalidInput "WHERE: found FOUND, expected EXPECTED".
[[noreturn]] void throw_invalid(const std::string& where, const std::string& found,
                                const std::string& expected);

namespace internal {
[[noreturn]] void throw_check_failed(const char* file, int line, const char* expression,
                                     const std::string& values);

template <class A, class B>
std::string both_values(const A& a, const B& b) {
  std::ostringstream out;
  out << a << " vs " << b;
  return out.str();
}
}  // namespace internal
}  // namespace roxel

/// Preconditions of the library. They throw std::logic_error with both values and never abort the host.
#define ROXEL_CHECK(condition)                                                                   \
  do {                                                                                           \
    if (!(condition)) ::roxel::internal::throw_check_failed(__FILE__, __LINE__, #condition, ""); \
  } while (false)
#define ROXEL_CHECK_OP(a, op, b)                                                       \
  do {                                                                                 \
    if (!((a)op(b)))                                                                   \
      ::roxel::internal::throw_check_failed(__FILE__, __LINE__, #a " " #op " " #b,     \
                                            ::roxel::internal::both_values((a), (b))); \
  } while (false)
#define ROXEL_CHECK_EQ(a, b) ROXEL_CHECK_OP(a, ==, b)
#define ROXEL_CHECK_LT(a, b) ROXEL_CHECK_OP(a, <, b)
#define ROXEL_CHECK_LE(a, b) ROXEL_CHECK_OP(a, <=, b)
#define ROXEL_CHECK_GE(a, b) ROXEL_CHECK_OP(a, >=, b)
