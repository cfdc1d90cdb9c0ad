#include "roxel/depth/depth_stage.h"

#include <algorithm>
#include <atomic>
#include <chrono>
#include <cmath>
#include <deque>
#include <future>
#include <map>
#include <mutex>
#include <numbers>

#include "roxel/base/parallel.h"
#include "roxel/depth/agree_views.h"
#include "roxel/depth/scaled_view.h"

namespace roxel {
namespace {

constexpr double kMostVoxels = 0.8;    ///< of a depth's deviation, as refinement sees it
constexpr double kUnconfirmed = 1;     ///< voxels that a depth may move by which no other view sees there
constexpr double kAnotherSurface = 3;  ///< voxels beyond which a smaller view's pixel saw another surface
constexpr int kSampleStride = 8;       ///< at most: pixels between samples that sources are chosen by
constexpr int kMostWriters = 4;
constexpr double kBytesPerPixelWritten = 64;  ///< of a view that is written

class Clock {
 public:
  double seconds() const {
    return std::chrono::duration<double>(std::chrono::steady_clock::now() - start_).count();
  }

 private:
  std::chrono::steady_clock::time_point start_ = std::chrono::steady_clock::now();
};

/// Some pieces of work beside the caller's own, such as writing what is ready; with one thread, in its place.
/// What they throw is thrown when another one starts, or in the end.
class Aside {
 public:
  explicit Aside(int threads)
      : most_(static_cast<std::size_t>(threads)),
        policy_(threads > 1 ? std::launch::async : std::launch::deferred) {}
  template <class Work>
  void start(Work work) {
    while (works_.size() >= most_) finish_one();
    works_.push_back(std::async(policy_, std::move(work)));
  }
  void finish() {
    while (!works_.empty()) finish_one();
  }

 private:
  void finish_one() {
    std::future<void> first = std::move(works_.front());
    works_.pop_front();
    first.get();
  }

  std::size_t most_;
  std::launch policy_;
  std::deque<std::future<void>> works_;
};

/// The views used last, as long as they fit.
template <class Value>
class ViewCache {
 public:
  using Load = std::function<Value(int view_idx)>;
  ViewCache(Load load, std::size_t bytes_a_pixel, std::size_t most_bytes)
      : load_(std::move(load)), bytes_a_pixel_(bytes_a_pixel), most_bytes_(most_bytes) {}

  /// Those views, in that order; missing ones are loaded by all threads.
  std::vector<std::shared_ptr<const Value>> get(const std::vector<int>& views, const Dataset& dataset,
                                                const RunContext& context) {
    std::vector<std::shared_ptr<const Value>> out(views.size());
    std::vector<int> missing;
    for (const int v : views)
      if (!entries_.contains(v)) missing.push_back(v);
    std::vector<std::shared_ptr<const Value>> loaded(missing.size());
    parallel_for(static_cast<std::int64_t>(missing.size()), context.thread_count(), [&](std::int64_t i, int) {
      context.throw_if_cancelled();
      loaded[i] = std::make_shared<const Value>(load_(missing[i]));
    });
    for (std::size_t i = 0; i < missing.size(); ++i) {
      const Intrinsics& k = dataset.views[missing[i]].camera.intrinsics;
      const std::size_t bytes = bytes_a_pixel_ * k.width * k.height;
      entries_[missing[i]] = {loaded[i], bytes, ++clock_};
      bytes_ += bytes;
    }
    for (std::size_t i = 0; i < views.size(); ++i) {
      entries_[views[i]].used = ++clock_;
      out[i] = entries_[views[i]].value;
    }
    while (bytes_ > most_bytes_ && entries_.size() > views.size()) {
      const auto oldest =
          std::min_element(entries_.begin(), entries_.end(),
                           [](const auto& a, const auto& b) { return a.second.used < b.second.used; });
      bytes_ -= oldest->second.bytes;
      entries_.erase(oldest);
    }
    return out;
  }

 private:
  struct Entry {
    std::shared_ptr<const Value> value;
    std::size_t bytes = 0;
    std::int64_t used = 0;
  };
  Load load_;
  std::size_t bytes_a_pixel_, most_bytes_;
  std::map<int, Entry> entries_;
  std::size_t bytes_ = 0;
  std::int64_t clock_ = 0;
};

double mean_focal(const PinholeCamera& camera) { return 0.5 * (camera.intrinsics.fx + camera.intrinsics.fy); }

/// How much a view at that angle says of depth.
double angle_score(double radians) {
  const double degrees = radians * 180 / std::numbers::pi;
  if (degrees < 10) return std::pow(degrees / 10, 1.5);
  if (degrees < 30) return 1;
  return std::exp(-std::pow((degrees - 30) / 20, 2));
}

/// The whole stage.
class DepthStage {
 public:
  DepthStage(const Dataset& dataset, const PhotographLoader& load, const DepthScene& scene,
             const DepthFiles& files, const DepthStageOptions& options, RunContext& context,
             double progress_begin, double progress_end)
      : dataset_(dataset),
        load_(load),
        scene_(scene),
        files_(files),
        options_(options),
        context_(context),
        progress_begin_(progress_begin),
        progress_end_(progress_end),
        count_(static_cast<int>(dataset.views.size())) {
    steps_ = count_ * ((options.bp ? 1 : 0) + (options.refine ? 6 : 0));
  }

  DepthStageFigures run() {
    for (const View& view : dataset_.views)
      figures_.pixels += static_cast<double>(view.camera.intrinsics.width) * view.camera.intrinsics.height;
    if (options_.bp) propagate_all();
    if (options_.refine) refine_all();
    return figures_;
  }

 private:
  void propagate_all() {
    const Clock clock;
    std::vector<PropagationFigures> figures(count_);
    parallel_for(count_, context_.thread_count(), [&](std::int64_t v, int) {
      context_.throw_if_cancelled();
      DepthLayers layers = files_.read(static_cast<int>(v));
      const Photograph photo = load_(dataset_.views[v]);
      const Image luma = matching_luma(photo.rgb, scene_.white, photo.valid);
      const PropagationGuide guide{luma, mean_focal(dataset_.views[v].camera), scene_.voxel_size,
                                   surface_pixels(photo, layers.opacity)};
      PropagateDepthOptions options;
      options.prior = options_.bp_prior;
      options.prior_sigma = options_.bp_sigma;
      options.fill = options_.bp_fill;
      options.propagation.schedule = options_.bp_schedule;
      options.propagation.sweeps = options_.bp_sweeps;
      figures[v] = propagate_depth(layers, guide, options, [&] { context_.throw_if_cancelled(); });
      files_.write(static_cast<int>(v), layers);
      report("belief propagation", 1);
    });
    for (const PropagationFigures& f : figures) figures_.propagation.add(f);
    figures_.propagate_seconds = clock.seconds();
  }

  /// Refines each view by itself; returns what each was matched with. Views are held only while it runs.
  std::vector<std::vector<int>> match_all() {
    ViewCache<MatchView> views([&](int v) { return match_view(v); }, 24, files_.most_held_bytes);
    std::vector<std::vector<int>> sources(count_);
    Aside writing(writers());
    for (int v = 0; v < count_; ++v) {
      sources[v] = refine_one(v, views, writing);
      report("refining depth", 5);
    }
    writing.finish();
    return sources;
  }

  /// Views that are written side by side: each holds all that is known of it.
  int writers() const {
    const double largest = std::ranges::max(pixels_of_views(dataset_));
    const double fit = static_cast<double>(files_.most_held_bytes) / (kBytesPerPixelWritten * largest);
    return std::clamp(static_cast<int>(std::min<double>(fit, kMostWriters)), 1, context_.thread_count());
  }

  void refine_all() {
    const Clock clock;
    set_scale();
    const std::vector<std::vector<int>> sources = match_all();
    Aside writing(writers());
    ViewCache<RefinedView> refined([&](int v) { return files_.recall(v); }, 24, files_.most_held_bytes);
    for (int v = 0; v < count_; ++v) {
      agree_one(v, sources[v], refined, writing);
      report("refining depth", 1);
    }
    writing.finish();
    figures_.refine_seconds = clock.seconds();
  }

  /// How much smaller all views are made: alike, so that patches are as sharp in one as in another.
  void set_scale() {
    scale_ = options_.refine_scale.value_or(1);
    if (!options_.refine_scale) {
      std::vector<double> across(count_);
      parallel_for(count_, context_.thread_count(), [&](std::int64_t v, int) {
        context_.throw_if_cancelled();
        across[v] = voxel_in_pixels(files_.read(static_cast<int>(v)).depth,
                                    mean_focal(dataset_.views[v].camera), scene_.voxel_size);
      });
      scale_ = choose_scale(std::move(across), pixels_of_views(dataset_));
    }
    figures_.refine_scale = scale_;
    small_ = dataset_;
    for (View& view : small_.views) view.camera = scaled(view.camera, scale_);
  }

  /// What the volume and belief propagation say, before refinement.
  static Image depth_before(const DepthLayers& layers) {
    return layers.depth_bp.empty() ? believed_depth(layers) : layers.depth_bp;
  }

  /// The volume's variance, belief propagation's where that has depth and the volume's is not believed.
  static Image variance_before(const DepthLayers& layers) {
    Image variance = layers.variance;
    if (layers.variance_bp.empty()) return variance;
    const Image believed = believed_depth(layers);
    for (std::size_t i = 0; i < variance.data().size(); ++i)
      if (!(believed.data()[i] > 0)) variance.data()[i] = layers.variance_bp.data()[i];
    return variance;
  }

  /// 1 where a photograph is valid and shows a surface: as its mask says, or else the volume.
  static Image surface_pixels(const Photograph& photo, const Image& opacity) {
    Image pixels(opacity.width(), opacity.height(), 1);
    for (std::size_t i = 0; i < pixels.data().size(); ++i) {
      const bool valid = photo.valid.empty() || photo.valid.data()[i] > 0;
      const bool surface =
          photo.foreground.empty() ? opacity.data()[i] >= kEmptyRay : photo.foreground.data()[i] > 0;
      pixels.data()[i] = valid && surface ? 1.0f : 0.0f;
    }
    return pixels;
  }

  /// What the volume says of the smaller view's pixels.
  struct SmallDepth {
    Image depth, variance;
  };
  SmallDepth small_depth(int v, const Image& before, const Image& variance) const {
    const Intrinsics& k = small_.views[v].camera.intrinsics;
    SmallDepth small{Image(k.width, k.height, 1), Image(k.width, k.height, 1)};
    const float most = static_cast<float>(kMostVoxels * kMostVoxels * scene_.voxel_size * scene_.voxel_size);
    const std::vector<std::int64_t> surest = surest_pixels(before, variance, scale_);
    for (std::size_t i = 0; i < surest.size(); ++i) {
      if (surest[i] < 0) continue;
      small.depth.data()[i] = before.data()[surest[i]];
      small.variance.data()[i] = std::min(variance.data()[surest[i]], most);
    }
    return small;
  }

  /// What refinement starts from.
  PlaneMap first_planes(int v, const Image& depth, const Image& variance, int threads) const {
    const double focal = mean_focal(small_.views[v].camera);
    return fit_planes(depth, variance, focal, plane_radius(depth, focal, scene_.voxel_size), threads);
  }

  MatchView match_view(int v) const {
    const DepthLayers layers = files_.read(v);
    const Photograph photo = scaled(load_(dataset_.views[v]), scale_);
    SmallDepth small = small_depth(v, depth_before(layers), variance_before(layers));
    return {small_.views[v].camera, matching_luma(photo.rgb, scene_.white, photo.valid),
            matching_color(photo.rgb, scene_.white), std::move(small.depth), std::move(small.variance)};
  }

  /// The view and those that come after it: each thread makes one ready.
  std::vector<int> next_views(int v) const {
    std::vector<int> next;
    const int most = std::min(context_.thread_count(), options_.refine_views);
    for (int n = v; n < std::min(count_, v + most); ++n) next.push_back(n);
    return next;
  }

  std::vector<int> refine_one(int v, ViewCache<MatchView>& views, Aside& writing) {
    const auto own = views.get(next_views(v), small_, context_).front();
    const std::vector<int> sources = choose_sources(small_, v, own->depth, options_.refine_views);
    const auto held = views.get(sources, small_, context_);
    std::vector<const MatchView*> pointers;
    for (const auto& view : held) pointers.push_back(view.get());
    const PlaneMap start = first_planes(v, own->depth, own->variance, context_.thread_count());
    PatchMatchOptions options;
    options.patch.radius = options_.refine_radius;
    options.patch.noise = options_.refine_noise;
    options.patch.gap = scene_.voxel_size;
    options.pixel_sigma = options_.refine_pixel_sigma / scale_;
    options.sources = options_.refine_views;
    options.iterations = options_.refine_rounds;
    options.sigmas = options_.refine_sigmas;
    options.seed = options_.seed;
    writing.start([this, v, refined = refine_view(*own, pointers, start, options, context_)]() mutable {
      doubt_unmatched(v, refined);
      files_.keep(v, refined);
    });
    return sources;
  }

  /// Where photographs say nothing, the volume's own variance stays.
  void doubt_unmatched(int v, RefinedView& refined) const {
    const DepthLayers layers = files_.read(v);
    const Image variance = variance_before(layers);
    const std::vector<std::int64_t> surest = surest_pixels(depth_before(layers), variance, scale_);
    for (std::size_t i = 0; i < refined.planes.planes.size(); ++i) {
      const float w = refined.planes.planes[i].w;
      if (w <= 0 || refined.correlation.data()[i] > 0 || surest[i] < 0) continue;
      refined.variance.data()[i] = refined.shared.data()[i] = variance.data()[surest[i]] * w * w * w * w;
    }
  }

  void agree_one(int v, const std::vector<int>& sources, ViewCache<RefinedView>& refined, Aside& writing) {
    const auto own = refined.get({v}, small_, context_).front();
    AgreedView agreed{own->planes, own->variance, Image(own->planes.width, own->planes.height, 1)};
    if (options_.refine_agree) {
      const auto held = refined.get(sources, small_, context_);
      std::vector<AgreeingView> others;
      for (std::size_t i = 0; i < sources.size(); ++i)
        others.push_back({held[i].get(), PatchWarp(small_.views[v].camera, small_.views[sources[i]].camera)});
      agreed = agree_views(*own, others, context_);
    }
    writing.start([this, v, own, agreed = std::move(agreed)] { write_refined(v, agreed, own->correlation); });
  }

  /// Each pixel's depth on the plane that shows its surface; as it was before, with the variance that it had
  /// and the volume's normal, where there is no such plane.
  void write_refined(int v, const AgreedView& agreed, const Image& correlation) {
    DepthStageFigures counts;
    DepthLayers layers = files_.read(v);
    const Image before = depth_before(layers), variance = variance_before(layers);
    const SmallDepth small = small_depth(v, before, variance);
    const PlaneMap first = first_planes(v, small.depth, small.variance, 1);
    const int width = before.width(), height = before.height();
    layers.depth_refined = Image(width, height, 1);
    layers.variance_refined = Image(width, height, 1);
    layers.normal = Image(width, height, 3);
    for (int y = 0; y < height; ++y)
      for (int x = 0; x < width; ++x) {
        const float expected = *before.pixel(x, y);
        if (!(expected > 0)) continue;
        ++counts.refined_pixels;
        float z = expected, spread = *variance.pixel(x, y);
        PixelPlane plane = plane_of_pixel(first, scale_, x, y, expected).plane;
        const PlaneOfPixel refined = plane_of_pixel(agreed.planes, scale_, x, y, expected);
        const int column = refined.column, row = refined.row;
        if (!refined.plane.empty() && same_surface(first.at(column, row), column, row, x, y, expected)) {
          const float moved = 1 / refined.plane.w;
          const bool matched = *correlation.pixel(column, row) > 0;
          const bool confirmed = *agreed.views.pixel(column, row) > 0;
          counts.matched_pixels += matched;
          counts.agreed_pixels += confirmed;
          if (believed(std::abs(moved - expected), matched, confirmed)) {
            plane = refined.plane;
            z = moved;
            spread = *agreed.variance.pixel(column, row) * z * z * z * z;
          }
        }
        *layers.depth_refined.pixel(x, y) = z;
        *layers.variance_refined.pixel(x, y) = spread;
        if (plane.empty()) continue;
        const Eigen::Vector3d normal = world_normal(dataset_.views[v].camera, plane, x + 0.5, y + 0.5);
        for (int c = 0; c < 3; ++c) layers.normal.pixel(x, y)[c] = static_cast<float>(normal[c]);
      }
    files_.write(v, layers);
    std::lock_guard lock(counting_);
    figures_.refined_pixels += counts.refined_pixels;
    figures_.matched_pixels += counts.matched_pixels;
    figures_.agreed_pixels += counts.agreed_pixels;
  }

  /// Whether the smaller view's pixel started from the surface that pixel (x, y) has at `expected`.
  bool same_surface(const PixelPlane& start, int column, int row, int x, int y, double expected) const {
    if (scale_ == 1) return true;
    const double w = start.w + start.wu * ((x + 0.5) / scale_ - (column + 0.5)) +
                     start.wv * ((y + 0.5) / scale_ - (row + 0.5));
    return w > 0 && std::abs(1 / w - expected) < kAnotherSurface * scene_.voxel_size;
  }

  /// Whether a pixel goes where its plane is, `moved` world units away.
  bool believed(double moved, bool matched, bool confirmed) const {
    if (confirmed) return true;
    if (scale_ > 1 && !matched) return false;
    return !options_.refine_agree || moved <= kUnconfirmed * scene_.voxel_size;
  }

  void report(const char* stage, int steps) {
    Progress progress;
    progress.stage = stage;
    const double share = static_cast<double>(done_ += steps) / std::max(1, steps_);
    progress.fraction = progress_begin_ + (progress_end_ - progress_begin_) * share;
    context_.report(progress);
  }

  const Dataset& dataset_;
  const PhotographLoader& load_;
  const DepthScene& scene_;
  const DepthFiles& files_;
  const DepthStageOptions& options_;
  RunContext& context_;
  double progress_begin_, progress_end_;
  int count_;
  int steps_ = 0;
  int scale_ = 1;
  Dataset small_;  ///< with the cameras of the smaller views
  std::atomic<int> done_{0};
  std::mutex counting_;
  DepthStageFigures figures_;
};

OptionTable<DepthStageOptions> make_table() {
  using Options = DepthStageOptions;
  OptionTable<Options> table;
  table.include(depth_map_option_table(), &Options::map);
  table.group("Depth");
  table.add("bp", &Options::bp)
      .help("Belief propagation over each view's depth")
      .source("[Jethwa04] section 6.3");
  table
      .add("bp-prior", &Options::bp_prior,
           {{"edge-aware", DepthPrior::kEdgeAware}, {"plain", DepthPrior::kPlain}})
      .help(
          "What neighbours expect of each other: one plane, up to edges of colour or depth; or the same "
          "depth")
      .source("docs/depth.md; [Jethwa04] eq. (6.8)");
  table.add("bp-sigma", &Options::bp_sigma)
      .help("Deviation between neighbours' depths that the prior grants")
      .unit("world units")
      .above(0)
      .unset("from the depth maps");
  table
      .add("bp-schedule", &Options::bp_schedule,
           {{"synchronous", MessageSchedule::kSynchronous}, {"residual", MessageSchedule::kResidual}})
      .help("Order of messages: all at once, or always those that change most");
  table.add("bp-sweeps", &Options::bp_sweeps).help("Most messages a pixel sends").range(1, 100000);
  table.add("bp-fill", &Options::bp_fill)
      .help("Give depth from their neighbours to pixels without that masks and volume do not call empty");
  table.add("refine", &Options::refine).help("Move depths to where the photographs agree best");
  table.add("refine-scale", &Options::refine_scale)
      .help("Side of the squares of pixels that refinement sees as one")
      .unit("pixels")
      .range(1, 16)
      .unset("as many as leave a voxel 1.5 of them and a view 100 000");
  table.add("refine-views", &Options::refine_views).help("Views that a patch is looked for in").range(1, 32);
  table.add("refine-rounds", &Options::refine_rounds).help("Rounds of propagation over a view").range(0, 100);
  table.add("refine-radius", &Options::refine_radius)
      .help("Radius of a patch")
      .unit("pixels, as refinement sees them")
      .range(1, 7);
  table.add("refine-sigmas", &Options::refine_sigmas)
      .help("Deviations of the volume's depth that refinement may move it by")
      .range(0.1, 1000);
  table.add("refine-noise", &Options::refine_noise)
      .help("Deviation of the images that patches are granted")
      .unit("of white, at middle grey")
      .range(1e-5, 1);
  table.add("refine-pixel-sigma", &Options::refine_pixel_sigma)
      .help("Deviation by which calibration puts a point beside where it is in a photograph")
      .unit("pixels")
      .range(0, 10);
  table.add("seed", &Options::seed).help("Draws other random planes in refinement").at_least(0);
  table.add("refine-agree", &Options::refine_agree).help("Join what several views say of the same surface");
  return table;
}

}  // namespace

const OptionTable<DepthStageOptions>& depth_option_table() {
  static const OptionTable<DepthStageOptions> table = make_table();
  return table;
}

std::vector<int> choose_sources(const Dataset& dataset, int view_idx, const Image& depth, int most) {
  const PinholeCamera& own = dataset.views[view_idx].camera;
  const int stride = std::clamp(std::min(depth.width(), depth.height()) / 16, 1, kSampleStride);
  std::vector<std::pair<double, int>> scores;
  for (int s = 0; s < static_cast<int>(dataset.views.size()); ++s) {
    if (s == view_idx) continue;
    const PinholeCamera& other = dataset.views[s].camera;
    if ((other.pose.centre - own.pose.centre).norm() == 0) continue;
    double score = 0;
    for (int y = stride / 2; y < depth.height(); y += stride)
      for (int x = stride / 2; x < depth.width(); x += stride) {
        const float z = *depth.pixel(x, y);
        if (!(z > 0)) continue;
        const Ray ray = own.ray(x + 0.5, y + 0.5);
        const Eigen::Vector3d point = ray.origin + z * ray.direction;
        const Eigen::Vector3d seen = other.project(point);
        if (!(seen.z() > 0) || !(seen.x() > 0) || !(seen.y() > 0) || !(seen.x() < other.intrinsics.width) ||
            !(seen.y() < other.intrinsics.height))
          continue;
        const Eigen::Vector3d a = (own.pose.centre - point).normalized(),
                              b = (other.pose.centre - point).normalized();
        const double scale = (mean_focal(other) / seen.z()) / (mean_focal(own) / z);
        score += angle_score(std::acos(std::clamp(a.dot(b), -1.0, 1.0))) *
                 std::min(1.0, std::min(scale, 2 / scale));
      }
    if (score > 0) scores.emplace_back(-score, s);
  }
  std::sort(scores.begin(), scores.end());
  std::vector<int> chosen;
  for (const auto& [score, s] : scores)
    if (static_cast<int>(chosen.size()) < most) chosen.push_back(s);
  return chosen;
}

void DepthStageFigures::add(const DepthStageFigures& other) {
  propagation.add(other.propagation);
  refine_scale = std::max(refine_scale, other.refine_scale);
  refined_pixels += other.refined_pixels;
  matched_pixels += other.matched_pixels;
  agreed_pixels += other.agreed_pixels;
  pixels = std::max(pixels, other.pixels);
  propagate_seconds += other.propagate_seconds;
  refine_seconds += other.refine_seconds;
}

DepthStageFigures run_depth_stage(const Dataset& dataset, const PhotographLoader& load,
                                  const DepthScene& scene, const DepthFiles& files,
                                  const DepthStageOptions& options, RunContext& context,
                                  double progress_begin, double progress_end) {
  depth_option_table().validate(options);
  return DepthStage(dataset, load, scene, files, options, context, progress_begin, progress_end).run();
}

}  // namespace roxel
