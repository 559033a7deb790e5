#include <fmt/format.h>

#include "acquire/import.h"
#include "acquire/section_pictures.h"
#include "base/html.h"

namespace scanview {

ReportSection import_section(ScanSet const& set) {
  std::string const unit = unit_suffix(set.unit);
  std::string html = fmt::format(
      "<p>{} views. Each row: the picture with the outline of what has a depth; the depth, near blue and far red; what "
      "every pixel is; sigma, the standard deviation of each depth, from the sensor's physics scaled by the scatter "
      "that "
      "the data show. Over all views sigma is {:.3g}{} (rms), 95 % lie below {:.3g}{}.</p>\n",
      set.views.size(), set.error_budget.sampling.rms, unit, set.error_budget.sampling.p95, unit);
  html += class_legend({{PixelClass::object, "depth"},
                        {PixelClass::no_depth, "no depth"},
                        {PixelClass::outlier, "outlier"},
                        {PixelClass::background, "background"},
                        {PixelClass::cut, "cut"}});
  std::vector<std::vector<std::string>> table{
      {"view", "size", "depths", "no depth", "outliers", "depth 1 % .. 99 %", "sigma median", "pose"}};
  std::size_t shown = 0;
  for (auto const& view : set.views) {
    auto const& image = view.image;
    auto const depth = quantiles(image.depth), sigma = quantiles(image.sigma);
    auto const count = [&](PixelClass what) { return std::to_string(count_class(image, what)); };
    table.push_back({view.name, fmt::format("{}×{}", image.depth.cols, image.depth.rows), count(PixelClass::object),
                     count(PixelClass::no_depth), count(PixelClass::outlier),
                     fmt::format("{:.4g} .. {:.4g}{}", depth.low, depth.high, unit),
                     fmt::format("{:.3g}{}", sigma.middle, unit), view.object_from_camera ? "given" : "none"});
    if (shown++ < kMostViewsShown) html += view_row(view, unit);
  }
  if (set.views.size() > kMostViewsShown)
    html += fmt::format("<p>Pictures of the first {} views only; the table names all.</p>\n", kMostViewsShown);
  html += html_table(table);
  return {"import", "Views", html};
}

}  // namespace scanview
