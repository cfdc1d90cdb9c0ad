#pragma once
/// What a large scene costs: time of edits and of a pass, and memory as the system sees it.

#include <cstdint>

namespace roxel {

/// Builds a volume of about so many live voxels as a run does, by dilation and division of a coarser one, and
/// marches once through it; prints a table. What would not fit into the memory that is free is left out and
/// said so.
void large_scene(std::int64_t voxels, int threads);

}  // namespace roxel
