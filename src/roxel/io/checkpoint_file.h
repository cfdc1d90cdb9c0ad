#pragma once
/// A running reconstruction on disc: RUN/checkpoint/latest.roxel, and previous.roxel, the one before it,
/// which stands in where the latest is damaged (docs/checkpoints.md has the layout).

#include <filesystem>
#include <nlohmann/json_fwd.hpp>
#include <optional>
#include <string>

#include "roxel/solve/checkpoint.h"

namespace roxel {

/// What becomes of the latest checkpoint when another is written: of this run and whole, it is kept as the
/// previous one; damaged, it makes room, and the previous one stays; of another run, both make room.
enum class EarlierCheckpoints { kRotate, kKeepPrevious, kReplace };

/// Writes RUN/checkpoint/latest.roxel. `made_from` is what the results
/// depend on, a JSON object: reading asks for the same. The file is on the disc, not only in its cache,
/// before it gets its name. Throws IoError, and then leaves both files as they were.
void write_checkpoint(const std::filesystem::path& run, const nlohmann::ordered_json& made_from,
                      const CheckpointView& checkpoint,
                      EarlierCheckpoints earlier = EarlierCheckpoints::kRotate);

struct FoundCheckpoint {
  Checkpoint checkpoint;
  std::string warning;  ///< why the latest was not taken; else empty
};

/// The latest checkpoint of a run, or the one before where that is damaged; none where there is no file.
/// Throws InvalidInput where all that is there is damaged, and where `made_from` differs: the message names
/// the first field that does, and both values.
std::optional<FoundCheckpoint> read_checkpoint(const std::filesystem::path& run,
                                               const nlohmann::ordered_json& made_from);

/// Whether a run has checkpoints, damaged or not.
bool has_checkpoint(const std::filesystem::path& run);

/// Removes RUN/checkpoint and what is in it.
void remove_checkpoints(const std::filesystem::path& run);

}  // namespace roxel
