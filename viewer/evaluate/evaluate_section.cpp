#include <fmt/format.h>

#include <algorithm>

#include "viewer/evaluate/held_out.h"

namespace scanview {
namespace {

template <typename Value>
double mean_of(std::vector<ViewFigures> const& views, Value const& value) {
  double sum = 0;
  for (auto const& view : views) sum += value(view);
  return views.empty() ? 0 : sum / static_cast<double>(views.size());
}

std::string interval(Interval const& i, char const* format) {
  return fmt::format(fmt::runtime(format), i.mean, i.low, i.high);
}

std::string contenders_table(std::vector<ContenderFigures> const& all) {
  std::vector<std::vector<std::string>> rows{{"renderer", "PSNR, drawn pixels (dB)", "PSNR, all object pixels (dB)",
                                              "SSIM", "coverage (%)", "outside (%)",
                                              "ours better by (dB, same pixels, 95 % interval)", "SSIM, likewise"}};
  for (auto const& one : all) {
    bool const ours = &one == &all.front();
    rows.push_back({one.title, fmt::format("{:.2f}", mean_of(one.views, [](auto const& f) { return f.psnr_common; })),
                    fmt::format("{:.2f}", mean_of(one.views, [](auto const& f) { return f.psnr_all; })),
                    fmt::format("{:.4f}", mean_of(one.views, [](auto const& f) { return f.ssim; })),
                    fmt::format("{:.2f}", 100 * mean_of(one.views, [](auto const& f) { return f.coverage; })),
                    fmt::format("{:.2f}", 100 * mean_of(one.views, [](auto const& f) { return f.outside; })),
                    ours ? "" : interval(one.psnr_lead, "{:+.2f} ({:+.2f} to {:+.2f})"),
                    ours ? "" : interval(one.ssim_lead, "{:+.4f} ({:+.4f} to {:+.4f})")});
  }
  return html_table(rows);
}

std::string contenders_plot(std::vector<ContenderFigures> const& all) {
  static constexpr char const* kColors[] = {"#c0392b", "#7f8c8d", "#8e44ad", "#2980b9", "#27ae60"};
  std::vector<PlotCurve> curves;
  for (std::size_t c = 0; c < all.size(); ++c) {
    PlotCurve curve{all[c].title, {}, kColors[c % 5], true};
    for (std::size_t i = 0; i < all[c].views.size(); ++i) {
      curve.points.emplace_back(static_cast<double>(i), all[c].views[i].psnr_all);
    }
    curves.push_back(curve);
  }
  PlotOptions options;
  options.x_label = "held-out view";
  options.y_label = "PSNR, all object pixels (dB)";
  return svg_plot(curves, options);
}

std::string views_table(std::vector<ViewFigures> const& views) {
  std::vector<std::vector<std::string>> rows{
      {"view", "PSNR, drawn pixels (dB)", "PSNR, all object pixels (dB)", "SSIM", "coverage (%)", "outside (%)"}};
  for (auto const& f : views) {
    rows.push_back({f.name, fmt::format("{:.1f}", f.psnr_common), fmt::format("{:.1f}", f.psnr_all),
                    fmt::format("{:.3f}", f.ssim), fmt::format("{:.1f}", 100 * f.coverage),
                    fmt::format("{:.2f}", 100 * f.outside)});
  }
  return html_table(rows);
}

/// The views that came out worst, as everybody draws them.
std::string worst_views(std::vector<ContenderFigures> const& all) {
  constexpr std::size_t kShown = 4;
  auto const& ours = all.front().views;
  std::vector<std::size_t> order(ours.size());
  for (std::size_t i = 0; i < order.size(); ++i) order[i] = i;
  std::stable_sort(order.begin(), order.end(),
                   [&](std::size_t a, std::size_t b) { return ours[a].psnr_all < ours[b].psnr_all; });
  order.resize(std::min(order.size(), kShown));
  std::string html;
  for (std::size_t const i : order) {
    std::vector<std::string> figures{html_jpeg(ours[i].photograph, "view " + ours[i].name + ": photograph", 320)};
    for (auto const& one : all) {
      figures.push_back(
          html_jpeg(one.views[i].rendered, fmt::format("{}: {:.1f} dB", one.title, one.views[i].psnr_all), 320));
    }
    figures.push_back(html_jpeg(ours[i].difference, "ours: difference, four times enlarged", 320));
    html += html_row(figures);
  }
  return html;
}

}  // namespace

ReportSection evaluate_section(std::vector<ContenderFigures> const& held_out, std::vector<ViewFigures> const& source) {
  std::string html;
  if (!held_out.empty() && !held_out.front().views.empty()) {
    html +=
        "<p>Views were left out and rendered from the others. What no other view saw stays black, and counts as black "
        "in the figures over all object pixels. Every renderer is compared with ours on the pixels that both drew.</p>";
    html += contenders_table(held_out) + contenders_plot(held_out);
    html += "<p>The views that came out worst:</p>" + worst_views(held_out);
    html += "<p>Ours, view by view:</p>" + views_table(held_out.front().views);
  }
  if (!source.empty()) {
    html += "<p>Rendered from the camera of a view, with that view in use:</p>" + views_table(source);
  }
  return {"evaluate", "Held-out views", html};
}

}  // namespace scanview
