#include "roxel/base/error.h"

namespace roxel {

void throw_invalid(const std::string& where, const std::string& found, const std::string& expected) {
  throw InvalidInput(where + ": found " + found + ", expected " + expected);
}

namespace internal {
void throw_check_failed(const char* file, int line, const char* expression, const std::string& values) {
  std::ostringstream out;
  out << file << ":" << line << ": check failed: " << expression;
  if (!values.empty()) out << " (" << values << ")";
  throw std::logic_error(out.str());
}
}  // namespace internal
}  // namespace roxel
