/// roxel sky: the light of every node, without a reconstruction.

#include <array>
#include <chrono>
#include <mutex>
#include <nlohmann/json.hpp>
#include <numbers>

#include "command.h"
#include "common.h"
#include "roxel/base/atomic_file.h"
#include "roxel/base/error.h"
#include "roxel/base/formatted.h"
#include "roxel/base/parallel.h"
#include "roxel/dataset/scaled_photograph.h"
#include "roxel/io/image_file.h"
#include "roxel/io/sky_file.h"
#include "roxel/report/pictures.h"
#include "roxel/report/run_record.h"
#include "roxel/report/sky_pictures.h"
#include "roxel/sky/second_sky.h"
#include "sky_again.h"
#include "sky_stage.h"

namespace roxel::cli {
namespace {

namespace fs = std::filesystem;
using nlohmann::ordered_json;

struct SkyCommandOptions {
  InputOptions input;
  SkyOptions sky;
  bool pictures = true;
  CommonOptions common;
};

OptionTable<SkyCommandOptions> sky_table() {
  OptionTable<SkyCommandOptions> table;
  table.include(reading_option_table(), &SkyCommandOptions::input);
  table.include(sky_option_table(), &SkyCommandOptions::sky);
  table.group("Sky files");
  table.add("pictures", &SkyCommandOptions::pictures)
      .help("Write pictures of the sphere, masks, fit and error, and a report, too");
  table.include(common_option_table(), &SkyCommandOptions::common);
  return table;
}

/// What is reported of one node.
struct NodeReport {
  ordered_json json;
  std::string line;
  std::vector<std::string> warnings;
  ReportView view;
};

ordered_json triple(const Eigen::Vector3d& v) { return {v[0], v[1], v[2]}; }

ordered_json sun_json(const std::optional<Eigen::Vector3d>& d) {
  if (!d) return nullptr;
  constexpr double kDegrees = 180 / std::numbers::pi;
  const double azimuth = std::atan2(d->x(), d->y()) * kDegrees;
  return {azimuth < 0 ? azimuth + 360 : azimuth, std::asin(std::clamp(d->z(), -1.0, 1.0)) * kDegrees};
}

std::optional<Eigen::Vector3d> used_sun(const NodeSky& sky) {
  return sky.sun_source == SunSource::kNone ? std::nullopt : std::optional(sky.sun);
}

ordered_json masks_json(const SkyFit& fit) {
  const SkyMasks& m = fit.masks;
  return {{"red_blue", m.red_blue_used ? "used" : "left out"},
          {"red_blue_share", m.red_blue_share},
          {"luminance", m.luminance_used ? "used" : "left out"},
          {"luminance_share", m.luminance_share},
          {"mean_luminance", m.mean_luminance},
          {"reason", m.reason}};
}

/// Mean error of the fit over all smooth facets of the sky's masks or the fit, by where they are.
ordered_json errors_json(const SkyFit& fit) {
  struct Region {
    const char* name;
    double error = 0, area = 0;
  };
  std::array<Region, 5> regions{
      {{"above_60"}, {"30_to_60"}, {"10_to_30"}, {"below_10"}, {"within_20_of_sun"}}};
  constexpr double kDegrees = 180 / std::numbers::pi;
  for (int f = 0; f < fit.light.sphere->count() && fit.sky.has_light(); ++f) {
    if (!fit.used[f] && !fit.masks.sky[f]) continue;
    const Eigen::Vector3d& d = fit.light.sphere->centre(f);
    const double area = fit.light.sphere->solid_angle(f), elevation = std::asin(d.z()) * kDegrees;
    const double error =
        (fit.sky.radiance_in_sky(d).array() / fit.light.facets[f].mean.array() - 1).abs().mean() * area;
    const bool near_sun =
        fit.sky.sun_source != SunSource::kNone && d.dot(fit.sky.sun) > std::cos(20 / kDegrees);
    Region& region = regions[near_sun ? 4 : elevation > 60 ? 0 : elevation > 30 ? 1 : elevation > 10 ? 2 : 3];
    region.error += error, region.area += area;
  }
  ordered_json json;
  for (const Region& region : regions)
    json[region.name] = region.area > 0 ? ordered_json(region.error / region.area) : ordered_json(nullptr);
  return json;
}

ordered_json node_json(const SkyFit& fit, double mask_share) {
  const NodeSky& s = fit.sky;
  const SkyLight light(s);
  return {{"node", s.name},
          {"images", s.views.size()},
          {"model", to_string(s.model)},
          {"fallback", s.fallback},
          {"mean_error", s.mean_error},
          {"error_by_region", errors_json(fit)},
          {"relative_sigma", triple(s.relative_sigma)},
          {"facets_used", std::count(fit.used.begin(), fit.used.end(), 1)},
          {"inlier_share", s.inlier_share},
          {"pixels_per_facet", fit.pixels_per_facet},
          {"sky_share", s.sky_share},
          {"clipped_share", s.clipped_share},
          {"seen_share", s.seen_share},
          {"mask_share", mask_share},
          {"disagreement", s.mean_disagreement},
          {"rounds", fit.rounds},
          {"settled", fit.settled},
          {"masks", masks_json(fit)},
          {"clearness_bin", s.clearness_bin},
          {"sun", sun_json(used_sun(s))},
          {"sun_source", to_string(s.sun_source)},
          {"sun_by_time", sun_json(s.sun_by_time)},
          {"sun_by_images", sun_json(s.sun_by_images)},
          {"sun_light", to_string(s.sun_light)},
          {"sun_irradiance", triple(s.sun_irradiance)},
          {"sun_relative_sigma", s.sun_relative_sigma},
          {"horizontal_irradiance", triple(light.horizontal_irradiance(Disc::kWith))},
          {"horizontal_irradiance_without_disc", triple(light.horizontal_irradiance(Disc::kWithout))},
          {"mean_radiance", triple(light.mean_radiance(Disc::kWith))},
          {"warnings", fit.warnings}};
}

std::string node_line(const SkyFit& fit) {
  const NodeSky& s = fit.sky;
  std::string line = formatted("  %-6s %-9s", s.name.c_str(), to_string(s.model));
  if (s.has_light())
    line += formatted(" error %4.1f %% over %4.1f %% of the dome", 100 * s.mean_error, 100 * s.sky_share);
  if (const auto sun = used_sun(s)) {
    const ordered_json angles = sun_json(sun);
    line += formatted("; sun %.1f, %.1f (%s), light %s", angles[0].get<double>(), angles[1].get<double>(),
                      to_string(s.sun_source), to_string(s.sun_light));
  }
  if (!s.fallback.empty()) line += "; " + s.fallback;
  return line + "\n";
}

ReportView write_pictures(const fs::path& run, const SkyFit& fit) {
  const std::vector<SkyPanel> panels = sky_panels(fit);
  std::vector<std::vector<Image>> sheet;
  for (std::size_t i = 0; i < panels.size(); ++i) {
    write_png(sky_path(run, fit.sky.name, "_" + panels[i].name + ".png").string(), panels[i].picture,
              kAsItIs);
    if (i % 2 == 0) sheet.emplace_back();
    sheet.back().push_back(panels[i].picture);
  }
  write_png(sky_path(run, fit.sky.name, ".png").string(), contact_sheet(sheet), kAsItIs);
  return sky_report(fit, panels);
}

/// Whether a fit says anything of where the sky is.
bool tells_sky(const NodeSky& sky) { return sky.has_light() || sky.fallback == kClippedSky; }

/// A view's mask as its picture was looked at, and what it takes to make it as large as the photograph.
struct ViewMask {
  Mask mask;  ///< empty where nothing says where the sky is
  int scale = 1;
};

/// A mask by hand stands; the others come from the fit, and are empty where it says nothing.
std::vector<ViewMask> make_masks(const SkyFit& fit, const SkyPictureSource& pictures) {
  std::vector<ViewMask> masks;
  for (std::size_t i = 0; i < fit.sky.views.size(); ++i) {
    SkyPicture picture = pictures(static_cast<int>(i));
    masks.push_back({!picture.known_sky.empty() ? std::move(picture.known_sky)
                     : tells_sky(fit.sky)       ? soft_sky_mask(picture, fit)
                                                : Mask(),
                     picture.scale});
  }
  return masks;
}

/// Mean of all pixels.
double mean_share(const std::vector<ViewMask>& masks) {
  double sum = 0, all = 0;
  for (const ViewMask& view : masks) {
    for (const std::uint8_t value : view.mask.data()) sum += value / 255.0;
    all += static_cast<double>(view.mask.data().size());
  }
  return all > 0 ? sum / all : 0;
}

void write_masks(const fs::path& run, const SkyInput& input, std::size_t task,
                 const std::vector<ViewMask>& masks) {
  const std::vector<std::string>& views = input.tasks[task].views;
  for (std::size_t i = 0; i < masks.size(); ++i) {
    if (masks[i].mask.empty()) continue;
    const fs::path file = sky_mask_path(run, views[i]);
    if (masks[i].scale == 1) {
      write_png(file.string(), masks[i].mask);
      continue;
    }
    const auto [width, height] = input.sizes[task][i];
    const Mask by_hand = input.hand_masks[task](static_cast<int>(i));
    write_png(file.string(),
              by_hand.empty() ? enlarged(masks[i].mask, masks[i].scale, width, height) : by_hand);
  }
}

NodeReport do_node(const SkyInput& input, std::size_t n, const SkyCommandOptions& options,
                   const fs::path& run) {
  const SkyTask& task = input.tasks[n];
  const SkyPictureSource& pictures = input.pictures[n];
  const SkyFit fit = fit_sky(task, pictures, options.sky.fit_options());
  write_sky(run, fit.sky);
  const std::vector<ViewMask> masks = make_masks(fit, pictures);
  write_masks(run, input, n, masks);
  NodeReport report{node_json(fit, mean_share(masks)), node_line(fit), {}, {}};
  if (options.pictures) report.view = write_pictures(run, fit);
  for (const std::string& warning : fit.warnings) report.warnings.push_back(task.name + ": " + warning);
  return report;
}

std::vector<NodeReport> do_nodes(const SkyInput& input, const SkyCommandOptions& options, const fs::path& run,
                                 Session& session) {
  std::vector<NodeReport> reports(input.tasks.size());
  std::mutex mutex;
  std::size_t done = 0;
  parallel_for(static_cast<std::int64_t>(reports.size()),
               sky_workers(input, session.context().thread_count()), [&](std::int64_t n, int) {
                 session.context().throw_if_cancelled();
                 reports[n] = do_node(input, static_cast<std::size_t>(n), options, run);
                 const std::lock_guard<std::mutex> lock(mutex);
                 Progress progress;
                 progress.stage = "sky";
                 progress.fraction = static_cast<double>(++done) / static_cast<double>(reports.size());
                 session.context().report(progress);
               });
  return reports;
}

ordered_json summary_json(const Invocation& invocation, const SkyInput& input, const ordered_json& options,
                          const std::vector<NodeReport>& reports, double seconds) {
  std::size_t images = 0;
  ordered_json skies = ordered_json::array(), warnings = ordered_json::array();
  if (input.input)
    for (const std::string& warning : input.input->dataset.warnings) warnings.push_back(warning);
  for (const std::string& warning : input.warnings) warnings.push_back(warning);
  for (const SkyTask& task : input.tasks) images += task.views.size();
  for (const NodeReport& report : reports) {
    skies.push_back(report.json);
    for (const std::string& warning : report.warnings) warnings.push_back(warning);
  }
  return {
      {"format", kSummaryFormat},
      {"version", ROXEL_VERSION},
      {"command", invocation.line},
      {"dataset",
       {{"path", input.path}, {"format", input.format}, {"images", images}, {"nodes", input.tasks.size()}}},
      {"options", options},
      {"termination", "done"},
      {"seconds", seconds},
      {"skies", skies},
      {"notes", input.notes},
      {"warnings", warnings}};
}

std::string report_page(const ordered_json& summary, const std::vector<NodeReport>& reports) {
  ReportContent content{summary};
  for (const int n : report_views(static_cast<int>(reports.size()))) content.skies.push_back(reports[n].view);
  return html_report(content);
}

/// A folder of this command's results may be written anew, one of a reconstruction may not.
void check_output(const fs::path& run) {
  if (fs::exists(run / "volume.vdb"))
    throw_invalid("-o " + run.string(), "a reconstruction", "another folder: its summary.json would be lost");
}

void remove_older_sky(const fs::path& run) {
  std::error_code ignored;
  if (!fs::is_regular_file(run / "summary.json")) return;
  fs::remove(run / "summary.json", ignored);
  fs::remove(run / "report.html", ignored);
  if (!fs::is_symlink(run / "sky")) fs::remove_all(run / "sky", ignored);
}

std::string text_of(const SkyInput& input, const std::vector<NodeReport>& reports, const fs::path& run) {
  std::string text;
  for (const NodeReport& report : reports) text += report.line;
  for (const std::string& note : input.notes) text += "  " + note + "\n";
  return text + formatted("%zu skies written to %s\n", reports.size(), run.string().c_str());
}

int run_sky(const Invocation& invocation, const SkyCommandOptions& options) {
  const auto start = std::chrono::steady_clock::now();
  Session session(options.common);
  const SkyInput input = read_sky_input(invocation.inputs.front(), options.input, options.sky, session);
  check_output(invocation.output);
  Sources sources;
  if (input.input) sources.dataset = &input.input->dataset;
  protect_sources(invocation.output, sources);
  const OutputFolder folder(invocation.output);
  PartialResults partial(folder.path());
  const std::vector<NodeReport> reports = do_nodes(input, options, partial.path(), session);
  const double seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
  const ordered_json summary =
      summary_json(invocation, input, ordered_json(sky_table().to_json(options)), reports, seconds);
  write_text_atomically(partial.path() / "summary.json", json_text(summary));
  if (options.pictures) write_text_atomically(partial.path() / "report.html", report_page(summary, reports));
  partial.publish([&] { remove_older_sky(folder.path()); });
  session.display().clear();
  for (const auto& warning : summary["warnings"]) warn(options.common, warning.get<std::string>());
  print_result(options.common, text_of(input, reports, invocation.output), json_text(summary));
  return 0;
}

}  // namespace

std::vector<ordered_json> fit_skies(const SkyInput& input, const SkyOptions& sky, const fs::path& run,
                                    Session& session, std::vector<std::string>& warnings) {
  SkyCommandOptions options;
  options.sky = sky;
  std::vector<ordered_json> nodes;
  for (NodeReport& report : do_nodes(input, options, run, session)) {
    nodes.push_back(std::move(report.json));
    for (std::string& warning : report.warnings) warnings.push_back(std::move(warning));
  }
  return nodes;
}

namespace {

/// The pictures of a node with what a volume lets through.
SkyPictureSource with_open_rays(const SkyTask& task, const SkyPictureSource& pictures, const OpenRays& open) {
  return [&](int i) {
    SkyPicture picture = pictures(i);
    if (const auto found = open.find(task.views[i]); found != open.end()) picture.open = found->second;
    return picture;
  };
}

/// Compares as large as masks are written.
double share_kept(const fs::path& run, const SkyInput& input, std::size_t task,
                  const std::vector<ViewMask>& masks) {
  SkyKept kept;
  for (std::size_t i = 0; i < masks.size(); ++i) {
    const fs::path file = sky_mask_path(run, input.tasks[task].views[i]);
    if (!fs::is_regular_file(file)) continue;
    const auto [width, height] = input.sizes[task][i];
    kept.add(read_mask(file.string()), enlarged(masks[i].mask, masks[i].scale, width, height));
  }
  return kept.share();
}

SkyModel model_named(const std::string& name) {
  for (const SkyModel model :
       {SkyModel::kUniform, SkyModel::kPublished, SkyModel::kGradation, SkyModel::kPerez})
    if (name == to_string(model)) return model;
  return SkyModel::kNone;
}

}  // namespace

std::vector<SkyAgain> fit_skies_again(const SkyInput& input, const SkyOptions& sky, const OpenRays& open,
                                      const fs::path& run, Session& session,
                                      std::vector<ordered_json>& nodes) {
  const SkyFitOptions options = sky.fit_options();
  std::vector<SkyAgain> all(input.tasks.size());
  parallel_for(
      static_cast<std::int64_t>(all.size()), sky_workers(input, session.context().thread_count()),
      [&](std::int64_t n, int) {
        session.context().throw_if_cancelled();
        const SkyPictureSource pictures = with_open_rays(input.tasks[n], input.pictures[n], open);
        const SkyFit fit = fit_sky(input.tasks[n], pictures, options);
        const std::vector<ViewMask> masks = make_masks(fit, pictures);
        std::vector<ViewMask> unexplained;
        for (const std::string& view : input.tasks[n].views)
          if (const auto found = open.find(view); found != open.end()) unexplained.push_back({found->second});
        all[n] = {input.tasks[n].name, mean_share(unexplained),           nodes[n].value("mask_share", 0.0),
                  mean_share(masks),   nodes[n].value("mean_error", 0.0), fit.sky.mean_error};
        SkyAgain& again = all[n];
        again.refused = why_refused(
            {model_named(nodes[n].value("model", "")), again.mask_share_before, again.error_before},
            {fit.sky.model, again.mask_share, again.error},
            share_kept(run, input, static_cast<std::size_t>(n), masks));
        if (!again.refused.empty()) return;
        write_sky(run, fit.sky);
        write_masks(run, input, static_cast<std::size_t>(n), masks);
        write_pictures(run, fit);
        nodes[n] = node_json(fit, again.mask_share);
      });
  return all;
}

void add_sky(Commands& commands) {
  CommandForm form{"sky", "Find the daylight of each node: sky, sun and sky masks", "DATASET", "RUN"};
  form.details =
      "DATASET may also be one panorama of all directions (EXR, HDR, ...). Writes RUN/sky/NODE.json and "
      ".exr,\n"
      "RUN/sky/mask/NAME.png, pictures, and RUN/summary.json.\n";
  add_command(commands, form, sky_table(), run_sky);
}

}  // namespace roxel::cli
