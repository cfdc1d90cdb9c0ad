#pragma once
/// The depth stage on the files of a run: RUN/depth/NAME.exr in, the same with more layers out.

#include <filesystem>
#include <nlohmann/json_fwd.hpp>

#include "roxel/depth/depth_stage.h"
#include "roxel/report/html_report.h"
#include "roxel/solve/summary.h"

namespace roxel::cli {

/// In "stages" of summary.json.
inline constexpr const char* kPropagationStage = "belief propagation";
inline constexpr const char* kRefinementStage = "refine depth";

/// In a run: what the stage puts aside while it works; goes in the end.
inline constexpr const char* kAsideFolder = ".aside";

/// Where the stage reads and writes.
struct DepthFolders {
  std::filesystem::path results;  ///< written to; depth maps in it are read first
  std::filesystem::path earlier;  ///< read from where `results` has none; may be the same
};

struct DepthWork {
  DepthFolders folders;
  std::optional<double> memory;  ///< GiB that the process may hold; none: what the machine has at hand
};

/// Adds the layers to every view's depth map, and shows the best of them in depth/NAME.png. Throws
/// InvalidInput for missing or broken depth maps.
DepthStageFigures refine_depth_files(const Dataset& dataset, const PhotographLoader& load,
                                     const DepthScene& scene, const DepthWork& work,
                                     const DepthStageOptions& options, RunContext& context,
                                     double progress_begin, double progress_end);

nlohmann::ordered_json to_json(const DepthStageFigures& figures);

/// Adds to a page's view what its file says of the refined depth, if anything.
void add_refined_pictures(const DepthLayers& layers, double voxel_size, ReportView& view);

/// The stages that it was, with their times.
std::vector<StageRecord> stage_records(const DepthStageFigures& figures);

/// For a person, a line each.
std::string brief(const DepthStageFigures& figures);

}  // namespace roxel::cli
