#include "roxel/solve/idle_options.h"

#include <nlohmann/json.hpp>

namespace roxel {

namespace {

using Chosen = ReconstructOptions;

/// An option, and why it cannot act where it cannot.
struct IdleRule {
  const char* option;
  bool (*is_idle)(const Chosen& options, const Scene& scene);
  const char* reason;
};

constexpr IdleRule kIdleRules[] = {
    {"agreement-scale", [](const Chosen& o, const Scene&) { return o.agreement == Agreement::kGaussian; },
     "gaussian agreement has --noise and no scale; see --agreement"},
    {"white-point", [](const Chosen& o, const Scene&) { return o.color_space != ColorSpace::kLuv; },
     "only Luv knows a white point; see --color-space"},
    {"evidence-half", [](const Chosen& o, const Scene&) { return !o.predictive; },
     "with --no-predictive a voxel's own colour always counts in full"},
    {"uninformative", [](const Chosen&, const Scene& s) { return s.model.evidence_half == 0; },
     "with --no-predictive, or --evidence-half 0, a voxel's own colour always counts in full"},
    {"filter-background",
     [](const Chosen&, const Scene& s) { return s.background.kind != BackgroundKind::kKnown; },
     "the background has no known colour; see --background"},
    {"acceleration", [](const Chosen& o, const Scene&) { return o.update == UpdateRule::kRoxels; },
     "--update roxels takes no steps of opacity that could be longer"},
    {"prior-sharpness", [](const Chosen& o, const Scene&) { return o.spatial_prior == 0; },
     "--spatial-prior 0 asks no neighbours"},
    {"prior-strength", [](const Chosen& o, const Scene&) { return o.update == UpdateRule::kRoxels; },
     "--update roxels has no prior where rays hit a voxel"},
    {"matching-blur", [](const Chosen&, const Scene& s) { return !s.light.local_matching; },
     "colours are compared with the light of their neighbourhood; see --matching local"},
    {"sky-light", [](const Chosen&, const Scene& s) { return s.light.from != LightSource::kSky; },
     "no sky's light is divided out; see --illumination"},
    {"empty-sky", [](const Chosen&, const Scene& s) { return s.background.kind != BackgroundKind::kMask; },
     "the background is not what masks of skies leave; see --background sky"},
    {"coarse-passes", [](const Chosen& o, const Scene&) { return o.levels == 1; },
     "there is but one level; see --levels"},
    {"outline-weight",
     [](const Chosen&, const Scene& s) { return s.background.kind != BackgroundKind::kMask; },
     "the background is not what masks leave; see --background"},
    {"tolerance", [](const Chosen& o, const Scene&) { return o.all_passes; },
     "with --all-passes it ends no level, and only says whether levels count as converged"},
};

}  // namespace

std::vector<std::string> idle_options(const ReconstructOptions& options, const Scene& scene) {
  const auto& table = reconstruct_option_table();
  const nlohmann::ordered_json set = table.to_json(options), defaults = table.to_json({});
  std::vector<std::string> warnings;
  for (const IdleRule& rule : kIdleRules)
    if (set.at(rule.option) != defaults.at(rule.option) && rule.is_idle(options, scene))
      warnings.push_back(std::string("--") + rule.option + " has no effect here: " + rule.reason);
  return warnings;
}

}  // namespace roxel
