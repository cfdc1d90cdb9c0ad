#include "roxel/report/html_report.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <regex>

#include "roxel/report/section_picture.h"

namespace roxel {
namespace {

using nlohmann::ordered_json;
using testing::HasSubstr;
using testing::Not;

ReportContent some_content() {
  ReportContent content;
  content.summary = {{"version", "1.2.3"},
                     {"command", "roxel reconstruct <evil> & co"},
                     {"dataset", {{"path", "/data/<b>\"bold\"</b>"}, {"images", 30}}},
                     {"scene", {{"bounds", {-1.2000000476837158, 0, 0, 1, 2, 3}}}},
                     {"warnings", {"the box <cuts> what is seen"}},
                     {"options", {{"levels", 3}, {"init", nullptr}, {"noise", 0.5}}},
                     {"levels", {{{"voxel_size", 0.25}, {"seconds", 3.0}, {"voxels_in_box", 1234567}}}},
                     {"stages",
                      {{{"name", "survey"}, {"seconds", 1.0}, {"peak_memory_bytes", 50 * 1024 * 1024}},
                       {{"name", "mesh"}, {"seconds", 0.0}, {"peak_memory_bytes", nullptr}}}},
                     {"peak_memory_bytes", 70 * 1024 * 1024},
                     {"seconds", 4.0},
                     {"passes",
                      {{{"level", 1},
                        {"mean_opacity_change", 0.1},
                        {"mean_log_likelihood", -3.0},
                        {"active_voxels", 9},
                        {"seconds", 3.0}}}}};
  content.views = {{"a<b", "RMS 2 %", {report_picture("photograph", Image(40, 30, 3, 0.5f))}}};
  content.opacities = {0.1f, 0.9f};
  return content;
}

TEST(HtmlReport, EscapesWhatComesFromOutside) {
  const std::string page = html_report(some_content());
  EXPECT_THAT(page, Not(HasSubstr("<evil>")));
  EXPECT_THAT(page, Not(HasSubstr("<cuts>")));
  EXPECT_THAT(page, Not(HasSubstr("<b>\"bold")));
  EXPECT_THAT(page, Not(HasSubstr("a<b")));
  EXPECT_THAT(page, HasSubstr("&lt;evil&gt; &amp; co"));
  EXPECT_THAT(page, HasSubstr("the box &lt;cuts&gt; what is seen"));
}

TEST(HtmlReport, FetchesNothing) {
  std::string page = html_report(some_content());
  const std::string space = "http://www.w3.org/2000/svg";  // a name, not an address
  for (std::size_t at; (at = page.find(space)) != std::string::npos;) page.erase(at, space.size());
  EXPECT_FALSE(std::regex_search(page, std::regex("https?:|<script|<link|url\\(|@import")));
  for (const char* attribute : {"src=\"", "href=\""})
    for (std::size_t at = page.find(attribute); at != std::string::npos; at = page.find(attribute, at + 1))
      EXPECT_EQ(page.compare(at + std::string(attribute).size(), 5, "data:"), 0);
}

TEST(HtmlReport, SaysWhatTheSummarySays) {
  const std::string page = html_report(some_content());
  EXPECT_THAT(page, HasSubstr("<td>-1.2, 0, 0, 1, 2, 3</td>"));
  EXPECT_THAT(page, HasSubstr("1 of 30 views"));
  EXPECT_THAT(page, HasSubstr("init = auto"));
  EXPECT_THAT(page, HasSubstr("noise = 0.5"));
  EXPECT_THAT(page, HasSubstr("<td>survey</td><td>1 s</td><td>25.0 %</td><td>50 MiB</td>"));
  EXPECT_THAT(page, HasSubstr("<td>mesh</td><td>0 s</td><td>0.0 %</td><td></td>"));
  EXPECT_THAT(page, HasSubstr("<td>70 MiB</td>"));
  EXPECT_THAT(page, HasSubstr("Mean change of opacity"));
  EXPECT_THAT(page, HasSubstr("roxel 1.2.3"));
  EXPECT_THAT(page, Not(HasSubstr("Against the truth")));
}

TEST(HtmlReport, ShowsMeasures) {
  ReportContent content = some_content();
  RunMeasures measures;
  measures.surfaces = {{"points", surface_accuracy({1, 2}, {1, 1, 3, 4}, {1, 2})}};
  measures.volume = volume_accuracy({1, 0.5f, 0.25f, 0.75f}, {0, 2, 4, 30}, {0.5});
  measures.notes = {"no <truth>"};
  content.measures = &measures;
  const std::string page = html_report(content);
  EXPECT_THAT(page, HasSubstr("Against the truth"));
  EXPECT_THAT(page, HasSubstr("<td>75.00 %</td>"));
  EXPECT_THAT(page, HasSubstr("no &lt;truth&gt;"));
}

TEST(HtmlReport, ShowsMeasuresOfLightAndSkies) {
  ReportContent content = some_content();
  RunMeasures measures;
  measures.light = {{"none", 1000, {900, 1.25, 1.5}, {}}, {"run", 1000, {900, 0.5, 0.25}, {7, 0.75, 0.625}}};
  measures.skies.resize(2);
  measures.skies[0].node = "n00";
  measures.skies[0].fit_error = 0.0123;
  measures.skies[1].node = "n01";
  SkyDebris debris;
  debris.opacity_threshold = 0.3;
  debris.all = {2000, 100.0}, debris.before_sky = {1, 0.5};
  measures.debris = {debris};
  content.measures = &measures;
  const std::string page = html_report(content);
  EXPECT_THAT(page, HasSubstr("<td>none</td><td>900</td><td>1.250</td><td>1.500</td><td>-</td><td>-</td>"));
  EXPECT_THAT(page,
              HasSubstr("<td>run</td><td>900</td><td>0.500</td><td>0.250</td><td>0.750</td><td>0.625</td>"));
  EXPECT_THAT(page, HasSubstr("<td>n00</td><td>1.23 %</td><td>-</td>"));
  EXPECT_THAT(page, HasSubstr("<td>n01</td><td>-</td><td>-</td>"));
  EXPECT_THAT(page, HasSubstr("<td>1</td><td>0.050 %</td><td>0.500 %</td>"));
}

TEST(HtmlReport, SaysWhereSkiesWereTakenFrom) {
  ReportContent content = some_content();
  EXPECT_THAT(html_report(content), Not(HasSubstr("<h2>Sky</h2>")));
  content.skies_from = "other & run";
  content.their_skies = {{{"node", "n07"}, {"model", "perez"}, {"mean_error", 0.5}, {"sky_share", 0.25}}};
  content.skies = {{"n07", "", {{"fitted sky", "data:"}}}};
  const std::string page = html_report(content);
  EXPECT_THAT(page, HasSubstr("<a href=\"other &amp; run/report.html\">other &amp; run</a>"));
  EXPECT_THAT(page, HasSubstr("<td>n07</td><td>perez</td><td>50.00 %</td><td>25.0 %</td>"));
  EXPECT_THAT(page, HasSubstr("fitted sky"));
}

TEST(HtmlReport, AnEmptyEstimateHasNoAccuracy) {
  ReportContent content = some_content();
  RunMeasures measures;
  measures.surfaces = {{"points", surface_accuracy({}, {1}, {0.5})}};
  content.measures = &measures;
  EXPECT_THAT(html_report(content), HasSubstr("<td>points</td><td>0</td><td>-</td><td>0.5</td>"));
}

TEST(HtmlReport, OfAnEmptySummaryIsStillAPage) {
  const std::string page = html_report({});
  EXPECT_THAT(page, HasSubstr("</html>"));
  EXPECT_THAT(page, Not(HasSubstr("nan")));
}

TEST(HtmlReport, ShowsEveryViewOfAFewAndSomeOfMany) {
  EXPECT_THAT(report_views(3), testing::ElementsAre(0, 1, 2));
  const std::vector<int> some = report_views(100);
  EXPECT_EQ(some.size(), kMostReportViews);
  EXPECT_EQ(some.front(), 0);
  EXPECT_GT(some.back(), 90);
  EXPECT_TRUE(report_views(0).empty());
}

TEST(SectionPicture, OutlinesAreDrawnOnceAndInsideAlone) {
  Section section{2, 0.25, 0.1, Image(10, 8, 1)};
  EXPECT_THAT(section_svg(section), Not(HasSubstr("<path")));
  const auto add = [&](double x0, double y0, double x1, double y1) {
    section.outline.push_back({Eigen::Vector2d(x0, y0), Eigen::Vector2d(x1, y1)});
  };
  add(1, 2, 3, 4.02);
  add(1, 2, 3, 4);     // the same to a tenth of a voxel
  add(20, 2, 30, 4);   // outside
  add(5, 5, 5.01, 5);  // no length
  const std::string svg = section_svg(section);
  EXPECT_THAT(svg, HasSubstr("d=\"M1 2L3 4\""));
  EXPECT_THAT(svg, HasSubstr("section z = 0.25"));
  EXPECT_THAT(svg, HasSubstr("viewBox=\"0 0 10 8\""));
}

}  // namespace
}  // namespace roxel
