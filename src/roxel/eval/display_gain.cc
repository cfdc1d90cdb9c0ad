#include "roxel/eval/display_gain.h"

#include <algorithm>
#include <cmath>
#include <vector>

#include "roxel/base/error.h"

namespace roxel {
namespace {

constexpr std::size_t kMostPixels = 60000;
constexpr double kReach = 4;  ///< of the gain's logarithm, to either side of 0
constexpr int kTrials = 65;   ///< the sum may have several hollows: the deepest of these is refined
constexpr double kFine = 1e-4;
constexpr float kSeen = 1e-6f;  ///< linear; darker is black in every light looked at

struct Channel {
  std::vector<float> rendered;  ///< linear
  std::vector<float> shown;     ///< encoded

  double squares(const Response& response, double log_gain) const {
    const auto gain = static_cast<float>(std::exp(log_gain));
    double sum = 0;
    for (std::size_t i = 0; i < rendered.size(); ++i) {
      const double off = encode(response, std::clamp(gain * rendered[i], 0.0f, 1.0f)) - shown[i];
      sum += off * off;
    }
    return sum;
  }
};

double deepest(const Channel& channel, const Response& response) {
  const auto squares = [&](double log_gain) { return channel.squares(response, log_gain); };
  const double step = 2 * kReach / (kTrials - 1);
  double best = 0, least = squares(0);
  for (int trial = 0; trial < kTrials; ++trial) {
    const double at = -kReach + step * trial, sum = squares(at);
    if (sum < least) best = at, least = sum;
  }
  // Golden section about it.
  const double golden = (std::sqrt(5.0) - 1) / 2;
  double low = std::max(-kReach, best - step), high = std::min(kReach, best + step);
  double left = high - golden * (high - low), right = low + golden * (high - low);
  double of_left = squares(left), of_right = squares(right);
  while (high - low > kFine) {
    if (of_left < of_right) {
      high = right, right = left, of_right = of_left;
      left = high - golden * (high - low), of_left = squares(left);
    } else {
      low = left, left = right, of_left = of_right;
      right = low + golden * (high - low), of_right = squares(right);
    }
  }
  return (low + high) / 2;
}

}  // namespace

std::array<double, 3> display_gain(const Image& rendered, const Image& photo, double white,
                                   const Mask& counted, const Response& response) {
  const std::size_t pixels = rendered.data().size() / 3;
  ROXEL_CHECK(rendered.channels() == 3 && photo.data().size() == rendered.data().size() &&
              (counted.empty() || counted.data().size() == pixels));
  std::vector<std::size_t> used;
  for (std::size_t i = 0; i < pixels; ++i)
    if (counted.empty() || counted.data()[i] >= 128) used.push_back(i);
  const std::size_t stride = 1 + used.size() / kMostPixels;
  const auto scale = static_cast<float>(1 / white);
  std::array<double, 3> gain{1, 1, 1};
  for (int c = 0; c < 3; ++c) {
    Channel channel;
    for (std::size_t k = 0; k < used.size(); k += stride) {
      const std::size_t i = 3 * used[k] + c;
      if (!(rendered.data()[i] > kSeen)) continue;  // black in any light: it decides nothing
      channel.rendered.push_back(rendered.data()[i]);
      channel.shown.push_back(encode(response, std::clamp(scale * photo.data()[i], 0.0f, 1.0f)));
    }
    if (!channel.rendered.empty()) gain[c] = std::exp(deepest(channel, response));
  }
  return gain;
}

}  // namespace roxel
