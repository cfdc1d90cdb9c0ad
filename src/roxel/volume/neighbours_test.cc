#include "roxel/volume/neighbours.h"

#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

namespace roxel {
namespace {

// The plain twin: one look-up a voxel.
RC_GTEST_PROP(GatherBlock, EqualsOneLookUpAVoxel, ()) {
  const LatticeFrame frame{Eigen::Vector3d::Zero(), 1.0, Eigen::Vector3i(3, 3, 3)};
  Topology topology(frame);
  const Eigen::Vector3i n = frame.size_in_voxels();
  for (int c : *rc::gen::container<std::vector<int>>(2000, rc::gen::inRange(0, n.prod())))
    topology.insert({c % n.x(), c / n.x() % n.y(), c / n.x() / n.y()});
  const std::uint32_t first = 7;
  const BrickIndex index(topology, first);
  std::vector<float> channel(first + index.slot_count());
  for (std::size_t s = 0; s < channel.size(); ++s) channel[s] = static_cast<float>(s);
  for (std::size_t b = 0; b < index.bricks().size(); ++b) {
    float block[kBlockVoxels];
    gather_block(index, channel.data(), static_cast<int>(b), -1.0f, block);
    for (int k = -1; k <= 8; ++k)
      for (int j = -1; j <= 8; ++j)
        for (int i = -1; i <= 8; ++i) {
          const std::uint32_t slot = index.slot(8 * index.bricks()[b].coord + Eigen::Vector3i(i, j, k));
          RC_ASSERT(block[voxel_in_block(i, j, k)] == (slot == kNoSlot ? -1.0f : channel[slot]));
        }
  }
}

}  // namespace
}  // namespace roxel
