#pragma once
/// Where numbers that lie without gaps belong in a vector of which only some lanes are wanted.

#include <array>
#include <cstdint>

namespace roxel {

/// For each mask of eight bits, how many bits are set below each bit.
constexpr std::array<std::array<std::uint8_t, 8>, 256> make_lane_ranks() {
  std::array<std::array<std::uint8_t, 8>, 256> ranks{};
  for (int mask = 0; mask < 256; ++mask)
    for (int bit = 0, rank = 0; bit < 8; rank += mask >> bit & 1, ++bit)
      ranks[mask][bit] = static_cast<std::uint8_t>(rank);
  return ranks;
}
inline constexpr auto kLaneRanks = make_lane_ranks();

}  // namespace roxel
