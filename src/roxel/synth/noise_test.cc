#include "roxel/synth/noise.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

namespace roxel {
namespace {

using Eigen::Vector3f;

TEST(Noise, LatticeRandomIsUniform) {
  double sum = 0, squares = 0;
  const int n = 20;
  for (int i = 0; i < n * n * n; ++i) {
    const float value = lattice_random(i % n - 10, i / n % n - 10, i / n / n - 10, 3);
    ASSERT_GE(value, 0);
    ASSERT_LT(value, 1);
    sum += value;
    squares += value * value;
  }
  // 8000 draws: standard errors 0.0032 (mean) and 0.0033 (mean square); five of them.
  EXPECT_NEAR(sum / 8000, 0.5, 0.016);
  EXPECT_NEAR(squares / 8000, 1 / 3.0, 0.017);
}

TEST(Noise, StaysInItsRangeAndDependsOnTheSeed) {
  float low = 1, high = -1;
  int differing = 0;
  for (int i = 0; i < 20000; ++i) {
    const Vector3f p(0.137f * i - 900, 0.071f * i, -0.113f * i);
    const float value = fractal_noise(p, 4, 1);
    low = std::min(low, value);
    high = std::max(high, value);
    differing += std::abs(value - fractal_noise(p, 4, 2)) > 1e-3f;
  }
  EXPECT_GE(low, -1);
  EXPECT_LE(high, 1);
  EXPECT_LT(low, -0.4f);
  EXPECT_GT(high, 0.4f);
  EXPECT_GT(differing, 19000);
}

TEST(Noise, IsContinuousAcrossCellsAndNegativeCoordinates) {
  for (float edge : {-2.0f, -1.0f, 0.0f, 1.0f, 5.0f})
    for (int axis = 0; axis < 3; ++axis) {
      Vector3f p(0.3f, -0.6f, 0.8f);
      p[axis] = edge - 1e-4f;
      Vector3f q = p;
      q[axis] = edge + 1e-4f;
      EXPECT_NEAR(value_noise(p, 9), value_noise(q, 9), 1e-3);
    }
}

}  // namespace
}  // namespace roxel
