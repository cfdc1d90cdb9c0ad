#pragma once
/// What `roxel reconstruct` is told.

#include <array>
#include <optional>
#include <string>

#include "common.h"
#include "mesh_stage.h"
#include "roxel/depth/depth_stage.h"
#include "roxel/solve/options.h"
#include "run_checkpoints.h"

namespace roxel::cli {

enum class Export { kNone, kColmap };

struct StageSwitches {
  std::optional<std::string> init;
  std::optional<std::string> sky;
  std::optional<std::array<double, 2>> sun;
  std::optional<std::string> sky_masks;
  bool sky_again = true;
  bool dry_run = false;
  bool depth = true;
  bool render = true;
  bool mesh = true;
  bool report = true;
  bool save_surround = false;
  Export exported = Export::kNone;
};

struct RunOptions {
  ReconstructOptions reconstruct;
  DepthStageOptions depth;
  MeshOptions mesh;
  InputOptions input;
  StageSwitches stages;
  CheckpointOptions checkpoints;
  CommonOptions common;
};

/// Group "Run".
const OptionTable<StageSwitches>& stage_table();

/// All of them.
const OptionTable<RunOptions>& run_table();

}  // namespace roxel::cli
