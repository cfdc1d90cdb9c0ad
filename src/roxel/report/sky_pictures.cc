#include "roxel/report/sky_pictures.h"

#include <algorithm>
#include <cmath>

#include "roxel/io/image_file.h"
#include "roxel/io/sky_file.h"
#include "roxel/report/pictures.h"

namespace roxel {
namespace {

constexpr float kUnseen = 0.15f, kNoError = 0.35f;
constexpr float kDimmed = 0.5f;  ///< heat of facets that the fit did not use

constexpr std::pair<const char*, const char*> kCaptions[] = {{"seen", "as the images show it"},
                                                             {"variance", "too much contrast"},
                                                             {"red_blue", "not blue"},
                                                             {"luminance", "dark"},
                                                             {"used", "facets of the fit"},
                                                             {"fit", "fitted sky"},
                                                             {"error", "error of the fit (pale: not used)"}};

std::string caption_of(const std::string& name, bool left_out) {
  for (const auto& [known, caption] : kCaptions)
    if (known == name) return std::string(caption) + (left_out ? " (left out)" : "");
  return name;
}

SkyPanel panel_of(const std::string& name, Image picture, bool left_out = false) {
  return {name, caption_of(name, left_out), std::move(picture)};
}

/// Radiance shown as white: little above what most of the sky has.
double white_of(const SkyFit& fit) {
  std::vector<double> values;
  for (const bool used : {true, false}) {
    for (int f = 0; f < fit.light.sphere->count(); ++f)
      if (fit.light.facets[f].weight > 0 && (!used || fit.used[f]))
        values.push_back(luminance(fit.light.facets[f].mean));
    if (values.empty()) continue;
    std::sort(values.begin(), values.end());
    return 1.5 * values[values.size() * 9 / 10];
  }
  return 1;
}

/// One panel, by the facet and direction of each pixel.
template <class Shade>
Image panel(const SkyFit& fit, int width, const Shade& shade) {
  const Equirectangular frame{width, width / 2};
  Image picture(width, width / 3, 3);
  for (int y = 0; y < picture.height(); ++y)
    for (int x = 0; x < width; ++x) {
      const Eigen::Vector3d direction = frame.direction(x + 0.5, y + 0.5);
      const Eigen::Vector3f color = shade(fit.light.sphere->facet_at(direction), direction);
      std::copy_n(color.data(), 3, picture.pixel(x, y));
    }
  return picture;
}

Eigen::Vector3f grey(float value) { return Eigen::Vector3f::Constant(value); }

Eigen::Vector3f shown(const Eigen::Vector3d& radiance, double white) {
  Eigen::Vector3f out;
  for (int c = 0; c < 3; ++c)
    out[c] = encode(Response{}, std::clamp(static_cast<float>(radiance[c] / white), 0.0f, 1.0f));
  return out;
}

/// Black, violet, red, yellow, white.
Eigen::Vector3f heat(double share) {
  const auto ramp = [&](double from, double to) {
    return static_cast<float>(std::clamp((share - from) / (to - from), 0.0, 1.0));
  };
  const float violet = share < 0.25 ? ramp(0, 0.25) : 1 - ramp(0.25, 0.5);
  return {ramp(0, 0.5), ramp(0.4, 0.8), std::max(0.6f * violet, ramp(0.8, 1))};
}

class Panels {
 public:
  Panels(const SkyFit& fit, int width) : fit_(fit), width_(width), white_(white_of(fit)) {}

  std::vector<SkyPanel> take() {
    const SkyMasks& m = fit_.masks;
    return {panel_of("seen", picture([&](int f, const auto&) { return seen(f); })),
            masked("variance", m.variance, {1, 0.1f, 0.1f}),
            masked("red_blue", m.red_blue, {1, 0.9f, 0.1f}, !m.red_blue_used),
            masked("luminance", m.luminance, {0.1f, 0.9f, 0.2f}, !m.luminance_used),
            masked("used", fit_.used, {0.1f, 0.4f, 1}),
            panel_of("fit", picture([&](int, const auto& d) { return fitted(d); })),
            panel_of("error", picture([&](int f, const auto&) { return error(f); }))};
  }

 private:
  template <class Shade>
  Image picture(const Shade& shade) const {
    return panel(fit_, width_, shade);
  }

  Eigen::Vector3f seen(int f) const {
    const FacetLight& facet = fit_.light.facets[f];
    if (facet.clipped > facet.weight) return grey(1);
    return facet.weight > 0 ? shown(facet.mean, white_) : grey(kUnseen);
  }

  SkyPanel masked(const char* name, const std::vector<std::uint8_t>& mask, const Eigen::Vector3f& color,
                  bool left_out = false) const {
    return panel_of(name, picture([&](int f, const auto& direction) -> Eigen::Vector3f {
                      const bool shows = mask[f] && direction.z() > 0 && fit_.light.facets[f].pictures > 0;
                      return shows ? Eigen::Vector3f(0.45f * seen(f) + 0.55f * color) : seen(f);
                    }),
                    left_out);
  }

  Eigen::Vector3f fitted(const Eigen::Vector3d& direction) const {
    if (direction.z() < 0 || !fit_.fitted.has_light()) return grey(kUnseen);
    return shown(fit_.fitted.radiance_in_sky(direction), white_);
  }

  Eigen::Vector3f error(int f) const {
    const FacetLight& facet = fit_.light.facets[f];
    if (!fit_.fitted.has_light() || !(facet.mean.minCoeff() > 0) || fit_.light.sphere->centre(f).z() <= 0)
      return grey(kNoError);
    const Eigen::Vector3d model = fit_.fitted.radiance_in_sky(fit_.light.sphere->centre(f));
    const Eigen::Array3d ratio = model.array() / facet.mean.array();
    const Eigen::Vector3f shown = heat((ratio - 1).abs().mean() / kHottestSkyError);
    return fit_.used[f] ? shown : Eigen::Vector3f(grey(kNoError) + kDimmed * (shown - grey(kNoError)));
  }

  const SkyFit& fit_;
  int width_;
  double white_;
};

}  // namespace

std::vector<SkyPanel> sky_panels(const SkyFit& fit, int width) { return Panels(fit, width).take(); }

ReportView sky_report(const SkyFit& fit, const std::vector<SkyPanel>& panels) {
  ReportView view{fit.sky.name, fit.masks.reason};
  for (const SkyPanel& panel : panels) view.pictures.push_back(report_picture(panel.caption, panel.picture));
  return view;
}

std::vector<ReportView> sky_reports_of(const std::filesystem::path& run,
                                       const nlohmann::ordered_json& skies) {
  std::vector<ReportView> views;
  if (!skies.is_array()) return views;
  for (const int n : report_views(static_cast<int>(skies.size()))) {
    const std::string node = skies[n].value("node", "");
    const nlohmann::ordered_json masks = skies[n].value("masks", nlohmann::ordered_json::object());
    ReportView view{node, masks.value("reason", "")};
    for (const auto& [name, caption] : kCaptions)
      if (const auto file = sky_path(run, node, std::string("_") + name + ".png");
          std::filesystem::is_regular_file(file))
        view.pictures.push_back(
            report_picture(caption_of(name, masks.value(name, "") == "left out"),
                           read_image(file.string(), Response{ResponseCurve::kLinear}).rgb));
    if (!view.pictures.empty()) views.push_back(std::move(view));
  }
  return views;
}

}  // namespace roxel
