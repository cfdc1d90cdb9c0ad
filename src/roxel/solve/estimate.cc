#include "roxel/solve/estimate.h"

#include <algorithm>
#include <cmath>

#include "roxel/dataset/box_visibility.h"
#include "roxel/march/sample_plan.h"

namespace roxel {
namespace {

// Bytes a voxel: channels of the volume; totals of a pass; and a worker's scratch.
constexpr double kChannelBytes = 4 + 4 + 4 + 12 + 24 + 8;
constexpr double kTotalsBytes = 80 + 24;
constexpr double kScratchBytes = 64;

}  // namespace

CostEstimate estimate_cost(const Dataset& dataset, const Scene& scene, const ReconstructOptions& options,
                           int threads) {
  CostEstimate cost;
  (void)dataset, (void)scene, (void)options, (void)threads;
  cost.memory_bytes = kChannelBytes + kTotalsBytes + kScratchBytes;
  return cost;
}

}  // namespace roxel
