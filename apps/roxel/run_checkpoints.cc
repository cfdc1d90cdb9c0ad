#include "run_checkpoints.h"

#include <algorithm>
#include <fstream>
#include <regex>

#include "depth_files.h"
#include "roxel/base/atomic_file.h"
#include "roxel/base/content_hash.h"
#include "roxel/base/error.h"

namespace roxel::cli {
namespace {

namespace fs = std::filesystem;

/// The target is as it was, or a whole copy.
void replace_folder(const fs::path& from, const fs::path& to) {
  std::error_code error;
  fs::path fresh = to;
  fresh += ".new";
  fs::remove_all(fresh, error);
  fs::create_directories(to.parent_path(), error);
  fs::copy(from, fresh, fs::copy_options::recursive, error);
  if (!error) fs::remove_all(to, error);
  if (!error) fs::rename(fresh, to, error);
  if (error) throw IoError(to.string() + ": cannot be written (" + error.message() + ")");
}

}  // namespace

const OptionTable<CheckpointOptions>& checkpoint_option_table() {
  static const OptionTable<CheckpointOptions> table = [] {
    OptionTable<CheckpointOptions> t;
    t.group("Checkpoints");
    t.add("resume", &CheckpointOptions::resume)
        .help("Go on from the checkpoint in RUN, with the options of the run that was interrupted");
    t.add("checkpoints", &CheckpointOptions::checkpoints)
        .help("Keep RUN/checkpoint while the volume is made, for --resume");
    t.add("checkpoint-interval", &CheckpointOptions::interval_s)
        .help("Time between checkpoints; one is also written after each level")
        .unit("seconds")
        .at_least(0);
    return t;
  }();
  return table;
}

RunCheckpoints::RunCheckpoints(std::filesystem::path run, const CheckpointOptions& options,
                               const CommonOptions& common, nlohmann::ordered_json made_from)
    : run_(std::move(run)), options_(options), common_(common), made_from_(std::move(made_from)) {}

Checkpoint* RunCheckpoints::find() {
  if (!options_.resume) {
    if (options_.checkpoints && has_checkpoint(run_))
      warn(common_, run_.string() +
                        " has a checkpoint of a run that was not finished; --resume would have gone on "
                        "from it, this run starts anew and replaces it");
    return nullptr;
  }
  std::optional<FoundCheckpoint> found = read_checkpoint(run_, made_from_);
  if (!found) {
    warn(common_, run_.string() + " has no checkpoint to go on from: starting anew");
    return nullptr;
  }
  if (!found->warning.empty()) warn(common_, found->warning + "; going on from the checkpoint before it");
  earlier_ = found->warning.empty() ? EarlierCheckpoints::kRotate : EarlierCheckpoints::kKeepPrevious;
  usable_ = true;
  found_ = std::move(found->checkpoint);
  return &*found_;
}

void RunCheckpoints::offer(const CheckpointView& checkpoint) {
  if (!options_.checkpoints) return;
  const double age = std::chrono::duration<double>(Clock::now() - last_).count();
  if (!checkpoint.state.level_done && age < options_.interval_s) return;
  try {
    write_checkpoint(run_, made_from_, checkpoint, earlier_);
    earlier_ = EarlierCheckpoints::kRotate;
    usable_ = true;
  } catch (const IoError& error) {
    warn(common_, std::string(error.what()) + "; going on without this checkpoint");
  }
  last_ = Clock::now();
}

void RunCheckpoints::give_up(const std::string& reason) {
  warn(common_, reason + "; going on without further checkpoints");
  options_.checkpoints = false;
}

void RunCheckpoints::remove() { remove_checkpoints(run_); }

void RunCheckpoints::say_how_to_resume() const {
  if (usable_)
    warn(common_,
         "a checkpoint is kept in " + run_.string() + ": the same command with --resume goes on from it");
}

void sweep_leftovers(const fs::path& run) {
  static const std::regex temporary(R"(\..*\.[0-9]+\.[0-9]+\.tmp(\..*)?)");
  std::error_code ignored;
  for (const char* folder : {".partial", kAsideFolder}) fs::remove_all(run / folder, ignored);
  std::vector<fs::path> left;
  for (fs::recursive_directory_iterator entry(run, ignored), end; !ignored && entry != end;
       entry.increment(ignored))
    if (entry->is_regular_file(ignored) && std::regex_match(entry->path().filename().string(), temporary))
      left.push_back(entry->path());
  for (const fs::path& file : left) fs::remove(file, ignored);
}

std::string hash_folder(const fs::path& folder) {
  if (!fs::is_directory(folder)) return "";
  std::vector<fs::path> files;
  for (const auto& entry : fs::recursive_directory_iterator(folder))
    if (entry.is_regular_file()) files.push_back(entry.path());
  std::sort(files.begin(), files.end());
  ContentHash hash;
  for (const fs::path& file : files)
    hash.update(file.lexically_relative(folder).string()).update(" ").update(hash_file(file));
  return hash.hex();
}

void keep_for_resume(const fs::path& run, const fs::path& results, const nlohmann::ordered_json& figures) {
  replace_folder(results / "sky", run / "checkpoint" / "sky");
  nlohmann::ordered_json kept = figures;
  kept["hash"] = hash_folder(run / "checkpoint" / "sky");
  write_text_atomically(run / "checkpoint" / "sky.json", json_text(kept));
}

nlohmann::ordered_json recall_for_resume(const fs::path& run, const fs::path& results) {
  const fs::path file = run / "checkpoint" / "sky.json";
  std::ifstream in(file);
  nlohmann::ordered_json figures = nlohmann::ordered_json::parse(in, nullptr, false);
  if (!figures.is_object() || !figures.contains("skies") || !figures.contains("again") ||
      figures.value("hash", "") != hash_folder(run / "checkpoint" / "sky"))
    throw_invalid(file.string(), "no skies of the interrupted run, or damaged ones",
                  "those that it kept with its checkpoint");
  replace_folder(run / "checkpoint" / "sky", results / "sky");
  return figures;
}

}  // namespace roxel::cli
