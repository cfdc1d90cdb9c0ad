#pragma once
/// Lazily created voxels: only cells that some ray reaches come into being ([Jethwa04] section 5.2.1).

#include "roxel/base/run_context.h"
#include "roxel/infer/sample_view.h"

namespace roxel {

/// The topologies of the frames with every cell that a sample with usable object pixels crosses. Samples that
/// masks call background create nothing. Result independent of the number of threads.
std::vector<Topology> reached_voxels(const std::vector<LatticeFrame>& frames,
                                     const std::vector<SampleNode>& nodes, const RunContext& context);

}  // namespace roxel
