#pragma once
/// What `roxel sky` reads: a data set, or one panorama.

#include <filesystem>
#include <functional>
#include <limits>
#include <string>
#include <utility>
#include <vector>

#include "common.h"
#include "roxel/sky/sky_options.h"
#include "roxel/sky/sky_tasks.h"

namespace roxel::cli {

struct SkyInput {
  std::optional<Input> input;  ///< none for a panorama
  std::string path, format;
  std::vector<SkyTask> tasks;
  std::vector<SkyPictureSource> pictures;  ///< of each task
  /// Of each task's photographs, as large as they are: width and height, and the mask by hand or nothing.
  std::vector<std::vector<std::pair<int, int>>> sizes;
  std::vector<std::function<Mask(int)>> hand_masks;
  std::vector<std::string> notes, warnings;  ///< of what shares a sky; not the reader's own
  double most_bytes =
      std::numeric_limits<double>::infinity();  ///< of memory for photographs looked at at once
};

/// Threads that look at photographs at once.
int sky_workers(const SkyInput& input, int threads);

/// Throws InvalidInput, also for masks by hand that no image has.
SkyInput read_sky_input(const std::string& path, const InputOptions& input, const SkyOptions& options,
                        const Session& session);

}  // namespace roxel::cli
