#include "cli/ldi_report.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <utility>

#include "base/error.h"
#include "base/median.h"
#include "cli/ldi_figures.h"
#include "cli/octree_drawing.h"
#include "viewer/layered/image_warper.h"

namespace scanview {
namespace {

constexpr int kFigure = 360;
/// Trees of so many images are shown in the paper's figures 7 and 11.
constexpr int kDrawnImages = 2, kFilledImages = 12;
constexpr double kMega = 1e6;
cv::Vec3b const kBlue{220, 90, 40};

std::vector<int> numbers_of_images(LdiReportOptions const& options, int available) {
  if (options.images.empty()) {
    std::vector<int> numbers;
    for (int const number : {2, 4, 8, 12, 24, 36})
      if (number <= available) numbers.push_back(number);
    if (numbers.empty() || (numbers.back() < available && available < 36)) numbers.push_back(available);
    return numbers;
  }
  std::vector<int> numbers = options.images;
  std::sort(numbers.begin(), numbers.end());
  numbers.erase(std::unique(numbers.begin(), numbers.end()), numbers.end());
  if (numbers.front() < 1 || numbers.back() > available)
    throw Error(ErrorCode::usage, {},
                fmt::format("--images: there are {}, so that numbers must be 1 to {}", available, available));
  return numbers;
}

/// One new view from trees of more and more images (figures 8 to 11).
class NewView {
 public:
  NewView(PathCamera from, std::vector<int> const& numbers) : from_(std::move(from)) {
    for (int const number : numbers)
      if (filled_of_ == 0 || number <= kFilledImages) filled_of_ = number;
  }
  void draw(int images, LdiRenderer& tree, std::vector<View> const& views, int threads) {
    auto const show = [&](Renderer& renderer, std::string const& caption) {
      cv::Mat4b const picture = renderer.render(from_.camera, from_.object_from_camera).color;
      figures_.push_back(html_jpeg(on_background(picture, kBlue), caption, kFigure));
    };
    LdiRenderOptions::Gaps const gaps = tree.options.gaps;
    tree.options.gaps = LdiRenderOptions::Gaps::background;
    show(tree, fmt::format("{} images, gaps left", images));
    tree.options.gaps = LdiRenderOptions::Gaps::filled;
    if (images == filled_of_) {
      show(tree, fmt::format("{} images, gaps filled", images));
      ImageWarper warper(views, threads);
      show(warper, fmt::format("{} images, all warped", images));
    }
    tree.options.gaps = gaps;
  }
  std::string row(std::vector<ReferenceFrame> const& references) const {
    std::vector<std::string> all = figures_;
    for (ReferenceFrame const& reference : references)
      if (reference.from.name == from_.name && reference.from.camera == from_.camera &&
          reference.from.object_from_camera.isApprox(from_.object_from_camera))
        all.push_back(html_jpeg(reference.picture, "ray traced", kFigure));
    return html_row(all);
  }

 private:
  PathCamera from_;
  int filled_of_ = 0;
  std::vector<std::string> figures_;
};

std::string hue(std::size_t i, std::size_t count) {
  return fmt::format("hsl({:.0f} 75% 42%)", count > 1 ? 300.0 * double(i) / double(count - 1) : 0.0);
}

std::string charts(std::vector<LdiFigures> const& all, bool has_truth) {
  PlotOptions of_memory{.x_label = "reference images", .y_label = "megabytes"};
  PlotCurve memory{"LDI tree", {}, "#117733", false}, input{"images", {}, "#999999", false};
  PlotCurve error{"LDI tree", {}, "#117733", false}, warping{"all warped", {}, "#cc7722", false};
  std::vector<PlotCurve> times, cells;
  for (std::size_t i = 0; i < all.size(); ++i) {
    LdiFigures const& one = all[i];
    memory.points.emplace_back(one.images, one.size["bytes"].get<double>() / kMega);
    input.points.emplace_back(one.images, one.size["input_bytes"].get<double>() / kMega);
    error.points.emplace_back(median(one.milliseconds), one.filled.psnr);
    warping.points.emplace_back(one.warped_milliseconds, one.warped.psnr);
    times.push_back({fmt::format("{} images", one.images), {}, hue(i, all.size()), false});
    cells.push_back(times.back());
    for (std::size_t f = 0; f < one.milliseconds.size(); ++f) {
      times.back().points.emplace_back(double(f), one.milliseconds[f]);
      cells.back().points.emplace_back(double(f), one.cells_traversed[f]);
    }
  }
  PlotOptions of_time{.x_label = "frame", .y_label = "milliseconds", .width = 640},
      of_cells{.x_label = "frame", .y_label = "octree cells traversed", .width = 640},
      of_error{.x_label = "ms a frame", .y_label = "PSNR (dB)", .width = 640};
  std::string html = "<h3>Memory (chart 1)</h3>" + svg_plot({memory, input}, of_memory) +
                     "<h3>Time of each frame (chart 2)</h3>" + svg_plot(times, of_time) +
                     "<h3>Cells traversed (chart 3)</h3>" + svg_plot(cells, of_cells);
  if (has_truth) html += "<h3>Error against time</h3>" + svg_plot({error, warping}, of_error);
  return html;
}

std::vector<std::vector<std::string>> table_of(std::vector<LdiFigures> const& all) {
  std::vector<std::vector<std::string>> rows = {{"images", "MB", "of input", "build (s)", "ms a frame", "cells",
                                                 "traversed", "splats", "uncovered", "uncovered, filled", "PSNR",
                                                 "PSNR, filled", "warping: ms", "uncovered, warped", "PSNR, warped",
                                                 "PSNR on both: tree", "warped"}};
  auto const decibel = [](double value) { return std::isfinite(value) ? fmt::format("{:.2f}", value) : std::string(); };
  for (LdiFigures const& one : all) {
    double const bytes = one.size["bytes"].get<double>();
    rows.push_back({fmt::format("{}", one.images), fmt::format("{:.1f}", bytes / kMega),
                    fmt::format("{:.2f}", bytes / one.size["input_bytes"].get<double>()),
                    fmt::format("{:.2f}", one.build_seconds), fmt::format("{:.1f}", median(one.milliseconds)),
                    fmt::format("{}", one.size["cells"].get<std::size_t>()),
                    fmt::format("{:.0f}", median(one.cells_traversed)), fmt::format("{:.0f}", median(one.splats)),
                    fmt::format("{:.5f}", 1 - one.open.coverage), fmt::format("{:.5f}", 1 - one.filled.coverage),
                    decibel(one.open.psnr), decibel(one.filled.psnr), fmt::format("{:.1f}", one.warped_milliseconds),
                    fmt::format("{:.5f}", 1 - one.warped.coverage), decibel(one.warped.psnr),
                    decibel(one.open.psnr_common), decibel(one.warped.psnr_common)});
  }
  return rows;
}

std::string text_of(std::vector<std::vector<std::string>> const& rows) {
  std::string text;
  std::vector<std::size_t> widths(rows[0].size(), 0);
  for (auto const& row : rows)
    for (std::size_t c = 0; c < row.size(); ++c) widths[c] = std::max(widths[c], row[c].size());
  for (auto const& row : rows) {
    for (std::size_t c = 0; c < row.size(); ++c)
      text += fmt::format("{:>{}}{}", row[c], widths[c], c + 1 < row.size() ? "  " : "\n");
  }
  return text;
}

Eigen::Vector3d up_of(LdiTree const& tree) {
  Eigen::Vector3d up = Eigen::Vector3d::Zero();
  for (View const& view : tree.views) up -= view.object_from_camera->linear().col(1);
  return up;
}

}  // namespace

LdiReport ldi_report(LdiSource& source, LdiReportOptions const& options, Context& context) {
  std::vector<int> const numbers = numbers_of_images(options, source.count());
  auto const path = source.path(options.frames, options.width, options.height);
  auto const references = source.references(path, context);
  NewView view(path[path.size() / 2], numbers);
  std::vector<LdiFigures> all;
  std::string drawing;
  LdiReport report;
  report.figures["images"] = Json::array();
  for (int const number : numbers) {
    context.check_cancelled();
    auto const views = source.views(number, context);
    // The sums are several times as large as the tree, and not needed any more.
    auto const [tree, seconds] = [&] {
      BuiltLdi const built = build_ldi(views, source.unit(), options.build, context);
      return std::pair(built.tree, built.seconds);
    }();
    all.push_back(measure_ldi(tree, views, path, references, options.draw, context));
    all.back().build_seconds = seconds;
    report.figures["images"].push_back(all.back().to_json());
    LdiRenderer renderer(tree, options.draw, context.threads);
    view.draw(number, renderer, views, context.threads);
    if (drawing.empty() || number <= kDrawnImages)
      drawing = fmt::format("<h3>The octree's cells from above, of {} images (figure 7)</h3>", number) +
                svg_octree(*tree, up_of(*tree));
    context.progress("report", all.size(), numbers.size());
  }
  auto const table = table_of(all);
  report.text = text_of(table);
  report.section = {
      "ldi", "LDI trees of more and more images",
      fmt::format("<p>{} frames along a path; {}. Where nothing is drawn counts as black; \"on both\": pixels that the "
                  "tree (gaps left) and warping of all images drew.</p>",
                  path.size(),
                  references.empty()
                      ? "there is nothing to compare them with"
                      : fmt::format("{} pictures are compared with what they should look like", references.size())) +
          html_table(table) + charts(all, !references.empty()) + drawing + "<h3>A new view (figures 8 to 11)</h3>" +
          view.row(references)};
  return report;
}

}  // namespace scanview
