#include "roxel/report/html_report.h"

#include <cmath>

#include "roxel/base/formatted.h"
#include "roxel/io/image_bytes.h"
#include "roxel/report/markup.h"
#include "roxel/report/measure_plots.h"
#include "roxel/report/pictures.h"
#include "roxel/report/section_picture.h"

namespace roxel {
namespace {

using nlohmann::ordered_json;

constexpr int kPictureQuality = 78;

constexpr const char* kStyle = R"(
:root { color-scheme: light; }
* { box-sizing: border-box; }
body { margin: 0 auto; max-width: 72rem; padding: 1rem; font: 16px/1.45 system-ui, sans-serif; color: #1a1a1a; background: #fff; }
h1 { font-size: 1.6rem; margin: 0 0 .2rem; overflow-wrap: anywhere; }
h2 { font-size: 1.25rem; margin: 2rem 0 .6rem; border-bottom: 2px solid #0072b2; padding-bottom: .2rem; }
h3 { font-size: 1rem; margin: 1rem 0 .3rem; overflow-wrap: anywhere; }
p { margin: .4rem 0; overflow-wrap: anywhere; }
.figures { display: grid; grid-template-columns: repeat(auto-fit, minmax(9rem, 1fr)); gap: .6rem; margin: 1rem 0; }
.figures div { border: 1px solid #ccc; border-radius: .4rem; padding: .5rem .7rem; }
.figures b { display: block; font-size: 1.25rem; }
.warning { border-left: .3rem solid #d55e00; background: #fdf1e7; padding: .4rem .8rem; margin: .5rem 0; }
.scroll { overflow-x: auto; }
table { border-collapse: collapse; margin: .5rem 0; font-variant-numeric: tabular-nums; }
th, td { border-bottom: 1px solid #ddd; padding: .25rem .7rem .25rem 0; text-align: right; vertical-align: top; }
td { white-space: nowrap; }
th:first-child, td:first-child { text-align: left; white-space: normal; min-width: 6rem; }
table.text td { text-align: left; white-space: normal; overflow-wrap: anywhere; }
table.text td:first-child { overflow-wrap: normal; }
.plots { display: grid; grid-template-columns: repeat(auto-fill, minmax(min(100%, 24rem), 1fr)); gap: 1rem; }
.plots svg, .sections svg { width: 100%; height: auto; display: block; }
.sections { display: grid; grid-template-columns: repeat(auto-fit, minmax(min(100%, 18rem), 1fr)); gap: 1rem; align-items: start; }
.sections figure { margin: 0; border: 1px solid #ccc; padding: .3rem; }
.sections svg { max-height: 32rem; }
figcaption { font-size: .85rem; color: #444; }
.view { break-inside: avoid; margin: 0 0 1rem; }
.view .row { display: grid; grid-auto-flow: column; grid-auto-columns: minmax(0, 1fr); gap: .3rem; }
.view .many { grid-auto-flow: row; grid-template-columns: repeat(5, minmax(0, 1fr)); }
.view figure { margin: 0; }
.view img { width: 100%; height: auto; display: block; background: #ddd; }
.settings { columns: 22rem; font-size: .85rem; font-family: ui-monospace, monospace; }
.settings div { break-inside: avoid; overflow-wrap: anywhere; }
.turntable { width: 240px; height: 480px; max-width: 100%; background-repeat: no-repeat; }
@keyframes turn { to { background-position-x: var(--end); } }
footer { margin-top: 2rem; font-size: .85rem; color: #555; border-top: 1px solid #ccc; padding-top: .4rem; }
@media (max-width: 40rem) {
  body { padding: .6rem; }
  .view .row, .view .many { grid-auto-flow: row; grid-template-columns: repeat(6, minmax(0, 1fr)); }
  .view figure { grid-column: span 3; }
  .view .five figure:nth-child(n+3) { grid-column: span 2; }
  table { font-size: .85rem; }
}
@media print {
  @page { margin: 14mm; }
  html { font-size: 9pt; }
  body { max-width: none; padding: 0; font-size: 1rem; }
  .settings { columns: 3; }
  h2, h3 { break-after: avoid; }
  .plots { grid-template-columns: 1fr 1fr; }
  .sections { grid-template-columns: repeat(3, 1fr); }
  .plots > *, .sections > *, tr, .warning { break-inside: avoid; }
  .scroll { overflow: visible; }
  table { font-size: 8pt; }
}
)";

/// A value of the summary as text; nothing where it is missing or null.
std::string text_of(const ordered_json& value) {
  if (value.is_null()) return "";
  if (value.is_string()) return value.get<std::string>();
  if (value.is_number_integer()) return grouped(value.get<std::int64_t>());
  if (value.is_number()) return short_number(value.get<double>(), 6);
  if (value.is_array()) {
    std::string list;
    for (const auto& entry : value) list += (list.empty() ? "" : ", ") + text_of(entry);
    return list;
  }
  return value.dump(-1, ' ', false, ordered_json::error_handler_t::replace);
}

const ordered_json& at(const ordered_json& json, const char* key) {
  static const ordered_json nothing;
  const auto found = json.is_object() ? json.find(key) : json.end();
  return json.is_object() && found != json.end() ? *found : nothing;
}

double number(const ordered_json& json, const char* key) {
  const ordered_json& value = at(json, key);
  return value.is_number() ? value.get<double>() : 0.0;
}

std::string percent(double share, int digits = 1) { return formatted("%.*f %%", digits, 100 * share); }

/// "-" for the distance of an estimate that has no points.
std::string distance_text(double distance) { return std::isfinite(distance) ? short_number(distance) : "-"; }

std::string duration(double seconds) {
  if (seconds < 100) return formatted("%.3g s", seconds);
  const long long whole = std::llround(seconds);
  if (whole < 3600) return formatted("%lld min %02lld s", whole / 60, whole % 60);
  return formatted("%lld h %02lld min", whole / 3600, whole / 60 % 60);
}

/// Rows of cells; all text is escaped here. The first row is the head.
std::string table(const std::vector<std::vector<std::string>>& rows, const char* kind = "") {
  std::string out = std::string("<div class=\"scroll\"><table") +
                    (*kind ? std::string(" class=\"") + kind + "\"" : "") + ">\n";
  for (std::size_t r = 0; r < rows.size(); ++r) {
    out += "<tr>";
    for (const std::string& cell : rows[r])
      out +=
          (r == 0 && !*kind ? "<th>" : "<td>") + escape_markup(cell) + (r == 0 && !*kind ? "</th>" : "</td>");
    out += "</tr>\n";
  }
  return out + "</table></div>\n";
}

std::string plots(const std::vector<NamedPlot>& drawn) {
  if (drawn.empty()) return "";
  std::string out = "<div class=\"plots\">\n";
  for (const NamedPlot& plot : drawn) out += svg_plot(plot.plot);
  return out + "</div>\n";
}

class Page {
 public:
  explicit Page(const ReportContent& content) : content_(content), summary_(content.summary) {}

  std::string html() {
    open();
    figures();
    warnings();
    inputs();
    measures();
    views();
    skies();
    mesh();
    sections();
    convergence();
    cost();
    settings();
    out_ += "<footer>roxel " + escape_markup(text_of(at(summary_, "version"))) + ", " +
            escape_markup(text_of(at(summary_, "command"))) + "</footer>\n</body>\n</html>\n";
    return std::move(out_);
  }

 private:
  std::string title() const {
    const std::string path = text_of(at(at(summary_, "dataset"), "path"));
    const std::size_t slash = path.find_last_of('/');
    return slash == std::string::npos || slash + 1 == path.size() ? path : path.substr(slash + 1);
  }

  void open() {
    out_ =
        "<!DOCTYPE html>\n<html lang=\"en\">\n<head>\n<meta charset=\"utf-8\">\n"
        "<meta name=\"viewport\" content=\"width=device-width, initial-scale=1\">\n<title>" +
        escape_markup(title()) + ": roxel report</title>\n<style>" + kStyle +
        "</style>\n</head>\n<body>\n<h1>" + escape_markup(title()) + "</h1>\n<p>" +
        escape_markup(text_of(at(at(summary_, "dataset"), "path"))) + "</p>\n";
  }

  void heading(const char* text) { out_ += std::string("<h2>") + text + "</h2>\n"; }

  void figure(const std::string& value, const std::string& what) {
    if (!value.empty()) out_ += "<div><b>" + escape_markup(value) + "</b>" + escape_markup(what) + "</div>\n";
  }

  void figures() {
    out_ += "<div class=\"figures\">\n";
    figure(text_of(at(at(summary_, "dataset"), "images")), "images");
    const ordered_json& levels = at(summary_, "levels");
    if (levels.is_array() && !levels.empty())
      figure(text_of(at(levels.back(), "voxels_in_box")), "voxels in the box");
    const ordered_json& rms = at(summary_, "reprojection_rms_percent");
    if (rms.is_number()) figure(formatted("%.2f %%", rms.get<double>()), "reprojection error (RMS)");
    if (at(summary_, "seconds").is_number()) figure(duration(number(summary_, "seconds")), "computing time");
    figure(text_of(at(summary_, "termination")), "ended");
    if (const RunMeasures* m = content_.measures) measured_figures(*m);
    out_ += "</div>\n";
  }

  void measured_figures(const RunMeasures& m) {
    if (!m.depth.empty()) {
      const DepthAccuracy all = total_depth(m.depth);
      if (all.thresholds.size() > 1)
        figure(percent(all.share_within(1)),
               "of depths within " + short_number(all.thresholds[1]) + " voxel");
    }
    if (m.volume) {
      figure(percent(m.volume->share_close()), "of voxels within 4 of the truth");
      figure(percent(m.volume->weighted_mean_opacity()), "weighted mean opacity");
      figure(percent(m.volume->share_covered()), "of the surface covered");
    }
  }

  void warnings() {
    const ordered_json& list = at(summary_, "warnings");
    for (const auto& warning : list.is_array() ? list : ordered_json::array())
      out_ += "<p class=\"warning\"><b>Warning:</b> " + escape_markup(text_of(warning)) + "</p>\n";
  }

  void inputs() {
    heading("What went in");
    const ordered_json &dataset = at(summary_, "dataset"), &scene = at(summary_, "scene");
    std::vector<std::vector<std::string>> rows;
    const auto row = [&](const char* name, const std::string& value) {
      if (!value.empty()) rows.push_back({name, value});
    };
    row("format", text_of(at(dataset, "format")));
    row("images", text_of(at(dataset, "images")));
    row("capture nodes", text_of(at(dataset, "nodes")));
    row("content", text_of(at(dataset, "hash")));
    row("box", text_of(at(scene, "bounds")));
    row("box from", text_of(at(scene, "bounds_from")));
    row("voxel size", text_of(at(scene, "voxel_size")));
    row("voxels", text_of(at(scene, "lattice_voxels")));
    row("colours compared in", text_of(at(scene, "color_space")));
    row("background", text_of(at(at(scene, "background"), "kind")));
    const ordered_json& notes = at(summary_, "notes");
    for (const auto& note : notes.is_array() ? notes : ordered_json::array()) row("note", text_of(note));
    out_ += table(rows, "text");
  }

  void measures() {
    const RunMeasures* m = content_.measures;
    if (!m) return;
    heading("Against the truth");
    if (m->truth) out_ += "<p>Truth: " + escape_markup(*m->truth) + "</p>\n";
    for (const std::string& note : m->notes) out_ += "<p class=\"warning\">" + escape_markup(note) + "</p>\n";
    surface_table(*m);
    volume_table(*m);
    debris_table(*m);
    depth_table(*m);
    quality_table("Images", m->images);
    quality_table("Held-out images", m->held_out);
    color_table(*m);
    light_table(*m);
    sky_table(*m);
    out_ += plots(measure_plots(*m));
  }

  void surface_table(const RunMeasures& m) {
    if (m.surfaces.empty()) return;
    std::vector<std::vector<std::string>> rows{
        {"surface", "points", "accuracy at 90 %", "within", "precision", "recall", "F"}};
    for (const NamedSurfaceAccuracy& surface : m.surfaces) {
      const SurfaceAccuracy& a = surface.accuracy;
      for (const DistanceShares& s : a.shares) {
        const bool first = &s == &a.shares.front();
        rows.push_back({first ? surface.title() : "", first ? grouped(a.estimate_points) : "",
                        first ? distance_text(a.accuracy_90) : "", short_number(s.distance),
                        percent(s.precision), percent(s.recall), formatted("%.4f", s.f_score)});
      }
    }
    out_ += "<h3>Surfaces</h3>\n" + table(rows);
    out_ += "<p>Distances in world units; the box's diagonal is " + short_number(m.box_diagonal()) +
            ", a voxel " + short_number(m.voxel_size) + ". Two views see " + percent(m.surface_seen) +
            " of the true surface in the box.</p>\n";
  }

  void volume_table(const RunMeasures& m) {
    if (!m.volume) return;
    out_ +=
        "<h3>Voxels</h3>\n" +
        table({{"opacity at least", "voxels", "within 4 voxels", "weighted mean opacity", "surface covered"},
               {short_number(m.opacity_threshold), grouped(m.volume->voxels),
                percent(m.volume->share_close(), 2), percent(m.volume->weighted_mean_opacity(), 2),
                percent(m.volume->share_covered(), 2)}});
  }

  void debris_table(const RunMeasures& m) {
    if (m.debris.empty()) return;
    std::vector<std::vector<std::string>> rows{{"opacity at least", "voxels", "in the open", "of voxels",
                                                "of opacity", "above all", "of voxels", "of opacity",
                                                "before the sky", "of voxels", "of opacity"}};
    for (const SkyDebris& d : m.debris) {
      rows.push_back({short_number(d.opacity_threshold), grouped(d.all.voxels)});
      for (const VoxelSum& part : {d.in_the_open, d.above_all, d.before_sky}) {
        rows.back().push_back(grouped(part.voxels));
        rows.back().push_back(percent(d.share(part), 3));
        rows.back().push_back(percent(d.share_of_opacity(part), 3));
      }
    }
    out_ += "<h3>Sky debris</h3>\n" + table(rows);
  }

  void depth_table(const RunMeasures& m) {
    if (m.depth.empty()) return;
    const DepthAccuracy all = total_depth(m.depth);
    std::vector<std::vector<std::string>> rows{{"depth"}, {"all views"}};
    for (std::size_t i = 0; i < all.thresholds.size(); ++i) {
      rows[0].push_back("within " + short_number(all.thresholds[i]) + " voxels");
      rows[1].push_back(percent(all.share_within(i), 2));
    }
    for (std::size_t i = 0; i < all.distances.size(); ++i) {
      rows[0].push_back("within " + short_number(all.distances[i]));
      rows[1].push_back(percent(all.share_within_distance(i), 2));
    }
    for (const auto& [head, value] : {std::pair{"empty given depth", all.share_false()},
                                      {"in 1 sigma (68.3 %)", all.share_within_sigma(1)},
                                      {"in 1.96 sigma (95 %)", all.share_within_sigma(1.96)}}) {
      rows[0].push_back(head);
      rows[1].push_back(percent(value, 2));
    }
    out_ += "<h3>Depth</h3>\n" + table(rows);
    if (m.depth_methods.size() > 1) depth_methods(m.depth_methods);
  }

  /// The same pixels before and after belief propagation and refinement.
  void depth_methods(const std::vector<NamedDepthAccuracy>& methods) {
    std::vector<std::vector<std::string>> rows{{"depth from"}};
    for (const double t : methods.front().accuracy.thresholds)
      rows[0].push_back("within " + short_number(t) + " voxels");
    for (const char* head : {"bias, voxels", "median error, voxels", "in 68 % interval", "in 95 % interval",
                             "median sigma, voxels", "log loss"})
      rows[0].push_back(head);
    for (const auto& [name, a] : methods) {
      std::vector<std::string> row{name};
      for (std::size_t i = 0; i < a.thresholds.size(); ++i) row.push_back(percent(a.share_within(i), 2));
      row.push_back(formatted("%+.3f", a.bias_voxels()));
      row.push_back(formatted("%.3f", a.median_error_voxels()));
      row.push_back(percent(a.share_within_sigma(1), 1));
      row.push_back(percent(a.share_within_sigma(1.96), 1));
      row.push_back(formatted("%.3f", a.median_sigma_voxels()));
      row.push_back(formatted("%.3f", a.mean_log_loss()));
      rows.push_back(row);
    }
    out_ += table(rows);
  }

  void quality_table(const char* title, const std::vector<NamedImageQuality>& list) {
    if (list.empty()) return;
    const NamedImageQuality total = total_quality(list);
    std::vector<std::vector<std::string>> rows{
        {"all views, over", "RMS", "red", "green", "blue", "PSNR", "SSIM"}};
    for (const auto& [name, q] : {std::pair{"the object", total.object}, {"all pixels", total.all}})
      rows.push_back({name, percent(q.rms(), 2), percent(q.rms(0), 2), percent(q.rms(1), 2),
                      percent(q.rms(2), 2), formatted("%.2f dB", q.psnr()), formatted("%.4f", q.ssim())});
    out_ += std::string("<h3>") + title + "</h3>\n" + table(rows);
  }

  void color_table(const RunMeasures& m) {
    if (!m.color) return;
    out_ += "<h3>Colour against albedo</h3>\n" +
            table({{"pixels", "CIEDE2000 mean", "median", "relative error mean", "median"},
                   {grouped(m.color->pixels), formatted("%.2f", m.color->mean_delta_e),
                    formatted("%.2f", m.color->median_delta_e), percent(m.color->mean_relative),
                    percent(m.color->median_relative)}});
  }

  void light_table(const RunMeasures& m) {
    if (m.light.empty()) return;
    std::vector<std::vector<std::string>> rows{
        {"photographs over", "places", "spread between nodes, mean", "median", "off albedo, mean", "median"}};
    for (const LightMeasure& light : m.light) {
      const bool albedo = light.albedo.pixels > 0;
      rows.push_back({light.name, grouped(light.spread.places), formatted("%.3f", light.spread.mean),
                      formatted("%.3f", light.spread.median),
                      albedo ? formatted("%.3f", light.albedo.mean) : "-",
                      albedo ? formatted("%.3f", light.albedo.median) : "-"});
    }
    out_ += "<h3>Light: log colour of places that several nodes see</h3>\n" + table(rows);
  }

  void sky_table(const RunMeasures& m) {
    if (m.skies.empty()) return;
    const auto share = [](const std::optional<double>& value) { return value ? percent(*value, 2) : "-"; };
    const auto angle = [](const std::optional<double>& value) {
      return value ? formatted("%.2f", *value) : "-";
    };
    std::vector<std::vector<std::string>> rows{{"sky", "fit", "dome", "oracle", "sun off, degrees",
                                                "sun found, off", "light with sun", "sky alone", "mask IoU"}};
    for (const SkyMeasure& sky : m.skies)
      rows.push_back({sky.node, share(sky.fit_error), share(sky.dome_error), share(sky.oracle_error),
                      angle(sky.sun_error_deg), angle(sky.found_error_deg), share(sky.horizontal_error),
                      share(sky.horizontal_sky_error), share(sky.mask_iou)});
    out_ += "<h3>Skies</h3>\n" + table(rows);
  }

  void views() {
    if (content_.views.empty()) return;
    heading("Views");
    const double all = number(at(summary_, "dataset"), "images");
    if (all > static_cast<double>(content_.views.size()))
      out_ += formatted("<p>%zu of %.0f views.</p>\n", content_.views.size(), all);
    out_ +=
        "<p>Depth: near is pale, far is blue. Error: black is none, white a quarter of full scale and more. "
        "Sigma: black is sure, white four voxels and more.";
    if (content_.measures && !content_.measures->depth.empty())
      out_ +=
          " Depth error: white is none, blue four voxels too near, red too far; black is missed or too much.";
    out_ += "</p>\n";
    picture_rows(content_.views);
  }

  void picture_rows(const std::vector<ReportView>& views) {
    for (const ReportView& view : views) {
      out_ += "<div class=\"view\"><h3>" + escape_markup(view.name) + (view.figures.empty() ? "" : ": ") +
              escape_markup(view.figures) + "</h3><div class=\"row" +
              (view.pictures.size() == 5  ? " five"
               : view.pictures.size() > 6 ? " many"
                                          : "") +
              "\">\n";
      for (const ReportPicture& picture : view.pictures)
        out_ += "<figure><img src=\"" + picture.uri + "\" alt=\"" +
                escape_markup(picture.caption + " of " + view.name) + "\"><figcaption>" +
                escape_markup(picture.caption) + "</figcaption></figure>\n";
      out_ += "</div></div>\n";
    }
  }

  void skies() {
    const ordered_json& list = content_.skies_from.empty() ? at(summary_, "skies") : content_.their_skies;
    if (content_.skies.empty() && content_.skies_from.empty()) return;
    heading("Sky");
    if (!content_.skies_from.empty())
      out_ += "<p>Skies, sun and sky masks of another run: <a href=\"" +
              escape_markup(content_.skies_from + "/report.html") + "\">" +
              escape_markup(content_.skies_from) + "</a></p>\n";
    out_ +=
        "<p>All directions down to 30 degrees below the horizon, north in the middle, east to the right. "
        "Masks show what "
        "they take out. Error of the fit: black is none, white a quarter and more, grey not used.</p>\n";
    std::vector<std::vector<std::string>> rows{{"node", "model", "error", "of the dome",
                                                "sun (azimuth, elevation)", "from", "its light", "fallback"}};
    for (const auto& sky : list.is_array() ? list : ordered_json::array())
      rows.push_back({text_of(at(sky, "node")), text_of(at(sky, "model")),
                      percent(number(sky, "mean_error"), 2), percent(number(sky, "sky_share")),
                      text_of(at(sky, "sun")), text_of(at(sky, "sun_source")), text_of(at(sky, "sun_light")),
                      text_of(at(sky, "fallback"))});
    if (rows.size() > 1) out_ += table(rows);
    picture_rows(content_.skies);
  }

  void mesh() {
    if (content_.mesh.views.empty()) return;
    heading("Surface");
    const ordered_json& mesh = at(summary_, "mesh");
    std::vector<std::vector<std::string>> rows;
    const auto row = [&](const char* name, const std::string& value) {
      if (!value.empty()) rows.push_back({name, value});
    };
    row("triangles", text_of(at(mesh, "triangles")));
    row("points", text_of(at(mesh, "points")));
    row("step of the lattice", text_of(at(mesh, "voxel_size")));
    row("triangles that close holes", text_of(at(mesh, "closing_triangles")));
    const ordered_json& texture = at(mesh, "texture");
    if (texture.is_object()) {
      row("texture", text_of(at(texture, "width")) + " x " + text_of(at(texture, "height")));
      row("charts", text_of(at(texture, "charts")));
      row("triangles that no photograph shows whole", text_of(at(texture, "unseen_triangles")));
      row("difference across seams (RMS)", percent(number(texture, "seam_rms_before"), 2) + ", levelled " +
                                               percent(number(texture, "seam_rms"), 2));
    }
    out_ += table(rows, "text");
    turntable();
    picture_rows(content_.mesh.views);
  }

  /// A strip of pictures behind a window that moves on by one picture at a time, without scripts.
  void turntable() {
    const ReportMesh& mesh = content_.mesh;
    if (mesh.turntable.empty() || mesh.turns < 1) return;
    out_ += formatted(
                "<div class=\"turntable\" role=\"img\" aria-label=\"the surface from all around\" "
                "style=\"--end: -%dpx; animation: turn 6s steps(%d) infinite; background-image: url(",
                240 * mesh.turns, mesh.turns) +
            data_uri("image/jpeg", mesh.turntable) + ")\"></div>\n";
  }

  void sections() {
    if (content_.sections.empty() && content_.opacities.empty()) return;
    heading("Cross-sections and opacities");
    if (!content_.sections.empty()) out_ += "<div class=\"sections\">\n";
    for (const Section& section : content_.sections)
      out_ += "<figure>" + section_svg(section) + "<figcaption>" + escape_markup(section_name(section)) +
              (section.outline.empty() ? "" : ", the true surface in red") + "</figcaption></figure>\n";
    if (!content_.sections.empty()) out_ += "</div>\n";
    if (!content_.opacities.empty()) out_ += plots({opacity_plot(content_.opacities)});
  }

  void convergence() {
    const std::vector<NamedPlot> drawn = convergence_plots(summary_);
    if (drawn.empty()) return;
    heading("Convergence");
    out_ += plots(drawn);
  }

  void cost() {
    heading("Cost");
    std::vector<std::vector<std::string>> rows{{"stage", "time", "share", "peak memory"}};
    const double total = number(summary_, "seconds");
    const auto row = [&](const std::string& name, double seconds, const ordered_json& bytes) {
      rows.push_back({name, duration(seconds), total > 0 ? percent(seconds / total) : "",
                      bytes.is_number() ? formatted("%.0f MiB", bytes.get<double>() / 1024 / 1024) : ""});
    };
    int level = 0;
    const ordered_json &levels = at(summary_, "levels"), &stages = at(summary_, "stages");
    for (const auto& record : levels.is_array() ? levels : ordered_json::array())
      row("level " + std::to_string(++level) + ", voxels of " + text_of(at(record, "voxel_size")),
          number(record, "seconds"), at(record, "peak_memory_bytes"));
    for (const auto& stage : stages.is_array() ? stages : ordered_json::array())
      row(text_of(at(stage, "name")), number(stage, "seconds"), at(stage, "peak_memory_bytes"));
    row("all", total, at(summary_, "peak_memory_bytes"));
    out_ += table(rows);
    out_ += formatted("<p>%.0f threads; memory of the whole process, the largest in each stage.</p>\n",
                      number(summary_, "threads"));
  }

  void settings() {
    const ordered_json& options = at(summary_, "options");
    if (!options.is_object()) return;
    heading("Settings");
    out_ += "<div class=\"settings\">\n";
    for (const auto& [name, value] : options.items()) {
      const std::string text = value.is_null() ? "auto" : value.is_number() ? value.dump() : text_of(value);
      out_ += "<div>" + escape_markup(name) + " = " + escape_markup(text) + "</div>\n";
    }
    out_ += "</div>\n";
  }

  const ReportContent& content_;
  const ordered_json& summary_;
  std::string out_;
};

}  // namespace

std::string html_report(const ReportContent& content) { return Page(content).html(); }

std::vector<int> report_views(int count) {
  std::vector<int> shown;
  const int kept = std::min(count, kMostReportViews);
  for (int i = 0; i < kept; ++i) shown.push_back(static_cast<int>(static_cast<long long>(i) * count / kept));
  return shown;
}

ReportPicture report_picture(const std::string& caption, const Image& picture, int width) {
  return {caption, data_uri("image/jpeg", jpeg_bytes(thumbnail(picture, width), kPictureQuality))};
}

}  // namespace roxel
