#include "roxel/report/measure_plots.h"

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>

#include "roxel/report/markup.h"

namespace roxel {
namespace {

using nlohmann::ordered_json;

NamedPlot surface_plot(const NamedSurfaceAccuracy& surface, std::size_t idx) {
  PlotSeries precision{"precision", {}, {}}, recall{"recall", {}, {}}, f_score{"F-score", {}, {}};
  for (const DistanceShares& s : surface.accuracy.curve) {
    for (PlotSeries* series : {&precision, &recall, &f_score}) series->x.push_back(s.distance);
    precision.y.push_back(s.precision);
    recall.y.push_back(s.recall);
    f_score.y.push_back(s.f_score);
  }
  return {"surface_" + std::to_string(idx + 1),
          {"Surface: " + surface.name,
           {"distance [world units]", 0.0},
           {"share", 0.0, 1.0},
           {precision, recall, f_score}}};
}

/// Bars of a histogram of voxels by their distance from the truth; the last stands for all that is farther.
NamedPlot distance_plot(const DistanceHistogram& histogram) {
  PlotSeries bars{"", {}, {}, PlotStyle::kBars, DistanceHistogram::kBinVoxels};
  for (int bin = 0; bin <= DistanceHistogram::kBins; ++bin) {
    bars.x.push_back(bin * DistanceHistogram::kBinVoxels);
    bars.y.push_back(static_cast<double>(histogram.voxels[bin]));
  }
  return {"voxel_distances",
          {"Voxels by distance from the truth",
           {"distance [voxels], last: 10 and more"},
           {"voxels", 0.0},
           {bars}}};
}

NamedPlot opacity_by_distance_plot(const DistanceHistogram& histogram) {
  PlotSeries bars{"", {}, {}, PlotStyle::kBars, DistanceHistogram::kBinVoxels};
  for (int bin = 0; bin <= DistanceHistogram::kBins; ++bin) {
    bars.x.push_back(bin * DistanceHistogram::kBinVoxels);
    bars.y.push_back(histogram.mean_opacity(bin));
  }
  return {"voxel_opacities",
          {"Mean opacity by distance from the truth",
           {"distance [voxels], last: 10 and more"},
           {"mean opacity", 0.0, 1.0},
           {bars}}};
}

/// The density of |error| / sigma beside that of honest Gaussian errors.
NamedPlot normalized_error_plot(const DepthAccuracy& all) {
  constexpr int kGroup = 5;  // bins to a bar: 0.2 sigma
  constexpr double kWidth = static_cast<double>(kGroup) / DepthAccuracy::kBinsPerSigma, kShown = 5;
  PlotSeries bars{"measured", {}, {}, PlotStyle::kBars, kWidth}, honest{"honest", {}, {}, PlotStyle::kDashes};
  for (int bar = 0; bar * kWidth < kShown - 1e-9; ++bar) {
    std::int64_t count = 0;
    for (int i = 0; i < kGroup; ++i) count += all.normalized_errors[bar * kGroup + i];
    bars.x.push_back(bar * kWidth);
    bars.y.push_back(static_cast<double>(count) /
                     (kWidth * static_cast<double>(std::max<std::int64_t>(all.calibrated_pixels, 1))));
  }
  for (double k = 0; k <= kShown; k += 0.1) {
    honest.x.push_back(k);
    honest.y.push_back(std::sqrt(2 / M_PI) * std::exp(-0.5 * k * k));
  }
  return {"depth_error_over_sigma",
          {"Depth error over its stated deviation",
           {"|error| / sigma", 0.0, kShown},
           {"density", 0.0},
           {bars, honest}}};
}

NamedPlot reliability_plot(const Reliability& curve) {
  PlotSeries points{"measured", {}, {}, PlotStyle::kPoints},
      honest{"honest", {0, 1}, {0, 1}, PlotStyle::kDashes};
  for (int bin = 0; bin < Reliability::kBins; ++bin) {
    if (curve.pixels[bin] == 0) continue;
    points.x.push_back(curve.mean_opacity(bin));
    points.y.push_back(curve.surface_share(bin));
  }
  return {"opacity_reliability",
          {"Are opacities honest?",
           {"opacity of the ray", 0.0, 1.0},
           {"share with a true surface", 0.0, 1.0},
           {points, honest}}};
}

/// A bar a view.
NamedPlot quality_plot(const std::string& name, const std::string& title,
                       const std::vector<NamedImageQuality>& views) {
  PlotSeries bars{"", {}, {}, PlotStyle::kBars, 0.9};
  for (const NamedImageQuality& view : views) {
    bars.x.push_back(static_cast<double>(bars.x.size()) + 0.55);
    bars.y.push_back(100 * view.object.rms());
  }
  return {name,
          {title,
           {"view", 0.5, static_cast<double>(views.size()) + 0.5},
           {"RMS over the object [%]", 0.0},
           {bars}}};
}

/// The number of that name, or NaN: a gap.
double number_or_gap(const ordered_json& pass, const char* key) {
  const auto found = pass.is_object() ? pass.find(key) : pass.end();
  return pass.is_object() && found != pass.end() && found->is_number() ? found->get<double>() : NAN;
}

/// A line over all passes of all levels, counted through.
NamedPlot pass_plot(const ordered_json& passes, const char* name, const char* title, const char* key,
                    PlotAxis y) {
  std::vector<PlotSeries> levels;
  int count = 0;
  double level = 0;
  for (const auto& pass : passes) {
    const double of_pass = number_or_gap(pass, "level");
    if (levels.empty() || (of_pass != level && !std::isnan(of_pass))) {
      level = std::isnan(of_pass) ? 0 : of_pass;
      levels.push_back({"level " + short_number(level), {}, {}});
    }
    levels.back().x.push_back(++count);
    levels.back().y.push_back(number_or_gap(pass, key));
  }
  return {name, {title, {"pass", 0.5, count + 0.5}, std::move(y), std::move(levels)}};
}

}  // namespace

std::vector<NamedPlot> measure_plots(const RunMeasures& measures) {
  std::vector<NamedPlot> plots;
  for (std::size_t i = 0; i < measures.surfaces.size(); ++i)
    plots.push_back(surface_plot(measures.surfaces[i], i));
  if (measures.volume) {
    plots.push_back(distance_plot(measures.volume->histogram));
    plots.push_back(opacity_by_distance_plot(measures.volume->histogram));
  }
  if (!measures.depth.empty()) plots.push_back(normalized_error_plot(total_depth(measures.depth)));
  if (measures.opacity_reliability) plots.push_back(reliability_plot(*measures.opacity_reliability));
  if (!measures.images.empty())
    plots.push_back(quality_plot("images", "Renders against photographs", measures.images));
  if (!measures.held_out.empty())
    plots.push_back(quality_plot("held_out", "Held-out views", measures.held_out));
  return plots;
}

std::vector<NamedPlot> convergence_plots(const ordered_json& summary) {
  if (!summary.is_object()) return {};
  const ordered_json passes = summary.value("passes", ordered_json::array());
  if (!passes.is_array() || passes.empty()) return {};
  return {
      pass_plot(passes, "opacity_change", "Mean change of opacity", "mean_opacity_change",
                {"change a pass", {}, {}, true}),
      pass_plot(passes, "log_likelihood", "Mean log-likelihood", "mean_log_likelihood", {"per observation"}),
      pass_plot(passes, "active_voxels", "Voxels", "active_voxels", {"voxels", 0.0}),
      pass_plot(passes, "pass_seconds", "Time of a pass", "seconds", {"seconds", 0.0})};
}

NamedPlot opacity_plot(const std::vector<float>& opacities) {
  constexpr int kBins = 20;
  PlotSeries bars{"", {}, {}, PlotStyle::kBars, 1.0 / kBins};
  for (int bin = 0; bin < kBins; ++bin) bars.x.push_back(static_cast<double>(bin) / kBins);
  bars.y.assign(kBins, 0);
  for (const float opacity : opacities) ++bars.y[std::clamp(static_cast<int>(opacity * kBins), 0, kBins - 1)];
  return {"opacities", {"Voxels by opacity", {"opacity", 0.0, 1.0}, {"voxels", 1.0, {}, true}, {bars}}};
}

}  // namespace roxel
