#include "roxel/depth/depth_layers.h"

#include <gtest/gtest.h>

#include <limits>
#include <vector>

namespace roxel {
namespace {

TEST(SureDepth, IsWhatHasASmallEnoughDeviation) {
  const float nan = std::numeric_limits<float>::quiet_NaN();
  Image depth(5, 1, 1), variance(5, 1, 1);
  depth.data() = {1, 2, 3, 4, 0};
  variance.data() = {0, 4, 4.1f, nan, 0};
  EXPECT_EQ(sure_depth({depth, variance}, 2).data(), (std::vector<float>{1, 2, 0, 0, 0}));
}

}  // namespace
}  // namespace roxel
