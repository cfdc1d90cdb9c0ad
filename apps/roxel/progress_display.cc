#include "progress_display.h"

#include <cmath>

namespace roxel::cli {
namespace {

constexpr int kBarWidth = 30;
constexpr double kLeastFractionForEstimate = 0.02;
constexpr double kLeastSecondsForEstimate = 1;
constexpr std::chrono::milliseconds kRedrawEvery{100};

}  // namespace

std::string duration_text(double seconds) {
  const long long s = std::llround(std::max(0.0, seconds));
  if (s < 60) return std::to_string(s) + " s";
  if (s < 3600) return std::to_string(s / 60) + " min" + (s % 60 ? " " + std::to_string(s % 60) + " s" : "");
  return std::to_string(s / 3600) + " h" +
         (s % 3600 / 60 ? " " + std::to_string(s % 3600 / 60) + " min" : "");
}

std::string progress_line(const Progress& progress, double elapsed_s) {
  const int filled = static_cast<int>(progress.fraction * kBarWidth);
  const std::string percent = std::to_string(static_cast<int>(100 * progress.fraction));
  std::string line = progress.stage + " [" + std::string(filled, '#') + std::string(kBarWidth - filled, ' ') +
                     "] " + std::string(3 - percent.size(), ' ') + percent + " %";
  std::string where;
  if (progress.level > 0)
    where += "  level " + std::to_string(progress.level) + "/" + std::to_string(progress.level_count);
  if (progress.pass > 0)
    where += std::string(where.empty() ? "  " : ", ") + "pass " + std::to_string(progress.pass) + "/" +
             std::to_string(progress.pass_limit);
  line += where;
  if (progress.fraction >= kLeastFractionForEstimate && progress.fraction < 1 &&
      elapsed_s >= kLeastSecondsForEstimate)
    line += ", about " + duration_text(elapsed_s * (1 - progress.fraction) / progress.fraction) + " left";
  return line;
}

ProgressDisplay::ProgressDisplay(Talk talk, bool terminal, std::FILE* out)
    : talk_(talk), terminal_(terminal), out_(out) {}

void ProgressDisplay::update(const Progress& progress) {
  if (talk_ == Talk::kQuiet) return;
  std::lock_guard lock(mutex_);
  if (terminal_) return draw(progress);
  if (progress.stage == stage_) return;
  stage_ = progress.stage;
  std::fprintf(out_, "%s ...\n", stage_.c_str());
  std::fflush(out_);
}

void ProgressDisplay::draw(const Progress& progress) {
  const auto now = Clock::now();
  if (now - last_drawn_ < kRedrawEvery && progress.fraction < 1) return;
  last_drawn_ = now;
  const double elapsed = std::chrono::duration<double>(now - start_).count();
  std::fprintf(out_, "\r\033[K%s", progress_line(progress, elapsed).c_str());
  std::fflush(out_);
  drawn_ = true;
}

void ProgressDisplay::line(const std::string& text) {
  if (talk_ == Talk::kQuiet || (terminal_ && talk_ != Talk::kVerbose)) return;
  std::lock_guard lock(mutex_);
  erase();
  std::fprintf(out_, "%s\n", text.c_str());
  std::fflush(out_);
}

void ProgressDisplay::detail(const std::string& text) {
  if (talk_ == Talk::kVerbose) line(text);
}

void ProgressDisplay::clear() {
  std::lock_guard lock(mutex_);
  erase();
}

void ProgressDisplay::erase() {
  if (!drawn_) return;
  std::fprintf(out_, "\r\033[K");
  std::fflush(out_);
  drawn_ = false;
}

}  // namespace roxel::cli
