#include "roxel/report/run_measures.h"

#include <cmath>

#include "roxel/base/formatted.h"

namespace roxel {
namespace {

using nlohmann::ordered_json;

/// "-" for the distances of an estimate that has no points.
std::string distance_text(double distance, int digits) {
  return std::isfinite(distance) ? formatted("%.*g", digits, distance) : "-";
}

/// The shortest text of a number, as a key.
std::string key(double value) { return formatted("%g", value); }

ordered_json finite(double value) {
  return std::isfinite(value) ? ordered_json(value) : ordered_json(nullptr);
}

ordered_json accuracy_json(const DepthAccuracy& accuracy) {
  ordered_json within, within_distance = ordered_json::object();
  for (std::size_t i = 0; i < accuracy.thresholds.size(); ++i)
    within[key(accuracy.thresholds[i])] = accuracy.share_within(i);
  for (std::size_t i = 0; i < accuracy.distances.size(); ++i)
    within_distance[key(accuracy.distances[i])] = accuracy.share_within_distance(i);
  return {{"true_pixels", accuracy.true_pixels},
          {"share_found", accuracy.share_found()},
          {"share_within_voxels", within},
          {"share_within_units", within_distance},
          {"bias_voxels", accuracy.bias_voxels()},
          {"empty_pixels", accuracy.empty_pixels},
          {"share_of_empty_given_depth", accuracy.share_false()},
          {"share_within_sigma",
           {{"1", accuracy.share_within_sigma(1)},
            {"2", accuracy.share_within_sigma(2)},
            {"3", accuracy.share_within_sigma(3)}}},
          {"median_normalized_error", accuracy.median_normalized_error()},
          {"coverage_68", accuracy.share_within_sigma(1)},
          {"coverage_95", accuracy.share_within_sigma(1.96)},
          {"median_error_voxels", accuracy.median_error_voxels()},
          {"median_sigma_voxels", accuracy.median_sigma_voxels()},
          {"log_loss", accuracy.mean_log_loss()}};
}

ordered_json depth_json(const RunMeasures& measures) {
  if (measures.depth.empty()) return nullptr;
  ordered_json json = accuracy_json(total_depth(measures.depth));
  json["truth"] = measures.truth.value_or("");
  json["methods"] = ordered_json::object();
  for (const NamedDepthAccuracy& method : measures.depth_methods)
    json["methods"][method.name] = accuracy_json(method.accuracy);
  json["views"] = ordered_json::array();
  for (const NamedDepthAccuracy& view : measures.depth) {
    ordered_json entry{{"name", view.name}};
    entry.update(accuracy_json(view.accuracy));
    json["views"].push_back(entry);
  }
  return json;
}

ordered_json reliability_json(const Reliability& curve) {
  ordered_json bins = ordered_json::array();
  for (int bin = 0; bin < Reliability::kBins; ++bin)
    bins.push_back({{"mean_opacity", curve.mean_opacity(bin)},
                    {"share_with_surface", curve.surface_share(bin)},
                    {"pixels", curve.pixels[bin]}});
  return {{"expected_calibration_error", curve.expected_calibration_error()}, {"bins", bins}};
}

ordered_json calibration_json(const RunMeasures& measures) {
  if (measures.depth.empty()) return nullptr;
  const DepthAccuracy all = total_depth(measures.depth);
  return {{"calibrated_pixels", all.calibrated_pixels},
          {"coverage_68", all.share_within_sigma(1)},
          {"coverage_95", all.share_within_sigma(1.96)},
          {"normalized_error_bins",
           {{"width_sigma", 1.0 / DepthAccuracy::kBinsPerSigma}, {"pixels", all.normalized_errors}}},
          {"opacity", measures.opacity_reliability ? reliability_json(*measures.opacity_reliability)
                                                   : ordered_json(nullptr)}};
}

ordered_json surface_json(const NamedSurfaceAccuracy& surface) {
  const SurfaceAccuracy& a = surface.accuracy;
  ordered_json at = ordered_json::array();
  for (const DistanceShares& s : a.shares)
    at.push_back(
        {{"distance", s.distance}, {"precision", s.precision}, {"recall", s.recall}, {"f_score", s.f_score}});
  ordered_json json{{"name", surface.name},
                    {"points", a.estimate_points},
                    {"true_points", a.truth_points},
                    {"accuracy_90", finite(a.accuracy_90)},
                    {"mean_to_truth", finite(a.mean_to_truth)},
                    {"median_to_truth", finite(a.median_to_truth)},
                    {"mean_to_estimate", finite(a.mean_to_estimate)},
                    {"median_to_estimate", finite(a.median_to_estimate)},
                    {"within", at}};
  if (surface.pixel_stride > 0) json["pixel_stride"] = surface.pixel_stride;
  return json;
}

ordered_json volume_json(const RunMeasures& measures) {
  if (!measures.volume) return nullptr;
  const VolumeAccuracy& a = *measures.volume;
  ordered_json mean_opacity = ordered_json::array();
  for (int bin = 0; bin <= DistanceHistogram::kBins; ++bin)
    mean_opacity.push_back(a.histogram.mean_opacity(bin));
  return {{"opacity_threshold", measures.opacity_threshold},
          {"confidence_threshold", measures.confidence_threshold},
          {"voxels", a.voxels},
          {"share_within_4_voxels", a.share_close()},
          {"weighted_mean_opacity", a.weighted_mean_opacity()},
          {"surface_points", a.seen_points},
          {"share_of_surface_covered", a.share_covered()},
          {"histogram",
           {{"bin_voxels", DistanceHistogram::kBinVoxels},
            {"voxels", a.histogram.voxels},
            {"mean_opacity", mean_opacity}}}};
}

ordered_json debris_json(const RunMeasures& measures) {
  ordered_json list = ordered_json::array();
  for (const SkyDebris& d : measures.debris) {
    const auto part = [&](const VoxelSum& sum) {
      return ordered_json{
          {"voxels", sum.voxels}, {"share", d.share(sum)}, {"share_of_opacity", d.share_of_opacity(sum)}};
    };
    list.push_back({{"opacity_threshold", d.opacity_threshold},
                    {"voxels", d.all.voxels},
                    {"in_the_open", part(d.in_the_open)},
                    {"above_all", part(d.above_all)},
                    {"before_sky", part(d.before_sky)}});
  }
  return list;
}

ordered_json quality_json(const ImageQuality& q) {
  ordered_json json{
      {"pixels", q.pixels}, {"rms", q.rms()}, {"psnr_db", finite(q.psnr())}, {"ssim", q.ssim()}};
  for (int c = 0; c < 3; ++c)
    json[std::string(1, "rgb"[c])] = {{"rms", q.rms(c)}, {"psnr_db", finite(q.psnr(c))}, {"ssim", q.ssim(c)}};
  return json;
}

ordered_json quality_json(const std::vector<NamedImageQuality>& views) {
  if (views.empty()) return nullptr;
  const NamedImageQuality total = total_quality(views);
  ordered_json list = ordered_json::array();
  for (const NamedImageQuality& view : views)
    list.push_back(
        {{"name", view.name}, {"object", quality_json(view.object)}, {"all", quality_json(view.all)}});
  return {{"object", quality_json(total.object)}, {"all", quality_json(total.all)}, {"views", list}};
}

ordered_json color_json(const std::optional<ColorAccuracy>& color) {
  if (!color) return nullptr;
  return {{"pixels", color->pixels},
          {"scale", color->scale},
          {"mean_delta_e_2000", color->mean_delta_e},
          {"median_delta_e_2000", color->median_delta_e},
          {"delta_e_2000_90", color->delta_e_90},
          {"mean_relative_error", color->mean_relative},
          {"median_relative_error", color->median_relative}};
}

/// A cell of a CSV file: quoted where it must be (RFC 4180).
std::string cell(const std::string& text) {
  if (text.find_first_of(",\"\r\n") == std::string::npos) return text;
  std::string quoted = "\"";
  for (const char c : text) quoted += c == '"' ? std::string("\"\"") : std::string(1, c);
  return quoted + "\"";
}

/// A line each of what is named: views, or methods.
std::string depth_csv(const char* named, const std::vector<NamedDepthAccuracy>& entries) {
  const DepthAccuracy& all = entries.front().accuracy;
  std::string csv = std::string(named) + ",true_pixels,share_found";
  for (const double t : all.thresholds) csv += ",within_" + key(t) + "_voxels";
  for (const double d : all.distances) csv += ",within_" + key(d) + "_units";
  csv += ",share_of_empty_given_depth,bias_voxels,coverage_68,coverage_95\n";
  const auto row = [&](const std::string& name, const DepthAccuracy& a) {
    csv += cell(name) + formatted(",%lld,%.6g", static_cast<long long>(a.true_pixels), a.share_found());
    for (std::size_t i = 0; i < a.thresholds.size(); ++i) csv += formatted(",%.6g", a.share_within(i));
    for (std::size_t i = 0; i < a.distances.size(); ++i)
      csv += formatted(",%.6g", a.share_within_distance(i));
    csv += formatted(",%.6g,%.6g,%.6g,%.6g\n", a.share_false(), a.bias_voxels(), a.share_within_sigma(1),
                     a.share_within_sigma(1.96));
  };
  for (const NamedDepthAccuracy& entry : entries) row(entry.name, entry.accuracy);
  return csv;
}

std::string color_csv(const ColorAccuracy& color) {
  return "pixels,scale,mean_delta_e_2000,median_delta_e_2000,delta_e_2000_90,mean_relative_error,median_"
         "relative_error\n" +
         formatted("%lld,%.6g,%.6g,%.6g,%.6g,%.6g,%.6g\n", static_cast<long long>(color.pixels), color.scale,
                   color.mean_delta_e, color.median_delta_e, color.delta_e_90, color.mean_relative,
                   color.median_relative);
}

std::string surfaces_csv(const std::vector<NamedSurfaceAccuracy>& surfaces) {
  std::string csv =
      "estimate,points,accuracy_90,mean_to_truth,mean_to_estimate,distance,precision,recall,f_score\n";
  for (const auto& [name, a, stride] : surfaces)
    for (const DistanceShares& s : a.shares)
      csv += cell(name) + formatted(",%lld,", static_cast<long long>(a.estimate_points)) +
             distance_text(a.accuracy_90, 6) + "," + distance_text(a.mean_to_truth, 6) + "," +
             distance_text(a.mean_to_estimate, 6) +
             formatted(",%.6g,%.6g,%.6g,%.6g\n", s.distance, s.precision, s.recall, s.f_score);
  return csv;
}

std::string histogram_csv(const DistanceHistogram& histogram) {
  std::string csv = "from_voxels,to_voxels,voxels,mean_opacity\n";
  for (int bin = 0; bin <= DistanceHistogram::kBins; ++bin) {
    const double from = bin * DistanceHistogram::kBinVoxels;
    const std::string to = bin < DistanceHistogram::kBins ? key(from + DistanceHistogram::kBinVoxels) : "";
    csv += formatted("%g,%s,%lld,%.6g\n", from, to.c_str(), static_cast<long long>(histogram.voxels[bin]),
                     histogram.mean_opacity(bin));
  }
  return csv;
}

std::string debris_csv(const std::vector<SkyDebris>& debris) {
  std::string csv =
      "opacity_threshold,voxels,in_the_open,in_the_open_share,in_the_open_share_of_opacity,above_all,"
      "above_all_share,above_all_share_of_opacity,before_sky,before_sky_share,before_sky_share_of_opacity\n";
  for (const SkyDebris& d : debris) {
    csv += formatted("%g,%lld", d.opacity_threshold, static_cast<long long>(d.all.voxels));
    for (const VoxelSum& part : {d.in_the_open, d.above_all, d.before_sky})
      csv += formatted(",%lld,%.6g,%.6g", static_cast<long long>(part.voxels), d.share(part),
                       d.share_of_opacity(part));
    csv += "\n";
  }
  return csv;
}

std::string quality_csv(const std::vector<NamedImageQuality>& views) {
  std::string csv = "view,over,pixels,rms,psnr_db,ssim,rms_r,rms_g,rms_b,ssim_r,ssim_g,ssim_b\n";
  const auto row = [&](const std::string& name, const char* over, const ImageQuality& q) {
    csv += cell(name) + formatted(",%s,%lld,%.6g,%.6g,%.6g", over, static_cast<long long>(q.pixels), q.rms(),
                                  q.psnr(), q.ssim());
    for (int c = 0; c < 3; ++c) csv += formatted(",%.6g", q.rms(c));
    for (int c = 0; c < 3; ++c) csv += formatted(",%.6g", q.ssim(c));
    csv += "\n";
  };
  std::vector<NamedImageQuality> rows = views;
  rows.push_back(total_quality(views));
  for (const NamedImageQuality& view : rows) {
    row(view.name, "object", view.object);
    row(view.name, "all", view.all);
  }
  return csv;
}

std::string calibration_csv(const DepthAccuracy& all) {
  std::string csv = "from_sigma,to_sigma,pixels\n";
  const int bins = static_cast<int>(all.normalized_errors.size());
  for (int bin = 0; bin < bins; ++bin) {
    const double width = 1.0 / DepthAccuracy::kBinsPerSigma;
    const std::string to = bin + 1 < bins ? key((bin + 1) * width) : "";
    csv += formatted("%g,%s,%lld\n", bin * width, to.c_str(),
                     static_cast<long long>(all.normalized_errors[bin]));
  }
  return csv;
}

std::string reliability_csv(const Reliability& curve) {
  std::string csv = "mean_opacity,share_with_surface,pixels\n";
  for (int bin = 0; bin < Reliability::kBins; ++bin)
    csv += formatted("%.6g,%.6g,%lld\n", curve.mean_opacity(bin), curve.surface_share(bin),
                     static_cast<long long>(curve.pixels[bin]));
  return csv;
}

std::string quality_text(const char* title, const std::vector<NamedImageQuality>& views) {
  if (views.empty()) return "";
  const NamedImageQuality total = total_quality(views);
  std::string text =
      formatted("| %s (%zu) | RMS %% | PSNR dB | SSIM |\n|---|---:|---:|---:|\n", title, views.size());
  for (const auto& [name, q] : {std::pair{"object", total.object}, {"all pixels", total.all}})
    text += formatted("| %s | %.2f | %.2f | %.4f |\n", name, 100 * q.rms(), q.psnr(), q.ssim());
  return text + "\n";
}

std::string surfaces_text(const RunMeasures& measures) {
  if (measures.surfaces.empty()) return "";
  std::string head =
      "| surface | points | accuracy 90 % | within | precision % | recall % | F "
      "|\n|---|---:|---:|---:|---:|---:|---:|\n";
  for (const NamedSurfaceAccuracy& surface : measures.surfaces) {
    const SurfaceAccuracy& a = surface.accuracy;
    for (std::size_t i = 0; i < a.shares.size(); ++i) {
      const DistanceShares& s = a.shares[i];
      head += i == 0 ? formatted("| %s | %lld | %s", surface.title().c_str(),
                                 static_cast<long long>(a.estimate_points),
                                 distance_text(a.accuracy_90, 4).c_str())
                     : std::string("| | | ");
      head += formatted(" | %.4g | %.2f | %.2f | %.4f |\n", s.distance, 100 * s.precision, 100 * s.recall,
                        s.f_score);
    }
  }
  return head + "\n";
}

std::string volume_text(const RunMeasures& measures) {
  if (!measures.volume) return "";
  const VolumeAccuracy& a = *measures.volume;
  return formatted(
      "| voxels of opacity >= %g | within 4 voxels %% | weighted mean opacity %% | surface covered %% "
      "|\n|---:|---:|---:|---:|\n"
      "| %lld | %.2f | %.2f | %.2f |\n\n",
      measures.opacity_threshold, static_cast<long long>(a.voxels), 100 * a.share_close(),
      100 * a.weighted_mean_opacity(), 100 * a.share_covered());
}

std::string debris_text(const RunMeasures& measures) {
  if (measures.debris.empty()) return "";
  std::string text =
      "| sky debris: voxels of opacity | voxels | in the open | % | of opacity % | above all | % | of "
      "opacity % "
      "| before the sky | % | of opacity % |\n|---:|---:|---:|---:|---:|---:|---:|---:|---:|---:|---:|\n";
  for (const SkyDebris& d : measures.debris) {
    text += formatted("| >= %g | %lld", d.opacity_threshold, static_cast<long long>(d.all.voxels));
    for (const VoxelSum& part : {d.in_the_open, d.above_all, d.before_sky})
      text += formatted(" | %lld | %.3f | %.3f", static_cast<long long>(part.voxels), 100 * d.share(part),
                        100 * d.share_of_opacity(part));
    text += " |\n";
  }
  return text + "\n";
}

std::string calibration_text(const RunMeasures& measures) {
  if (measures.depth.empty()) return "";
  const DepthAccuracy all = total_depth(measures.depth);
  std::string text =
      formatted("depth within 1 sigma %.1f %% (honest: 68.3), within 1.96 sigma %.1f %% (95.0)\n",
                100 * all.share_within_sigma(1), 100 * all.share_within_sigma(1.96));
  if (measures.opacity_reliability)
    text += formatted("opacity is off by %.3f on average (expected calibration error)\n",
                      measures.opacity_reliability->expected_calibration_error());
  return text;
}

std::string color_text(const std::optional<ColorAccuracy>& color) {
  if (!color) return "";
  return formatted(
      "colour against albedo: CIEDE2000 mean %.2f, median %.2f; relative error mean %.1f %%, median %.1f %% "
      "(scale %.4g)\n",
      color->mean_delta_e, color->median_delta_e, 100 * color->mean_relative, 100 * color->median_relative,
      color->scale);
}

}  // namespace

std::string NamedSurfaceAccuracy::title() const {
  return pixel_stride > 1 ? name + ", 1 in " + std::to_string(pixel_stride * pixel_stride) : name;
}

bool RunMeasures::empty() const {
  return depth.empty() && reprojection.empty() && surfaces.empty() && !volume && images.empty() &&
         held_out.empty() && !color && light.empty() && skies.empty();
}

DepthAccuracy total_depth(const std::vector<NamedDepthAccuracy>& views) {
  DepthAccuracy all;
  for (std::size_t i = 0; i < views.size(); ++i) {
    if (i == 0)
      all = views[i].accuracy;
    else
      all.add(views[i].accuracy);
  }
  return all;
}

NamedImageQuality total_quality(const std::vector<NamedImageQuality>& views) {
  NamedImageQuality total{"all", {}, {}};
  for (const NamedImageQuality& view : views) {
    total.object.add(view.object);
    total.all.add(view.all);
  }
  return total;
}

ordered_json to_json(const RunMeasures& measures) {
  ordered_json json{{"run", measures.run},
                    {"voxel_size", measures.voxel_size},
                    {"box_diagonal", measures.box_diagonal()},
                    {"reprojection_rms_percent", measures.reprojection_rms_percent
                                                     ? ordered_json(*measures.reprojection_rms_percent)
                                                     : ordered_json(nullptr)}};
  json["depth"] = depth_json(measures);
  json["calibration"] = calibration_json(measures);
  json["surface_samples"] = measures.surface_samples;
  json["surface_seen_by_two_views"] = measures.surface_seen;
  json["surfaces"] = ordered_json::array();
  for (const NamedSurfaceAccuracy& surface : measures.surfaces)
    json["surfaces"].push_back(surface_json(surface));
  json["volume"] = volume_json(measures);
  if (!measures.debris.empty()) json["sky_debris"] = debris_json(measures);
  json["images"] = quality_json(measures.images);
  json["held_out"] = quality_json(measures.held_out);
  json["color"] = color_json(measures.color);
  json["reprojection"] = ordered_json::array();
  for (const auto& [name, rms] : measures.reprojection)
    json["reprojection"].push_back({{"name", name}, {"rms_percent", rms}});
  if (!measures.light.empty()) json["light"] = to_json(measures.light);
  if (!measures.skies.empty()) json["skies"] = to_json(measures.skies);
  json["notes"] = measures.notes;
  return json;
}

std::vector<std::pair<std::string, std::string>> csv_tables(const RunMeasures& measures) {
  std::vector<std::pair<std::string, std::string>> tables;
  if (!measures.depth.empty()) {
    const DepthAccuracy total = total_depth(measures.depth);
    std::vector<NamedDepthAccuracy> views = measures.depth;
    views.push_back({"all", total});
    tables.emplace_back("depth.csv", depth_csv("view", views));
    tables.emplace_back("depth_error_over_sigma.csv", calibration_csv(total));
  }
  if (!measures.depth_methods.empty())
    tables.emplace_back("depth_methods.csv", depth_csv("method", measures.depth_methods));
  if (measures.opacity_reliability)
    tables.emplace_back("opacity_reliability.csv", reliability_csv(*measures.opacity_reliability));
  if (!measures.surfaces.empty()) tables.emplace_back("surfaces.csv", surfaces_csv(measures.surfaces));
  if (measures.volume) tables.emplace_back("voxel_distances.csv", histogram_csv(measures.volume->histogram));
  if (!measures.debris.empty()) tables.emplace_back("sky_debris.csv", debris_csv(measures.debris));
  if (!measures.images.empty()) tables.emplace_back("images.csv", quality_csv(measures.images));
  if (!measures.held_out.empty()) tables.emplace_back("held_out.csv", quality_csv(measures.held_out));
  if (measures.color) tables.emplace_back("color.csv", color_csv(*measures.color));
  if (!measures.light.empty()) tables.emplace_back("light.csv", csv_table(measures.light));
  if (!measures.skies.empty()) tables.emplace_back("skies.csv", csv_table(measures.skies));
  return tables;
}

std::string to_text(const RunMeasures& measures, std::size_t most_views) {
  std::string text;
  if (!measures.depth.empty()) text += depth_accuracy_table(measures.depth, most_views) + "\n";
  if (!measures.depth_methods.empty()) text += depth_methods_table(measures.depth_methods) + "\n";
  text += surfaces_text(measures) + volume_text(measures) + debris_text(measures) +
          quality_text("images", measures.images) + quality_text("held-out images", measures.held_out) +
          calibration_text(measures) + color_text(measures.color) + to_text(measures.light) +
          to_text(measures.skies);
  if (measures.reprojection_rms_percent)
    text += formatted("reprojection error %.2f %% of full scale\n", *measures.reprojection_rms_percent);
  for (const std::string& note : measures.notes) text += "note: " + note + "\n";
  return text;
}

}  // namespace roxel
