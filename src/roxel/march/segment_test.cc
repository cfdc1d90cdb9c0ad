#include "roxel/march/segment.h"

#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

#include <cmath>
#include <vector>

namespace roxel {
namespace {

// Three multiplications and two additions of numbers up to 1, each rounded to half a unit of 2^-24.
constexpr float kRounding = 8 * 6e-8f;

Segment draw_segment() {
  const auto unit = [] { return *rc::gen::inRange(0, 1 << 16) / 65536.0f; };
  return {unit(), unit()};
}

bool close(const Segment& a, const Segment& b) {
  return std::abs(a.transmittance - b.transmittance) <= kRounding &&
         std::abs(a.likelihood - b.likelihood) <= kRounding * 3;
}

RC_GTEST_PROP(Segment, CompositionIsAssociative, ()) {
  const Segment a = draw_segment(), b = draw_segment(), c = draw_segment();
  RC_ASSERT(close(a.then(b).then(c), a.then(b.then(c))));
}

RC_GTEST_PROP(Segment, NothingIsTheIdentity, ()) {
  const Segment a = draw_segment();
  RC_ASSERT(a.then(Segment()).transmittance == a.transmittance &&
            a.then(Segment()).likelihood == a.likelihood);
  RC_ASSERT(Segment().then(a).transmittance == a.transmittance &&
            Segment().then(a).likelihood == a.likelihood);
}

RC_GTEST_PROP(Segment, AppendIsCompositionWithOneVoxel, ()) {
  Segment a = draw_segment();
  const float opacity = draw_segment().transmittance, likelihood = draw_segment().likelihood;
  const Segment composed = a.then({1 - opacity, opacity * likelihood});
  a.append(opacity, likelihood);
  RC_ASSERT(close(a, composed));
}

TEST(Segment, ThreeVoxelsByHand) {
  Segment segment;
  segment.append(0.5f, 0.8f);
  segment.append(0.25f, 0.4f);
  segment.append(1, 0.2f);
  EXPECT_FLOAT_EQ(segment.likelihood, 0.5f * 0.8f + 0.5f * 0.25f * 0.4f + 0.375f * 0.2f);
  EXPECT_FLOAT_EQ(segment.transmittance, 0);
}

TEST(Segment, DoesNotCommute) {
  const Segment opaque{0, 0.5f}, clear{0.5f, 0.1f};
  EXPECT_NE(opaque.then(clear).likelihood, clear.then(opaque).likelihood);
}

}  // namespace
}  // namespace roxel
