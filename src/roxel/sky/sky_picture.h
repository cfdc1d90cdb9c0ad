#pragma once
/// A picture with the sky in it, and where its pixels look. The sky's frame: X east, Y north, Z up, where the
/// data set says so; else Z up alone is known.

#include <Eigen/Core>
#include <limits>
#include <optional>
#include <variant>

#include "roxel/camera/camera.h"
#include "roxel/image/image.h"

namespace roxel {

/// A panorama of all directions: row 0 is the zenith, the centre column north (+Y), to the right is east
/// (+X); azimuth = (u / width - 1/2) 360 degrees, elevation = (1/2 - v / height) 180 degrees.
struct Equirectangular {
  int width = 0;
  int height = 0;

  Eigen::Vector3d direction(double u, double v) const;  ///< unit
  Eigen::Vector2d position(const Eigen::Vector3d& direction) const;
};

/// Columns x0 to x1 - 1 of rows y0 to y1 - 1. Columns beyond the edges of a panorama are those of its other
/// edge: take them modulo its width.
struct PixelRange {
  int x0 = 0, y0 = 0, x1 = 0, y1 = 0;
};

/// Directions of a picture's pixels.
class PixelRays {
 public:
  explicit PixelRays(const Equirectangular& panorama);
  /// `sky_from_world` is a rotation.
  PixelRays(const PinholeCamera& camera, const Eigen::Matrix3d& sky_from_world);

  int width() const { return width_; }
  int height() const { return height_; }
  /// Unit, in the sky's frame; (0.5, 0.5) is the top-left pixel's centre.
  Eigen::Vector3d direction(double u, double v) const;
  /// Where a direction is seen; none behind the camera. May lie outside the picture.
  std::optional<Eigen::Vector2d> position(const Eigen::Vector3d& direction) const;
  /// Steradians of pixel (x, y): exact, but for pinhole cameras with skew, where it is that of the centre
  /// times the area.
  double solid_angle(int x, int y) const;
  /// Holds all pixels whose centres look within `angle_rad` (below a quarter turn) of a direction, and
  /// others.
  PixelRange around(const Eigen::Vector3d& direction, double angle_rad) const;
  /// Edge of a pixel in the middle of the picture, radians.
  double pixel_angle() const;

 private:
  std::variant<Equirectangular, PinholeCamera> camera_;
  Eigen::Matrix3d sky_from_camera_ = Eigen::Matrix3d::Identity();
  int width_, height_;
};

struct SkyPicture {
  Image rgb;            ///< linear
  Mask valid = {};      ///< 0 where there is no data; empty = all valid
  Mask known_sky = {};  ///< 255 where a person, or a volume, says that this is sky; empty = not known
  PixelRays rays;
  Mask open = {};  ///< 255 where a volume lets the ray through: it knows of nothing there; empty = not known
  double clip = std::numeric_limits<double>::infinity();  ///< a channel of at least this is clipped
  int scale = 1;  ///< pixels of the photograph that a pixel is across (sky_scale)
};

/// Where a picture clips: files whose values end at 1 do so just below 1; others where several pixels share
/// the highest value, or where that is half float's end, 65 504. Infinity where nothing says that it does.
double clip_level(const Image& rgb);

/// Rec. 709 luminance of linear red, green, blue.
template <class Rgb>
double luminance(const Rgb& rgb) {
  return 0.2126 * rgb[0] + 0.7152 * rgb[1] + 0.0722 * rgb[2];
}

}  // namespace roxel
