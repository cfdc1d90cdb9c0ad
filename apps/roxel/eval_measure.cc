#include "eval_measure.h"
#include "common.h"

#include <cmath>
#include <limits>

#include "eval_light.h"
#include "roxel/base/error.h"
#include "roxel/base/parallel.h"
#include "roxel/eval/depth_points.h"
#include "roxel/eval/display_gain.h"
#include "roxel/eval/surface_sight.h"
#include "roxel/io/depth_file.h"
#include "roxel/io/image_file.h"
#include "roxel/io/ply_file.h"
#include "roxel/io/sky_file.h"
#include "roxel/io/sky_truth.h"
#include "roxel/report/markup.h"
#include "roxel/report/pictures.h"
#include "run_renderer.h"
#include "view_writer.h"

namespace roxel::cli {
namespace {

namespace fs = std::filesystem;

constexpr std::size_t kMostColorPixels = 2000000;
constexpr double kOpaqueDebris = 0.3;               ///< sky debris of at least this opacity is told apart
constexpr std::int64_t kMostDepthPixels = 2000000;  ///< of all views, that are compared pixel by pixel

/// One view as far as its files are there.
struct MeasuredView {
  std::optional<NamedDepthAccuracy> depth;
  std::vector<NamedDepthAccuracy> methods;  ///< "volume", "bp", "refined"
  std::optional<Reliability> reliability;
  std::optional<NamedImageQuality> quality;
  std::optional<ViewDepth> estimate;  ///< pixels that count alone
  std::optional<ViewDepth> sure;      ///< of these, those of small enough deviation
  std::optional<ViewDepth> refined;   ///< pixels that count of the refined depth
  std::optional<ViewDepth> truth;     ///< where there is an estimate, too
};

std::string size_text(const Image& image) {
  return std::to_string(image.width()) + " x " + std::to_string(image.height());
}

void check_size(const fs::path& file, const Image& found, int width, int height, const std::string& who) {
  if (found.width() == width && found.height() == height) return;
  throw_invalid(file.string(), size_text(found) + " pixels",
                std::to_string(width) + " x " + std::to_string(height) + " as " + who + " has");
}

/// The channel Z, as a run's own depth maps have it, else the first.
Image read_true_depth(const fs::path& file) {
  const std::vector<FloatChannel> channels = read_exr_channels(file.string());
  const Image* depth = find_channel(channels, "Z");
  return depth ? *depth : channels.front().plane;
}

/// True depth, 0 where the surface is outside the box: there is nothing there that the run could find.
Image depth_in_box(const Image& depth, const PinholeCamera& camera, const Eigen::AlignedBox3d& box) {
  Image inside = depth;
  for (int y = 0; y < depth.height(); ++y)
    for (int x = 0; x < depth.width(); ++x) {
      const float z = *depth.pixel(x, y);
      if (!(z > 0 && std::isfinite(z))) continue;
      const Ray ray = camera.ray(x + 0.5, y + 0.5);
      if (!box.contains(ray.origin + z * ray.direction)) *inside.pixel(x, y) = 0;
    }
  return inside;
}

/// The whole job, step by step.
class Measurement {
 public:
  Measurement(const EvalSource& source, const MeasureOptions& options, Session& session)
      : source_(source), options_(options), session_(session), threads_(session.context().thread_count()) {}

  RunMeasures take() {
    describe();
    draw_samples();
    measure_views();
    report(0.5);
    measure_surfaces();
    measure_volume();
    report(0.7);
    measure_held_out();
    measure_colors();
    measure_light();
    take_sections();
    return std::move(out_);
  }

 private:
  void describe() {
    out_.run = source_.run.path.string();
    if (source_.truth) out_.truth = source_.truth->string();
    out_.voxel_size = source_.voxel_size();
    out_.box = source_.box;
    out_.opacity_threshold = options_.opacity_threshold;
    out_.confidence_threshold = options_.confidence_threshold;
    out_.notes = source_.notes;
    const nlohmann::json& summary = source_.run.summary;
    if (const auto rms = summary.find("reprojection_rms_percent"); rms != summary.end() && rms->is_number())
      out_.reprojection_rms_percent = rms->get<double>();
    read_from_summary(source_.run.path, [&] {
      for (const auto& view : summary.value("views", nlohmann::json::array()))
        if (const auto found = view.find("reprojection_rms_percent");
            found != view.end() && found->is_number())
          out_.reprojection.emplace_back(view.value("name", ""), found->get<double>());
    });
  }

  void draw_samples() {
    if (!source_.surface) return;
    samples_ = source_.surface->is_point_set()
                   ? points_in_box(source_.surface->points, source_.box)
                   : sample_surface(*source_.surface, {options_.samples, options_.seed, source_.box});
    out_.surface_samples = static_cast<std::int64_t>(samples_.size());
    if (samples_.empty())
      out_.notes.push_back("no surface of " + (*source_.truth / "mesh.ply").string() +
                           " is in the run's box");
  }

  void measure_views() {
    std::vector<MeasuredView> views(source_.view_names.size());
    parallel_for(static_cast<std::int64_t>(views.size()), threads_, [&](std::int64_t v, int) {
      session_.context().throw_if_cancelled();
      views[v] = measure_view(source_.view_names[v]);
    });
    for (MeasuredView& view : views) {
      for (const NamedDepthAccuracy& method : view.methods) add_method(method);
      if (view.depth) out_.depth.push_back(std::move(*view.depth));
      if (view.quality) out_.images.push_back(std::move(*view.quality));
      if (view.truth) compared_.push_back(*view.estimate), truths_.push_back(std::move(*view.truth));
      if (view.estimate) estimates_.push_back(std::move(*view.estimate));
      if (view.sure) sure_.push_back(std::move(*view.sure));
      if (view.refined) refined_.push_back(std::move(*view.refined));
      if (!view.reliability) continue;
      if (!out_.opacity_reliability) out_.opacity_reliability.emplace();
      out_.opacity_reliability->add(*view.reliability);
    }
    if (out_.depth.empty()) note_unmatched("depth", "depth map");
    keep_seen_samples();
  }

  void add_method(const NamedDepthAccuracy& method) {
    for (NamedDepthAccuracy& known : out_.depth_methods)
      if (known.name == method.name) return known.accuracy.add(method.accuracy);
    out_.depth_methods.push_back(method);
  }

  /// Truth that is there and goes with nothing of the run.
  void note_unmatched(const std::string& folder, const std::string& what) {
    if (source_.truth && fs::is_directory(*source_.truth / folder))
      out_.notes.push_back("no NAME.exr in " + (*source_.truth / folder).string() + " for any " + what +
                           " of the run");
  }

  MeasuredView measure_view(const std::string& name) {
    MeasuredView out;
    const View* view = source_.view(name);
    const fs::path estimate_file = depth_path(source_.run.path, name);
    std::optional<DepthLayers> estimate;
    if (fs::is_regular_file(estimate_file)) estimate = read_depth(estimate_file);
    Image truth;  // in the box; empty where there is none
    if (const auto file = source_.truth ? truth_file(*source_.truth, "depth", name) : std::nullopt) {
      truth = read_true_depth(*file);
      if (estimate)
        check_size(*file, truth, estimate->depth.width(), estimate->depth.height(), estimate_file.string());
      if (view) {
        check_size(*file, truth, view->camera.intrinsics.width, view->camera.intrinsics.height, view->source);
        truth = depth_in_box(truth, view->camera, source_.run.file.volume.index(0).frame().box());
      }
    }
    if (estimate && !truth.empty()) measure_depth(name, *estimate, truth, out);
    if (estimate && view) {
      out.estimate = countable(*estimate, estimate->depth, view->camera);
      const double most_sigma = options_.sure_within * source_.voxel_size();
      out.sure =
          countable(*estimate, sure_depth({estimate->depth, estimate->variance}, most_sigma), view->camera);
    }
    if (estimate && view && !estimate->depth_refined.empty())
      out.refined = countable(*estimate, estimate->depth_refined, view->camera);
    if (out.estimate && !truth.empty()) out.truth = ViewDepth{view->camera, truth};
    if (view) out.quality = measure_render(*view, estimate ? &*estimate : nullptr, truth);
    return out;
  }

  void measure_depth(const std::string& name, const DepthLayers& estimate, const Image& truth,
                     MeasuredView& out) const {
    DepthAccuracyOptions options;
    options.voxel_size = source_.voxel_size();
    options.distances = options_.depth_within;
    const auto add = [&](const char* method, const Image& depth, const Image& variance) {
      if (depth.empty()) return;
      out.methods.push_back({method, depth_accuracy({depth.data(), variance.data(), estimate.opacity.data()},
                                                    truth.data(), options)});
    };
    add("volume", estimate.depth, estimate.variance);
    add("bp", estimate.depth_bp, estimate.variance_bp);
    add("refined", estimate.depth_refined, estimate.variance_refined);
    out.depth = {name, out.methods.front().accuracy};
    out.reliability = reliability(estimate.opacity.data(), truth.data());
  }

  static ViewDepth countable(const DepthLayers& layers, const Image& depth, const PinholeCamera& camera) {
    ViewDepth view{camera, depth};
    for (std::size_t i = 0; i < view.depth.data().size(); ++i)
      if (!(layers.opacity.data()[i] > kHasDepth)) view.depth.data()[i] = 0;
    return view;
  }

  /// The object: the mask, else the true surface in the box, else what the run holds for opaque.
  static Mask object_pixels(const Photograph& photo, const DepthLayers* estimate, const Image& truth) {
    const std::vector<float>* planes = nullptr;
    float above = 0;
    if (!truth.empty()) {
      planes = &truth.data();
    } else if (estimate) {
      planes = &estimate->opacity.data();
      above = kHasDepth;
    }
    Mask object(photo.rgb.width(), photo.rgb.height());
    for (std::size_t i = 0; i < object.data().size(); ++i) {
      const bool valid = photo.valid.empty() || photo.valid.data()[i] > 0;
      const bool shown =
          !photo.foreground.empty() ? photo.foreground.data()[i] >= 128 : !planes || (*planes)[i] > above;
      object.data()[i] = valid && shown ? 255 : 0;
    }
    return object;
  }

  std::optional<NamedImageQuality> measure_render(const View& view, const DepthLayers* estimate,
                                                  const Image& truth) const {
    const fs::path file = view_path(source_.run.path, "render", view.name, ".png");
    if (!fs::is_regular_file(file)) return {};
    const Image render = read_image(file.string(), kAsItIs).rgb;
    const Photograph photo = source_.input->load(view);
    check_size(file, render, photo.rgb.width(), photo.rgb.height(), view.source);
    return quality(view.name, render, photo, object_pixels(photo, estimate, truth));
  }

  NamedImageQuality quality(const std::string& name, Image render, const Photograph& photo,
                            const Mask& object) const {
    Image shown = encoded_picture(photo.rgb, source_.run.file.info.exposure, source_.picture_response());
    for (std::size_t i = 0; i < photo.valid.data().size(); ++i)
      if (photo.valid.data()[i] == 0)
        std::fill_n(&shown.data()[3 * i], 3, 0.0f), std::fill_n(&render.data()[3 * i], 3, 0.0f);
    return {name, image_quality(render, shown, object), image_quality(render, shown, photo.valid)};
  }

  std::vector<PinholeCamera> known_cameras() const {
    std::vector<PinholeCamera> cameras;
    for (const std::string& name : source_.view_names)
      if (const View* view = source_.view(name)) cameras.push_back(view->camera);
    return cameras;
  }

  /// What two images see. A scan (points without triangles) holds nothing else, and hides nothing.
  void keep_seen_samples() {
    if (samples_.empty()) return;
    const std::vector<PinholeCamera> cameras = known_cameras();
    if (cameras.empty() || source_.surface->is_point_set()) {
      out_.notes.push_back("all of the true surface in the box counts, seen or not: " +
                           std::string(cameras.empty() ? "cameras are not known" : "it is a set of points"));
      seen_ = samples_;
    } else {
      const std::vector<int> sightings = count_sightings(*source_.surface, samples_, cameras, threads_);
      for (std::size_t i = 0; i < samples_.size(); ++i)
        if (sightings[i] >= 2) seen_.push_back(samples_[i]);
      if (seen_.empty()) out_.notes.push_back("no two images see any of the true surface in the box");
    }
    out_.surface_seen = static_cast<double>(seen_.size()) / static_cast<double>(samples_.size());
  }

  std::vector<double> distances() const {
    return options_.distances.empty() ? default_distances(out_.box_diagonal(), out_.voxel_size)
                                      : options_.distances;
  }

  void measure_surfaces() {
    if (seen_.empty()) return;
    truth_distance_.emplace(*source_.surface);
    const double cell = out_.voxel_size / 2;
    if (!estimates_.empty()) {
      add_points("depth points", one_point_a_cell(depth_points(estimates_, {}, threads_), cell));
      const DepthPointOptions agreeing{options_.views_agree, out_.voxel_size};
      add_points("depth points that " + std::to_string(options_.views_agree) + " views agree on",
                 one_point_a_cell(depth_points(estimates_, agreeing, threads_), cell));
      measure_pixels();
      add_points("depth points of sigma within " + short_number(options_.sure_within) + " voxels",
                 one_point_a_cell(depth_points(sure_, {}, threads_), cell));
    }
    if (!refined_.empty())
      add_points("refined depth points", one_point_a_cell(depth_points(refined_, {}, threads_), cell));
    saved_ = saved_voxels(source_.run.file.volume, static_cast<float>(options_.opacity_threshold),
                          static_cast<float>(options_.confidence_threshold));
    add_points("voxels", saved_.centres);
    if (source_.run_mesh) add_mesh("mesh", *source_.run_mesh);
    if (source_.estimate) add_mesh(source_.estimate_name, *source_.estimate);
  }

  /// The same pixels of the run's depth maps and of the true ones, a point each: as photographs weigh them.
  void measure_pixels() {
    if (truths_.empty()) return;
    session_.context().throw_if_cancelled();
    DepthPointOptions options;
    options.stride = pixel_stride(truths_, kMostDepthPixels);
    std::vector<Eigen::Vector3d> points = depth_points(compared_, options, threads_);
    const std::vector<Eigen::Vector3d> truth =
        points_in_box(depth_points(truths_, options, threads_), source_.box);
    const std::vector<Eigen::Vector3d> inside = points_in_box(points, source_.box);
    add_surface("depth points by pixel", inside, Mesh{std::move(points), {}}, truth);
    out_.surfaces.back().pixel_stride = options.stride;
  }

  void add_points(const std::string& name, std::vector<Eigen::Vector3d> points) {
    session_.context().throw_if_cancelled();
    const std::vector<Eigen::Vector3d> inside = points_in_box(points, source_.box);
    add_surface(name, inside, Mesh{std::move(points), {}}, seen_);
  }

  void add_mesh(const std::string& name, const Mesh& mesh) {
    if (mesh.is_point_set()) return add_points(name, mesh.points);
    add_surface(name, sample_surface(mesh, {options_.samples, options_.seed, source_.box}), mesh, seen_);
  }

  /// `truth`: the places of the true surface that are to be found.
  void add_surface(const std::string& name, const std::vector<Eigen::Vector3d>& points, Mesh mesh,
                   const std::vector<Eigen::Vector3d>& truth) {
    std::vector<double> to_truth = truth_distance_->of(points, threads_);
    std::vector<double> to_estimate = SurfaceDistance(std::move(mesh)).of(truth, threads_);
    out_.surfaces.push_back(
        {name, surface_accuracy(std::move(to_truth), std::move(to_estimate), distances())});
  }

  void measure_volume() {
    if (!truth_distance_) return;
    const auto in_voxels = [&](std::vector<double> distances) {
      for (double& d : distances) d /= out_.voxel_size;
      return distances;
    };
    const SurfaceDistance to_voxels(Mesh{saved_.centres, {}});  // those just outside the box cover, too
    SavedVoxels inside;
    for (std::size_t i = 0; i < saved_.centres.size(); ++i) {
      if (!source_.box.contains(saved_.centres[i])) continue;
      inside.centres.push_back(saved_.centres[i]);
      inside.opacity.push_back(saved_.opacity[i]);
    }
    out_.volume = volume_accuracy(inside.opacity, in_voxels(truth_distance_->of(inside.centres, threads_)),
                                  in_voxels(to_voxels.of(seen_, threads_)));
    measure_debris(inside);
  }

  /// Towards the sky, where the run or the truth has one.
  std::optional<Eigen::Vector3d> up() const {
    if (fs::is_directory(source_.run.path / "sky"))
      return read_skies(source_.run.path).front().sky_from_world.transpose() * Eigen::Vector3d::UnitZ();
    if (has_sky_truth(*source_.truth)) return Eigen::Vector3d::UnitZ();
    return {};
  }

  void measure_debris(const SavedVoxels& voxels) {
    const std::optional<Eigen::Vector3d> upwards = up();
    if (!upwards || source_.surface->is_point_set()) return;
    session_.context().throw_if_cancelled();
    const std::vector<SkyStand> stands = sky_stands(*source_.surface, voxels.centres, known_cameras(),
                                                    {*upwards, out_.voxel_size, out_.voxel_size}, threads_);
    out_.debris.push_back(sky_debris(voxels.opacity, stands, options_.opacity_threshold));
    if (options_.opacity_threshold < kOpaqueDebris)
      out_.debris.push_back(sky_debris(voxels.opacity, stands, kOpaqueDebris));
  }

  const RunRenderer& renderer() {
    if (!renderer_) renderer_.emplace(source_.run, RunRendererOptions{});
    return *renderer_;
  }

  void measure_held_out() {
    if (!source_.held_out) return;
    const bool gains = read_from_summary(source_.run.path, [&] {
      const nlohmann::json scene = source_.run.summary.value("scene", nlohmann::json::object());
      return scene.value("light", nlohmann::json::object()).value("illumination", "none") == "gain";
    });
    if (gains)
      out_.notes.push_back(
          "held-out views: one gain a channel is fitted to each, the one that leaves the least error");
    for (const View& view : source_.held_out->dataset.views) {
      session_.context().throw_if_cancelled();
      Rendering rendering = renderer()(view, session_.context());
      const Photograph photo = source_.held_out->load(view);
      const Mask object = object_mask(photo, rendering.opacity);
      if (gains) bring_to_light_of(photo, object, rendering.rgb);
      out_.held_out.push_back(
          quality(view.name, encoded_picture(rendering.rgb, 1, source_.picture_response()), photo, object));
    }
  }

  void bring_to_light_of(const Photograph& photo, const Mask& object, Image& rendered) const {
    const auto gain =
        display_gain(rendered, photo.rgb, source_.run.file.info.exposure, object, source_.picture_response());
    for (std::size_t i = 0; i < rendered.data().size(); ++i)
      rendered.data()[i] *= static_cast<float>(gain[i % 3]);
  }

  void measure_colors() {
    if (!source_.truth) return;
    std::vector<std::pair<const View*, fs::path>> views;
    std::size_t pixels = 0;
    for (const std::string& name : source_.view_names) {
      const View* view = source_.view(name);
      const auto file = view ? truth_file(*source_.truth, "albedo", name) : std::nullopt;
      if (!file) continue;
      views.emplace_back(view, *file);
      pixels += static_cast<std::size_t>(view->camera.intrinsics.width) * view->camera.intrinsics.height;
    }
    if (views.empty()) return note_unmatched("albedo", "image with a known camera");
    const RunRenderer alone(source_.run, {std::array<double, 3>{0, 0, 0}, false});
    std::vector<ColorPair> pairs;
    const std::size_t stride = 1 + pixels / kMostColorPixels;
    for (const auto& [view, file] : views) add_color_pairs(alone, *view, file, stride, pairs);
    out_.color = color_accuracy(std::move(pairs));
  }

  /// `alone` shows the box over black: no background or surround is taken for the object's colour.
  void add_color_pairs(const RunRenderer& alone, const View& view, const fs::path& file, std::size_t stride,
                       std::vector<ColorPair>& pairs) {
    session_.context().throw_if_cancelled();
    const Image albedo = read_image(file.string(), kAsItIs).rgb;
    const Rendering rendering = alone(view, session_.context());
    check_size(file, albedo, rendering.rgb.width(), rendering.rgb.height(), view.source);
    for (std::size_t i = 0; i < rendering.opacity.data().size(); i += stride) {
      const float opacity = rendering.opacity.data()[i];
      if (!(opacity > kHasDepth)) continue;
      if (const auto pair = color_pair(&rendering.rgb.data()[3 * i], opacity, &albedo.data()[3 * i]))
        pairs.push_back(*pair);
    }
  }

  void measure_light() {
    TrueDepths depths;
    for (const std::string& name : source_.view_names) depths.push_back(true_depth_of(source_, name));
    out_.light = cli::measure_light(source_, depths, session_);
    if (source_.truth && has_sky_truth(*source_.truth) && fs::is_directory(source_.run.path / "sky"))
      out_.skies = measure_skies(source_.run.path, *source_.truth, threads_);
  }

  void take_sections() {
    const LatticeFrame& frame = source_.run.file.volume.index(0).frame();
    const Eigen::Vector3d middle = source_.box.center();
    for (int axis = 0; axis < 3; ++axis) {
      const double position = options_.section ? (*options_.section)[axis] : middle[axis];
      Section section = opacity_section(source_.run.file.volume, axis, position);
      if (source_.surface) section.outline = surface_outline(*source_.surface, section, frame);
      out_.sections.push_back(std::move(section));
    }
  }

  void report(double fraction) {
    session_.context().throw_if_cancelled();
    Progress progress;
    progress.stage = "measuring";
    progress.fraction = fraction;
    session_.context().report(progress);
  }

  const EvalSource& source_;
  const MeasureOptions& options_;
  Session& session_;
  int threads_;
  RunMeasures out_;
  std::vector<Eigen::Vector3d> samples_, seen_;  ///< of the true surface; those that two views see
  std::vector<ViewDepth> estimates_, sure_, refined_;
  std::vector<ViewDepth> compared_, truths_;  ///< depth maps of the run and true ones of the same views
  SavedVoxels saved_;
  std::optional<SurfaceDistance> truth_distance_;
  std::optional<RunRenderer> renderer_;
};

}  // namespace

std::vector<double> default_distances(double diagonal, double voxel_size) {
  std::vector<double> distances{0.005 * diagonal, 0.01 * diagonal, voxel_size, 2 * voxel_size,
                                4 * voxel_size};
  std::sort(distances.begin(), distances.end());
  return distances;
}

Image true_depth_of(const EvalSource& source, const std::string& view_name) {
  const auto file = source.truth ? truth_file(*source.truth, "depth", view_name) : std::nullopt;
  if (!file) return {};
  Image depth = read_true_depth(*file);
  const View* view = source.view(view_name);
  return view ? depth_in_box(depth, view->camera, source.run.file.volume.index(0).frame().box()) : depth;
}

RunMeasures measure(const EvalSource& source, const MeasureOptions& options, Session& session) {
  return Measurement(source, options, session).take();
}

}  // namespace roxel::cli
