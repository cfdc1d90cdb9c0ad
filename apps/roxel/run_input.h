#pragma once
/// The photographs of a finished run, read as the run has read them.

#include "common.h"
#include "roxel/report/run_record.h"

namespace roxel::cli {

/// Input options as the run used them.
InputOptions input_options_of(const FinishedRun& run);

/// The run's photographs, from `dataset` or else from where the run has read them. Throws InvalidInput where
/// they are not there.
Input read_input_of(const FinishedRun& run, const std::optional<std::string>& dataset,
                    const Session& session);

/// Memory that a command which goes on from a run may hold.
struct MemoryOptions {
  std::optional<double> memory;  ///< GiB; none: what the machine has at hand
};

const OptionTable<MemoryOptions>& memory_option_table();

/// Bytes that may still be taken: of `memory` GiB for the process, or of what the machine has at hand.
std::int64_t bytes_left(const std::optional<double>& memory);

/// The bounds of the summary, or the box of the lattice where it has none. Throws InvalidInput where they are
/// damaged.
Eigen::AlignedBox3d box_of(const FinishedRun& run);

}  // namespace roxel::cli
