#include "roxel/report/sky_measures.h"

#include "roxel/base/error.h"
#include "roxel/base/formatted.h"
#include "roxel/base/parallel.h"
#include "roxel/eval/sky_accuracy.h"
#include "roxel/io/image_file.h"
#include "roxel/io/sky_file.h"
#include "roxel/io/sky_truth.h"

namespace roxel {
namespace {

namespace fs = std::filesystem;
using nlohmann::ordered_json;

double relative_error(const Eigen::Vector3d& ours, const Eigen::Vector3d& truth) {
  return ((ours.array() / truth.array() - 1).abs()).mean();
}

/// The true mask of a view, by its name or its file name alone.
std::optional<fs::path> true_mask(const fs::path& truth, const std::string& view) {
  for (const std::string& name : {view, fs::path(view).filename().string()})
    if (const fs::path file = truth / "mask" / (name + ".png"); fs::is_regular_file(file)) return file;
  return std::nullopt;
}

void measure_masks(const fs::path& run, const fs::path& truth, const NodeSky& sky, SkyMeasure& measure) {
  MaskAgreement agreement;
  for (const std::string& view : sky.views) {
    const auto file = true_mask(truth, view);
    const fs::path ours = sky_mask_path(run, view);
    if (!file || !fs::is_regular_file(ours)) continue;
    const Mask mask = read_mask(ours.string()), surface = read_mask(file->string());
    if (mask.width() != surface.width() || mask.height() != surface.height())
      throw_invalid(file->string(),
                    std::to_string(surface.width()) + " x " + std::to_string(surface.height()) + " pixels",
                    std::to_string(mask.width()) + " x " + std::to_string(mask.height()) + " as " +
                        ours.string() + " has");
    agreement.add(mask, surface);
    ++measure.masks;
  }
  if (measure.masks > 0) measure.mask_iou = agreement.iou();
}

/// Whether the exponent was free, for an oracle of the same model.
PerezFreedom freedom_of(const NodeSky& sky) {
  const bool exponent = std::any_of(sky.channels.begin(), sky.channels.end(),
                                    [](const PerezChannel& channel) { return channel.shape.h != 1; });
  return exponent ? PerezFreedom::kExponent : PerezFreedom::kFull;
}

SkyMeasure measure_sky(const fs::path& run, const fs::path& folder, const NodeSky& sky,
                       const SkyTruth& truth) {
  SkyMeasure m;
  m.node = sky.name;
  m.model = to_string(sky.model);
  m.sun_light = to_string(sky.sun_light);
  if (sky.sun_source != SunSource::kNone) m.sun_error_deg = angle_between_deg(sky.sun, truth.sun);
  if (truth.disc && sky.sun_by_images) m.found_error_deg = angle_between_deg(*sky.sun_by_images, truth.sun);
  measure_masks(run, folder, sky, m);
  if (!sky.has_light()) return m;
  m.fit_error = sky.mean_error;
  const Image map = truth.map();
  m.dome_error = dome_error(sky_map(sky, Disc::kWithout, map.width(), map.height()), map);
  m.oracle_error = oracle_dome_error(map, truth.sun, freedom_of(sky));
  const SkyLight light(sky);
  m.horizontal_error = relative_error(light.horizontal_irradiance(Disc::kWith), truth.horizontal);
  m.horizontal_sky_error = relative_error(light.horizontal_irradiance(Disc::kWithout), truth.horizontal_sky);
  return m;
}

template <class T>
ordered_json optional_json(const std::optional<T>& value) {
  return value ? ordered_json(*value) : ordered_json(nullptr);
}

std::string percent(const std::optional<double>& share) {
  return share ? formatted("%.2f", 100 * *share) : "-";
}
std::string number(const std::optional<double>& value, int digits) {
  return value ? formatted("%.*f", digits, *value) : "-";
}

}  // namespace

std::vector<SkyMeasure> measure_skies(const fs::path& run, const fs::path& truth, int threads) {
  const std::vector<NodeSky> skies = read_skies(run);
  std::vector<std::pair<const NodeSky*, SkyTruth>> pairs;
  for (const SkyTruth& node : read_sky_truth(truth))
    for (const NodeSky& sky : skies)
      if (sky.name == node.node) pairs.emplace_back(&sky, node);
  std::vector<SkyMeasure> measures(pairs.size());
  parallel_for(static_cast<std::int64_t>(pairs.size()), threads, [&](std::int64_t i, int) {
    measures[i] = measure_sky(run, truth, *pairs[i].first, pairs[i].second);
  });
  return measures;
}

ordered_json to_json(const std::vector<SkyMeasure>& skies) {
  ordered_json list = ordered_json::array();
  for (const SkyMeasure& m : skies)
    list.push_back({{"node", m.node},
                    {"model", m.model},
                    {"fit_error", optional_json(m.fit_error)},
                    {"dome_error", optional_json(m.dome_error)},
                    {"oracle_error", optional_json(m.oracle_error)},
                    {"sun_error_deg", optional_json(m.sun_error_deg)},
                    {"found_sun_error_deg", optional_json(m.found_error_deg)},
                    {"sun_light", m.sun_light},
                    {"horizontal_error", optional_json(m.horizontal_error)},
                    {"horizontal_sky_error", optional_json(m.horizontal_sky_error)},
                    {"mask_iou", optional_json(m.mask_iou)},
                    {"masks", m.masks}});
  return list;
}

std::string csv_table(const std::vector<SkyMeasure>& skies) {
  std::string out =
      "node,model,fit_error,dome_error,oracle_error,sun_error_deg,found_sun_error_deg,sun_light,horizontal_"
      "error,"
      "horizontal_sky_error,mask_iou,masks\n";
  for (const SkyMeasure& m : skies)
    out += formatted("%s,%s,%s,%s,%s,%s,%s,%s,%s,%s,%s,%d\n", m.node.c_str(), m.model.c_str(),
                     number(m.fit_error, 6).c_str(), number(m.dome_error, 6).c_str(),
                     number(m.oracle_error, 6).c_str(), number(m.sun_error_deg, 4).c_str(),
                     number(m.found_error_deg, 4).c_str(), m.sun_light.c_str(),
                     number(m.horizontal_error, 6).c_str(), number(m.horizontal_sky_error, 6).c_str(),
                     number(m.mask_iou, 5).c_str(), m.masks);
  return out;
}

std::string to_text(const std::vector<SkyMeasure>& skies) {
  if (skies.empty()) return "";
  std::string out =
      "sky      fit %  dome %  oracle %  sun deg  found deg  light with sun %  sky alone %  sun's light  "
      "mask IoU\n";
  for (const SkyMeasure& m : skies)
    out += formatted("  %-6s %5s  %6s  %8s  %7s  %9s  %16s  %11s  %-11s  %8s\n", m.node.c_str(),
                     percent(m.fit_error).c_str(), percent(m.dome_error).c_str(),
                     percent(m.oracle_error).c_str(), number(m.sun_error_deg, 2).c_str(),
                     number(m.found_error_deg, 2).c_str(), percent(m.horizontal_error).c_str(),
                     percent(m.horizontal_sky_error).c_str(), m.sun_light.c_str(),
                     number(m.mask_iou, 4).c_str());
  return out;
}

}  // namespace roxel
