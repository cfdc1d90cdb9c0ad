#include "eval_source.h"

#include "roxel/base/error.h"
#include "roxel/io/ply_file.h"
#include "roxel/io/sky_truth.h"
#include "run_input.h"

namespace roxel::cli {
namespace {

namespace fs = std::filesystem;

std::vector<std::string> names_of_views(const FinishedRun& run) {
  std::vector<std::string> names;
  for (const auto& view : run.summary.value("views", nlohmann::json::array()))
    names.push_back(view.value("name", ""));
  return names;
}

void read_dataset_of_run(const EvalPaths& paths, const Session& session, EvalSource& source) {
  const std::string path = paths.dataset.value_or(source.run.file.info.dataset);
  if (path.empty() || (!paths.dataset && !fs::exists(path))) {
    source.notes.push_back("the run's data set " + path +
                           " is not there: cameras and photographs are not known (--dataset)");
    return;
  }
  try {
    source.input = read_input(path, input_options_of(source.run), session);
  } catch (const InvalidInput& error) {
    if (paths.dataset) throw;
    source.notes.push_back(std::string("the run's data set cannot be read as it was: ") + error.what() +
                           " (--dataset)");
    return;
  }
  for (const View& view : source.input->dataset.views) source.views[view.name] = &view;
}

std::optional<fs::path> truth_folder(const EvalPaths& paths, const EvalSource& source) {
  if (paths.truth) {
    if (!has_truth(*paths.truth))
      throw_invalid("--truth " + *paths.truth,
                    "no folder depth or albedo, no mesh.ply, transforms_test.json or illumination.json in it",
                    "depth/NAME.exr or albedo/NAME.exr for the images of the run, mesh.ply, held-out views, "
                    "or the light of nodes");
    return *paths.truth;
  }
  const fs::path dataset = paths.dataset.value_or(source.run.file.info.dataset);
  if (!dataset.empty() && has_truth(dataset)) return dataset;
  return {};
}

void read_surfaces(const EvalPaths& paths, EvalSource& source) {
  if (source.truth && fs::is_regular_file(*source.truth / "mesh.ply"))
    source.surface = read_ply(*source.truth / "mesh.ply");
  if (source.surface && fs::is_regular_file(source.run.path / "mesh.ply"))
    source.run_mesh = read_ply(source.run.path / "mesh.ply");
  if (!paths.estimate) return;
  if (!source.surface)
    throw_invalid("--estimate " + *paths.estimate, "no true surface to measure it by",
                  "a truth with mesh.ply");
  source.estimate = read_ply(*paths.estimate);
  source.estimate_name = fs::path(*paths.estimate).filename().string();
}

void read_held_out(const Session& session, EvalSource& source) {
  for (const fs::path& folder :
       {source.truth.value_or(""), source.input ? fs::path(source.input->dataset.path) : fs::path()}) {
    const fs::path file = folder / "transforms_test.json";
    if (folder.empty() || !fs::is_regular_file(file)) continue;
    InputOptions options = input_options_of(source.run);
    options.format = "transforms";
    options.images.reset();
    options.nodes.reset();
    source.held_out = read_input(file.string(), options, session);
    return;
  }
}

}  // namespace

const View* EvalSource::view(const std::string& name) const {
  const auto found = views.find(name);
  return found == views.end() ? nullptr : found->second;
}

Response EvalSource::picture_response() const {
  return run.file.info.exposure == 1 && input && input->response ? *input->response : Response{};
}

bool has_truth(const fs::path& folder) {
  return fs::is_directory(folder / "depth") || fs::is_directory(folder / "albedo") ||
         fs::is_regular_file(folder / "mesh.ply") || fs::is_regular_file(folder / "transforms_test.json") ||
         has_sky_truth(folder);
}

std::optional<fs::path> truth_file(const fs::path& truth, const std::string& kind, const std::string& name) {
  for (const std::string& candidate : {name, fs::path(name).filename().string()}) {
    const fs::path file = view_path(truth, kind, candidate, ".exr");
    if (fs::is_regular_file(file)) return file;
  }
  return {};
}

EvalSource read_eval_source(const EvalPaths& paths, const Session& session) {
  EvalSource source;
  source.run = read_run(paths.run);
  session.context().throw_if_cancelled();
  read_from_summary(source.run.path, [&] {
    source.view_names = names_of_views(source.run);
    source.box = box_of(source.run);
  });
  read_dataset_of_run(paths, session, source);
  source.truth = truth_folder(paths, source);
  read_surfaces(paths, source);
  read_held_out(session, source);
  session.context().throw_if_cancelled();
  return source;
}

}  // namespace roxel::cli
