#pragma once
/// What `roxel eval` reads: a finished run, its photographs and cameras where they are still there, and the
/// truth.

#include <map>
#include <memory>

#include "common.h"
#include "roxel/report/run_record.h"
#include "roxel/surface/mesh.h"

namespace roxel::cli {

struct EvalPaths {
  std::string run;
  std::optional<std::string> truth;     ///< folder; none: the data set, where that has truth
  std::optional<std::string> dataset;   ///< none: as the run names it
  std::optional<std::string> estimate;  ///< PLY file of another surface to measure
};

struct EvalSource {
  FinishedRun run;
  std::vector<std::string> view_names;       ///< of the run
  Eigen::AlignedBox3d box;                   ///< that was asked for
  std::optional<Input> input;                ///< the run's data set
  std::map<std::string, const View*> views;  ///< of it, by name
  std::optional<std::filesystem::path> truth;
  std::optional<Mesh> surface;   ///< truth/mesh.ply
  std::optional<Mesh> run_mesh;  ///< RUN/mesh.ply, where there is a surface to measure it by
  std::optional<Mesh> estimate;  ///< to measure besides the run
  std::string estimate_name;
  std::optional<Input> held_out;  ///< views of transforms_test.json
  std::vector<std::string> notes;

  double voxel_size() const { return run.file.volume.index(0).frame().voxel_size; }
  /// The view of that name, or null where its camera is not known.
  const View* view(const std::string& name) const;
  /// How the run's pictures encode light.
  Response picture_response() const;
};

/// A folder with true depth, a true mesh, true colours or held-out views in it.
bool has_truth(const std::filesystem::path& folder);

/// TRUTH/KIND/NAME.exr by the view's name, or by its file name alone; none where there is no such file.
std::optional<std::filesystem::path> truth_file(const std::filesystem::path& truth, const std::string& kind,
                                                const std::string& name);

/// Throws InvalidInput for what was named and is missing or broken. What the run's own data set lacks is
/// noted.
EvalSource read_eval_source(const EvalPaths& paths, const Session& session);

}  // namespace roxel::cli
