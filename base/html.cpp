#include "base/html.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "base/image_file.h"

namespace scanview {
namespace {

std::string base64(std::string const& bytes) {
  constexpr char kDigits[] = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
  std::string text;
  text.reserve((bytes.size() + 2) / 3 * 4);
  for (std::size_t i = 0; i < bytes.size(); i += 3) {
    std::uint32_t group = 0;
    for (std::size_t k = 0; k < 3; ++k)
      group = group << 8 | (i + k < bytes.size() ? static_cast<unsigned char>(bytes[i + k]) : 0U);
    for (std::size_t k = 0; k < 4; ++k) text += i + k <= bytes.size() ? kDigits[group >> (18 - 6 * k) & 63] : '=';
  }
  return text;
}

std::string figure(std::string const& mime, std::string const& bytes, std::string const& caption, int width) {
  return fmt::format(
      "<figure style=\"max-width:{}px\"><img alt=\"{}\" src=\"data:{};base64,{}\"><figcaption>{}</figcaption></figure>",
      width, html_escape(caption), mime, base64(bytes), html_escape(caption));
}

bool looks_like_number(std::string const& cell) {
  return !cell.empty() && cell.find_first_not_of("0123456789.,+-−e %×°") == std::string::npos;
}

/// Distances between ticks: 1, 2 or 5 times a power of ten, about five of them.
double tick_step(double span) {
  double const rough = span / 5;
  double const power = std::pow(10, std::floor(std::log10(rough)));
  for (double factor : {1.0, 2.0, 5.0})
    if (rough <= factor * power) return factor * power;
  return 10 * power;
}

struct Axis {
  double low = std::numeric_limits<double>::infinity(), high = -low;
  bool log = false;

  bool usable(double v) const { return std::isfinite(v) && (!log || v > 0); }
  double place(double v) const { return log ? std::log10(v) : v; }
  void include(double v) {
    low = std::min(low, place(v));
    high = std::max(high, place(v));
  }
  void widen() {
    double const margin = high > low ? 0.04 * (high - low) : (low == 0 ? 1 : 0.1 * std::abs(low));
    low -= margin;
    high += margin;
  }
  double share(double placed) const { return (placed - low) / (high - low); }
  std::vector<double> ticks() const {  // placed
    std::vector<double> result;
    double const step = log ? std::max(1.0, std::ceil((high - low) / 6)) : tick_step(high - low);
    for (double i = std::ceil(low / step); i <= std::floor(high / step) && result.size() < 20; ++i) {
      double const value = log ? std::pow(10, i * step) : i * step;
      if (std::isfinite(value)) result.push_back(i * step);
    }
    return result;
  }
  std::string label(double placed) const {
    if (log) return fmt::format("{:g}", std::pow(10, placed));
    return fmt::format("{:g}", std::abs(placed) < 1e-12 * (high - low) ? 0.0 : placed);
  }
};

constexpr char kStyle[] = R"(
:root{color-scheme:light dark}
body{font:16px/1.5 system-ui,sans-serif;max-width:1200px;margin:0 auto;padding:1rem;background:#fff;color:#1a1a1a;overflow-wrap:break-word}
h1{font-size:1.7rem;margin:.2em 0}h2{border-top:1px solid #ccc;padding-top:1rem;margin-top:2rem}
nav a{margin-right:1em}figure{margin:0 .8rem .8rem 0;display:inline-block;vertical-align:top}
img{max-width:100%;height:auto;display:block}figcaption{font-size:.8rem;color:#555;overflow-wrap:anywhere}
.row{display:flex;flex-wrap:wrap;align-items:flex-start}.scroll{overflow-x:auto}
table{border-collapse:collapse;margin:.6rem 0;font-size:.9rem}td,th{padding:.15rem .7rem;border-bottom:1px solid #ddd;text-align:left}
td.n,th.n{text-align:right}td.n{white-space:nowrap;font-variant-numeric:tabular-nums}.warning{background:#fff3cd;color:#5c4300;padding:.4rem .8rem;margin:.3rem 0}
svg text{fill:currentColor;font:11px system-ui,sans-serif}
@media(prefers-color-scheme:dark){body{background:#161616;color:#e6e6e6}figcaption{color:#aaa}td,th{border-color:#444}h2{border-color:#444}}
@media print{figure{break-inside:avoid}nav{display:none}})";

}  // namespace

std::string html_escape(std::string const& text) {
  std::string result;
  for (char const c : text) {
    if (c == '&')
      result += "&amp;";
    else if (c == '<')
      result += "&lt;";
    else if (c == '>')
      result += "&gt;";
    else if (c == '"')
      result += "&quot;";
    else
      result += c;
  }
  return result;
}

std::string html_png(cv::Mat const& image, std::string const& caption, int width) {
  return figure("image/png", encode_png(image), caption, width);
}

std::string html_jpeg(cv::Mat const& image, std::string const& caption, int width) {
  return figure("image/jpeg", encode_jpeg(image, 85), caption, width);
}

std::string html_row(std::vector<std::string> const& figures) {
  std::string html = "<div class=\"row\">";
  for (auto const& one : figures) html += one;
  return html + "</div>\n";
}

std::string html_table(std::vector<std::vector<std::string>> const& rows) {
  std::string html = "<div class=\"scroll\"><table>\n";
  std::size_t const columns = rows.empty() ? 0 : rows[0].size();
  std::vector<char> filled(columns, rows.size() < 2), numbers(columns, 1);
  for (std::size_t r = 1; r < rows.size(); ++r)
    for (std::size_t c = 0; c < std::min(columns, rows[r].size()); ++c) {
      if (rows[r][c].empty()) continue;
      filled[c] = 1;
      if (!looks_like_number(rows[r][c])) numbers[c] = 0;
    }
  for (std::size_t r = 0; r < rows.size(); ++r) {
    html += "<tr>";
    for (std::size_t c = 0; c < std::min(columns, rows[r].size()); ++c) {
      if (filled[c] == 0) continue;
      bool const right = r == 0 ? rows.size() > 1 && numbers[c] != 0 : looks_like_number(rows[r][c]);
      char const* const tag = r == 0 ? "th" : "td";
      html += fmt::format("<{}{}>{}</{}>", tag, right ? " class=\"n\"" : "", html_escape(rows[r][c]), tag);
    }
    html += "</tr>\n";
  }
  return html + "</table></div>\n";
}

std::string svg_plot(std::vector<PlotCurve> const& curves, PlotOptions const& options) {
  Axis x{.log = options.log_x}, y{.log = options.log_y};
  bool any = false;
  for (auto const& curve : curves)
    for (auto const& p : curve.points)
      if (x.usable(p.x) && y.usable(p.y)) {
        x.include(p.x);
        y.include(p.y);
        any = true;
      }
  if (!any) return "<p>no data</p>\n";
  x.widen();
  y.widen();
  double const left = 62, top = 10, width = options.width - left - 12, height = options.height - top - 42;
  if (options.equal_scale) {
    double const unit = std::max((x.high - x.low) / width, (y.high - y.low) / height);
    double const dx = (unit * width - (x.high - x.low)) / 2, dy = (unit * height - (y.high - y.low)) / 2;
    x.low -= dx, x.high += dx, y.low -= dy, y.high += dy;
  }
  auto const px = [&](double placed) { return left + width * x.share(placed); };
  auto const py = [&](double placed) { return top + height * (1 - y.share(placed)); };

  std::string svg = fmt::format(
      "<svg viewBox=\"0 0 {0} {1}\" width=\"{0}\" style=\"max-width:100%\" role=\"img\">"
      "<rect x=\"{2}\" y=\"{3}\" width=\"{4}\" height=\"{5}\" fill=\"none\" stroke=\"currentColor\" "
      "stroke-opacity=\".4\"/>",
      options.width, options.height, left, top, width, height);
  for (double const t : x.ticks())
    svg += fmt::format(
        "<path d=\"M{0:.1f} {1:.1f}v4\" stroke=\"currentColor\"/><text x=\"{0:.1f}\" y=\"{2:.1f}\" "
        "text-anchor=\"middle\">{3}</text>",
        px(t), top + height, top + height + 16, x.label(t));
  for (double const t : y.ticks())
    svg += fmt::format(
        "<path d=\"M{0:.1f} {1:.1f}h-4\" stroke=\"currentColor\"/><text x=\"{2:.1f}\" y=\"{3:.1f}\" "
        "text-anchor=\"end\">{4}</text>",
        left, py(t), left - 7, py(t) + 4, y.label(t));
  svg += fmt::format("<text x=\"{:.1f}\" y=\"{:.1f}\" text-anchor=\"middle\">{}</text>", left + width / 2,
                     options.height - 6.0, html_escape(options.x_label));
  svg += fmt::format("<text transform=\"translate(12 {:.1f}) rotate(-90)\" text-anchor=\"middle\">{}</text>",
                     top + height / 2, html_escape(options.y_label));
  double legend_y = top + 14;
  for (auto const& curve : curves) {
    std::string const color = html_escape(curve.color);
    std::string path;
    for (auto const& p : curve.points) {
      if (!x.usable(p.x) || !y.usable(p.y)) continue;
      double const u = px(x.place(p.x)), v = py(y.place(p.y));
      path += curve.dots ? fmt::format("M{:.1f} {:.1f}h0", u, v)
                         : fmt::format("{}{:.1f} {:.1f}", path.empty() ? 'M' : 'L', u, v);
    }
    if (path.empty()) continue;
    svg += fmt::format("<path d=\"{}\" fill=\"none\" stroke=\"{}\" stroke-width=\"{}\" stroke-linecap=\"round\"/>",
                       path, color, curve.dots ? "1.6" : "1.8");
    if (curve.name.empty()) continue;
    svg += fmt::format(
        "<path d=\"M{0:.1f} {1:.1f}h14\" stroke=\"{2}\" stroke-width=\"3\"/><text x=\"{3:.1f}\" "
        "y=\"{4:.1f}\">{5}</text>",
        left + width - 110, legend_y - 4, color, left + width - 92, legend_y, html_escape(curve.name));
    legend_y += 15;
  }
  return svg + "</svg>\n";
}

std::string html_page(std::string const& title, std::string const& introduction_html,
                      std::vector<ReportSection> const& sections) {
  std::string html = fmt::format(
      "<!doctype html>\n<html lang=\"en\"><head><meta charset=\"utf-8\"><meta name=\"viewport\" "
      "content=\"width=device-width,initial-scale=1\"><title>{0}</title><style>{1}</style></head><body>\n<h1>{0}</"
      "h1>\n<nav>",
      html_escape(title), kStyle);
  for (auto const& section : sections)
    html += fmt::format("<a href=\"#{}\">{}</a>", section.id, html_escape(section.title));
  html += "</nav>\n" + introduction_html;
  for (auto const& section : sections)
    html += fmt::format("<section id=\"{}\"><h2>{}</h2>\n{}</section>\n", section.id, html_escape(section.title),
                        section.html);
  return html + "</body></html>\n";
}

}  // namespace scanview
