#include "roxel/solve/memory_plan.h"

#include <unistd.h>

#include <algorithm>
#include <fstream>
#include <string>

namespace roxel {
namespace {

constexpr double kUnknown = 1e18;

/// The number in a file that holds one; "max" and a missing file are no number.
double number_in(const char* file) {
  double value = kUnknown;
  std::ifstream in(file);
  return in >> value ? value : kUnknown;
}

double available_on_machine() {
  std::ifstream in("/proc/meminfo");
  std::string name, unit;
  double value = 0;
  while (in >> name >> value) {
    std::getline(in, unit);
    if (name == "MemAvailable:") return 1024 * value;
  }
  return kUnknown;
}

/// "key value" in a file of such lines; 0 where it is missing.
double entry_in(const std::string& file, const std::string& key) {
  std::ifstream in(file);
  std::string name;
  double value = 0;
  while (in >> name >> value)
    if (name == key) return value;
  return 0;
}

/// What a control group's limit leaves; files that are only cached do not count as used.
double left_in(const std::string& group, const char* limit_file, const char* used_file, const char* cached) {
  const double limit = number_in((group + "/" + limit_file).c_str());
  const double used = number_in((group + "/" + used_file).c_str());
  if (!(limit < kUnknown && used < kUnknown)) return kUnknown;
  return std::max(0.0, limit - std::max(0.0, used - entry_in(group + "/memory.stat", cached)));
}

/// The least that the process's groups and those above them leave, of both versions of control groups.
double left_in_groups() {
  double left = kUnknown;
  std::ifstream in("/proc/self/cgroup");
  for (std::string line; std::getline(in, line);) {
    const auto first = line.find(':'), second = line.find(':', first + 1);
    if (second == std::string::npos) continue;
    const std::string controllers = line.substr(first + 1, second - first - 1);
    if (!controllers.empty() && controllers != "memory") continue;
    for (std::string path = line.substr(second + 1);; path.resize(path.rfind('/'))) {
      if (path == "/") path.clear();
      left = std::min(left,
                      controllers.empty()
                          ? left_in("/sys/fs/cgroup" + path, "memory.max", "memory.current", "inactive_file")
                          : left_in("/sys/fs/cgroup/memory" + path, "memory.limit_in_bytes",
                                    "memory.usage_in_bytes", "total_inactive_file"));
      if (path.find('/') == std::string::npos) break;
    }
  }
  return left;
}

}  // namespace

double resident_bytes() {
  std::ifstream in("/proc/self/statm");
  double all = 0, resident = 0;
  return in >> all >> resident ? resident * static_cast<double>(sysconf(_SC_PAGESIZE)) : 0;
}

double memory_at_hand() { return std::min(available_on_machine(), left_in_groups()); }

}  // namespace roxel
