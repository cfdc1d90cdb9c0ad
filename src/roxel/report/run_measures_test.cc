#include "roxel/report/run_measures.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <map>
#include <string>

#include "roxel/report/measure_plots.h"

namespace roxel {
namespace {

using testing::HasSubstr;

/// Two views with a pixel each, one surface, four voxels.
RunMeasures some_measures() {
  RunMeasures m;
  m.run = "run";
  m.truth = "truth";
  m.voxel_size = 0.5;
  m.box = Eigen::AlignedBox3d(Eigen::Vector3d(0, 0, 0), Eigen::Vector3d(3, 4, 12));
  DepthAccuracyOptions options;
  options.voxel_size = 0.5;
  options.distances = {0.3};
  const std::vector<float> truth{4}, good{4.2f}, bad{9}, variance{0.04f};
  m.depth = {{"a,b", depth_accuracy({good, variance, {}}, truth, options)},
             {"c", depth_accuracy({bad, variance, {}}, truth, options)}};
  m.opacity_reliability.emplace();
  m.opacity_reliability->add(0.95, true);
  m.surfaces = {{"points", surface_accuracy({1, 2}, {1, 1, 3, 4}, {1, 2})}};
  m.volume = volume_accuracy({1, 0.5f, 0.25f, 0.75f}, {0, 2, 4, 30}, {0.5});
  m.images = {{"a,b", image_quality(Image(12, 12, 3, 0.5f), Image(12, 12, 3, 0.4f), {}), {}}};
  m.color = color_accuracy({{{0.5f, 0.4f, 0.3f}, {0.4f, 0.4f, 0.4f}}});
  return m;
}

TEST(RunMeasures, JsonHasEveryPart) {
  const auto json = to_json(some_measures());
  EXPECT_NEAR(json["box_diagonal"].get<double>(), 13, 1e-12);
  EXPECT_EQ(json["depth"]["share_within_voxels"]["0.5"], 0.5);
  EXPECT_EQ(json["depth"]["share_within_units"]["0.3"], 0.5);
  EXPECT_EQ(json["depth"]["views"].size(), 2);
  EXPECT_EQ(json["calibration"]["coverage_68"], 0.5);
  EXPECT_EQ(json["calibration"]["opacity"]["bins"][19]["share_with_surface"], 1);
  EXPECT_EQ(json["surfaces"][0]["within"][1]["precision"], 1);
  EXPECT_EQ(json["surfaces"][0]["within"][1]["recall"], 0.5);
  EXPECT_EQ(json["volume"]["share_within_4_voxels"], 0.75);
  EXPECT_EQ(json["volume"]["histogram"]["voxels"][4], 1);
  EXPECT_NEAR(json["images"]["object"]["g"]["rms"].get<double>(), 0.1, 1e-6);
  EXPECT_EQ(json["color"]["pixels"], 1);
  EXPECT_TRUE(json["held_out"].is_null());
}

TEST(RunMeasures, WhatWasNotMeasuredIsNull) {
  const RunMeasures none;
  EXPECT_TRUE(none.empty());
  const auto json = to_json(none);
  for (const char* key : {"depth", "calibration", "volume", "images", "held_out", "color"})
    EXPECT_TRUE(json[key].is_null()) << key;
  EXPECT_TRUE(csv_tables(none).empty());
  EXPECT_EQ(to_text(none), "");
  EXPECT_TRUE(measure_plots(none).empty());
}

TEST(RunMeasures, TablesHaveAHeadAndALineEach) {
  for (const auto& [name, table] : csv_tables(some_measures())) {
    const auto commas = [](const std::string& line) {
      bool quoted = false;
      int count = 0;
      for (const char c : line) {
        quoted = quoted != (c == '"');
        count += c == ',' && !quoted;
      }
      return count;
    };
    std::size_t begin = 0, end = 0;
    int expected = -1, lines = 0;
    for (; (end = table.find('\n', begin)) != std::string::npos; begin = end + 1, ++lines) {
      const std::string line = table.substr(begin, end - begin);
      if (expected < 0) expected = commas(line);
      EXPECT_EQ(commas(line), expected) << name << ": " << line;
    }
    EXPECT_GT(lines, 1) << name;
    EXPECT_EQ(begin, table.size()) << name;
  }
}

TEST(RunMeasures, ACommaInANameIsQuoted) {
  EXPECT_THAT(csv_tables(some_measures())[0].second, HasSubstr("\n\"a,b\",1,1,"));
}

TEST(RunMeasures, MethodsAndColourHaveTables) {
  RunMeasures m = some_measures();
  m.depth_methods = {{"volume", m.depth[0].accuracy}, {"bp", m.depth[1].accuracy}};
  std::map<std::string, std::string> tables;
  for (const auto& [name, table] : csv_tables(m)) tables[name] = table;
  EXPECT_THAT(tables["depth.csv"], HasSubstr("\nall,2,1,0.5,"));
  EXPECT_THAT(tables["depth_methods.csv"], HasSubstr("method,true_pixels,"));
  EXPECT_THAT(tables["depth_methods.csv"], HasSubstr("\nvolume,1,1,1,"));
  EXPECT_THAT(tables["depth_methods.csv"], HasSubstr("\nbp,1,1,0,"));
  EXPECT_THAT(tables["depth_methods.csv"], Not(HasSubstr("all")));
  EXPECT_THAT(tables["color.csv"], HasSubstr("\n1,"));
}

TEST(RunMeasures, TextIsShortWhereViewsAreMany) {
  const RunMeasures m = some_measures();
  EXPECT_THAT(to_text(m), HasSubstr("| c | 1 |"));
  EXPECT_THAT(to_text(m, 1), Not(HasSubstr("| c | 1 |")));
  EXPECT_THAT(to_text(m, 1), HasSubstr("| **all** | 2 | 50.00 |"));
  EXPECT_THAT(to_text(m), HasSubstr("| points | 2 | 2 | 1 | 50.00 | 50.00 | 0.5000 |"));
}

TEST(RunMeasures, AnEmptyEstimateHasNoDistances) {
  RunMeasures m;
  m.surfaces = {{"points", surface_accuracy({}, {INFINITY}, {0.5})}};
  const auto json = to_json(m)["surfaces"][0];
  for (const char* key :
       {"accuracy_90", "mean_to_truth", "median_to_truth", "mean_to_estimate", "median_to_estimate"})
    EXPECT_TRUE(json[key].is_null()) << key;
  EXPECT_THAT(to_text(m), HasSubstr("| points | 0 | - | 0.5 | 0.00 | 0.00 | 0.0000 |"));
  EXPECT_THAT(csv_tables(m)[0].second, HasSubstr("\npoints,0,-,-,-,0.5,0,0,0\n"));
}

TEST(RunMeasures, ASetOfPixelsSaysHowManyCount) {
  RunMeasures m;
  m.surfaces = {{"pixels", surface_accuracy({0, 1}, {0}, {0.5}), 3},
                {"points", surface_accuracy({0}, {0}, {0.5})}};
  const auto json = to_json(m)["surfaces"];
  EXPECT_EQ(json[0]["name"], "pixels");
  EXPECT_EQ(json[0]["pixel_stride"], 3);
  EXPECT_EQ(json[0]["true_points"], 1);
  EXPECT_FALSE(json[1].contains("pixel_stride"));
  EXPECT_THAT(to_text(m), HasSubstr("| pixels, 1 in 9 | 2 |"));
}

TEST(RunMeasures, SkyDebrisIsThereWhereItWasMeasured) {
  RunMeasures m;
  EXPECT_FALSE(to_json(m).contains("sky_debris"));
  SkyDebris debris;
  debris.opacity_threshold = 0.04;
  debris.all = {400, 100.0}, debris.in_the_open = {100, 10.0}, debris.above_all = {2, 3.0},
  debris.before_sky = {1, 0.5};
  m.debris = {debris};
  const auto json = to_json(m)["sky_debris"][0];
  EXPECT_EQ(json["in_the_open"]["share"], 0.25);
  EXPECT_EQ(json["above_all"]["share_of_opacity"], 0.03);
  EXPECT_EQ(json["before_sky"]["voxels"], 1);
  EXPECT_EQ(json["before_sky"]["share_of_opacity"], 0.005);
  EXPECT_THAT(to_text(m),
              HasSubstr("| >= 0.04 | 400 | 100 | 25.000 | 10.000 | 2 | 0.500 | 3.000 | 1 | 0.250 | 0.500 |"));
  EXPECT_THAT(csv_tables(m)[0].second, HasSubstr("\n0.04,400,100,0.25,0.1,2,0.005,0.03,1,0.0025,0.005\n"));
}

TEST(RunMeasures, ANodeWithoutLightHasNoErrors) {
  RunMeasures m;
  m.skies.resize(1);
  m.skies[0].node = "n00";
  m.skies[0].model = m.skies[0].sun_light = "none";
  const auto json = to_json(m)["skies"][0];
  for (const char* key : {"fit_error", "dome_error", "horizontal_error", "horizontal_sky_error"})
    EXPECT_TRUE(json[key].is_null()) << key;
  EXPECT_THAT(csv_tables(m)[0].second, HasSubstr("\nn00,none,-,-,-,-,-,none,-,-,-,0\n"));
  EXPECT_THAT(to_text(m), Not(HasSubstr("0.00")));
}

TEST(ConvergencePlots, WhatIsNoNumberIsAGap) {
  const nlohmann::ordered_json pass{{"level", 1}, {"mean_log_likelihood", -3.0}, {"active_voxels", 9}};
  nlohmann::ordered_json broken = pass;
  broken["mean_log_likelihood"] = nullptr;
  broken["active_voxels"] = "many";
  broken["level"] = nullptr;
  nlohmann::ordered_json summary;
  summary["passes"] = {broken, pass, broken, 5};
  const std::vector<NamedPlot> plots = convergence_plots(summary);
  ASSERT_EQ(plots.size(), 4);
  std::vector<double> likelihoods;
  for (const PlotSeries& level : plots[1].plot.series)
    likelihoods.insert(likelihoods.end(), level.y.begin(), level.y.end());
  ASSERT_EQ(likelihoods.size(), 4);
  for (const int gap : {0, 2, 3}) EXPECT_TRUE(std::isnan(likelihoods[gap])) << gap;
  EXPECT_EQ(likelihoods[1], -3);
  for (const NamedPlot& plot : plots) EXPECT_THAT(svg_plot(plot.plot), Not(HasSubstr("nan")));
  summary["passes"] = 5;
  EXPECT_TRUE(convergence_plots(summary).empty());
}

TEST(MeasurePlots, OneForEachPart) {
  std::vector<std::string> names;
  for (const NamedPlot& plot : measure_plots(some_measures())) {
    names.push_back(plot.name);
    EXPECT_THAT(svg_plot(plot.plot), Not(HasSubstr("nan")));
  }
  EXPECT_THAT(names, testing::ElementsAre("surface_1", "voxel_distances", "voxel_opacities",
                                          "depth_error_over_sigma", "opacity_reliability", "images"));
}

TEST(MeasurePlots, HonestErrorsFillTheirCurve) {
  RunMeasures m;
  DepthAccuracy all;
  all.calibrated_pixels = 1000;
  all.normalized_errors[0] = 500;  // half below 1/25 sigma, half near 0.3: bars of 0.2 sigma
  all.normalized_errors[7] = 500;
  m.depth = {{"a", all}};
  const PlotSeries bars = measure_plots(m)[0].plot.series[0];
  EXPECT_NEAR(bars.y[0], 2.5, 1e-12);
  EXPECT_NEAR(bars.y[1], 2.5, 1e-12);
  EXPECT_EQ(bars.y[2], 0);
}

}  // namespace
}  // namespace roxel
