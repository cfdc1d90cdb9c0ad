#pragma once
/// Depth maps of many views to one signed distance: how far each place near a surface is in front of it (> 0)
/// or behind it (< 0), as the views that look there say, weighted by how sure they are [Curless96]
/// (docs/surface.md).

#include <Eigen/Geometry>
#include <functional>
#include <memory>
#include <optional>

#include "roxel/base/error.h"
#include "roxel/base/run_context.h"
#include "roxel/camera/camera.h"
#include "roxel/image/image.h"

namespace roxel {

/// What one view says of depth; one channel each, of the camera's size.
struct FusionView {
  PinholeCamera camera;
  Image depth;         ///< along the optical axis, world units; 0 = none
  Image variance;      ///< of it, world units squared
  Image opacity = {};  ///< of the ray, in [0, 1]; empty: nothing is known where there is no depth
  Image normal = {};   ///< 3 channels, unit, world; zero or empty: taken from the depth around
};

/// The view of that number, from any thread; called twice for every view.
using FusionViewLoader = std::function<FusionView(int view_idx)>;

/// What is read is sound, yet there is no surface in it.
class NoSurface : public InvalidInput {
 public:
  using InvalidInput::InvalidInput;
};

struct FusionOptions {
  double voxel_size = 0;      ///< of the distance's lattice, world units
  Eigen::AlignedBox3d box;    ///< surfaces outside it are left out
  double band = 5;            ///< half the width of the band in which distances count, voxels
  double least_sigma = 0.5;   ///< no depth is taken to be surer than that, voxels
  float free_opacity = 0.1f;  ///< rays without depth and of less opacity than that see nothing in the box
  double smooth = 0.3;        ///< pull of neighbours, see smooth_distance; 0 = none
  double hole_size = 12;  ///< how far apart seen edges may be that distances are carried on between, voxels
  /// InvalidInput where the lattice, the views that vote on it, and what is made from it would take more.
  std::int64_t most_bytes = std::int64_t{8} << 30;
};

/// A distance at the corners of a lattice, in a narrow band around the surfaces that views see.
class DistanceField {
 public:
  struct Voxels;
  static constexpr float kFilled = -1;  ///< views of corners that nobody saw

  explicit DistanceField(std::unique_ptr<Voxels> voxels);
  DistanceField(DistanceField&&) noexcept;
  DistanceField& operator=(DistanceField&&) noexcept;
  ~DistanceField();

  /// What the field holds at one corner of the lattice.
  struct Sample {
    float distance = 0;  ///< world units, within the band
    /// Sum of inverse variances, less where views differ by more than these say, world units to the -2; 0:
    /// nobody saw it.
    float weight = 0;
    int views = 0;  ///< that see a surface within 2.5 steps of it; -1: filled in
  };
  /// At the corner nearest to x; none where the field holds nothing.
  std::optional<Sample> at(const Eigen::Vector3d& x) const;
  std::int64_t sample_count() const;
  std::int64_t bytes() const;
  double voxel_size() const;

  const Voxels& voxels() const { return *voxels_; }

 private:
  std::unique_ptr<Voxels> voxels_;
};

/// Views are loaded a few at a time. The same bit for bit for any number of threads. Throws NoSurface
/// where no view has depth in the box, InvalidInput where more than options.most_bytes would
/// be needed; Cancelled.
DistanceField fuse_depth(int view_count, const FusionViewLoader& load, const FusionOptions& options,
                         RunContext& context);

}  // namespace roxel
