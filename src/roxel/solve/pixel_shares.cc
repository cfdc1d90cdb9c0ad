#include "roxel/solve/pixel_shares.h"

#include <algorithm>
#include <cmath>

#include "roxel/base/parallel.h"
#include "roxel/solve/surface_paint.h"

namespace roxel {

namespace {

constexpr double kApart = 0.35;            ///< voxels between neighbouring pixels that are looked at
constexpr double kMostPixels = 1 << 24;    ///< of all views, 16 bytes each
constexpr double kEnoughPixels = 1 << 22;  ///< for few voxels
constexpr double kPixelsOfVoxel = 3;       ///< surfaces are a fifth of the voxels
constexpr std::size_t kPixelGrain = 2048;
constexpr float kDarkest = 0.005f;     ///< darker colours are displayed as steeply as this one
constexpr float kLeastWeight = 1e-6f;  ///< half precision ends there
constexpr float kMostWeight = 1000;    ///< a dark pixel in bright light
constexpr float kLeastShare = 0.003f;  ///< smaller ones go to the others in proportion

}  // namespace

float display_slope(float light) { return 1.055f / 2.4f * std::pow(std::max(light, kDarkest), 1 / 2.4f - 1); }

void FitPixel::believe(float trust) {
  for (Eigen::half& w : weight)
    w = trust > 0 ? Eigen::half(std::max(kLeastWeight, static_cast<float>(w) * trust)) : Eigen::half(0);
}

/// Finds the shares of a pixel.
class FitPixels::Finder {
 public:
  explicit Finder(const LatticeStack& stack) : stack_(stack) { options_.interpolate = true; }

  PixelShares find(const View& view, const FitPixel& pixel) {
    slots_.clear(), sums_.clear();
    places_.fill(kEmpty);
    const int width = view.camera.intrinsics.width;
    const int x = static_cast<int>(pixel.at) % width, y = static_cast<int>(pixel.at) / width;
    const float part = 1.0f / static_cast<float>(view.rays.count());
    for (int i = 0; i < view.rays.count(); ++i) {
      const double u = view.rays.u(x, i), v = view.rays.v(y, i);
      const Ray ray = view.camera.ray(u, v);
      for_each_share(stack_, options_, ray, view.range, view.sight.at(u, v), chunk_,
                     [&](const StepChunk& steps, int step, float, float share) {
                       const VoxelBlend blend = blend_of(stack_, options_, steps, step, ray, share);
                       for (int k = 0; k < blend.count; ++k)
                         add(blend.slot[k], part * share * blend.weight[k]);
                     });
    }
    return rounded();
  }

 private:
  static constexpr std::uint16_t kEmpty = 0xffff;
  static constexpr std::size_t kPlaces = 1024;  ///< a power of two; a pixel shows far fewer voxels

  /// Voxels are shown by several steps and rays: a small hash table finds them again.
  void add(std::uint32_t slot, float share) {
    if (slots_.size() >= kPlaces / 2) return add_searching(slot, share);
    std::size_t place = slot % kPlaces;
    while (places_[place] != kEmpty && slots_[places_[place]] != slot) place = (place + 1) % kPlaces;
    if (places_[place] == kEmpty) {
      places_[place] = static_cast<std::uint16_t>(slots_.size());
      slots_.push_back(slot), sums_.push_back(share);
    } else {
      sums_[places_[place]] += share;
    }
  }
  /// Of fog with more voxels than the table is for.
  void add_searching(std::uint32_t slot, float share) {
    const auto found = std::find(slots_.begin(), slots_.end(), slot);
    if (found == slots_.end())
      slots_.push_back(slot), sums_.push_back(share);
    else
      sums_[found - slots_.begin()] += share;
  }

  PixelShares rounded() {
    float all = 0, large = 0;
    for (const float sum : sums_) {
      all += sum;
      if (sum >= kLeastShare) large += sum;
    }
    const float scale = large > 0 ? all / large / kShareUnit : 0;
    std::size_t count = 0;
    shares_.resize(sums_.size());
    for (std::size_t i = 0; i < sums_.size(); ++i) {
      if (sums_[i] < kLeastShare) continue;
      slots_[count] = slots_[i];
      shares_[count++] = static_cast<std::uint16_t>(std::min(65535.0f, std::round(scale * sums_[i])));
    }
    return {{slots_.data(), count}, {shares_.data(), count}};
  }

  const LatticeStack& stack_;
  RenderOptions options_;
  StepChunk chunk_;
  std::array<std::uint16_t, kPlaces> places_;
  std::vector<std::uint32_t> slots_;
  std::vector<float> sums_;
  std::vector<std::uint16_t> shares_;
};

FitPixels::FitPixels(const Dataset& dataset, const PhotographLoader& load, const Scene& scene,
                     const SurfaceLight* surface_light, const LatticeStack& stack, double kept_bytes,
                     const RunContext& context)
    : stack_(stack), context_(context), room_(static_cast<std::int64_t>(kept_bytes)) {
  for (std::size_t v = 0; v < dataset.views.size(); ++v) {
    context.throw_if_cancelled();
    const PinholeCamera& camera = dataset.views[v].camera;
    views_.push_back({camera,
                      view_range(scene, dataset, static_cast<int>(v)),
                      BrickSight(stack, camera),
                      SubpixelRays(stack.volume().index(0).frame(), camera),
                      {}});
  }
  const double apart = common_distance();
  parallel_for(std::ssize(views_), context.thread_count(), [&](std::int64_t v, int) {
    context.throw_if_cancelled();
    choose(dataset, load, scene, surface_light, static_cast<int>(v), apart);
  });
  for (const View& view : views_) room_ -= static_cast<std::int64_t>(view.pixels.size() * sizeof(FitPixel));
  for (std::size_t v = 0; v < views_.size(); ++v)
    for (std::size_t begin = 0; begin < views_[v].pixels.size(); begin += kPixelGrain)
      parts_.push_back({v, begin, std::min(begin + kPixelGrain, views_[v].pixels.size())});
}

/// Voxels between pixels, so that there are few enough.
double FitPixels::common_distance() const {
  const auto pixels = [&](double apart) {
    double sum = 0;
    for (const View& view : views_) {
      const double stride = stride_of(view, apart);
      sum += view.camera.intrinsics.width / stride * view.camera.intrinsics.height / stride;
    }
    return sum;
  };
  const double most = std::clamp(kPixelsOfVoxel * stack_.volume().slot_count(), kEnoughPixels, kMostPixels);
  double apart = kApart;
  while (pixels(apart) > most) apart *= 1.1;
  return apart;
}

int FitPixels::stride_of(const View& view, double apart) {
  return std::max(1, static_cast<int>(std::lround(apart / view.rays.pixel_in_voxels())));
}

void FitPixels::choose(const Dataset& dataset, const PhotographLoader& load, const Scene& scene,
                       const SurfaceLight* surface_light, int view_idx, double apart) {
  View& view = views_[view_idx];
  const Photograph photo = load(dataset.views[view_idx]);
  const bool by_sky = surface_light && surface_light->sky_of_view(view_idx) >= 0;
  const Image light = by_sky ? light_of_pixels(stack_, *surface_light, surface_light->sky_of_view(view_idx),
                                               view.camera, view.range, context_)
                             : Image();
  const Rgb of_view = scene.light.of_view(view_idx);
  const auto exposure = static_cast<float>(scene.exposure);
  const int stride = stride_of(view, apart), width = view.camera.intrinsics.width;
  for (int y = stride / 2; y < view.camera.intrinsics.height; y += stride)
    for (int x = stride / 2; x < width; x += stride) {
      if (!photo.valid.empty() && photo.valid.at(x, y) < 255) continue;
      if (!photo.foreground.empty() && photo.foreground.at(x, y) < 128) continue;
      FitPixel pixel{static_cast<std::uint32_t>(x + width * y), {}, {}};
      bool known = true;
      for (int c = 0; c < 3; ++c) {
        const float seen = photo.rgb.pixel(x, y)[c] / exposure;
        const float by = light.empty() ? of_view[c] : light.pixel(x, y)[c];
        known = known && by > 0 && std::isfinite(seen);
        const float slope = known ? display_slope(seen) * by : 0;
        pixel.target[c] = Eigen::half(known ? seen / by : 0);
        pixel.weight[c] = Eigen::half(std::clamp(slope * slope, kLeastWeight, kMostWeight));
      }
      if (known) view.pixels.push_back(pixel);
    }
  view.pixels.shrink_to_fit();
}

void FitPixels::for_each(
    const std::function<void(std::size_t part, FitPixel& pixel, const PixelShares& shares)>& visit) {
  parallel_for(std::ssize(parts_), context_.thread_count(), [&](std::int64_t p, int) {
    context_.throw_if_cancelled();
    Part& part = parts_[p];
    View& view = views_[part.view];
    if (part.kept) {
      std::uint32_t begin = 0;
      for (std::size_t i = part.begin; i < part.end; ++i) {
        const std::uint32_t end = part.ends[i - part.begin], count = end - begin;
        if (view.pixels[i].is_believed())
          visit(p, view.pixels[i], {{&part.slots[begin], count}, {&part.shares[begin], count}});
        begin = end;
      }
      return;
    }
    const bool keep = room_ > 0;
    Finder finder(stack_);
    std::vector<std::uint32_t> ends, slots;
    std::vector<std::uint16_t> shares;
    for (std::size_t i = part.begin; i < part.end; ++i) {
      if (view.pixels[i].is_believed()) {
        const PixelShares found = finder.find(view, view.pixels[i]);
        visit(p, view.pixels[i], found);
        if (keep && view.pixels[i].is_believed()) {
          slots.insert(slots.end(), found.slots.begin(), found.slots.end());
          shares.insert(shares.end(), found.shares.begin(), found.shares.end());
        }
      }
      ends.push_back(static_cast<std::uint32_t>(slots.size()));
    }
    if (!keep) return;
    slots.shrink_to_fit(), shares.shrink_to_fit();
    const auto bytes = static_cast<std::int64_t>(4 * ends.size() + 6 * slots.size());
    if (room_.fetch_sub(bytes) < bytes) {
      room_ += bytes;
      return;
    }
    part.ends = std::move(ends), part.slots = std::move(slots), part.shares = std::move(shares);
    part.kept = true;
  });
}

}  // namespace roxel
