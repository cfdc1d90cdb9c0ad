#pragma once
/// Mean and covariance of every square region of a photograph at every level: the tree of samples that
/// adaptive rays divide in [Jethwa04] ch. 5. Region (x, y) of a level covers pixels [x, x+1) x [y, y+1) times
/// 2^level, cut at the image's right and bottom border; its children are (2x, 2y) .. (2x+1, 2y+1) one level
/// finer.

#include <cstddef>
#include <cstdint>
#include <vector>

#include "roxel/image/image.h"

namespace roxel {

/// Statistics of the square region of 2^level x 2^level pixels.
///
/// A pixel's weight is its valid mask; its object weight is that times its foreground mask. Mean and
/// covariance (population, of the weighted pixels) are over object weight where the region has any, else over
/// valid weight: the colour of a region at an object's outline is the object's.
struct RegionStats {
  float mean[3];     ///< in the pyramid's (matching) space
  float cov[6];      ///< xx, yy, zz, xy, xz, yz
  float valid;       ///< share of the nominal area 4^level with usable pixels, 0 to 1; where 0 all else is 0
  float foreground;  ///< share of the valid weight that is object, 0 to 1; 1 without a foreground mask
};

/// Immutable after construction; safe to read from many threads.
///
///     level 0 (where it is stored): mean as floats, masks as bytes, no covariance     12 to 14 bytes a pixel
///     each level above: one RegionStats a region                                      44 bytes / 4^level a
///     pixel
class SamplePyramid {
 public:
  /// `samples` has 3 channels; the masks are empty (all 255) or of its size. Levels finest .. coarsest
  /// (0 <= finest <= coarsest <= 30) are stored; sums run in doubles. Throws std::logic_error otherwise.
  SamplePyramid(const Image& samples, const Mask& valid, const Mask& foreground, int finest_level,
                int coarsest_level);

  int finest_level() const { return finest_level_; }
  int coarsest_level() const { return finest_level_ + static_cast<int>(levels_.size()) - 1; }
  /// Whether it came with a foreground mask: else `foreground` says nothing.
  bool masked() const { return masked_; }
  /// ceil(image width / 2^level), and height; of stored levels only.
  int width(int level) const { return levels_[level - finest_level_].width; }
  int height(int level) const { return levels_[level - finest_level_].height; }

  /// 0 <= x < width(level), 0 <= y < height(level), level stored; not checked.
  RegionStats at(int level, int x, int y) const {
    const Level& stored = levels_[level - finest_level_];
    const std::size_t index = static_cast<std::size_t>(y) * stored.width + x;
    return level > 0 ? stored.regions[index] : pixel(index);
  }

  /// The same region's `valid` alone.
  float valid(int level, int x, int y) const {
    const Level& stored = levels_[level - finest_level_];
    const std::size_t index = static_cast<std::size_t>(y) * stored.width + x;
    return level > 0 ? stored.regions[index].valid : valid_share(index);
  }

  /// Brings regions (x .. x + 7, y) near to the processor; those beyond the image do no harm.
  void prefetch(int level, int x, int y) const {
    const Level& stored = levels_[level - finest_level_];
    const std::size_t index = static_cast<std::size_t>(y) * stored.width + x;
    if (level == 0) return __builtin_prefetch(pixels_.data() + 3 * index);
    const char* from = reinterpret_cast<const char*>(stored.regions.data() + index);
    for (std::size_t byte = 0; byte < 8 * sizeof(RegionStats); byte += 64) __builtin_prefetch(from + byte);
  }

  /// The mean interpolated between the four regions around pixel position (u, v), (0.5, 0.5) being the
  /// top-left pixel's centre. Regions count by their valid share, and by their foreground too where the
  /// region that (u, v) is in has any; beyond the border the outermost regions go on. False, and mean = 0,
  /// where none is valid.
  bool bilinear(int level, double u, double v, float mean[3]) const;

  /// Memory held, in bytes.
  std::size_t bytes() const;

 private:
  struct Level {
    int width;
    int height;
    std::vector<RegionStats> regions;  // empty for level 0
  };
  struct Builder;

  static constexpr float kByte = 1.0f / 255.0f;
  float valid_share(std::size_t index) const { return valid_.empty() ? 1.0f : valid_[index] * kByte; }
  RegionStats pixel(std::size_t index) const {
    const float* mean = pixels_.data() + 3 * index;
    return {{mean[0], mean[1], mean[2]},
            {0, 0, 0, 0, 0, 0},
            valid_share(index),
            foreground_.empty() ? 1.0f : foreground_[index] * kByte};
  }

  int finest_level_;
  bool masked_;
  std::vector<Level> levels_;             // levels_[i] is level finest_level_ + i
  std::vector<float> pixels_;             // level 0
  std::vector<std::uint8_t> valid_;       // level 0; empty = all 255
  std::vector<std::uint8_t> foreground_;  // level 0; empty = all 255
};

}  // namespace roxel
