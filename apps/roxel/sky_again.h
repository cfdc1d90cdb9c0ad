#pragma once
/// The loop of [Jethwa04] section 7.2.2: rays that a first volume leaves unexplained feed the next fit of the
/// skies.

#include <atomic>
#include <map>
#include <memory>
#include <set>
#include <string>

#include "roxel/solve/scene.h"
#include "roxel/volume/volume.h"
#include "sky_stage.h"

namespace roxel::cli {

/// Masks by view name: 255 where less than half of the pixel's ray ends in the volume and it rises above the
/// horizon.
using OpenRays = std::map<std::string, Mask>;
OpenRays open_rays(const Volume& volume, const Dataset& dataset, const Scene& scene,
                   const Eigen::Vector3d& up, const RunContext& context);

/// The loader, with what rises above the horizon as possibly, if hardly, background while `doubt` holds, in
/// photographs of these names without a mask of the object: a sky mask that lacks part of the sky must not
/// force a volume to be built there.
PhotographLoader with_doubt(PhotographLoader load, const Eigen::Vector3d& up, std::set<std::string> names,
                            std::shared_ptr<const std::atomic<bool>> doubt);

/// One node's sky before and after.
struct SkyAgain {
  std::string node;
  double open_share = 0;                         ///< of the pixels: rays that the volume leaves unexplained
  double mask_share_before = 0, mask_share = 0;  ///< of the pixels that are sky
  double error_before = 0, error = 0;            ///< mean error of the fit
  std::string refused = "not looked at";  ///< why the second does not replace the first; empty: it does
};
nlohmann::ordered_json to_json(const SkyAgain& again);

/// Fits every sky again with open rays as evidence. Those that find more sky, lose none, and are fitted as
/// well, replace files in RUN/sky and entries of `nodes` (what fit_skies returned).
std::vector<SkyAgain> fit_skies_again(const SkyInput& input, const SkyOptions& options, const OpenRays& open,
                                      const std::filesystem::path& run, Session& session,
                                      std::vector<nlohmann::ordered_json>& nodes);

}  // namespace roxel::cli
