#include "base/html.h"

#include <gtest/gtest.h>

#include <limits>

namespace scanview {
namespace {

TEST(HtmlTable, LeavesOutColumnsWithNothingBeneathTheirTitle) {
  std::string const html = html_table({{"view", "rows", "why"}, {"a", "", "dark"}, {"b", "", ""}});
  EXPECT_EQ(html.find("rows"), std::string::npos);
  EXPECT_NE(html.find("<td>dark</td>"), std::string::npos);
  EXPECT_NE(html_table({{"view", "rows"}}).find("rows"), std::string::npos);  // no rows at all: the titles stay
}

TEST(HtmlTable, AlignsTitlesWithTheirNumbers) {
  std::string const html = html_table({{"sigma", "mixed"}, {"0.5", "1"}, {"", "none"}});
  EXPECT_NE(html.find("<th class=\"n\">sigma</th>"), std::string::npos);
  EXPECT_NE(html.find("<th>mixed</th>"), std::string::npos);
}

TEST(Html, TextIsEscaped) { EXPECT_EQ(html_escape("<a & \"b\">"), "&lt;a &amp; &quot;b&quot;&gt;"); }

TEST(Html, PicturesAreEmbedded) {
  std::string const html = html_png(cv::Mat(2, 2, CV_8UC1, cv::Scalar(9)), "a <picture>", 100);
  EXPECT_NE(html.find("data:image/png;base64,iVBORw0KGgo"), std::string::npos);  // the PNG signature
  EXPECT_NE(html.find("a &lt;picture&gt;"), std::string::npos);
}

TEST(Html, PageNeedsNothingFromOutside) {
  std::string const page = html_page("t", "<p>i</p>", {{"mesh", "Meshes", "<p>m</p>"}});
  EXPECT_EQ(page.find("http"), std::string::npos);
  EXPECT_NE(page.find("<section id=\"mesh\">"), std::string::npos);
}

TEST(Html, PlotsOfHardDataAreDefined) {
  double const nan = std::numeric_limits<double>::quiet_NaN(), infinity = std::numeric_limits<double>::infinity();
  EXPECT_EQ(svg_plot({}, {}), "<p>no data</p>\n");
  EXPECT_EQ(svg_plot({{"", {{nan, 1}, {1, infinity}}, "red"}}, {}), "<p>no data</p>\n");
  for (std::vector<cv::Point2d> const& points :
       {std::vector<cv::Point2d>{{1, 1}}, {{0, 0}, {0, 0}}, {{1e-300, 1}, {1e300, 2}}, {{5, -3}, {5, 7}}}) {
    for (bool const log : {false, true}) {
      std::string const svg = svg_plot({{"c", points, "red"}}, {.log_x = log, .log_y = log});
      EXPECT_EQ(svg.find("nan"), std::string::npos);
      EXPECT_EQ(svg.find("inf"), std::string::npos);
      EXPECT_LT(svg.size(), 20'000U);
    }
  }
}

}  // namespace
}  // namespace scanview
