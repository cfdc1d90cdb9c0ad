#include "roxel/solve/idle_options.h"

#include <gmock/gmock.h>

namespace roxel {
namespace {

/// What is set, where it cannot act, and where it can.
struct IdleCase {
  const char* option;
  void (*set)(ReconstructOptions& options);
  void (*idle)(ReconstructOptions& options, Scene& scene);
  void (*active)(ReconstructOptions& options, Scene& scene);
};

void as_it_is(ReconstructOptions&, Scene&) {}
void without_others(ReconstructOptions& o, Scene& s) { o.predictive = false, s.model.evidence_half = 0; }
void by_roxels(ReconstructOptions& o, Scene&) { o.update = UpdateRule::kRoxels; }

const IdleCase kIdleCases[] = {
    {"agreement-scale", [](auto& o) { o.agreement_scale = 8; }, as_it_is,
     [](auto& o, auto&) { o.agreement = Agreement::kExponential; }},
    {"white-point", [](auto& o) { o.white_point = "A"; },
     [](auto& o, auto&) { o.color_space = ColorSpace::kRgb; }, as_it_is},
    {"evidence-half", [](auto& o) { o.evidence_half = 1; }, without_others, as_it_is},
    {"uninformative", [](auto& o) { o.uninformative = 0.01; }, without_others, as_it_is},
    {"uninformative", [](auto& o) { o.uninformative = 0.01; },
     [](auto&, auto& s) { s.model.evidence_half = 0; }, as_it_is},
    {"filter-background", [](auto& o) { o.filter_background = true; },
     [](auto&, auto& s) { s.background.kind = BackgroundKind::kMask; },
     [](auto&, auto& s) { s.background.kind = BackgroundKind::kKnown; }},
    {"acceleration", [](auto& o) { o.acceleration = 4; }, by_roxels, as_it_is},
    {"prior-sharpness", [](auto& o) { o.prior_sharpness = 3; }, [](auto& o, auto&) { o.spatial_prior = 0; },
     as_it_is},
    {"prior-strength", [](auto& o) { o.prior_strength = 4; }, by_roxels, as_it_is},
    {"matching-blur", [](auto& o) { o.matching_blur = 9; }, as_it_is,
     [](auto&, auto& s) { s.light.local_matching = true; }},
    {"sky-light", [](auto& o) { o.sky_light = DomeLight::kMean; },
     [](auto&, auto& s) { s.light.from = LightSource::kGain; },
     [](auto&, auto& s) { s.light.from = LightSource::kSky; }},
    {"empty-sky", [](auto& o) { o.empty_sky = false; },
     [](auto&, auto& s) { s.background.kind = BackgroundKind::kUnknown; },
     [](auto&, auto& s) { s.background.kind = BackgroundKind::kMask; }},
    {"coarse-passes", [](auto& o) { o.coarse_passes = 3; }, [](auto& o, auto&) { o.levels = 1; }, as_it_is},
    {"outline-weight", [](auto& o) { o.outline_weight = 0.5; },
     [](auto&, auto& s) { s.background.kind = BackgroundKind::kUnknown; },
     [](auto&, auto& s) { s.background.kind = BackgroundKind::kMask; }},
    {"tolerance", [](auto& o) { o.tolerance = 0.01; }, [](auto& o, auto&) { o.all_passes = true; }, as_it_is},
};

TEST(IdleOptions, EachIsNamedWhereItCannotActAndNowhereElse) {
  for (const IdleCase& c : kIdleCases) {
    SCOPED_TRACE(c.option);
    ReconstructOptions options;
    Scene scene;
    c.set(options);
    c.active(options, scene);
    EXPECT_THAT(idle_options(options, scene), testing::IsEmpty());
    options = {};
    scene = Scene();
    c.idle(options, scene);
    EXPECT_THAT(idle_options(options, scene), testing::IsEmpty()) << "it has its default";
    c.set(options);
    EXPECT_THAT(idle_options(options, scene),
                testing::ElementsAre(testing::StartsWith(std::string("--") + c.option + " has no effect")));
  }
}

}  // namespace
}  // namespace roxel
