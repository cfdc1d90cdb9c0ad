#pragma once
/// When a run writes checkpoints, and what it goes on from (docs/checkpoints.md).

#include <chrono>
#include <filesystem>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>

#include "common.h"
#include "roxel/io/checkpoint_file.h"
#include "roxel/solve/checkpoint.h"

namespace roxel::cli {

struct CheckpointOptions {
  bool resume = false;
  bool checkpoints = true;
  double interval_s = 120;
};

const OptionTable<CheckpointOptions>& checkpoint_option_table();

/// The checkpoints of one run.
class RunCheckpoints {
 public:
  /// `made_from` is what a resumed run must have in common with this one.
  RunCheckpoints(std::filesystem::path run, const CheckpointOptions& options, const CommonOptions& common,
                 nlohmann::ordered_json made_from);

  /// What to go on from: nothing without --resume, and where there is none. Throws InvalidInput where what is
  /// there is damaged or of other options.
  Checkpoint* find();
  /// Writes it when a level has ended, or when the last one is older than the interval. A disc that takes no
  /// more is no reason to end a run: it is said, and the checkpoint before stays.
  void offer(const CheckpointView& checkpoint);
  /// The run is finished: they are of no more use.
  void remove();
  /// No more of them in this run: said, with the reason.
  void give_up(const std::string& reason);
  /// For a run that ends early: says how to go on, where this one left or found a checkpoint.
  void say_how_to_resume() const;

 private:
  using Clock = std::chrono::steady_clock;

  std::filesystem::path run_;
  CheckpointOptions options_;
  const CommonOptions& common_;
  nlohmann::ordered_json made_from_;
  std::optional<Checkpoint> found_;
  EarlierCheckpoints earlier_ = EarlierCheckpoints::kReplace;  ///< what a first checkpoint makes of them
  bool usable_ = false;                                        ///< there is one of this run
  Clock::time_point last_ = Clock::now();
};

/// Removes what a run that was killed left half-written below `run`: temporary files and unpublished results.
void sweep_leftovers(const std::filesystem::path& run);

/// A hash of the files in a folder, by name; empty where there is none. Throws IoError.
std::string hash_folder(const std::filesystem::path& folder);

/// Keeps the skies in `results` beside the checkpoints of `run`, with `figures` on them: they were found with
/// a volume that a resumed run no longer has. Throws IoError.
void keep_for_resume(const std::filesystem::path& run, const std::filesystem::path& results,
                     const nlohmann::ordered_json& figures);

/// Puts them back into `results`, and returns the figures. Throws InvalidInput where they are missing.
nlohmann::ordered_json recall_for_resume(const std::filesystem::path& run,
                                         const std::filesystem::path& results);

}  // namespace roxel::cli
