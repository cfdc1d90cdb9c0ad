#include "mesh_stage.h"
#include "common.h"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <chrono>
#include <functional>

#include "roxel/base/atomic_file.h"
#include "roxel/base/error.h"
#include "roxel/base/formatted.h"
#include "roxel/base/parallel.h"
#include "roxel/base/peak_memory.h"
#include "roxel/depth/scaled_view.h"
#include "roxel/io/depth_file.h"
#include "roxel/io/image_bytes.h"
#include "roxel/io/image_file.h"
#include "roxel/io/surface_ply.h"
#include "roxel/io/textured_file.h"
#include "roxel/report/pictures.h"
#include "roxel/report/run_record.h"
#include "roxel/solve/summary.h"
#include "roxel/surface/depth_fusion.h"
#include "roxel/surface/mesh_picture.h"
#include "roxel/surface/simplification.h"
#include "roxel/surface/surface_extraction.h"
#include "roxel/surface/volume_colors.h"
#include "run_input.h"

namespace roxel::cli {
namespace {

namespace fs = std::filesystem;

constexpr int kTurnSize = 240;          ///< pixels
constexpr double kOnTheirSides = 1.02;  ///< how much more alike photographs are in what is right than up
constexpr int kShownViews = 4;
constexpr int kMostViewsHeld = 4;          ///< photographs at once
constexpr double kBytesPerPixelHeld = 40;  ///< of one, while it is read
constexpr int kShownWidth = 480;

std::string size_text(int width, int height) {
  return std::to_string(width) + " x " + std::to_string(height);
}

/// What the run's depth file says of a view.
FusionView read_fusion_view(const fs::path& file, const View& view) {
  DepthLayers layers = read_depth(file);
  const Intrinsics& k = view.camera.intrinsics;
  if (layers.depth.width() != k.width || layers.depth.height() != k.height)
    throw_invalid(file.string(), size_text(layers.depth.width(), layers.depth.height()) + " pixels",
                  size_text(k.width, k.height) + " as " + view.source + " has");
  DepthEstimates best = best_estimates(layers);
  return {view.camera, std::move(best.depth), std::move(best.variance), std::move(layers.opacity),
          std::move(layers.normal)};
}

/// The whole job, step by step.
class MeshStage {
 public:
  MeshStage(const MeshInput& input, const MeshOptions& options, const fs::path& results, RunContext& context)
      : input_(input),
        options_(options),
        results_(results),
        context_(context),
        voxel_size_(options.voxel_size.value_or(input.volume.index(0).frame().voxel_size / 2)) {}

  MeshResult make() {
    check_mesh_voxel_size(options_, input_.volume.index(0).frame().voxel_size);
    find_depth();
    fuse_and_extract();
    simplify();
    color();
    lap("mesh: colour", 0.5);
    if (options_.texture == MeshTexture::kNone) {
      write_surface_ply(results_ / "mesh.ply", surface_);
    } else {
      texture();
    }
    say();
    if (options_.pictures) {
      take_pictures();
      lap("mesh: pictures", 1);
    }
    out_.figures["stages"] = std::move(stages_);
    return std::move(out_);
  }

 private:
  using Clock = std::chrono::steady_clock;

  void lap(const char* name, double fraction) {
    const auto now = Clock::now();
    stages_.push_back(
        to_json(StageRecord{name, std::chrono::duration<double>(now - last_).count(), memory_.bytes()}));
    memory_.restart();
    last_ = now;
    Progress progress;
    progress.stage = "mesh";
    progress.fraction = input_.progress_begin + fraction * (input_.progress_end - input_.progress_begin);
    context_.report(progress);
    context_.throw_if_cancelled();
  }

  void find_depth() {
    for (std::size_t v = 0; v < input_.dataset.views.size(); ++v)
      if (fs::is_regular_file(depth_path(input_.depth_run, input_.dataset.views[v].name)))
        with_depth_.push_back(static_cast<int>(v));
    if (with_depth_.empty())
      throw_invalid(input_.depth_run.string(), "no depth/NAME.exr for any image of the data set",
                    "a run with depth maps (roxel reconstruct without --no-depth)");
    out_.figures["voxel_size"] = voxel_size_;
    out_.figures["views_with_depth"] = with_depth_.size();
  }

  void fuse_and_extract() {
    FusionOptions fusion;
    fusion.voxel_size = voxel_size_;
    fusion.box = input_.box;
    fusion.band = options_.band;
    fusion.hole_size = options_.hole_size;
    fusion.smooth = options_.smooth;
    fusion.most_bytes = bytes_left(input_.memory);
    const FusionViewLoader load = [&](int v) {
      const View& view = input_.dataset.views[with_depth_[v]];
      return read_fusion_view(depth_path(input_.depth_run, view.name), view);
    };
    const DistanceField field = fused(load, fusion);
    out_.figures["fused_samples"] = field.sample_count();
    lap("mesh: fusion", 0.15);
    Extraction extraction = extract_surface(
        field, {options_.min_views, options_.hole_size, options_.smallest_part, context_.thread_count()});
    if (extraction.surface.mesh.triangles.empty())
      throw NoSurface(input_.depth_run.string() + ": found no surface that " +
                      std::to_string(options_.min_views) +
                      " views agree on and that is large enough, expected --min-views 1, a smaller "
                      "--smallest-part, or better depth maps");
    out_.figures["extracted_triangles"] = extraction.surface.mesh.triangles.size();
    out_.figures["unsupported_triangles"] = extraction.unsupported;
    out_.figures["debris_triangles"] = extraction.debris;
    out_.figures["closing_triangles"] = extraction.closed;
    surface_ = std::move(extraction.surface);
    lap("mesh: extraction", 0.2);
  }

  DistanceField fused(const FusionViewLoader& load, const FusionOptions& fusion) const {
    try {
      return fuse_depth(static_cast<int>(with_depth_.size()), load, fusion, context_);
    } catch (const NoSurface& error) {
      throw NoSurface(depth_folder() + ": " + error.what());
    } catch (const InvalidInput& error) {
      throw InvalidInput(depth_folder() + ": " + error.what());
    }
  }

  std::string depth_folder() const { return (input_.depth_run / "depth").string(); }

  void simplify() {
    const auto extracted = std::ssize(surface_.mesh.triangles);
    if (options_.faces && *options_.faces > extracted)
      out_.warnings.push_back("--faces " + std::to_string(*options_.faces) + ": the surface has only " +
                              std::to_string(extracted) + " triangles; all are kept");
    // Of all triangles, which are small and regular; those that are left include slivers, whose normals are
    // anything. Points that stay keep theirs.
    surface_.normals = point_normals(surface_.mesh);
    try {
      surface_ = simplified(surface_, {options_.faces, options_.error * voxel_size_});
    } catch (const InvalidInput& error) {
      throw InvalidInput("--faces: " + std::string(error.what()));
    }
    out_.figures["triangles"] = surface_.mesh.triangles.size();
    out_.figures["points"] = surface_.mesh.points.size();
    lap("mesh: simplification", 0.3);
  }

  TextureView texture_view(int v) const {
    const View& view = input_.dataset.views[v];
    Photograph photo = input_.load(view);
    for (float& value : photo.rgb.data()) value /= static_cast<float>(input_.info.exposure);
    if (photo.foreground.empty()) return {view.camera, std::move(photo.rgb), std::move(photo.valid)};
    for (std::size_t i = 0; i < photo.valid.data().size(); ++i)
      photo.foreground.data()[i] = std::min(photo.foreground.data()[i], photo.valid.data()[i]);
    return {view.camera, std::move(photo.rgb), std::move(photo.foreground)};
  }

  /// As many photographs as half of the memory that is left has room for.
  int views_held() const {
    const double largest = std::ranges::max(pixels_of_views(input_.dataset));
    const double fit = 0.5 * static_cast<double>(bytes_left(input_.memory)) / (kBytesPerPixelHeld * largest);
    return std::clamp(static_cast<int>(std::min<double>(fit, kMostViewsHeld)), 1, kMostViewsHeld);
  }

  int view_count() const { return static_cast<int>(input_.dataset.views.size()); }

  void color() {
    surface_.colors =
        volume_colors(surface_.mesh.points, input_.volume, input_.info.colors, context_.thread_count());
    if (options_.colors == MeshColors::kCanonical) return;
    const MeshRays rays(surface_.mesh);
    SightOptions sight;
    sight.tolerance = voxel_size_;
    sight.views_held = views_held();
    const std::vector<Rgb> as_they_are(input_.dataset.views.size(), Rgb{1, 1, 1});
    surface_.colors = photograph_colors(
        surface_, rays, view_count(), [&](int v) { return texture_view(v); }, as_they_are, surface_.colors,
        sight, context_);
  }

  void texture() {
    TextureOptions wanted;
    wanted.largest_side = options_.texture_size;
    wanted.match_light = options_.colors == MeshColors::kCanonical;
    wanted.level_seams = options_.level_seams;
    wanted.sight_tolerance = voxel_size_;
    wanted.seam_cost = options_.seam_cost;
    wanted.transient = options_.transient;
    wanted.views_held = views_held();
    textured_ = textured(
        std::move(surface_), view_count(), [&](int v) { return texture_view(v); }, wanted, context_);
    out_.figures["texture"] = {{"width", textured_->picture.width()},
                               {"height", textured_->picture.height()},
                               {"charts", textured_->charts},
                               {"scale", textured_->scale},
                               {"unseen_triangles", textured_->unseen},
                               {"transient_views", textured_->transients},
                               {"seam_rms_before", textured_->seam_before},
                               {"seam_rms", textured_->seam_after}};
    lap("mesh: texture", 0.8);
    const TextureFormat format =
        options_.texture == MeshTexture::kJpeg ? TextureFormat::kJpeg : TextureFormat::kPng;
    const std::function<void()> files[] = {
        [&] { write_obj(results_ / "mesh.obj", *textured_, format); },
        [&] { write_glb(results_ / "mesh.glb", *textured_, format); },
        [&] { write_surface_ply(results_ / "mesh.ply", textured_->surface); }};
    parallel_for(std::ssize(files), context_.thread_count(), [&](std::int64_t i, int) { files[i](); });
    lap("mesh: writing", 0.9);
  }

  const Surface& final_surface() const { return textured_ ? textured_->surface : surface_; }

  /// Shaded and coloured views, one beside the other, and a turntable.
  void take_pictures() {
    const Surface& surface = final_surface();
    const MeshRays rays(surface.mesh);
    const HitColor color = textured_ ? HitColor(texture_colors(*textured_)) : point_colors(surface);
    MeshPictureOptions look;
    look.threads = context_.thread_count();
    std::vector<std::vector<Image>> rows;
    for (int i = 0; i < std::min(kShownViews, view_count()); ++i) {
      context_.throw_if_cancelled();
      const View& view =
          input_.dataset.views[(2 * i + 1) * view_count() / (2 * std::min(kShownViews, view_count()))];
      rows.push_back({thumbnail(shaded_picture(surface, rays, view.camera, look), kShownWidth),
                      thumbnail(colored_picture(rays, view.camera, color, look), kShownWidth)});
      out_.pictures.views.push_back({view.name,
                                     "",
                                     {report_picture("shaded", rows.back()[0]),
                                      report_picture(textured_ ? "textured" : "coloured", rows.back()[1])}});
    }
    write_png((results_ / "mesh_views.png").string(), contact_sheet(rows), kAsItIs);
    const Image strip = turntable(surface, rays, color);
    write_text_atomically(results_ / "mesh_turntable.jpg", jpeg_bytes(strip, 85));
    out_.pictures.turntable = jpeg_bytes(strip, 80);
    out_.pictures.turns = kTurns;
  }

  void say() {
    out_.text = std::to_string(final_surface().mesh.triangles.size()) + " triangles";
    if (textured_)
      out_.text += formatted(", texture of %d x %d from %ld charts", textured_->picture.width(),
                             textured_->picture.height(), static_cast<long>(textured_->charts));
    out_.text += "\n";
  }

  /// The mean of what is up in the photographs. Where they were taken on their sides, what is up in them
  /// turns with the way around, and the line to their right stays: then up is that, towards the cameras.
  Eigen::Vector3d up(const Eigen::Vector3d& middle) const {
    Eigen::Vector3d up = Eigen::Vector3d::Zero(), to_cameras = up;
    Eigen::Matrix3d ups = Eigen::Matrix3d::Zero(), rights = ups;
    for (const View& view : input_.dataset.views) {
      const Eigen::Vector3d own = -view.camera.pose.rotation.row(1).transpose(),
                            right = view.camera.pose.rotation.row(0).transpose();
      up += own;
      ups += own * own.transpose();
      rights += right * right.transpose();
      to_cameras += view.camera.pose.centre - middle;
    }
    const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> of_ups(ups), of_rights(rights);
    if (of_rights.eigenvalues()[2] > kOnTheirSides * of_ups.eigenvalues()[2]) {
      const Eigen::Vector3d right = of_rights.eigenvectors().col(2);
      return right.dot(to_cameras) < 0 ? -right : right;
    }
    return up.norm() > 1e-3 ? up.normalized() : Eigen::Vector3d::UnitZ();
  }

  Image turntable(const Surface& surface, const MeshRays& rays, const HitColor& color) const {
    Eigen::AlignedBox3d box;
    for (const Eigen::Vector3d& x : surface.mesh.points) box.extend(x);
    const Eigen::Vector3d axis = up(box.center());
    Eigen::Vector3d start = input_.dataset.views.front().camera.pose.centre - box.center();
    start -= start.dot(axis) * axis;
    start = start.norm() > 1e-6 ? start.normalized() : axis.unitOrthogonal();
    MeshPictureOptions look;
    look.samples = 1;
    look.threads = context_.thread_count();
    Image strip(kTurns * kTurnSize, 2 * kTurnSize, 3);
    for (int turn = 0; turn < kTurns; ++turn) {
      context_.throw_if_cancelled();
      const Eigen::AngleAxisd rotation(2 * 3.14159265358979323846 * turn / kTurns, axis);
      const PinholeCamera camera = orbit_camera(box.center(), box.diagonal().norm() / 2,
                                                rotation * start + 0.35 * axis, axis, kTurnSize);
      put(shaded_picture(surface, rays, camera, look), turn * kTurnSize, 0, strip);
      put(colored_picture(rays, camera, color, look), turn * kTurnSize, kTurnSize, strip);
    }
    return strip;
  }

  static void put(const Image& picture, int left, int top, Image& target) {
    for (int y = 0; y < picture.height(); ++y)
      std::copy_n(picture.pixel(0, y), 3 * picture.width(), target.pixel(left, top + y));
  }

  const MeshInput& input_;
  const MeshOptions& options_;
  const fs::path& results_;
  RunContext& context_;
  double voxel_size_;
  std::vector<int> with_depth_;  ///< views
  Surface surface_;
  std::optional<TexturedSurface> textured_;
  Clock::time_point last_ = Clock::now();
  PeakMemory memory_;
  nlohmann::ordered_json stages_ = nlohmann::ordered_json::array();
  MeshResult out_;
};

OptionTable<MeshOptions> make_mesh_table() {
  OptionTable<MeshOptions> table;
  table.group("Surface");
  table.add("mesh-voxel-size", &MeshOptions::voxel_size)
      .help("Step of the lattice that depth maps are fused on")
      .unit("world units")
      .above(0)
      .unset("half a voxel of the volume");
  table.add("mesh-band", &MeshOptions::band)
      .help("Half the width of the band around a depth in which it counts, in steps of the lattice")
      .range(1.5, 16)
      .source("measured on plane and head");
  table.add("min-views", &MeshOptions::min_views)
      .help("Views that must see a piece of surface")
      .range(1, 1000);
  table.add("hole-size", &MeshOptions::hole_size)
      .help(
          "Holes that are surrounded by surface and no larger than this are closed, in steps of the lattice; "
          "0: none")
      .range(0, 64);
  table.add("smallest-part", &MeshOptions::smallest_part)
      .help("Connected parts of less extent are left out, in steps of the lattice")
      .range(0, 1e9);
  table.add("mesh-smooth", &MeshOptions::smooth)
      .help(
          "How strongly distances of neighbours pull at those that few or unsure views have made; 0: not at "
          "all")
      .range(0, 100)
      .source("measured on plane and head");
  table.add("faces", &MeshOptions::faces)
      .help("Most triangles of the mesh")
      .range(4, 1000000000)
      .unset("as --mesh-error allows");
  table.add("mesh-error", &MeshOptions::error)
      .help("How far simplification may move the surface, in steps of the lattice; not used with --faces")
      .range(0, 100);
  table
      .add("colors", &MeshOptions::colors,
           {{"canonical", MeshColors::kCanonical}, {"image", MeshColors::kImage}})
      .help(
          "Colours of points and texture: in the volume's canonical light, or as the photographs have them");
  table
      .add("texture", &MeshOptions::texture,
           {{"png", MeshTexture::kPng}, {"jpeg", MeshTexture::kJpeg}, {"none", MeshTexture::kNone}})
      .help("Picture on the surface, in mesh.glb and mesh.obj; none: mesh.ply alone");
  table.add("texture-size", &MeshOptions::texture_size)
      .help("Longest side of the texture; charts are reduced until they fit")
      .unit("pixels")
      .range(64, 16384);
  table.add("seam-cost", &MeshOptions::seam_cost)
      .help("Cost of a seam between neighbouring triangles; 1 = what the worst view of a triangle costs")
      .range(0, 100);
  table.add("level-seams", &MeshOptions::level_seams).help("Even out colours where photographs meet");
  table.add("transient", &MeshOptions::transient)
      .help(
          "Photographs that differ by more from the median of what all show of a triangle are not used for "
          "it")
      .unit("display values, 0 to 1")
      .range(0, 1);
  table.add("mesh-pictures", &MeshOptions::pictures)
      .help("Pictures of the surface: mesh_views.png, mesh_turntable.jpg");
  return table;
}

}  // namespace

std::vector<std::string> mesh_files() {
  return {"mesh.ply", "mesh.glb", "mesh.obj",       "mesh.mtl",
          "mesh.png", "mesh.jpg", "mesh_views.png", "mesh_turntable.jpg"};
}

void check_mesh_voxel_size(const MeshOptions& options, double volume_voxel_size) {
  const double least = volume_voxel_size / 16;
  if (options.voxel_size && *options.voxel_size < least)
    throw_invalid("--mesh-voxel-size", formatted("%g", *options.voxel_size),
                  formatted("at least %g, a sixteenth of the volume's voxels", least));
}

MeshResult make_mesh(const MeshInput& input, const MeshOptions& options, const fs::path& results,
                     RunContext& context) {
  return MeshStage(input, options, results, context).make();
}

const OptionTable<MeshOptions>& mesh_option_table() {
  static const OptionTable<MeshOptions> table = make_mesh_table();
  return table;
}

}  // namespace roxel::cli
