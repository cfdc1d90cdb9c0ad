#pragma once
/// Writes what a run says of each view, and gathers the figures and the sheet of a few views side by side.

#include <filesystem>
#include <map>
#include <mutex>
#include <vector>

#include "roxel/color/response.h"
#include "roxel/eval/image_error.h"
#include "roxel/image/image.h"
#include "roxel/report/html_report.h"
#include "roxel/report/run_record.h"
#include "roxel/solve/run_stages.h"

namespace roxel::cli {

class ViewWriter {
 public:
  /// `white` is the radiance that pictures show as white, `response` how they encode light.
  ViewWriter(std::filesystem::path run, const Dataset& dataset, double white, Response response);

  /// Writes depth/NAME.exr and .png, render/NAME.png, error/NAME.png: those that the result has. Thread safe.
  void write(const ViewResult& result);

  /// overview.png: a row each for a few views; photograph, render, depth, error. Nothing without results.
  void write_overview() const;

  /// In the order of the data set's views, without hashes.
  const std::vector<ViewFigures>& figures() const { return figures_; }
  /// Those of the page, in that order; empty without keep_for_report.
  std::vector<ReportView> report_pictures() const;
  /// Before the first write: pictures for the page are kept, deviations in voxels of this size.
  void keep_for_report(double voxel_size);
  /// Before the first write: a later stage writes the depth files again, so they need not be small.
  void expect_more_depth() { depth_compression_ = ExrCompression::kNone; }
  /// Over all views together; none where nothing was rendered.
  std::optional<double> reprojection_rms() const;

 private:
  struct Pictures {
    Image photo, render, depth, error;
    Image canonical;  ///< the photograph under canonical light; empty where nothing is divided out
  };
  Pictures make_pictures(const ViewResult& result) const;
  void write_files(const ViewResult& result, const std::string& name, const Pictures& pictures) const;
  void keep_for_overview(int view_idx, const Pictures& pictures);
  ReportView report_view(const ViewResult& result, const ViewFigures& figures,
                         const Pictures& pictures) const;

  std::filesystem::path run_;
  const Dataset& dataset_;
  double white_;
  Response response_;
  std::mutex mutex_;
  std::vector<ViewFigures> figures_;
  std::map<int, ImageError> errors_;         ///< by view: summed in that order, whichever is written first
  std::map<int, std::vector<Image>> sheet_;  ///< thumbnails by view
  ExrCompression depth_compression_ = ExrCompression::kRunLength;
  double voxel_size_ = 0;             ///< 0: there is no report
  std::map<int, ReportView> report_;  ///< by view, those that the page shows
};

/// The photograph without its light, of each pixel or else of the view; black where that is not known.
Image over_light(Image photo, const Image& light, const std::array<float, 3>& view_light);
inline constexpr const char* kOverItsLight = "photograph over its light";

/// The pixels whose error counts: the foreground where the view has a mask, else those more opaque than one
/// half; only valid ones.
Mask object_mask(const Photograph& photo, const Image& opacity);

}  // namespace roxel::cli
