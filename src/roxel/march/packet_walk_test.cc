#include "roxel/march/packet_walk.h"

#include <gtest/gtest.h>

#include <limits>
#include <numeric>

#include "roxel/march/walk_fixture.h"

namespace roxel {
namespace {

using Directions = std::vector<Eigen::Vector3d>;

/// A walk and what it finds.
class Packet {
 public:
  explicit Packet(const LatticeStack& stack) : stack_(stack), walk_(stack) {}

  /// The steps of every ray, one vector a ray.
  std::vector<std::vector<VoxelStep>> walked(const Eigen::Vector3d& origin, const Directions& directions,
                                             Stretch range, const std::vector<std::uint32_t>& bricks) {
    walk_.begin(origin, range, bricks);
    for (std::size_t ray = 0; ray < directions.size(); ++ray)
      walk_.add(static_cast<int>(ray), directions[ray]);
    std::vector<std::vector<VoxelStep>> steps(kMaxPacketRays);
    while (walk_.next(found_))
      for (int i = 0; i < found_.count; ++i)
        steps[found_.ray[i]].push_back(
            {found_.slot[i], found_.length[i], found_.weight[i], std::numeric_limits<float>::quiet_NaN()});
    return steps;
  }

  /// Whether all rays meet what the twin meets, and unused ones nothing.
  ::testing::AssertionResult same_walks(const Eigen::Vector3d& origin, const Directions& directions,
                                        Stretch range, const std::vector<std::uint32_t>& bricks) {
    std::vector<std::vector<VoxelStep>> steps = walked(origin, directions, range, bricks);
    for (std::size_t ray = 0; ray < directions.size(); ++ray) {
      std::erase_if(steps[ray], [](const VoxelStep& step) { return step.length < kSliver; });
      const auto same = same_as_twin(stack_.volume(), {origin, directions[ray]}, range, steps[ray]);
      if (!same) return ::testing::AssertionFailure() << "ray " << ray << ": " << same.message();
    }
    for (std::size_t ray = directions.size(); ray < kMaxPacketRays; ++ray)
      if (!steps[ray].empty()) return ::testing::AssertionFailure() << "steps of unused ray " << ray;
    return ::testing::AssertionSuccess();
  }

  PacketWalk& walk() { return walk_; }
  PacketSteps& found() { return found_; }

 private:
  const LatticeStack& stack_;
  PacketWalk walk_;
  PacketSteps found_;
};

/// All bricks of a volume of one lattice, nearest to `origin` first, face by face.
std::vector<std::uint32_t> all_bricks(const LatticeStack& stack, const Eigen::Vector3d& origin) {
  const LatticeFrame& frame = stack.volume().index(0).frame();
  std::vector<std::uint32_t> bricks(stack.brick_count());
  std::iota(bricks.begin(), bricks.end(), 0u);
  const Eigen::Vector3d at = (origin - frame.origin) / (kBrickSide * frame.voxel_size);
  const auto faces = [&](std::uint32_t number) {
    int sum = 0;
    for (int a = 0; a < 3; ++a)
      sum += std::abs(stack.brick(number).coord[a] - static_cast<int>(std::floor(at[a])));
    return sum;
  };
  std::stable_sort(bricks.begin(), bricks.end(),
                   [&](std::uint32_t a, std::uint32_t b) { return faces(a) < faces(b); });
  return bricks;
}

TEST(PacketWalk, MeetsWhatSortedPlaneCrossingsMeet) {
  std::mt19937 random(1);
  const Volume volume = one_lattice(0.5, {3, 2, 2}, random);
  const LatticeStack stack(volume);
  RandomRays rays(volume.index(0).frame().box(), 2);
  Packet packet(stack);
  for (int i = 0; i < 2000; ++i) {
    const Eigen::Vector3d origin = rays.any().origin;
    Directions directions;
    for (int ray = 0; ray < i % (PacketWalk::rays() + 1); ++ray)
      directions.push_back((rays.point() - origin) * (0.3 + 0.1 * ray));
    ASSERT_TRUE(packet.same_walks(origin, directions, i % 2 ? rays.range() : Stretch{0, 20},
                                  all_bricks(stack, origin)));
  }
}

TEST(PacketWalk, PassesExactlyThroughFacesEdgesAndCorners) {
  std::mt19937 random(5);
  const Volume volume = one_lattice(0.6, {2, 2, 2}, random);
  const LatticeStack stack(volume);
  Packet packet(stack);
  for (int i = 0; i < 4000; ++i) {
    const Ray ray = ray_with_ties(volume.index(0).frame(), i % 3, random);
    Directions directions{ray.direction};
    std::uniform_int_distribution<int> component(-2, 2);
    while (static_cast<int>(directions.size()) < PacketWalk::rays()) {
      const Eigen::Vector3d other(component(random), component(random), component(random));
      if (!other.isZero()) directions.push_back(other);
    }
    ASSERT_TRUE(packet.same_walks(ray.origin, directions, {0, 30}, all_bricks(stack, ray.origin)));
  }
}

TEST(PacketWalk, StoppedRaysGiveNoMoreSteps) {
  std::mt19937 random(8);
  const Volume volume = one_lattice(1, {6, 1, 1}, random);
  const LatticeStack stack(volume);
  const Eigen::Vector3d from = volume.index(0).frame().voxel_centre({0, 3, 3});
  Packet packet(stack);
  const std::vector<std::uint32_t> bricks = all_bricks(stack, from);
  PacketWalk& walk = packet.walk();
  walk.begin(from, {0, 20}, bricks);
  const int last = PacketWalk::rays() - 1;
  for (int ray = 0; ray <= last; ++ray) walk.add(ray, {1, 0.01, 0.02});
  const auto steps_of = [&](int ray) {
    return std::count(packet.found().ray, packet.found().ray + packet.found().count, ray);
  };
  ASSERT_TRUE(walk.next(packet.found()));
  EXPECT_EQ(steps_of(last), 8);
  walk.stop(last);
  EXPECT_EQ(walk.next(packet.found()), last > 0);
  if (last == 0) return;
  EXPECT_EQ(steps_of(last), 0);
  EXPECT_EQ(steps_of(0), 8);
}

// What one round finds of a ray is one brick's: where segments break. Every such brick is listed.
TEST(PacketWalk, ARoundIsOneBrickARay) {
  std::mt19937 random(9);
  const Volume volume = one_lattice(0.5, {3, 3, 3}, random);
  const LatticeStack stack(volume);
  RandomRays rays(volume.index(0).frame().box(), 10);
  const auto brick_of = [&](std::uint32_t slot) {
    std::uint32_t number = 0;
    while (slot >= stack.brick(number).first_slot + stack.brick(number).count()) ++number;
    return number;
  };
  Packet packet(stack);
  int rounds = 0;
  for (int i = 0; i < 200; ++i) {
    const Eigen::Vector3d origin = rays.any().origin;
    const std::vector<std::uint32_t> bricks = all_bricks(stack, origin);
    packet.walk().begin(origin, {0, 20}, bricks);
    for (int ray = 0; ray < PacketWalk::rays(); ++ray) packet.walk().add(ray, rays.point() - origin);
    const PacketSteps& found = packet.found();
    std::vector<std::uint32_t> last(kMaxPacketRays, kNoSlot);
    while (packet.walk().next(packet.found())) {
      ++rounds;
      std::vector<std::uint32_t> here(kMaxPacketRays, kNoSlot);
      for (int s = 0; s < found.count; ++s) {
        const int ray = found.ray[s];
        const std::uint32_t brick = brick_of(found.slot[s]);
        ASSERT_TRUE(here[ray] == kNoSlot || here[ray] == brick);
        ASSERT_NE(last[ray], brick);
        here[ray] = brick;
        ASSERT_NE(std::find(found.bricks, found.bricks + found.brick_count, brick),
                  found.bricks + found.brick_count);
      }
      for (int ray = 0; ray < PacketWalk::rays(); ++ray)
        if (here[ray] != kNoSlot) last[ray] = here[ray];
    }
  }
  EXPECT_GT(rounds, 400);
}

// Rows say whose the steps are; vectors are read whole: what fills the last one up must be harmless.
TEST(PacketWalk, RowsAndPaddingAreAsPromised) {
  std::mt19937 random(11);
  const Volume volume = one_lattice(0.5, {3, 3, 3}, random);
  const LatticeStack stack(volume);
  RandomRays rays(volume.index(0).frame().box(), 12);
  Packet packet(stack);
  for (int i = 0; i < 200; ++i) {
    const Eigen::Vector3d origin = rays.any().origin;
    const std::vector<std::uint32_t> bricks = all_bricks(stack, origin);
    packet.walk().begin(origin, {0, 20}, bricks);
    for (int ray = 0; ray < 1 + i % PacketWalk::rays(); ++ray) packet.walk().add(ray, rays.point() - origin);
    const PacketSteps& found = packet.found();
    while (packet.walk().next(packet.found())) {
      int step = 0;
      for (int row = 0; row < found.rows; ++row) {
        ASSERT_NE(found.rays[row], 0u);
        for (int ray = 0; ray < kMaxPacketRays; ++ray) {
          if ((found.rays[row] >> ray & 1) == 0) continue;
          ASSERT_EQ(found.ray[step++], ray);
        }
      }
      ASSERT_EQ(step, found.count);
      for (int s = 0; s < found.count; ++s) ASSERT_GT(found.length[s], 0);
      for (int s = found.count; found.count > 0 && s < found.count + kMaxPacketRays; ++s) {
        ASSERT_LT(found.slot[s], volume.slot_count());
        ASSERT_EQ(found.length[s], 0);
        ASSERT_EQ(found.weight[s], 0);
        ASSERT_EQ(found.ray[s], 0);
      }
    }
  }
}

}  // namespace
}  // namespace roxel
