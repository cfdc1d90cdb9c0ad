#pragma once
/// What a person sees of a long job: a bar on a terminal, plain lines elsewhere, nothing when quiet.

#include <chrono>
#include <cstdio>
#include <mutex>
#include <string>

#include "roxel/base/run_context.h"

namespace roxel::cli {

enum class Talk { kQuiet, kNormal, kVerbose };

/// Safe to use from several threads.
class ProgressDisplay {
 public:
  /// `out` is where bar and lines go; `terminal` says whether a line can be drawn over.
  ProgressDisplay(Talk talk, bool terminal, std::FILE* out);
  ~ProgressDisplay() { clear(); }
  ProgressDisplay(const ProgressDisplay&) = delete;
  ProgressDisplay& operator=(const ProgressDisplay&) = delete;

  /// Redraws the bar at most ten times a second; off a terminal, says when a stage begins.
  void update(const Progress& progress);
  /// A line of its own: always off a terminal, on one only when verbose.
  void line(const std::string& text);
  /// A line of its own, when verbose.
  void detail(const std::string& text);
  /// Takes the bar away.
  void clear();

 private:
  using Clock = std::chrono::steady_clock;
  void draw(const Progress& progress);
  void erase();

  Talk talk_;
  bool terminal_;
  std::FILE* out_;
  Clock::time_point start_ = Clock::now();
  Clock::time_point last_drawn_{};
  std::string stage_;
  bool drawn_ = false;
  std::mutex mutex_;
};

/// "volume [#####     ] 45 %  level 2/3, pass 3/8, about 1 min 20 s left".
std::string progress_line(const Progress& progress, double elapsed_s);

/// "12 s", "1 min 20 s", "2 h 5 min".
std::string duration_text(double seconds);

}  // namespace roxel::cli
