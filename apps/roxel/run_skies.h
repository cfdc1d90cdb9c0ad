#pragma once
/// The skies of one `roxel reconstruct`: given, or fitted before the volume and again after its first level.

#include <atomic>

#include "command.h"
#include "roxel/solve/reconstruct.h"
#include "run_options.h"
#include "sky_again.h"

namespace roxel::cli {

class RunSkies {
 public:
  /// From find() on, the photographs of `input` come with sky masks.
  RunSkies(const Invocation& invocation, const RunOptions& options, Session& session, Input& input);

  /// The skies, where they are given or asked for, written below `results`; says whether any were fitted.
  /// Throws InvalidInput where an option says how skies are fitted and none are.
  bool find(const std::filesystem::path& results);
  /// Lets a reconstruction into `run` know the skies, and fit them again where that was asked for.
  void add_to(ReconstructHooks& hooks, const std::filesystem::path& run, RunCheckpoints& checkpoints);

  const std::vector<nlohmann::ordered_json>& nodes() const { return skies_; }
  const std::vector<nlohmann::ordered_json>& again() const { return skies_again_; }

 private:
  /// What says how skies are fitted does nothing where none is.
  void check_sky_options(bool fitted) const;
  /// Says so where --no-sky-again does nothing.
  void warn_if_idle(bool fitted);
  SkyOptions sky_options() const;
  /// Fits the skies. Where they were not asked for, the light of half of the photographs must turn out to be
  /// known; else nodes() says why not, and nothing is left of them below `results`.
  bool find_skies(bool wanted);
  Eigen::Vector3d up() const;
  /// Of photographs whose sky mask comes from a fit; of nodes with a mask by hand, none, as those decide
  /// alone.
  std::set<std::string> names_of_fitted_masks() const;
  /// Skies again, with what a first volume leaves unexplained. From here on masks are not doubted.
  std::optional<Daylight> look_at_skies_again(const Volume& volume, const Scene& scene,
                                              RunCheckpoints& checkpoints);
  /// What look_at_skies_again found before the run was interrupted.
  Daylight recall_skies();

  const Invocation& invocation_;
  const RunOptions& options_;
  Session& session_;
  Input& input_;
  std::filesystem::path run_, results_;
  std::optional<Daylight> daylight_;
  std::vector<nlohmann::ordered_json> skies_, skies_again_;
  std::optional<SkyInput> sky_input_;         ///< of skies that are fitted in this run
  std::shared_ptr<std::atomic<bool>> doubt_;  ///< whether sky masks may lack sky; null: never
};

}  // namespace roxel::cli
