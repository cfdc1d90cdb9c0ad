#pragma once
/// How like two pictures are: RMS, PSNR and structural similarity [Wang04], per channel. Pictures are display
/// values (the photographs' own response), 3 channels in [0, 1].

#include <array>
#include <cstdint>

#include "roxel/image/image.h"

namespace roxel {

/// Sums over any number of views; add() joins them, so that figures are of all their pixels together.
struct ImageQuality {
  std::int64_t pixels = 0;
  std::array<double, 3> squared_sum{};  ///< of differences
  std::int64_t windows = 0;             ///< pixels whose window of similarity lies inside the image
  std::array<double, 3> ssim_sum{};

  double rms(int channel) const;  ///< 0 to 1; 0 without pixels
  double rms() const;
  double psnr(int channel) const;  ///< dB; infinity where nothing differs
  double psnr() const;
  double ssim(int channel) const;  ///< -1 to 1; 0 without windows
  double ssim() const;
  void add(const ImageQuality& other);
};

/// Over pixels whose `counted` is at least 128 (empty: all). Windows are Gaussian, 11 pixels wide with a
/// deviation of 1.5, weighted to sum 1; K1 = 0.01, K2 = 0.03, full scale 1, as [Wang04] has it. What a window
/// sees beside the counted pixels takes part. Throws std::logic_error where sizes differ.
ImageQuality image_quality(const Image& render, const Image& photo, const Mask& counted);

}  // namespace roxel
