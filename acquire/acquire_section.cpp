#include "acquire/acquire_section.h"

#include <fmt/format.h>

#include "acquire/section_pictures.h"

namespace scanview {
namespace {

std::string introduction(AcquireResult const& result) {
  auto const& budget = result.set.error_budget.sampling;
  std::string const unit = unit_suffix(result.set.unit);
  std::string html = fmt::format(
      "<p>{} view{}, cameras {:.4g}{} apart. Each row: the picture with the outline of what has a depth; the depth, "
      "near blue and far red (gray: none); what every pixel is; sigma, the standard deviation of each depth, from the "
      "noise of the frames by way of peak or code edge, the slope of the code along the epipolar line, and "
      "triangulation.",
      result.views.size(), result.views.size() == 1 ? "" : "s", result.rig.baseline(), unit);
  if (std::isfinite(budget.p95))
    html += fmt::format(" Over all views 95 % of sigma lie below {:.3g}{}.", budget.p95, unit);
  if (result.set.unit == Unit::arbitrary) html += " The scale is free: lengths are in a unit of their own.";
  return html + "</p>\n";
}

std::string percent(std::size_t part, std::size_t whole) {
  return whole == 0 ? "" : fmt::format("{:.2f} %", 100.0 * static_cast<double>(part) / static_cast<double>(whole));
}

std::string measured(double value, char const* format) {
  return value > 0 ? fmt::format(fmt::runtime(format), value) : "";
}

/// Why pixels are missing, a row a view.
std::string missing_table(AcquireResult const& result) {
  std::vector<std::vector<std::string>> table = {{"view", "depths", "found of decodable", "no light", "saturated",
                                                  "several peaks", "no partner", "inconsistent", "background",
                                                  "out of range", "outlier", "outside"}};
  for (std::size_t v = 0; v < result.views.size(); ++v) {
    auto const& view = result.views[v];
    std::vector<std::string> row = {view.name, std::to_string(view.depths),
                                    percent(view.depths + view.background_removed, view.decodable)};
    for (auto const& [pixel, name] : kWhyMissing)
      row.push_back(std::to_string(count_class(result.set.views[v].image, pixel)));
    row.push_back(std::to_string(count_class(result.set.views[v].image, PixelClass::no_depth)));
    table.push_back(row);
  }
  return html_table(table);
}

/// How good the measurement is, a row a view.
std::string quality_table(AcquireResult const& result) {
  std::string const unit = unit_suffix(result.set.unit), in = unit.empty() ? "" : fmt::format(" ({})", unit.substr(1));
  std::vector<std::vector<std::string>> table = {
      {"view", "size", "depth 1 % .. 99 %" + in, "sigma median" + in, "angle of rays", "beam left, right (steps)",
       "noise left, right (gray values)", "scatter of the light (codes)", "ambiguous", "rows within 2"}};
  for (std::size_t v = 0; v < result.views.size(); ++v) {
    auto const& view = result.views[v];
    auto const& image = result.set.views[v].image;
    auto const depth = quantiles(image.depth);
    table.push_back(
        {view.name, fmt::format("{}×{}", image.depth.cols, image.depth.rows),
         fmt::format("{:.4g} .. {:.4g}", depth.low, depth.high), fmt::format("{:.3g}", view.sigma_median),
         measured(view.angle_deg, "{:.1f}°"),
         view.beam_sigma[0] > 0 ? fmt::format("{:.2f}, {:.2f}", view.beam_sigma[0], view.beam_sigma[1]) : "",
         fmt::format("{:.2f}, {:.2f}", view.noise_read[0], view.noise_read[1]), measured(view.sheet_scatter, "{:.3f}"),
         std::to_string(view.ambiguous), percent(view.row_pairs - view.row_off_2, view.row_pairs)});
  }
  return html_table(table);
}

std::string number(Json const& figures, char const* key, double scale, char const* format) {
  auto const found = figures.find(key);
  return found != figures.end() && found->is_number() ? fmt::format(fmt::runtime(format), scale * found->get<double>())
                                                      : "";
}

/// Whether the pictures are what they should be, a row a camera and view.
std::string soundness_table(AcquireResult const& result) {
  std::vector<std::vector<std::string>> table = {
      {"view", "camera", "lit", "saturated", "flicker", "gamma", "beam (steps)", "uneven steps", "rows off (px)"}};
  for (auto const& view : result.views)
    for (Side const side : kSides) {
      auto const found = view.soundness.find(to_string(side));
      if (found == view.soundness.end()) continue;
      std::string const shift = side == Side::right && view.soundness.contains("rig")
                                    ? number(view.soundness["rig"], "rms_px", 1, "{:.2f}")
                                    : "";
      table.push_back({view.name, to_string(side), number(*found, "lit_share", 100, "{:.0f} %"),
                       number(*found, "saturated_share", 100, "{:.1f} %"), number(*found, "flicker", 100, "{:.1f} %"),
                       number(*found, "gamma", 1, "{:.2f}"), number(*found, "beam_steps", 1, "{:.2f}"),
                       number(*found, "step_scatter", 100, "{:.0f} %"), shift});
    }
  return table.size() > 1 ? "<p>Is the capture sound?</p>\n" + html_table(table) : "";
}

std::string warning_list(AcquireResult const& result) {
  std::string items;
  for (auto const& view : result.views)
    for (auto const& warning : view.warnings)
      items += fmt::format("<li>{}: {}</li>\n", html_escape(view.name), html_escape(warning));
  return items.empty() ? "" : "<ul>\n" + items + "</ul>\n";
}

}  // namespace

Json why_missing(RangeImage const& image) {
  Json counts = Json::object();
  for (auto const& [pixel, name] : kWhyMissing) counts[name] = count_class(image, pixel);
  if (std::size_t const other = count_class(image, PixelClass::no_depth)) counts["no_depth"] = other;
  return counts;
}

ReportSection acquire_section(AcquireResult const& result) {
  std::string html = introduction(result);
  html += class_legend({{PixelClass::object, "depth"},
                        {PixelClass::no_light, "no light"},
                        {PixelClass::saturated, "saturated"},
                        {PixelClass::several_peaks, "several peaks"},
                        {PixelClass::no_partner, "no partner"},
                        {PixelClass::inconsistent, "inconsistent"},
                        {PixelClass::background, "background"},
                        {PixelClass::cut, "out of range"},
                        {PixelClass::outlier, "outlier"},
                        {PixelClass::no_depth, "outside the picture"}});
  std::string const unit = unit_suffix(result.set.unit);
  for (std::size_t v = 0; v < result.set.views.size() && v < kMostViewsShown; ++v)
    html += view_row(result.set.views[v], unit);
  if (result.set.views.size() > kMostViewsShown)
    html += fmt::format("<p>Pictures of the first {} views only; the tables name all.</p>\n", kMostViewsShown);
  html +=
      "<p>Pixels without a depth, by the reason. Found of decodable: the share of the pixels with a code that got a "
      "depth, background that was removed later among them.</p>\n" +
      missing_table(result);
  html += "<p>What was measured:</p>\n" + quality_table(result);
  html += soundness_table(result) + warning_list(result);
  return {"acquire", "Views", html};
}

}  // namespace scanview
