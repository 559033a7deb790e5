#pragma once
#include <opencv2/core/mat.hpp>
#include <string>
#include <vector>

namespace scanview {

/// A stage's part of report.html: a title and HTML that needs nothing from outside (pictures embedded). It holds no
/// times, so that it is as reproducible as the stage's other output.
struct ReportSection {
  std::string id;  ///< "register": the anchor, and the file name report/ID.html inside a set
  std::string title;
  std::string html;
};

std::string html_escape(std::string const& text);

/// <figure> with the picture embedded as PNG (drawings, masks) or JPEG (photographs), `width` CSS pixels wide at most.
std::string html_png(cv::Mat const& image, std::string const& caption, int width);
std::string html_jpeg(cv::Mat const& image, std::string const& caption, int width);

/// Figures side by side, wrapping.
std::string html_row(std::vector<std::string> const& figures);

/// A table; cells are text (escaped), the first row of `rows` is the header. Cells that look like numbers align right,
/// and so does the title of a column of them. A column with nothing beneath its title is left out.
std::string html_table(std::vector<std::vector<std::string>> const& rows);

/// A curve of an SVG plot; `points` are (x, y); drawn as a line, or as dots where `dots` is set.
struct PlotCurve {
  std::string name;
  std::vector<cv::Point2d> points;
  std::string color;  ///< CSS colour
  bool dots = false;
};
struct PlotOptions {
  std::string x_label = "", y_label = "";
  bool log_x = false, log_y = false;
  bool equal_scale = false;  ///< one unit is as long on both axes (cross-sections)
  int width = 480, height = 320;
};
/// SVG with axes, ticks, a legend. Non-finite points are left out; an empty plot says "no data".
std::string svg_plot(std::vector<PlotCurve> const& curves, PlotOptions const& options);

/// The whole page: self-contained, readable on a phone and on paper, with a table of contents.
std::string html_page(std::string const& title, std::string const& introduction_html,
                      std::vector<ReportSection> const& sections);

}  // namespace scanview
