#include <openvdb/tools/Morphology.h>
#include <openvdb/tree/LeafManager.h>

#include <algorithm>
#include <cmath>

#include "roxel/base/error.h"
#include "roxel/base/formatted.h"
#include "roxel/base/parallel.h"
#include "roxel/surface/distance_voxels.inl"

namespace roxel {
namespace {

using openvdb::Coord;
using openvdb::FloatTree;
using Leaf = FloatTree::LeafNodeType;
using Manager = openvdb::tree::LeafManager<FloatTree>;

constexpr std::int64_t kFillGrain = 4096;
constexpr float kRim = 1.5f;  ///< surfaces end within so many steps of a corner that nobody knows
constexpr int kSmoothRounds = 6;
const std::array<Coord, 6> kNeighbours{Coord(1, 0, 0),  Coord(-1, 0, 0), Coord(0, 1, 0),
                                       Coord(0, -1, 0), Coord(0, 0, 1),  Coord(0, 0, -1)};

constexpr std::int64_t kBytesOfLeaf = Leaf::SIZE * sizeof(float) + 128;
constexpr std::int64_t kBytesOfUnknown = 60;  ///< in Unknowns, and in the values before and after a round

/// Corners whose distance is to be found, each with its neighbours: those of the list by number, others by
/// value.
struct Unknowns {
  std::vector<Coord> places;
  std::vector<std::array<std::int32_t, 6>> neighbours;  ///< -1: not one of them
  std::vector<float> given_sum;                         ///< of neighbours whose distance is given
  std::vector<std::uint8_t> given_count;
};

/// Every active corner for which is_unknown(weight); `is_given(weight)` says whose distances count.
template <class IsUnknown, class IsGiven>
Unknowns find_unknowns(const DistanceField::Voxels& voxels, const IsUnknown& is_unknown,
                       const IsGiven& is_given, int threads) {
  Unknowns out;
  const openvdb::Int32Tree::Ptr made = make_tree<openvdb::Int32Grid>(-1);
  openvdb::Int32Tree& number = *made;
  openvdb::tree::ValueAccessor<openvdb::Int32Tree> numbers(number);
  for (auto leaf = voxels.weight->cbeginLeaf(); leaf; ++leaf)
    for (auto it = leaf->cbeginValueOn(); it; ++it)
      if (is_unknown(it.getValue())) {
        numbers.setValueOn(it.getCoord(), static_cast<std::int32_t>(out.places.size()));
        out.places.push_back(it.getCoord());
      }
  out.neighbours.resize(out.places.size());
  out.given_sum.resize(out.places.size());
  out.given_count.resize(out.places.size());
  parallel_for_blocks(
      std::ssize(out.places), kFillGrain, threads, [&](std::int64_t begin, std::int64_t end, int) {
        const openvdb::tree::ValueAccessor<const openvdb::Int32Tree> own(number);
        const openvdb::tree::ValueAccessor<const FloatTree> weight(*voxels.weight),
            distance(*voxels.distance);
        for (std::int64_t i = begin; i < end; ++i)
          for (int k = 0; k < 6; ++k) {
            const Coord at = out.places[i] + kNeighbours[k];
            out.neighbours[i][k] = weight.isValueOn(at) ? own.getValue(at) : -1;
            if (out.neighbours[i][k] >= 0 || !weight.isValueOn(at) || !is_given(weight.getValue(at)))
              continue;
            out.given_sum[i] += distance.getValue(at);
            ++out.given_count[i];
          }
      });
  return out;
}

/// Adds the surroundings of places where seen surface ends. Throws InvalidInput where what is to be filled
/// then would take more than `most_bytes`.
void grow_at_rims(DistanceField::Voxels& voxels, int reach, std::int64_t most_bytes) {
  const openvdb::MaskTree::Ptr made = make_tree<openvdb::MaskGrid>();
  openvdb::MaskTree& rims = *made;
  openvdb::tree::ValueAccessor<openvdb::MaskTree> mark(rims);
  const openvdb::tree::ValueAccessor<const FloatTree> weights(*voxels.weight), distances(*voxels.distance);
  const float near = kRim * static_cast<float>(voxels.voxel_size);
  for (auto leaf = voxels.weight->cbeginLeaf(); leaf; ++leaf)
    for (auto it = leaf->cbeginValueOn(); it; ++it) {
      if (!(it.getValue() > 0) || std::abs(distances.getValue(it.getCoord())) > near) continue;
      for (const Coord& step : kNeighbours)
        if (!(weights.getValue(it.getCoord() + step) > 0)) {
          mark.setValueOn(it.getCoord());
          break;
        }
    }
  openvdb::tools::dilateActiveValues(rims, reach, openvdb::tools::NN_FACE_EDGE, openvdb::tools::IGNORE_TILES);
  rims.topologyUnion(*voxels.weight);
  check_lattice_bytes(lattice_bytes(static_cast<std::int64_t>(rims.leafCount()),
                                    static_cast<std::int64_t>(rims.activeVoxelCount())),
                      most_bytes, voxels.voxel_size);
  for (const auto& tree : {voxels.distance, voxels.weight, voxels.views}) tree->topologyUnion(rims);
}

}  // namespace

std::int64_t lattice_bytes(std::int64_t leaves, std::int64_t corners) {
  // The three trees of the field and the one that numbers unknowns; then lists of all unknowns.
  return leaves * 4 * kBytesOfLeaf + corners * kBytesOfUnknown;
}

void check_lattice_bytes(std::int64_t bytes, std::int64_t most, double voxel_size) {
  if (bytes <= most) return;
  throw InvalidInput(formatted(
      "the surface's lattice of voxels of %g and what it is made of would take %lld MiB: found %lld MiB for "
      "it, expected more memory, larger voxels, or less to fuse",
      voxel_size, static_cast<long long>(bytes >> 20), static_cast<long long>(most >> 20)));
}

void smooth_distance(DistanceField::Voxels& voxels, double strength, int threads) {
  if (!(strength > 0)) return;
  const auto seen = [](float weight) { return weight > 0; };
  const auto never = [](float) { return false; };
  const Unknowns all = find_unknowns(voxels, seen, never, threads);
  std::vector<float> measured(all.places.size()), now, next(all.places.size()), certainty(all.places.size());
  const openvdb::tree::ValueAccessor<const FloatTree> weights(*voxels.weight), distances(*voxels.distance);
  for (std::size_t i = 0; i < measured.size(); ++i) {
    measured[i] = distances.getValue(all.places[i]);
    certainty[i] =
        static_cast<float>(weights.getValue(all.places[i]) * voxels.voxel_size * voxels.voxel_size);
  }
  now = measured;
  for (int round = 0; round < kSmoothRounds; ++round) {
    parallel_for_blocks(std::ssize(now), kFillGrain, threads, [&](std::int64_t begin, std::int64_t end, int) {
      for (std::int64_t i = begin; i < end; ++i) {
        float sum = certainty[i] * measured[i], weight = certainty[i];
        for (int axis = 0; axis < 3; ++axis) {
          const std::int32_t next_to = all.neighbours[i][2 * axis], last = all.neighbours[i][2 * axis + 1];
          if (next_to < 0 || last < 0) continue;  // one alone would bend what is straight
          sum += static_cast<float>(strength) * (now[next_to] + now[last]);
          weight += 2 * static_cast<float>(strength);
        }
        next[i] = sum / weight;
      }
    });
    now.swap(next);
  }
  openvdb::tree::ValueAccessor<FloatTree> target(*voxels.distance);
  for (std::size_t i = 0; i < now.size(); ++i) target.setValueOnly(all.places[i], now[i]);
}

void fill_unseen(DistanceField::Voxels& voxels, double hole_size, std::int64_t most_bytes, int threads) {
  if (!(hole_size > 0)) return;
  grow_at_rims(voxels, static_cast<int>(std::ceil(hole_size / 2)) + 1, most_bytes);
  const Unknowns unseen = find_unknowns(
      voxels, [](float weight) { return !(weight > 0); }, [](float weight) { return weight > 0; }, threads);
  std::vector<float> now(unseen.places.size()), next(now.size());
  std::vector<std::uint8_t> known(now.size()), next_known(now.size());
  const int rounds = static_cast<int>(std::ceil(2 * hole_size)) + 4;
  for (int round = 0; round < rounds; ++round) {
    parallel_for_blocks(std::ssize(now), kFillGrain, threads, [&](std::int64_t begin, std::int64_t end, int) {
      for (std::int64_t i = begin; i < end; ++i) {
        float sum = unseen.given_sum[i];
        int count = unseen.given_count[i];
        for (const std::int32_t n : unseen.neighbours[i])
          if (n >= 0 && known[n]) sum += now[n], ++count;
        next_known[i] = count > 0;
        next[i] = count > 0 ? sum / static_cast<float>(count) : 0.0f;
      }
    });
    now.swap(next);
    known.swap(next_known);
  }
  openvdb::tree::ValueAccessor<FloatTree> distance(*voxels.distance), views(*voxels.views);
  for (std::size_t i = 0; i < now.size(); ++i)
    if (known[i]) {
      distance.setValueOnly(unseen.places[i], now[i]);
      views.setValueOnly(unseen.places[i], DistanceField::kFilled);
    }
}

}  // namespace roxel
