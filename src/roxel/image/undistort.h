#pragma once
/// Undoes a lens: resamples an image file's pixels to what a pinhole at the same place would have seen.

#include <cstdint>
#include <vector>

#include "roxel/camera/lens.h"
#include "roxel/image/image.h"

namespace roxel {

/// The pinhole to undistort to: image size, principal point, skew and focal lengths of the file, so that the
/// middle of the image keeps its place and scale, and a point calibrated there its pixel. A wide lens loses
/// what it saw past the new image's edges. Only where those focal lengths would need a half field of view
/// of more than 85 degrees in a corner are they enlarged, by one factor.
PinholeCamera undistorted_camera(const Lens& lens, const Pose& pose);

/// Where every pixel of the pinhole's image comes from in the file's image. Make it once, apply it to the
/// photograph and to its masks. Immutable, so safe to share between threads.
class UndistortMap {
 public:
  UndistortMap(const Lens& lens, const Intrinsics& pinhole);

  /// True where nothing moves: no distortion and equal intrinsics. Then apply returns copies, bit for bit.
  bool identity() const { return sources_.empty(); }

  /// Bilinear; for photographs in linear light. Pixels from outside the source are 0. Throws when
  /// source is not of the lens's size.
  Image apply(const Image& source) const;
  /// Bilinear, rounded to the nearest; 0 outside the source.
  Mask apply(const Mask& source) const;

  /// 255 where a pixel comes from inside the source, within the lens's valid radius, and from source pixels
  /// that are all valid (255) in source_valid, if that is not empty; else 0. Empty where all would be 255.
  Mask valid(const Mask& source_valid = {}) const;

 private:
  struct Position {
    float x, y;  ///< pixel position in the source, (0.5, 0.5) is the top-left pixel's centre; NaN = none
  };
  Intrinsics lens_;
  Intrinsics pinhole_;
  std::vector<Position> sources_;  ///< pinhole's width x height, row-major; empty for the identity
};

/// UndistortMap in one call; `valid` is set to map.valid().
Image undistort(const Image& source, const Lens& lens, const Intrinsics& pinhole, Mask& valid);
Mask undistort(const Mask& source, const Lens& lens, const Intrinsics& pinhole);

}  // namespace roxel
