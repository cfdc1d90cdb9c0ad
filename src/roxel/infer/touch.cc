#include "roxel/infer/touch.h"

#include <atomic>
#include <memory>

#include "roxel/base/parallel.h"

namespace roxel {

namespace {

constexpr int kWords = kBrickVoxels / 64;

/// A brick's mask that many threads may set bits of.
struct AtomicBrickMask {
  std::atomic<std::uint64_t> words[kWords] = {};
};

/// Bricks of one frame, made when first touched.
class ReachedBricks {
 public:
  explicit ReachedBricks(const LatticeFrame& frame) : frame_(frame), bricks_(frame.size_in_bricks.prod()) {}
  ~ReachedBricks() {
    for (auto& brick : bricks_) delete brick.load();
  }

  AtomicBrickMask* brick(int x, int y, int z) {
    std::atomic<AtomicBrickMask*>& entry = bricks_[index(x, y, z)];
    AtomicBrickMask* mask = entry.load(std::memory_order_acquire);
    if (mask) return mask;
    auto fresh = std::make_unique<AtomicBrickMask>();
    if (entry.compare_exchange_strong(mask, fresh.get(), std::memory_order_acq_rel)) return fresh.release();
    return mask;
  }

  Topology topology() const {
    Topology result(frame_);
    for (int z = 0; z < frame_.size_in_bricks.z(); ++z)
      for (int y = 0; y < frame_.size_in_bricks.y(); ++y)
        for (int x = 0; x < frame_.size_in_bricks.x(); ++x)
          if (const AtomicBrickMask* reached = bricks_[index(x, y, z)].load())
            result.insert_brick({x, y, z}, bits(*reached));
    return result;
  }

 private:
  std::size_t index(int x, int y, int z) const {
    return x + static_cast<std::size_t>(frame_.size_in_bricks.x()) *
                   (y + static_cast<std::size_t>(frame_.size_in_bricks.y()) * z);
  }
  static BrickMask bits(const AtomicBrickMask& reached) {
    BrickMask mask;
    for (int w = kWords - 1; w >= 0; --w) mask = (mask << 64) | BrickMask(reached.words[w].load());
    return mask;
  }

  LatticeFrame frame_;
  std::vector<std::atomic<AtomicBrickMask*>> bricks_;
};

class Toucher {
 public:
  Toucher(const std::vector<Eigen::AlignedBox3d>& boxes, const std::vector<LatticeFrame>& frames,
          std::vector<std::unique_ptr<ReachedBricks>>& reached)
      : boxes_(boxes), frames_(frames), reached_(reached) {}

  void touch(const SampleView& view, const Region& region, double begin) {
    const RegionStats sample = view.pyramid->at(region.level, region.x, region.y);
    if (sample.valid <= 0 || sample.foreground <= 0) return;
    const Stretch range = served_range(view, region, begin);
    if (range.end > range.begin) touch_along(region_ray(view, region), range);
    if (range.end >= view.plan.range.end || region.level == view.plan.finest_level) return;
    for (int c = 0; c < 4; ++c)
      if (const Region child = region.child(c); inside(view, child))
        touch(view, child, std::max(range.begin, range.end));
  }

 private:
  void touch_along(const Ray& ray, const Stretch& range) {
    walk_lattices(boxes_, ray, range, nullptr, [&](int lattice, Stretch stretch) {
      AtomicBrickMask* brick = nullptr;
      const auto enter = [&](int x, int y, int z) {
        brick = reached_[lattice]->brick(x, y, z);
        return AtBrick::kVisit;
      };
      const auto visit = [&](CellCode cell, std::int64_t, std::int64_t) {
        const int voxel = cell_in_brick(cell);
        std::atomic<std::uint64_t>& word = brick->words[voxel / 64];
        const std::uint64_t bit = std::uint64_t{1} << (voxel % 64);
        if (!(word.load(std::memory_order_relaxed) & bit)) word.fetch_or(bit, std::memory_order_relaxed);
        return true;
      };
      return walk_cells(frames_[lattice], ray, stretch, enter, visit);
    });
  }

  const std::vector<Eigen::AlignedBox3d>& boxes_;
  const std::vector<LatticeFrame>& frames_;
  std::vector<std::unique_ptr<ReachedBricks>>& reached_;
};

}  // namespace

std::vector<Topology> reached_voxels(const std::vector<LatticeFrame>& frames,
                                     const std::vector<SampleNode>& nodes, const RunContext& context) {
  std::vector<Eigen::AlignedBox3d> boxes;
  std::vector<std::unique_ptr<ReachedBricks>> reached;
  for (const LatticeFrame& frame : frames) {
    boxes.push_back(frame.box());
    reached.push_back(std::make_unique<ReachedBricks>(frame));
  }
  std::vector<const SampleView*> views;
  for (const SampleNode& node : nodes)
    for (const SampleView& view : node) views.push_back(&view);
  Toucher toucher(boxes, frames, reached);
  parallel_for(views.size(), context.thread_count(), [&](std::int64_t v, int) {
    const SampleView view = resident(*views[v]);
    const int level = view.plan.root_level;
    for (int y = 0; y < view.pyramid->height(level); ++y) {
      context.throw_if_cancelled();
      for (int x = 0; x < view.pyramid->width(level); ++x)
        toucher.touch(view, {level, x, y}, view.plan.range.begin);
    }
  });
  std::vector<Topology> topologies;
  for (std::size_t k = 0; k < frames.size(); ++k) {
    topologies.push_back(reached[k]->topology());
    if (k > 0) topologies.back().erase_inside(boxes[k - 1]);
  }
  return topologies;
}

}  // namespace roxel
