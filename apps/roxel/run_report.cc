#include "run_report.h"
#include "common.h"

#include <fstream>
#include <sstream>

#include "mesh_stage.h"
#include "roxel/base/atomic_file.h"
#include "roxel/base/parallel.h"
#include "roxel/eval/section.h"
#include "roxel/eval/volume_accuracy.h"
#include "roxel/io/depth_file.h"
#include "roxel/io/image_file.h"
#include "roxel/report/markup.h"
#include "roxel/report/pictures.h"
#include "roxel/report/sky_pictures.h"
#include "run_input.h"
#include "view_writer.h"

namespace roxel::cli {
namespace {

namespace fs = std::filesystem;

std::string bytes_of(const fs::path& file) {
  std::ifstream in(file, std::ios::binary);
  std::ostringstream bytes;
  bytes << in.rdbuf();
  return std::move(bytes).str();
}

/// The file of that kind of a view, the newest there is; empty where there is none.
fs::path newest(const DepthFolders& folders, const std::string& kind, const std::string& name,
                const std::string& suffix) {
  for (const fs::path& folder : {folders.results, folders.earlier})
    if (const fs::path file = view_path(folder, kind, name, suffix); fs::is_regular_file(file)) return file;
  return {};
}

std::string rms_text(const nlohmann::ordered_json& summary, const std::string& name) {
  for (const auto& view : summary.value("views", nlohmann::ordered_json::array()))
    if (view.value("name", "") == name && view.contains("reprojection_rms_percent") &&
        view["reprojection_rms_percent"].is_number())
      return "RMS " + short_number(view["reprojection_rms_percent"].get<double>(), 3) + " %";
  return "";
}

ReportView view_of(const RunReportSource& source, const View& view) {
  const double white = source.run.file.info.exposure;
  const Response response = white == 1 && source.input.response ? *source.input.response : Response{};
  ReportView out{view.name, rms_text(source.summary, view.name), {}};
  const Image photo = source.input.load(view).rgb;
  out.pictures.push_back(report_picture("photograph", encoded_picture(photo, white, response)));
  if (const Image plain = over_light_of(source.run, source.input.dataset, view, photo); !plain.empty())
    out.pictures.push_back(report_picture(kOverItsLight, encoded_picture(plain, white, response)));
  for (const char* kind : {"render", "error"})
    if (const fs::path file = newest(source.folders, kind, view.name, ".png"); !file.empty())
      out.pictures.push_back(report_picture(kind, read_image(file.string(), kAsItIs).rgb));
  const fs::path file = newest(source.folders, "depth", view.name, ".exr");
  if (file.empty()) return out;
  const DepthLayers layers = read_depth(file);
  const double voxel_size = source.run.file.volume.index(0).frame().voxel_size;
  out.pictures.push_back(report_picture(
      "depth", depth_picture(layers.depth, layers.opacity, shown_depths(layers.depth, layers.opacity))));
  out.pictures.push_back(report_picture(
      "sigma of depth", sigma_picture(layers.variance, layers.depth, layers.opacity, voxel_size)));
  add_refined_pictures(layers, voxel_size, out);
  return out;
}

}  // namespace

Image over_light_of(const FinishedRun& run, const Dataset& dataset, const View& view, const Image& photo) {
  const Light light = light_of_run(run, dataset);
  if (light.from == LightSource::kNone) return {};
  const fs::path file = view_path(run.path, "light", view.name, ".exr");
  const Image of_pixels = light.by_normal && fs::is_regular_file(file)
                              ? read_image(file.string(), Response{ResponseCurve::kLinear}).rgb
                              : Image();
  if (!of_pixels.empty() && of_pixels.data().size() != photo.data().size()) return {};
  return over_light(photo, of_pixels, light.of_view(static_cast<int>(&view - dataset.views.data())));
}

bool has_report(const FinishedRun& run) { return fs::is_regular_file(run.path / "report.html"); }

ReportMesh mesh_pictures_of(const fs::path& run) {
  ReportMesh mesh;
  if (!fs::is_regular_file(run / "mesh_views.png")) return mesh;
  mesh.views.push_back(
      {"mesh_views.png",
       "",
       {report_picture("shaded, and in its colours",
                       read_image((run / "mesh_views.png").string(), kAsItIs).rgb, kMeshSheetWidth)}});
  if (!fs::is_regular_file(run / "mesh_turntable.jpg")) return mesh;
  mesh.turntable = bytes_of(run / "mesh_turntable.jpg");
  mesh.turns = kTurns;
  return mesh;
}

void add_skies(const fs::path& results, ReportContent& content) {
  const auto options = content.summary.value("options", nlohmann::ordered_json::object());
  if (const auto from = options.find("sky"); from != options.end() && from->is_string()) {
    content.skies_from = fs::absolute(from->get<std::string>()).lexically_normal().string();
    if (fs::is_regular_file(fs::path(content.skies_from) / "summary.json"))
      content.their_skies = nlohmann::ordered_json(read_summary(content.skies_from))
                                .value("skies", nlohmann::ordered_json::array());
    content.skies = sky_reports_of(content.skies_from, content.their_skies);
  } else {
    content.skies = sky_reports_of(results, content.summary.value("skies", nlohmann::ordered_json::array()));
  }
}

void write_run_report(const RunReportSource& source, ReportMesh mesh, const RunContext& context) {
  const Dataset& dataset = source.input.dataset;
  ReportContent content;
  content.summary = source.summary;
  content.mesh = std::move(mesh);
  const std::vector<int> shown = report_views(static_cast<int>(dataset.views.size()));
  content.views.resize(shown.size());
  parallel_for(std::ssize(shown), context.thread_count(), [&](std::int64_t i, int) {
    context.throw_if_cancelled();
    content.views[i] = view_of(source, dataset.views[shown[i]]);
  });
  const Volume& volume = source.run.file.volume;
  const Eigen::Vector3d middle = box_of(source.run).center();
  for (int axis = 0; axis < 3; ++axis)
    content.sections.push_back(opacity_section(volume, axis, middle[axis]));
  content.opacities = saved_voxels(volume, 0, 0).opacity;
  add_skies(source.run.path, content);
  write_text_atomically(source.folders.results / "report.html", html_report(content));
}

}  // namespace roxel::cli
