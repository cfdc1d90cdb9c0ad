#include "roxel/report/sky_pictures.h"

#include <gtest/gtest.h>

#include "roxel/sky/sky_fixture.h"

namespace roxel {
namespace {

Image named(const std::vector<SkyPanel>& panels, const std::string& name) {
  return std::find_if(panels.begin(), panels.end(), [&](const SkyPanel& p) { return p.name == name; })
      ->picture;
}

Eigen::Vector3f color_at(const Image& picture, const Eigen::Vector3d& direction) {
  const Equirectangular frame{picture.width(), picture.width() / 2};
  const Eigen::Vector2d at = frame.position(direction);
  return Eigen::Vector3f(picture.pixel(static_cast<int>(at.x()), static_cast<int>(at.y())));
}

TEST(SkyPanels, ErrorsAreShownOfAllThatIsSeenAboveTheHorizon) {
  Square square;
  square.roof_deg = 25;
  const SkyFit fit = fit_one(panorama_of(clear_sky(), square));
  const Image error = named(sky_panels(fit), "error");
  const Eigen::Vector3d sky = sun_direction({330, 50}), wall = sun_direction({330, 12}),
                        ground = sun_direction({330, -10});
  ASSERT_TRUE(fit.used[fit.light.sphere->facet_at(sky)]);
  ASSERT_FALSE(fit.used[fit.light.sphere->facet_at(wall)]);
  const Eigen::Vector3f none = color_at(error, ground);
  EXPECT_LT(color_at(error, sky).maxCoeff(), 0.35f) << "the fit is good";
  EXPECT_EQ(none, Eigen::Vector3f::Constant(none[0])) << "nothing to compare with: grey";
  // The wall is five times brighter: white, half as strong.
  EXPECT_GT((color_at(error, wall) - none).minCoeff(), 0.2f);
  EXPECT_LT(color_at(error, wall).maxCoeff(), 0.8f);
}

}  // namespace
}  // namespace roxel
