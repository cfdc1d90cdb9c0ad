#include "view_writer.h"
#include "common.h"

#include <algorithm>

#include "roxel/io/depth_file.h"
#include "roxel/io/image_file.h"
#include "roxel/report/markup.h"
#include "roxel/report/pictures.h"

namespace roxel::cli {
namespace {

constexpr int kSheetRows = 4;
constexpr int kThumbnailWidth = 400;

bool in_overview(int view_idx, int count) {
  for (int row = 0; row < kSheetRows; ++row)
    if (view_idx == (2 * row + 1) * count / (2 * kSheetRows)) return true;
  return false;
}

double share_opaque(const Image& opacity) {
  const auto opaque =
      std::count_if(opacity.data().begin(), opacity.data().end(), [](float a) { return a > 0.5f; });
  return static_cast<double>(opaque) / static_cast<double>(opacity.data().size());
}

/// The render's light in units of white, as image_error compares it.
Image in_whites(const Image& light, double white) {
  Image scaled = light;
  for (float& value : scaled.data()) value /= static_cast<float>(white);
  return scaled;
}

}  // namespace

Image over_light(Image photo, const Image& light, const std::array<float, 3>& view_light) {
  for (std::size_t i = 0; i < photo.data().size(); ++i) {
    const float by = light.empty() ? view_light[i % 3] : light.data()[i];
    photo.data()[i] = by > 0 ? photo.data()[i] / by : 0.0f;
  }
  return photo;
}

Mask object_mask(const Photograph& photo, const Image& opacity) {
  Mask mask(photo.rgb.width(), photo.rgb.height());
  for (std::size_t i = 0; i < mask.data().size(); ++i) {
    const bool valid = photo.valid.empty() || photo.valid.data()[i] > 0;
    const bool object =
        photo.foreground.empty() ? opacity.data()[i] > 0.5f : photo.foreground.data()[i] >= 128;
    mask.data()[i] = valid && object ? 255 : 0;
  }
  return mask;
}

ViewWriter::ViewWriter(std::filesystem::path run, const Dataset& dataset, double white, Response response)
    : run_(std::move(run)),
      dataset_(dataset),
      white_(white),
      response_(response),
      figures_(dataset.views.size()) {
  for (std::size_t v = 0; v < figures_.size(); ++v) figures_[v].name = dataset.views[v].name;
}

void ViewWriter::write(const ViewResult& result) {
  ViewFigures figures = figures_[result.view_idx];
  const Pictures pictures = make_pictures(result);
  write_files(result, figures.name, pictures);
  ImageError error;
  if (!result.depth.opacity.empty()) figures.depth_share = share_opaque(result.depth.opacity);
  if (!result.rendering.rgb.empty()) {
    // Not the depth map's opacity: that has seen the photograph, and is low where the volume explains it
    // badly.
    error = image_error(in_whites(result.rendering.rgb, white_), in_whites(result.photo.rgb, white_),
                        object_mask(result.photo, result.rendering.opacity));
    figures.reprojection_rms = error.rms_percent();
    figures.object_pixels = error.pixel_count;
  }
  std::optional<ReportView> shown;
  if (report_.contains(result.view_idx)) shown = report_view(result, figures, pictures);
  std::lock_guard lock(mutex_);
  if (shown) report_.at(result.view_idx) = std::move(*shown);
  figures_[result.view_idx] = std::move(figures);
  errors_[result.view_idx] = error;
  keep_for_overview(result.view_idx, pictures);
}

ViewWriter::Pictures ViewWriter::make_pictures(const ViewResult& result) const {
  Pictures pictures;
  pictures.photo = encoded_picture(result.photo.rgb, white_, response_);
  if (!result.light.empty() || result.view_light != std::array<float, 3>{1, 1, 1})
    pictures.canonical =
        encoded_picture(over_light(result.photo.rgb, result.light, result.view_light), white_, response_);
  if (!result.rendering.rgb.empty()) {
    pictures.render = encoded_picture(result.rendering.rgb, white_, response_);
    pictures.error =
        error_picture(pictures.render, pictures.photo, result.photo.valid, result.photo.foreground);
  }
  const DepthMap& map = result.depth;
  if (!map.depth.empty())
    pictures.depth = depth_picture(map.depth, map.opacity, shown_depths(map.depth, map.opacity));
  return pictures;
}

void ViewWriter::write_files(const ViewResult& result, const std::string& name,
                             const Pictures& pictures) const {
  const auto put = [&](const char* kind, const Image& picture) {
    if (!picture.empty()) write_png(view_path(run_, kind, name, ".png").string(), picture, kAsItIs);
  };
  if (!result.depth.depth.empty())
    write_depth(depth_path(run_, name), {result.depth.depth, result.depth.variance, result.depth.opacity},
                depth_compression_);
  put("depth", pictures.depth);
  put("render", pictures.render);
  put("error", pictures.error);
  if (!result.light.empty()) {
    write_exr(view_path(run_, "light", name, ".exr").string(), rgb_channels(result.light),
              ExrPrecision::kHalf);
    put("light", pictures.canonical);
  }
}

void ViewWriter::keep_for_overview(int view_idx, const Pictures& pictures) {
  if (!in_overview(view_idx, static_cast<int>(figures_.size()))) return;
  for (const Image* picture : {&pictures.photo, &pictures.render, &pictures.depth, &pictures.error})
    if (!picture->empty()) sheet_[view_idx].push_back(thumbnail(*picture, kThumbnailWidth));
}

void ViewWriter::keep_for_report(double voxel_size) {
  voxel_size_ = voxel_size;
  for (const int view_idx : report_views(static_cast<int>(figures_.size()))) report_[view_idx];
}

ReportView ViewWriter::report_view(const ViewResult& result, const ViewFigures& figures,
                                   const Pictures& pictures) const {
  ReportView view{figures.name, {}, {report_picture("photograph", pictures.photo)}};
  if (figures.reprojection_rms) view.figures = "RMS " + short_number(*figures.reprojection_rms, 3) + " %";
  if (!pictures.canonical.empty()) view.pictures.push_back(report_picture(kOverItsLight, pictures.canonical));
  if (!pictures.render.empty()) {
    view.pictures.push_back(report_picture("render", pictures.render));
    view.pictures.push_back(report_picture("error", pictures.error));
  }
  const DepthMap& map = result.depth;
  if (!map.depth.empty()) {
    view.pictures.push_back(report_picture("depth", pictures.depth));
    view.pictures.push_back(
        report_picture("sigma of depth", sigma_picture(map.variance, map.depth, map.opacity, voxel_size_)));
  }
  return view;
}

std::vector<ReportView> ViewWriter::report_pictures() const {
  std::vector<ReportView> views;
  for (const auto& [view_idx, view] : report_)
    if (!view.pictures.empty()) views.push_back(view);
  return views;
}

void ViewWriter::write_overview() const {
  std::vector<std::vector<Image>> rows;
  for (const auto& [view_idx, row] : sheet_) rows.push_back(row);
  if (!rows.empty()) write_png((run_ / "overview.png").string(), contact_sheet(rows), kAsItIs);
}

std::optional<double> ViewWriter::reprojection_rms() const {
  if (std::none_of(figures_.begin(), figures_.end(), [](const ViewFigures& f) { return f.reprojection_rms; }))
    return {};
  ImageError all;
  for (const auto& [view_idx, error] : errors_) all.add(error);
  return all.rms_percent();
}

}  // namespace roxel::cli
