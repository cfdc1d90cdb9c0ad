#pragma once
/// What several commands share: common options, how a data set is read, and the frame around a long job.

#include <nlohmann/json_fwd.hpp>
#include <optional>
#include <string>
#include <vector>

#include "output_folder.h"
#include "progress_display.h"
#include "roxel/base/option_table.h"
#include "roxel/base/run_context.h"
#include "roxel/io/dataset_reader.h"
#include "roxel/io/photograph.h"

namespace roxel::cli {

/// Of pictures, whose values are neither encoded nor decoded when they are written and read.
inline constexpr Response kAsItIs{ResponseCurve::kLinear};
/// Opacity above which a pixel's depth counts.
inline constexpr float kHasDepth = 0.5f;

struct CommonOptions {
  std::optional<int> threads;
  bool quiet = false;
  bool verbose = false;
  bool json = false;
};

const OptionTable<CommonOptions>& common_option_table();

/// How photographs and cameras are read.
struct InputOptions {
  std::string format = "auto";
  std::optional<std::string> images;
  std::optional<std::string> nodes;
  std::optional<double> node_tolerance;
  std::string masks = "auto";
  std::string response = "auto";
};

const OptionTable<InputOptions>& input_option_table();
/// The same without masks, for what does not look at objects.
const OptionTable<InputOptions>& reading_option_table();

/// A data set that was read, and how to get at its pixels.
struct Input {
  Dataset dataset;
  PhotographLoader load;
  std::optional<Response> response;  ///< where it was chosen
};

/// Progress, Ctrl-C and messages around a long job. One at a time; the first thing that a command makes, so
/// that Ctrl-C always ends it in order.
class Session {
 public:
  explicit Session(const CommonOptions& options);
  ~Session();
  Session(const Session&) = delete;
  Session& operator=(const Session&) = delete;

  RunContext& context() { return context_; }
  const RunContext& context() const { return context_; }
  ProgressDisplay& display() { return display_; }
  /// The loader, but it throws Cancelled after Ctrl-C: for work that looks at images and knows no context.
  PhotographLoader cancellable(PhotographLoader load) const;

 private:
  ProgressDisplay display_;
  RunContext context_;
};

/// Its loader throws Cancelled after Ctrl-C, as this does; `session` must outlive it.
Input read_input(const std::string& path, const InputOptions& options, const Session& session);

/// A warning for people on stderr, unless --quiet.
void warn(const CommonOptions& options, const std::string& message);

/// Indented; text that is not UTF-8 gets replacement characters.
std::string json_text(const nlohmann::ordered_json& json);

/// Text on stdout at the end of a command: `json` with --json, else `text` unless --quiet.
void print_result(const CommonOptions& options, const std::string& text, const std::string& json);

}  // namespace roxel::cli
