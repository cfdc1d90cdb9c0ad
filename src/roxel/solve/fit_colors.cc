#include "roxel/solve/fit_colors.h"

#include <algorithm>
#include <atomic>
#include <cmath>
#include <optional>

#include "roxel/base/parallel.h"
#include "roxel/solve/pixel_shares.h"
#include "roxel/solve/run_stages.h"

namespace roxel {

namespace {

constexpr float kMissed = 0.3f;          ///< of the display's full scale: an error that counts a quarter
constexpr float kSpreadOfColors = 0.3f;  ///< of colours about voxels' means, full scale (docs/color.md)
constexpr int kMostRounds = 12;
constexpr double kLeastGain = 0.003;  ///< of the squared error that is left: a round for less ends it
constexpr std::int64_t kSlotGrain = 1 << 14;
constexpr double kKeptBytes = 1 << 30;  ///< of pixels' shares, at most
constexpr double kBytesOfSlot = 120;    ///< what the fit needs besides

/// Sums of three channels for every slot that any thread may add to in any order: fixed point. The terms of
/// one pixel add up to at most 1000, and pixels number at most 2^24: 2^(10 + 28 + 24) fits.
class SharedSums {
 public:
  explicit SharedSums(std::size_t slots) : sums_(slots, Sum{}), locks_(kLocks) {}

  /// Adds of(share) to each voxel of a pixel.
  template <class Terms>
  void add(const PixelShares& shares, Terms&& of) {
    // Nearly all of a pixel's voxels are in one or two stretches of slots, each locked once.
    std::size_t done = 0;
    for (std::size_t first = 0; done < shares.slots.size(); ++first) {
      const std::uint32_t stretch = shares.slots[first] / kStretch;
      const auto is_seen = [&](std::uint32_t slot) { return slot / kStretch == stretch; };
      if (std::any_of(shares.slots.begin(), shares.slots.begin() + static_cast<std::ptrdiff_t>(first),
                      is_seen))
        continue;
      const Locked locked(locks_[stretch % kLocks]);
      for (std::size_t i = first; i < shares.slots.size(); ++i) {
        if (shares.slots[i] / kStretch != stretch) continue;
        const Rgb terms = of(kShareUnit * static_cast<float>(shares.shares[i]));
        Sum& sum = sums_[shares.slots[i]];
        for (int c = 0; c < 3; ++c)
          sum[c] += static_cast<std::int64_t>(std::clamp(terms[c], -kLargest, kLargest) * kUnits);
        ++done;
      }
    }
  }
  float of(std::size_t slot, int channel) const { return static_cast<float>(sums_[slot][channel]) / kUnits; }

 private:
  using Sum = std::array<std::int64_t, 3>;
  static constexpr float kLargest = 1000;
  static constexpr float kUnits = 1 << 28;
  static constexpr std::uint32_t kStretch = 1024;
  static constexpr std::size_t kLocks = 1024;

  struct Locked {
    explicit Locked(std::atomic_flag& of) : flag(of) {
      while (flag.test_and_set(std::memory_order_acquire)) {
      }
    }
    ~Locked() { flag.clear(std::memory_order_release); }
    std::atomic_flag& flag;
  };

  std::vector<Sum> sums_;
  std::vector<std::atomic_flag> locks_;
};

Rgb scaled(const Rgb& color, float by) { return {by * color[0], by * color[1], by * color[2]}; }

float total(const PixelShares& shares) {
  std::uint32_t sum = 0;
  for (const std::uint16_t share : shares.shares) sum += share;
  return kShareUnit * static_cast<float>(sum);
}

/// What a pixel looks like.
Rgb mixed(const PixelShares& shares, const std::vector<Rgb>& colors) {
  Rgb sum{0, 0, 0};
  for (std::size_t i = 0; i < shares.slots.size(); ++i) {
    const Rgb& color = colors[shares.slots[i]];
    const auto share = static_cast<float>(shares.shares[i]);
    for (int c = 0; c < 3; ++c) sum[c] += share * color[c];
  }
  for (float& value : sum) value *= kShareUnit;
  return sum;
}

/// Conjugate gradients, preconditioned by the diagonal, each channel for itself.
class ColorFit {
 public:
  /// `background` where its colour is known: of others, pixels show only what the volume does.
  ColorFit(FitPixels& pixels, std::vector<Rgb> colors, const std::optional<Rgb>& background,
           const RunContext& context)
      : pixels_(pixels), context_(context), colors_(std::move(colors)), background_(background) {}

  ColorFitRecord run(const std::function<void(double)>& progress) {
    const auto report = [&] { progress((1.0 + record_.rounds) / (kMostRounds + 1)); };
    begin();
    report();
    while (record_.pixels > 0 && record_.rounds < kMostRounds && improve()) report();
    progress(1);
    record_.rms_after_percent = rms();
    return record_;
  }

  std::vector<Rgb> take_colors() {
    for (Rgb& color : colors_)
      for (float& value : color) value = std::max(0.0f, value);
    return std::move(colors_);
  }

 private:
  using Triple = std::array<double, 3>;

  double rms() const {
    if (record_.pixels == 0) return 0;
    return 100 * std::sqrt(std::max(0.0, left_) / (3.0 * static_cast<double>(record_.pixels)));
  }

  /// The sum over all slots of visit(slot), the same for any number of threads.
  template <class Visit>
  Triple sum_over_slots(Visit&& visit) const {
    const std::int64_t slots = std::ssize(colors_);
    std::vector<Triple> sums((slots + kSlotGrain - 1) / kSlotGrain, Triple{0, 0, 0});
    parallel_for_blocks(slots, kSlotGrain, context_.thread_count(),
                        [&](std::int64_t begin, std::int64_t end, int) {
                          Triple& sum = sums[begin / kSlotGrain];
                          for (std::int64_t s = begin; s < end; ++s) {
                            const Triple of = visit(static_cast<std::size_t>(s));
                            for (int c = 0; c < 3; ++c) sum[c] += of[c];
                          }
                        });
    Triple all{0, 0, 0};
    for (const Triple& sum : sums)
      for (int c = 0; c < 3; ++c) all[c] += sum[c];
    return all;
  }

  /// How far the mean colours miss: which pixels are believed, and with these the gradient and the diagonal.
  void begin() {
    struct PartSums {
      double squares = 0, bounded = 0;
      std::int64_t pixels = 0;
    };
    std::vector<PartSums> parts(pixels_.part_count());
    SharedSums gradient(colors_.size()), diagonal(colors_.size());
    pixels_.for_each([&](std::size_t part, FitPixel& pixel, const PixelShares& shares) {
      const float opacity = total(shares);
      const Rgb seen = mixed(shares, colors_);
      Rgb error;
      float squares = 0;
      for (int c = 0; c < 3; ++c) {
        const auto target = static_cast<float>(pixel.target[c]);
        const float of_volume = background_ ? target - (1 - opacity) * (*background_)[c] : opacity * target;
        error[c] = of_volume - seen[c];
        squares += static_cast<float>(pixel.weight[c]) * error[c] * error[c];
      }
      if (!(opacity > 0.5f) || !std::isfinite(squares)) {
        pixel.believe(0);
        return;
      }
      const float trust = 1 / (1 + squares / (3 * kMissed * kMissed));
      pixel.believe(trust * trust);
      PartSums& sums = parts[part];
      ++sums.pixels;
      sums.bounded += std::min(squares, 3 * kMissed * kMissed);
      Rgb weight, weighted;
      for (int c = 0; c < 3; ++c) {
        weight[c] = static_cast<float>(pixel.weight[c]);
        weighted[c] = weight[c] * error[c];
        sums.squares += weighted[c] * error[c];
      }
      gradient.add(shares, [&](float share) { return scaled(weighted, share); });
      diagonal.add(shares, [&](float share) { return scaled(weight, share * share); });
    });
    double bounded = 0;
    for (const PartSums& part : parts)
      record_.pixels += part.pixels, left_ += part.squares, bounded += part.bounded;
    if (record_.pixels == 0) return;
    record_.rms_before_percent = rms();
    const double noise = bounded / (3.0 * static_cast<double>(record_.pixels));
    const auto strength = static_cast<float>(noise / (kSpreadOfColors * kSpreadOfColors));
    for (std::vector<Rgb>* of : {&residual_, &diagonal_, &prior_, &direction_})
      of->assign(colors_.size(), Rgb{0, 0, 0});
    descent_ = sum_over_slots([&](std::size_t s) {
      Triple dots{0, 0, 0};
      for (int c = 0; c < 3; ++c) {
        const float slope = display_slope(colors_[s][c]);
        prior_[s][c] = strength * slope * slope;
        residual_[s][c] = gradient.of(s, c);
        diagonal_[s][c] = diagonal.of(s, c);
        direction_[s][c] = preconditioned(s, c);
        dots[c] = static_cast<double>(residual_[s][c]) * direction_[s][c];
      }
      return dots;
    });
  }

  float preconditioned(std::size_t slot, int c) const {
    const float curvature = diagonal_[slot][c] + prior_[slot][c];
    return curvature > 0 ? residual_[slot][c] / curvature : 0;  // no pixel shows it, and all is explained
  }

  /// One round; false when another is not worth it.
  bool improve() {
    SharedSums bent(colors_.size());  // what the squares' curvature makes of the direction
    pixels_.for_each([&](std::size_t, FitPixel& pixel, const PixelShares& shares) {
      Rgb weighted = mixed(shares, direction_);
      for (int c = 0; c < 3; ++c) weighted[c] *= static_cast<float>(pixel.weight[c]);
      bent.add(shares, [&](float share) { return scaled(weighted, share); });
    });
    const auto curved = [&](std::size_t s, int c) { return bent.of(s, c) + prior_[s][c] * direction_[s][c]; };
    const Triple curvature = sum_over_slots([&](std::size_t s) {
      Triple dots;
      for (int c = 0; c < 3; ++c) dots[c] = static_cast<double>(direction_[s][c]) * curved(s, c);
      return dots;
    });
    std::array<float, 3> step{0, 0, 0};
    double gained = 0;
    for (int c = 0; c < 3; ++c) {
      if (!(curvature[c] > 0)) continue;
      step[c] = static_cast<float>(descent_[c] / curvature[c]);
      gained += descent_[c] * descent_[c] / curvature[c];
    }
    const Triple next = sum_over_slots([&](std::size_t s) {
      Triple dots;
      for (int c = 0; c < 3; ++c) {
        colors_[s][c] += step[c] * direction_[s][c];
        residual_[s][c] -= step[c] * curved(s, c);
        dots[c] = static_cast<double>(residual_[s][c]) * preconditioned(s, c);
      }
      return dots;
    });
    sum_over_slots([&](std::size_t s) {
      for (int c = 0; c < 3; ++c) {
        const double keep = descent_[c] > 0 ? next[c] / descent_[c] : 0;
        direction_[s][c] = preconditioned(s, c) + static_cast<float>(keep) * direction_[s][c];
      }
      return Triple{0, 0, 0};
    });
    descent_ = next;
    ++record_.rounds;
    const bool worth_it = gained > kLeastGain * left_;
    left_ -= gained;
    return worth_it;
  }

  FitPixels& pixels_;
  const RunContext& context_;
  std::vector<Rgb> colors_;
  const std::optional<Rgb> background_;
  ColorFitRecord record_;
  double left_ = 0;                               ///< weighted square error, and the prior's share
  std::vector<Rgb> residual_, diagonal_, prior_;  ///< the gradient is -2 residual_
  std::vector<Rgb> direction_;
  Triple descent_{0, 0, 0};  ///< residual_ times preconditioned residual_
};

}  // namespace

ColorFitRecord fit_colors(const Dataset& dataset, const PhotographLoader& load, const Scene& scene,
                          const SurfaceLight* surface_light, const RunContext& context,
                          const std::function<void(double)>& progress, Volume& volume) {
  const LatticeStack stack(volume);
  const double room = scene.memory.peak_bytes - resident_bytes() - kBytesOfSlot * volume.slot_count();
  FitPixels pixels(dataset, load, scene, surface_light, stack, std::clamp(room, 0.0, kKeptBytes), context);
  std::optional<Rgb> background;
  if (scene.background.kind == BackgroundKind::kKnown) {
    background = background_radiance(scene);
    for (float& value : *background) value /= static_cast<float>(scene.exposure);
  }
  ColorFit fit(pixels, radiance_colors(volume, scene.transform, 1), background, context);
  const ColorFitRecord record = fit.run(progress);
  volume.fitted_color = fit.take_colors();
  return record;
}

}  // namespace roxel
