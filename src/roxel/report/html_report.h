#pragma once
/// report.html: one page that holds all it shows, for a screen, a phone and paper.

#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "roxel/report/run_measures.h"

namespace roxel {

/// A picture of a view, already a file of its own (data_uri).
struct ReportPicture {
  std::string caption;
  std::string uri;
};

struct ReportView {
  std::string name;
  std::string figures = {};  ///< "RMS 2.1 %"
  std::vector<ReportPicture> pictures = {};
};

/// The surface: shaded and textured views, and a strip of square pictures from all around, shaded above
/// coloured.
struct ReportMesh {
  std::vector<ReportView> views = {};
  std::string turntable = {};  ///< bytes of a JPEG; empty: none
  int turns = 0;               ///< pictures side by side in it
};

struct ReportContent {
  nlohmann::ordered_json summary;      ///< of the run, as docs/format.md has it
  std::vector<ReportView> views = {};  ///< those that are shown
  ReportMesh mesh = {};                ///< no views: there is no mesh
  std::vector<Section> sections = {};
  std::vector<float> opacities = {};        ///< of the box's voxels
  const RunMeasures* measures = nullptr;    ///< against the truth; null: not measured
  std::vector<ReportView> skies = {};       ///< of nodes: sphere, masks, fit, error
  std::string skies_from = {};              ///< the run that they were taken from; empty: this one
  nlohmann::ordered_json their_skies = {};  ///< "skies" of that run's summary
};

/// Everything from outside is escaped; nothing is fetched from anywhere, and there are no scripts.
std::string html_report(const ReportContent& content);

/// Most views that a report shows; larger runs show every n-th.
inline constexpr int kMostReportViews = 12;
/// Which of `count` views are shown, ascending.
std::vector<int> report_views(int count);

inline constexpr int kReportPictureWidth = 320;
/// A photograph, render or other picture of a view at the size that reports have.
/// `width`: at most, pixels.
ReportPicture report_picture(const std::string& caption, const Image& picture,
                             int width = kReportPictureWidth);

}  // namespace roxel
