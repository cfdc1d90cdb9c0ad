#include "run_skies.h"

#include <limits>

#include "roxel/base/error.h"
#include "roxel/io/sky_file.h"
#include "run_input.h"

namespace roxel::cli {
namespace {

/// Whether all photographs say when and where they were taken, and some are more than a quarter of an hour
/// apart.
bool several_times_of_day(const Dataset& dataset) {
  double first = std::numeric_limits<double>::infinity(), last = -first;
  for (const View& view : dataset.views) {
    if (!view.time_utc_s || !view.latitude_deg || !view.longitude_deg) return false;
    first = std::min(first, *view.time_utc_s), last = std::max(last, *view.time_utc_s);
  }
  return last - first > kSameSky_s;
}

}  // namespace

RunSkies::RunSkies(const Invocation& invocation, const RunOptions& options, Session& session, Input& input)
    : invocation_(invocation), options_(options), session_(session), input_(input) {}

bool RunSkies::find(const std::filesystem::path& results) {
  results_ = results;
  const IlluminationChoice choice = options_.reconstruct.illumination;
  const bool wanted = choice == IlluminationChoice::kSky || choice == IlluminationChoice::kSkyNormal ||
                      options_.reconstruct.background == BackgroundChoice::kSky;
  const bool likely = choice == IlluminationChoice::kAuto && several_times_of_day(input_.dataset);
  const bool fitted = !options_.stages.sky && (wanted || likely);
  check_sky_options(fitted);
  const bool found = fitted && find_skies(wanted);
  warn_if_idle(found);
  if (fitted && !found) return true;
  if (!fitted && !options_.stages.sky) return false;
  const std::filesystem::path skies = fitted ? results_ : std::filesystem::path(*options_.stages.sky);
  daylight_ = read_daylight(skies, input_.dataset);
  if (fitted && options_.stages.sky_again && options_.reconstruct.levels > 1) {
    doubt_ = std::make_shared<std::atomic<bool>>(true);
    input_.load = with_doubt(input_.load, up(), names_of_fitted_masks(), doubt_);
  }
  if (daylight_->has_masks() || doubt_) input_.load = with_sky_masks(input_.load, skies);
  return fitted;
}

void RunSkies::check_sky_options(bool fitted) const {
  if (fitted) return;
  const char* idle = options_.stages.sun ? "--sun" : options_.stages.sky_masks ? "--sky-masks" : nullptr;
  if (idle)
    throw_invalid(idle, "no sky that is fitted in this run",
                  "--illumination sky or sky-normal, or --background sky, without --sky RUN");
}

void RunSkies::warn_if_idle(bool fitted) {
  if (options_.stages.sky_again) return;
  const char* why = options_.stages.sky                ? "skies are taken from --sky RUN as they are"
                    : !fitted                          ? "no skies are fitted in this run; see --illumination"
                    : options_.reconstruct.levels == 1 ? "there is but one level; see --levels"
                                                       : nullptr;
  if (why) input_.dataset.warnings.push_back(std::string("--no-sky-again has no effect here: ") + why);
}

SkyOptions RunSkies::sky_options() const {
  SkyOptions options;
  options.sun = options_.stages.sun;
  options.sky_masks = options_.stages.sky_masks;
  sky_option_table().validate(options);
  return options;
}

bool RunSkies::find_skies(bool wanted) {
  sky_input_ = read_sky_input(invocation_.inputs.front(), options_.input, sky_options(), session_);
  sky_input_->most_bytes = static_cast<double>(bytes_left(options_.reconstruct.memory));
  for (const std::string& warning : sky_input_->warnings) input_.dataset.warnings.push_back(warning);
  skies_ = fit_skies(*sky_input_, sky_options(), results_, session_, input_.dataset.warnings);
  if (wanted) return true;
  const Daylight daylight = read_daylight(results_, input_.dataset);
  const std::size_t views = input_.dataset.views.size();
  std::size_t lit = 0;
  for (std::size_t v = 0; v < views; ++v) lit += daylight.of_view(static_cast<int>(v)) != nullptr;
  const bool found = 2 * lit >= views;
  const std::string reasons = reasons_without_light(daylight);
  std::string note = "light: photographs of several times of day; of " + std::to_string(lit) + " of " +
                     std::to_string(views) + " the light of the sky is known";
  if (!found) note += ", too few to divide it out";
  if (!reasons.empty()) note += ": " + reasons;
  (found ? input_.dataset.notes : input_.dataset.warnings).push_back(note);
  if (!found) std::filesystem::remove_all(results_ / "sky");
  return found;
}

Eigen::Vector3d RunSkies::up() const {
  return sky_input_->tasks.empty() ? Eigen::Vector3d(Eigen::Vector3d::UnitZ())
                                   : Eigen::Vector3d(sky_input_->tasks.front().sky_from_world.transpose() *
                                                     Eigen::Vector3d::UnitZ());
}

std::set<std::string> RunSkies::names_of_fitted_masks() const {
  std::set<std::string> names;
  for (std::size_t t = 0; t < sky_input_->tasks.size(); ++t) {
    const std::vector<std::string>& views = sky_input_->tasks[t].views;
    std::set<std::string> fitted;
    for (std::size_t i = 0; i < views.size(); ++i)
      if (sky_input_->hand_masks[t](static_cast<int>(i)).empty() &&
          std::filesystem::is_regular_file(sky_mask_path(results_, views[i])))
        fitted.insert(views[i]);
    if (fitted.size() == views.size()) names.merge(fitted);
  }
  return names;
}

std::optional<Daylight> RunSkies::look_at_skies_again(const Volume& volume, const Scene& scene,
                                                      RunCheckpoints& checkpoints) {
  *doubt_ = false;
  sky_input_->most_bytes = static_cast<double>(bytes_left(options_.reconstruct.memory));
  const OpenRays open = open_rays(volume, input_.dataset, scene, up(), session_.context());
  for (const SkyAgain& again : fit_skies_again(*sky_input_, sky_options(), open, results_, session_, skies_))
    skies_again_.push_back(to_json(again));
  try {
    if (options_.checkpoints.checkpoints)
      keep_for_resume(run_, results_, {{"skies", skies_}, {"again", skies_again_}});
  } catch (const IoError& error) {
    checkpoints.give_up(error.what());  // later ones would be of no use without these skies
  }
  return read_daylight(results_, input_.dataset);
}

Daylight RunSkies::recall_skies() {
  *doubt_ = false;
  const nlohmann::ordered_json kept = recall_for_resume(run_, results_);
  skies_ = kept.at("skies").get<std::vector<nlohmann::ordered_json>>();
  skies_again_ = kept.at("again").get<std::vector<nlohmann::ordered_json>>();
  return read_daylight(results_, input_.dataset);
}

void RunSkies::add_to(ReconstructHooks& hooks, const std::filesystem::path& run,
                      RunCheckpoints& checkpoints) {
  run_ = run;
  if (daylight_) hooks.daylight = &*daylight_;
  if (!doubt_) return;
  hooks.look_at_skies_again = [this, &checkpoints](const Volume& volume, const Scene& scene) {
    return look_at_skies_again(volume, scene, checkpoints);
  };
  hooks.recall_skies = [this] { return recall_skies(); };
}

}  // namespace roxel::cli
