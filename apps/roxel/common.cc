#include "common.h"

#include <signal.h>
#include <unistd.h>

#include <atomic>
#include <cstdio>
#include <filesystem>
#include <nlohmann/json.hpp>

#include "roxel/base/error.h"

namespace roxel::cli {
namespace {

namespace fs = std::filesystem;

std::atomic<RunContext*> running{nullptr};
std::atomic<int> interruptions{0};

/// The first signal asks the job to stop; the second does not wait for it.
extern "C" void on_signal(int) {
  if (interruptions.fetch_add(1) > 0) _exit(130);
  if (RunContext* context = running.load()) context->cancel();
}

void handle_signals(void (*handler)(int)) {
  struct sigaction action {};
  action.sa_handler = handler;
  sigemptyset(&action.sa_mask);
  action.sa_flags = SA_RESTART;
  sigaction(SIGINT, &action, nullptr);
  sigaction(SIGTERM, &action, nullptr);
}

Talk talk(const CommonOptions& options) {
  return options.quiet ? Talk::kQuiet : options.verbose ? Talk::kVerbose : Talk::kNormal;
}

OptionTable<CommonOptions> make_common_table() {
  OptionTable<CommonOptions> table;
  table.group("Common");
  table.add("threads", &CommonOptions::threads)
      .help("Threads to work on; results do not depend on it")
      .range(1, 1024)
      .unset("all cores");
  table.add("quiet", &CommonOptions::quiet).help("Say nothing but errors");
  table.add("verbose", &CommonOptions::verbose).help("Say more: a line a pass, on a terminal, too");
  table.add("json", &CommonOptions::json).help("The result as JSON on standard output");
  return table;
}

OptionTable<InputOptions> make_input_table(bool masks) {
  OptionTable<InputOptions> table;
  table.group(masks ? "Input" : "Photographs");
  table.add("format", &InputOptions::format)
      .help("Format of the data set; auto: by what is in the folder")
      .placeholder("auto|colmap|transforms|middlebury|strecha|krt");
  table.add("images", &InputOptions::images)
      .help("Use only images whose path or name matches this pattern")
      .placeholder("GLOB")
      .unset("all");
  table.add("nodes", &InputOptions::nodes)
      .help("Use only capture nodes A to B - 1, counted from 0; either may be left out")
      .placeholder("A:B")
      .unset("all");
  table.add("node-tolerance", &InputOptions::node_tolerance)
      .help(
          "Images whose centres are at most this far apart, or joined by others that are, were taken from "
          "one "
          "place (node), where the data set does not say; 0: only from the same point")
      .unit("world units")
      .at_least(0)
      .unset("a twentieth of the step between views spread evenly over the cameras' extent")
      .source("docs/datasets.md");
  if (masks)
    table.add("masks", &InputOptions::masks)
        .help("Folder of masks; auto: those of the data set; none: no masks")
        .placeholder("auto|none|FOLDER");
  table.add("response", &InputOptions::response)
      .help("How stored values follow from light; auto: sRGB for 8 and 16 bits, linear for float")
      .placeholder("auto|srgb|linear|gamma:G");
  return table;
}

}  // namespace

const OptionTable<CommonOptions>& common_option_table() {
  static const OptionTable<CommonOptions> table = make_common_table();
  return table;
}

const OptionTable<InputOptions>& input_option_table() {
  static const OptionTable<InputOptions> table = make_input_table(true);
  return table;
}

const OptionTable<InputOptions>& reading_option_table() {
  static const OptionTable<InputOptions> table = make_input_table(false);
  return table;
}

Input read_input(const std::string& path, const InputOptions& options, const Session& session) {
  ReadOptions read;
  if (options.format != "auto") read.format = options.format;
  read.images = options.images.value_or("");
  read.nodes = options.nodes.value_or("");
  read.node_tolerance = options.node_tolerance;
  read.masks = options.masks;
  Input input;
  if (options.response != "auto") input.response = parse_response(options.response, "--response");
  input.dataset = read_dataset(path, read);
  input.dataset.path = fs::absolute(path).lexically_normal().string();  // for those who come from elsewhere
  PhotographOptions photograph;
  photograph.response = input.response;
  if (options.masks == "none") photograph.masks = MaskUse::kNone;
  input.load = session.cancellable(make_photograph_loader(photograph));
  session.context().throw_if_cancelled();
  return input;
}

PhotographLoader Session::cancellable(PhotographLoader load) const {
  return [this, load = std::move(load)](const View& view) {
    context_.throw_if_cancelled();
    return load(view);
  };
}

Session::Session(const CommonOptions& options)
    : display_(talk(options), isatty(STDERR_FILENO) != 0, stderr),
      context_(options.threads.value_or(0), [this](const Progress& progress) { display_.update(progress); }) {
  running = &context_;
  handle_signals(on_signal);
}

Session::~Session() {
  handle_signals(SIG_DFL);
  running = nullptr;
}

void warn(const CommonOptions& options, const std::string& message) {
  if (!options.quiet) std::fprintf(stderr, "roxel: warning: %s\n", message.c_str());
}

std::string json_text(const nlohmann::ordered_json& json) {
  return json.dump(2, ' ', false, nlohmann::ordered_json::error_handler_t::replace);
}

void print_result(const CommonOptions& options, const std::string& text, const std::string& json) {
  if (options.json) std::printf("%s\n", json.c_str());
  if (!options.json && !options.quiet) std::fputs(text.c_str(), stdout);
}

}  // namespace roxel::cli
