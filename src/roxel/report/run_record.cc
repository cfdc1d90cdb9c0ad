#include "roxel/report/run_record.h"

#include <cstdio>
#include <fstream>
#include <map>

#include "roxel/base/content_hash.h"
#include "roxel/base/error.h"

namespace roxel {
namespace {

namespace fs = std::filesystem;
using nlohmann::json;
using nlohmann::ordered_json;

const char* background_name(BackgroundKind kind) {
  switch (kind) {
    case BackgroundKind::kNone:
      return "none";
    case BackgroundKind::kUnknown:
      return "unknown";
    case BackgroundKind::kKnown:
      return "constant";
    case BackgroundKind::kMask:
      return "mask";
  }
  return "";
}

ordered_json numbers(const Eigen::Vector3d& v) { return {v.x(), v.y(), v.z()}; }

template <class T>
ordered_json or_null(const std::optional<T>& value) {
  return value ? ordered_json(*value) : ordered_json(nullptr);
}

ordered_json background_json(const Scene& scene) {
  ordered_json background{{"kind", background_name(scene.background.kind)}};
  if (scene.background.kind == BackgroundKind::kKnown) {
    float rgb[3];
    scene.transform.to_rgb(scene.background.mean, rgb);
    background["color"] = {std::max(0.0f, rgb[0]), std::max(0.0f, rgb[1]), std::max(0.0f, rgb[2])};
  }
  return background;
}

const char* light_name(const Light& light) {
  switch (light.from) {
    case LightSource::kNone:
      return "none";
    case LightSource::kGain:
      return "gain";
    case LightSource::kSky:
      return light.by_normal ? "sky-normal" : "sky";
  }
  return "";
}

ordered_json scene_json(const RunRecord& record) {
  const Scene& scene = record.scene;
  const Eigen::Vector3d low = scene.bounds.box.min(), high = scene.bounds.box.max();
  const Eigen::Vector3i voxels = record.frame.size_in_voxels();
  return {{"bounds", {low.x(), low.y(), low.z(), high.x(), high.y(), high.z()}},
          {"bounds_from", scene.bounds.how},
          {"far", scene.bounds.far},
          {"voxel_size", scene.voxel_size},
          {"lattice_origin", numbers(record.frame.origin)},
          {"lattice_voxels", {voxels.x(), voxels.y(), voxels.z()}},
          {"surround_lattices", scene.surround_count},
          {"color_space", to_string(scene.transform.space())},
          {"white_point", to_string(scene.transform.white())},
          {"exposure", scene.exposure},
          {"light",
           {{"illumination", light_name(scene.light)},
            {"matching", scene.light.local_matching ? "local" : "canonical"},
            {"matching_blur_deg", scene.light.blur_deg}}},
          {"background", background_json(scene)}};
}

ordered_json pass_json(const PassRecord& pass) {
  return {{"level", pass.level},
          {"pass", pass.pass},
          {"draft", pass.draft},
          {"active_voxels", pass.active_voxels},
          {"rays", pass.rays},
          {"steps", pass.steps},
          {"color_steps", pass.color_steps},
          {"mean_log_likelihood", pass.mean_log_likelihood},
          {"mean_opacity_change", pass.mean_opacity_change},
          {"mean_opacity", pass.mean_opacity},
          {"seconds", pass.seconds},
          {"color_seconds", pass.color_seconds},
          {"opacity_seconds", pass.opacity_seconds},
          {"ns_per_step", pass.ns_per_step}};
}

ordered_json light_json(const LightRecord& light) {
  return {{"level", light.level},
          {"pass", light.pass},
          {"fitted_views", light.fitted_views},
          {"largest_change", light.largest_change},
          {"spread", light.spread}};
}

ordered_json color_fit_json(const std::optional<ColorFitRecord>& fit) {
  if (!fit) return nullptr;
  return {{"pixels", fit->pixels},
          {"rounds", fit->rounds},
          {"rms_before_percent", fit->rms_before_percent},
          {"rms_after_percent", fit->rms_after_percent},
          {"seconds", fit->seconds}};
}

ordered_json known_bytes(std::int64_t bytes) {
  return bytes > 0 ? ordered_json(bytes) : ordered_json(nullptr);
}

ordered_json level_json(const LevelRecord& level) {
  return {{"voxel_size", level.voxel_size},
          {"voxels_in_box", level.voxels_in_box},
          {"voxels_around", level.voxels_around},
          {"converged", level.converged},
          {"seconds", level.seconds},
          {"peak_memory_bytes", known_bytes(level.peak_memory_bytes)}};
}

ordered_json view_json(const ViewFigures& view, const std::array<float, 3>& light) {
  return {{"name", view.name},
          {"hash", view.hash},
          {"reprojection_rms_percent", or_null(view.reprojection_rms)},
          {"object_pixels", view.object_pixels},
          {"depth_share", or_null(view.depth_share)},
          {"light", light}};
}

ordered_json views_json(const RunRecord& record) {
  ordered_json array = ordered_json::array();
  for (std::size_t v = 0; v < record.views.size(); ++v)
    array.push_back(view_json(record.views[v], record.scene.light.of_view(static_cast<int>(v))));
  return array;
}

template <class T, class ToJson>
ordered_json list(const std::vector<T>& items, ToJson to) {
  ordered_json array = ordered_json::array();
  for (const T& item : items) array.push_back(to(item));
  return array;
}

}  // namespace

ordered_json to_json(const StageRecord& stage) {
  return {{"name", stage.name},
          {"seconds", stage.seconds},
          {"peak_memory_bytes", known_bytes(stage.peak_memory_bytes)}};
}

ordered_json to_json(const RunRecord& record) {
  const Summary& summary = record.summary;
  ordered_json json{{"format", kSummaryFormat},
                    {"version", ROXEL_VERSION},
                    {"command", record.command_line},
                    {"dataset",
                     {{"path", record.dataset_path},
                      {"format", record.dataset_format},
                      {"images", record.views.size()},
                      {"nodes", record.nodes},
                      {"hash", record.dataset_hash}}},
                    {"options", record.options},
                    {"scene", scene_json(record)},
                    {"termination", summary.termination},
                    {"reprojection_rms_percent", or_null(record.reprojection_rms)},
                    {"levels", list(summary.levels, level_json)},
                    {"passes", list(summary.passes, pass_json)},
                    {"light", list(summary.light, light_json)},
                    {"color_fit", color_fit_json(summary.color_fit)},
                    {"stages", list(summary.stages, [](const StageRecord& stage) { return to_json(stage); })},
                    {"mesh", record.mesh},
                    {"seconds", summary.seconds},
                    {"threads", record.threads},
                    {"peak_memory_bytes", summary.peak_memory_bytes},
                    {"notes", summary.notes},
                    {"warnings", record.warnings},
                    {"views", views_json(record)}};
  if (!record.skies.empty()) json["skies"] = record.skies;
  if (!record.skies_again.empty()) json["skies_again"] = record.skies_again;
  return json;
}

void add_to_hash(const View& view, const std::string& file_hash, std::string& combined) {
  ContentHash hash;
  hash.update(combined).update(view.name).update(file_hash);
  const Intrinsics& k = view.camera.intrinsics;
  std::vector<double> numbers{
      static_cast<double>(k.width), static_cast<double>(k.height), k.fx, k.fy, k.cx, k.cy, k.skew};
  numbers.insert(numbers.end(), view.camera.pose.rotation.data(), view.camera.pose.rotation.data() + 9);
  numbers.insert(numbers.end(), view.camera.pose.centre.data(), view.camera.pose.centre.data() + 3);
  for (const double number : numbers) {
    char text[32];
    std::snprintf(text, sizeof text, " %.17g", number);
    hash.update(text);
  }
  combined = hash.hex();
}

const json& FinishedRun::option(const std::string& name) const {
  static const json none;
  const auto options = summary.find("options");
  if (options == summary.end() || !options->contains(name)) return none;
  return (*options)[name];
}

json read_summary(const fs::path& run) {
  const fs::path file = run / "summary.json";
  std::ifstream in(file);
  if (!in) throw_invalid(run.string(), "no readable summary.json", "the folder of a finished run");
  json summary;
  try {
    summary = json::parse(in);
  } catch (const json::exception& error) {
    throw_invalid(file.string(), std::string("a syntax error (") + error.what() + ")", "what roxel wrote");
  }
  const bool ours = summary.is_object() && summary.value("format", json()).is_number_integer();
  if (!ours || summary["format"] != kSummaryFormat)
    throw_invalid(file.string(), "another format", "format " + std::to_string(kSummaryFormat) + " of roxel");
  return summary;
}

FinishedRun read_run(const fs::path& run) {
  nlohmann::json summary = read_summary(run);
  return {run, std::move(summary), read_volume(run / "volume.vdb")};
}

Light light_of_run(const FinishedRun& run, const Dataset& dataset) {
  return read_from_summary(run.path, [&] {
    Light light;
    const json scene = run.summary.value("scene", json::object());
    const json found = scene.value("light", json::object());
    const std::string from = found.value("illumination", "none");
    light.by_normal = from == "sky-normal";
    if (from == "gain") light.from = LightSource::kGain;
    if (from == "sky" || light.by_normal) light.from = LightSource::kSky;
    light.local_matching = found.value("matching", "canonical") == "local";
    light.blur_deg = found.value("matching_blur_deg", light.blur_deg);
    if (light.from == LightSource::kNone) return light;
    std::map<std::string, std::array<float, 3>> of_names;
    for (const json& view : run.summary.value("views", json::array()))
      if (view.contains("light"))
        of_names[view.value("name", "")] = view["light"].get<std::array<float, 3>>();
    for (const View& view : dataset.views) {
      const auto named = of_names.find(view.name);
      light.of_views.push_back(named == of_names.end() ? std::array<float, 3>{1, 1, 1} : named->second);
    }
    return light;
  });
}

void throw_damaged_summary(const fs::path& run, const std::string& why) {
  throw_invalid((run / "summary.json").string(), "a value of the wrong kind (" + why + ")",
                "what roxel wrote");
}

void remove_results(const fs::path& run) {
  json summary;
  try {
    summary = read_summary(run);
  } catch (const InvalidInput&) {
    return;
  }
  std::error_code ignored;
  fs::remove(run / "summary.json", ignored);
  for (const char* name :
       {"volume.vdb", "voxels.ply", "overview.png", "report.html", "mesh.ply", "mesh.glb", "mesh.obj",
        "mesh.mtl", "mesh.png", "mesh.jpg", "mesh_views.png", "mesh_turntable.jpg"})
    fs::remove(run / name, ignored);
  if (summary.contains("skies") && !fs::is_symlink(run / "sky")) fs::remove_all(run / "sky", ignored);
  try {
    for (const json& view : summary.value("views", json::array())) {
      const std::string name = view.value("name", "");
      if (name.empty()) continue;
      for (const char* kind : {"depth", "render", "error", "light"})
        for (const char* suffix : {".png", ".exr"}) fs::remove(view_path(run, kind, name, suffix), ignored);
    }
  } catch (const json::exception&) {  // a damaged list of views: what it named stays
  }
}

fs::path view_path(const fs::path& run, const std::string& kind, const std::string& name,
                   const std::string& suffix) {
  fs::path path = run / kind;
  for (const auto& part : fs::path(name).relative_path())
    if (part != "." && part != ".." && !part.empty()) path /= part;
  path += suffix;
  return path;
}

}  // namespace roxel
