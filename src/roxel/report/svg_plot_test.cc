#include "roxel/report/svg_plot.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>

#include "roxel/report/markup.h"

namespace roxel {
namespace {

using testing::HasSubstr;
using testing::Not;

TEST(Markup, EscapesWhatHasMeaning) {
  EXPECT_EQ(escape_markup("a<b & \"c\" 'd'>"), "a&lt;b &amp; &quot;c&quot; &#39;d&#39;&gt;");
  EXPECT_EQ(escape_markup("grün\n"), "grün\n");
  EXPECT_EQ(escape_markup("x\xFFy\x01z"), "x\xEF\xBF\xBDy\xEF\xBF\xBDz");
}

TEST(Markup, Base64OfTheStandardsExamples) {
  EXPECT_EQ(base64(""), "");
  EXPECT_EQ(base64("f"), "Zg==");
  EXPECT_EQ(base64("fo"), "Zm8=");
  EXPECT_EQ(base64("foobar"), "Zm9vYmFy");
  EXPECT_EQ(base64("\xFF\xFE\xFD"), "//79");
  EXPECT_EQ(data_uri("image/png", "f"), "data:image/png;base64,Zg==");
}

TEST(Markup, Numbers) {
  EXPECT_EQ(short_number(0.25), "0.25");
  EXPECT_EQ(short_number(1234.5678), "1235");
  EXPECT_EQ(grouped(12), "12");
  EXPECT_EQ(grouped(1234567),
            "1\xE2\x80\x89"
            "234\xE2\x80\x89"
            "567");
  EXPECT_EQ(grouped(-123), "-123");
}

TEST(SvgPlot, TicksAreRound) {
  EXPECT_THAT(axis_ticks(0, 1, 6),
              testing::Pointwise(testing::DoubleNear(1e-12), {0.0, 0.2, 0.4, 0.6, 0.8, 1.0}));
  EXPECT_THAT(axis_ticks(-3, 14, 6), testing::ElementsAre(0, 5, 10));
  EXPECT_THAT(axis_ticks(1000, 1004, 6), testing::ElementsAre(1000, 1001, 1002, 1003, 1004));
}

TEST(SvgPlot, DrawsALineWhereItsPointsAre) {
  Plot plot{"A <title>", {"x [m]", 0, 10}, {"y", 0, 1}, {{"one", {0, 10}, {0, 1}}}};
  const std::string svg = svg_plot(plot);
  // The corners of the field: 64 to 466 across, 270 (below) to 54 (a legend above).
  EXPECT_THAT(svg, HasSubstr("M64.0 270.0L466.0 54.0"));
  EXPECT_THAT(svg, HasSubstr("A &lt;title&gt;"));
  EXPECT_THAT(svg, HasSubstr(">x [m]<"));
  EXPECT_THAT(svg, HasSubstr(">one<"));
}

TEST(SvgPlot, ThinLinesArePaleAndNeverDashed) {
  // The second of two: a line of its own would be dashed.
  const PlotSeries thin{"many", {0, 1}, {0, 1}, PlotStyle::kThin};
  const std::string svg = svg_plot({"Thin", {"x"}, {"y"}, {{"", {}, {}}, thin}});
  EXPECT_THAT(svg, HasSubstr("stroke-width=\"0.7\" stroke-opacity=\"0.5\" stroke-dasharray=\"\""));
}

TEST(SvgPlot, BarsStandOnZero) {
  Plot plot{"Bars", {"x", 0, 2}, {"y", 0, 2}, {{"", {0, 1}, {1, 2}, PlotStyle::kBars, 1}}};
  const std::string svg = svg_plot(plot);
  // 236 units high without a legend, 201 wide each.
  EXPECT_THAT(svg, HasSubstr("<rect x=\"64.00\" y=\"152.00\" width=\"201.00\" height=\"118.00\""));
  EXPECT_THAT(svg, HasSubstr("<rect x=\"265.00\" y=\"34.00\" width=\"201.00\" height=\"236.00\""));
}

TEST(SvgPlot, BarsStandOnZeroWhereTheAxisIsFromTheData) {
  // The taller one is as high as the field less 4 % of the axis; the other half as high.
  const std::string svg = svg_plot({"Bars", {"x"}, {"y"}, {{"", {0, 1}, {4, 8}, PlotStyle::kBars, 1}}});
  EXPECT_THAT(svg, HasSubstr("height=\"113.46\""));
  EXPECT_THAT(svg, HasSubstr("height=\"226.92\""));
}

TEST(SvgPlot, LogarithmsAndGaps) {
  Plot plot{"Log", {"x", 0, 4}, {"y", 0.01, 100, true}, {{"", {0, 1, 2, 3, 4}, {1, 0, NAN, 1, 100}}}};
  const std::string svg = svg_plot(plot);
  EXPECT_THAT(svg, HasSubstr("M64.0 152.0M365.5 152.0L466.0 34.0"));
  EXPECT_THAT(svg, HasSubstr(">0.01<"));
}

TEST(SvgPlot, NothingToDrawIsStillAPlot) {
  for (const bool log : {false, true}) {
    const std::string svg = svg_plot({"Empty", {"x"}, {"y", {}, {}, log}, {{"", {}, {}}, {"", {1}, {NAN}}}});
    EXPECT_THAT(svg, HasSubstr("</svg>"));
    EXPECT_THAT(svg, Not(HasSubstr("nan")));
    EXPECT_THAT(svg, Not(HasSubstr("inf")));
  }
}

TEST(SvgPlot, OneValueHasAnAxis) {
  const std::string svg = svg_plot({"One", {"x"}, {"y"}, {{"", {3}, {7}}}});
  EXPECT_THAT(svg, Not(HasSubstr("nan")));
}

}  // namespace
}  // namespace roxel
