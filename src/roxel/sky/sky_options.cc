#include "roxel/sky/sky_options.h"

namespace roxel {
namespace {

OptionTable<SkyOptions> make_table() {
  OptionTable<SkyOptions> table;
  table.group("Sky");
  table.add("sun", &SkyOptions::sun)
      .help("Where the sun stands: degrees clockwise from north (+Y), degrees above the horizon")
      .placeholder("AZ,EL")
      .unit("degrees")
      .range(-360, 360)
      .unset("from time and place, else a bright spot that is surely the sun");
  table.add("up", &SkyOptions::up)
      .help("Which way the world's zenith is")
      .placeholder("X,Y,Z")
      .unset("+Z where places are known or cameras agree, else as most cameras are held");
  table.add("sky-masks", &SkyOptions::sky_masks)
      .help("Folder of masks NAME.png by hand, 255 = sky: they alone say what is fitted")
      .placeholder("DIR")
      .unset("found from variance, colour and luminance");
  table.add("facets", [](SkyOptions& o) -> int& { return o.fit.facet_level; })
      .help("How often the sphere's facets are divided: 4 7 degrees, 5 3.4, 6 1.7, 7 0.8")
      .range(4, 7)
      .source("1 to 3 degrees [Jethwa04] §3.3");
  table.add("contrast-limit", [](SkyOptions& o) -> double& { return o.fit.masks.contrast_limit; })
      .help("Facets whose luminance deviates by more of its mean are no sky at first")
      .above(0);
  table.add("red-blue-limit", [](SkyOptions& o) -> double& { return o.fit.masks.red_blue_limit; })
      .help("Facets with more red over blue are no sky at first, where the sky is blue")
      .above(0)
      .source("[Jethwa04] §3.3");
  table.add("lowest-elevation", [](SkyOptions& o) -> double& { return o.fit.masks.lowest_elevation_deg; })
      .help("Facets below are left out of the fit")
      .unit("degrees")
      .range(0, 80);
  table.add("exponent", [](SkyOptions& o) -> bool& { return o.fit.free_exponent; })
      .help("Fit the exponent h of the glow around the sun, too; without it is 1")
      .source("[Jethwa04] eq. (3.2)");
  table.add("residual", [](SkyOptions& o) -> int& { return o.fit.residual_order; })
      .help("Order of spherical functions on top of the model; 0: none")
      .range(0, 4);
  table.add("sky-rounds", [](SkyOptions& o) -> int& { return o.fit.most_rounds; })
      .help("Most fits of a node, each with the facets that agree with the one before")
      .range(1, 50);
  table.rule([](const SkyOptions& o) -> std::string {
    if (o.sun && std::abs((*o.sun)[1]) > 90) return "sun: the elevation must be from -90 to 90 degrees";
    if (o.up && (*o.up) == std::array<double, 3>{0, 0, 0}) return "up must not be 0,0,0";
    return "";
  });
  return table;
}

}  // namespace

SkyFitOptions SkyOptions::fit_options() const {
  SkyFitOptions options = fit;
  if (sun) options.sun = SunPosition{(*sun)[0], (*sun)[1]};
  return options;
}

const OptionTable<SkyOptions>& sky_option_table() {
  static const OptionTable<SkyOptions> table = make_table();
  return table;
}

}  // namespace roxel
