#pragma once
/// A finished run's volume as any camera sees it.

#include <array>
#include <optional>
#include <vector>

#include "roxel/dataset/dataset.h"
#include "roxel/march/render.h"
#include "roxel/report/run_record.h"

namespace roxel::cli {

struct RunRendererOptions {
  std::optional<std::array<double, 3>>
      background_color;  ///< linear; none: the run's own where known, else black
  bool surround = true;  ///< voxels around the box are seen, where the run has them
};

class RunRenderer {
 public:
  /// `run` must outlive it.
  RunRenderer(const FinishedRun& run, const RunRendererOptions& options);
  /// Linear RGB in the volume's unit: 1 = the run's exposure.
  Rendering operator()(const View& view, const RunContext& context) const;

 private:
  LatticeStack stack_;
  std::vector<std::array<float, 3>> colors_;
  RenderOptions options_;
};

}  // namespace roxel::cli
