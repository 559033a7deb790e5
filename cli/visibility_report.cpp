#include "cli/visibility_report.h"

#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <numeric>

#include "base/image_file.h"
#include "synth/visible_triangles.h"
#include "viewer/visibility/selection_drawer.h"
#include "viewer/visibility/smallest_samples.h"
#include "viewer/visibility/visibility_check.h"
#include "viewer/visibility/visibility_file.h"

namespace scanview {
namespace {

constexpr int kRaysAPolygon = 12, kPixels = 1024;
constexpr double kNearest = 2, kFarthest = 5;

struct Measured {
  VisibilityFigures figures;
  VisibilityTimes times;
  std::size_t patches = 0, samples = 0, enough = 0;
  double bits_a_polygon = 0, select_us = 0, frame_ms = 0;
};

double milliseconds_since(std::chrono::steady_clock::time_point start) {
  return 1e3 * std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
}

Measured measure(PolygonModel const& model, VisibilityOptions const& options, bool facing, std::size_t eye_count,
                 double farthest, Context& context) {
  Measured result;
  VisibilityField const field = build_visibility(model, options, context, &result.times);
  TriangleMesh const drawn = drawn_mesh(model.mesh, field.patches);
  auto const eyes = unseen_eyes(field, eye_count, kNearest, farthest, context.seed);
  result.figures = check_visibility(field, drawn, model.polygons, facing, eyes, kPixels, context);
  result.patches = field.patches.count();
  result.samples = field.rows.rows();
  result.enough = smallest_samples(field.rows).size();
  result.bits_a_polygon = 8.0 * static_cast<double>(format_visibility(field, model.mesh).size()) /
                          static_cast<double>(model.polygon_count());
  VisibilitySelector selector(field, drawn, facing);
  double fastest = std::numeric_limits<double>::infinity();
  for (int turn = 0; turn < 5; ++turn) {
    auto const start = std::chrono::steady_clock::now();
    for (auto const& eye : eyes) selector.select(eye);
    fastest = std::min(fastest, milliseconds_since(start) / static_cast<double>(eyes.size()));
  }
  result.select_us = 1e3 * fastest;
  SelectionDrawer drawer(drawn);
  std::size_t const timed = std::min<std::size_t>(eyes.size(), 20);
  for (std::size_t i = 0; i < timed; ++i) {
    SampleCamera const camera = eye_camera(field, eyes[i], kPixels);
    double best = std::numeric_limits<double>::infinity();
    for (int turn = 0; turn < 2; ++turn) {
      auto const start = std::chrono::steady_clock::now();
      drawer.draw(camera, selector.select(eyes[i]));
      best = std::min(best, milliseconds_since(start));
    }
    result.frame_ms += best / static_cast<double>(timed);
  }
  return result;
}

/// Shares of polygons that cannot be seen: the most that could be culled. And the time to draw the rest, and all.
struct Limit {
  double culling_rate = 0, exact_frame_ms = 0, whole_frame_ms = 0;
};

Limit exact_limit(PolygonModel const& model, std::size_t eye_count, Context& context) {
  VisibilityField const ball = field_ball(model);
  RayScene const scene(model.mesh.vertices, model.mesh.triangles);
  SelectionDrawer drawer(model.mesh);
  Limit limit;
  auto const eyes = unseen_eyes(ball, eye_count, kNearest, kFarthest, context.seed);
  for (auto const& eye : eyes) {
    auto const visible =
        visible_triangles(scene, model.mesh.vertices, model.mesh.triangles, eye, kRaysAPolygon, context);
    std::vector<std::uint8_t> polygon(model.polygon_count());
    std::vector<IndexRange> ranges;
    for (std::uint32_t i = 0; i < visible.size(); ++i) {
      if (!visible[i]) continue;
      polygon[model.polygons.empty() ? i : static_cast<std::size_t>(model.polygons[i])] = 1;
      if (!ranges.empty() && ranges.back().first + ranges.back().count == i) {
        ++ranges.back().count;
      } else {
        ranges.push_back({i, 1});
      }
    }
    auto const n = static_cast<double>(eyes.size());
    limit.culling_rate +=
        (1 - static_cast<double>(std::count(polygon.begin(), polygon.end(), 1)) / static_cast<double>(polygon.size())) /
        n;
    SampleCamera const camera = eye_camera(ball, eye, kPixels);
    auto const time = [&](std::span<IndexRange const> what) {
      double best = std::numeric_limits<double>::infinity();
      for (int turn = 0; turn < 2; ++turn) {
        auto const start = std::chrono::steady_clock::now();
        drawer.draw(camera, what);
        best = std::min(best, milliseconds_since(start));
      }
      return best / n;
    };
    limit.exact_frame_ms += time(ranges);
    IndexRange const all{0, static_cast<std::uint32_t>(model.mesh.triangles.size())};
    limit.whole_frame_ms += time({&all, 1});
  }
  return limit;
}

std::vector<std::string> row(std::string const& name, Measured const& m, Limit const& limit) {
  double const pixels = static_cast<double>(m.figures.pixels);
  return {name,
          fmt::format("{}", m.patches),
          fmt::format("{:.1f}", 100 * m.figures.culling_rate),
          fmt::format("{:.3f}", m.figures.culling_rate / limit.culling_rate),
          fmt::format("{:.2g}", static_cast<double>(m.figures.wrong_pixels) / pixels),
          fmt::format("{:.2f}", m.frame_ms),
          fmt::format("{:+.0f} %", 100 * (limit.whole_frame_ms / m.frame_ms - 1)),
          fmt::format("{:.1f}", m.select_us),
          fmt::format("{:.0f}", m.figures.ranges),
          fmt::format("{:.1f}", m.bits_a_polygon),
          fmt::format("{:.2f}", m.times.patches + m.times.sampling)};
}

std::string as_text(std::vector<std::vector<std::string>> const& rows) {
  std::string text;
  for (auto const& cells : rows) {
    for (std::size_t c = 0; c < cells.size(); ++c)
      text += c == 0 ? fmt::format("{:<34}", cells[c]) : fmt::format("{:>10}", cells[c]);
    text += '\n';
  }
  return text;
}

}  // namespace

VisibilityReport visibility_report(PolygonModel const& model, std::string const& name, VisibilityOptions const& options,
                                   bool thorough, Context& context) {
  std::size_t const eyes = thorough ? 200 : 40;
  Limit const limit = exact_limit(model, std::min<std::size_t>(eyes, 24), context);
  std::vector<std::vector<std::string>> table{
      {"", "patches", "culled %", "of limit", "wrong", "ms", "faster", "select us", "ranges", "bits", "build s"}};
  Measured const asked = measure(model, options, true, eyes, kFarthest, context);
  table.push_back(row("as asked", asked, limit));
  table.push_back({fmt::format("exact limit ({} rays a polygon)", kRaysAPolygon), "",
                   fmt::format("{:.1f}", 100 * limit.culling_rate), "1", "0",
                   fmt::format("{:.2f}", limit.exact_frame_ms),
                   fmt::format("{:+.0f} %", 100 * (limit.whole_frame_ms / limit.exact_frame_ms - 1)), "", "", "", ""});
  VisibilityOptions conservative = options;
  conservative.conservative = true;
  table.push_back(row("conservative", measure(model, conservative, false, eyes, kFarthest, context), limit));

  // As in the papers: eyes as far as the samples, pixels only, patches cut smallest first, no facing.
  VisibilityOptions paper = options;
  paper.seen = Seen::in_picture;
  paper.cut = PatchCut::even;
  paper.shells = {kNearest};
  std::vector<std::size_t> samples{6, 18, 66, 258, 1026};
  if (thorough) samples.push_back(4098);
  auto const curve = [](std::string const& title, std::string const& color) { return PlotCurve{title, {}, color}; };
  PlotCurve id_rate = curve("id, 3 + 3 samples", "#c33"), patch_rate = curve("1000 patches", "#36c"),
            limit_rate = curve("exact limit", "#888");
  PlotCurve id_frames = curve("id", "#c33"), patch_frames = curve("1000 patches", "#36c");
  PlotCurve id_wrong = curve("id", "#c33"), patch_wrong = curve("1000 patches", "#36c");
  for (std::size_t const n : samples) {
    auto const x = static_cast<double>(n);
    for (VisibilityMethod const method : {VisibilityMethod::id, VisibilityMethod::patch}) {
      paper.method = method;
      paper.samples = n;
      paper.patches = 1000;
      bool const id = method == VisibilityMethod::id;
      Measured const m = measure(model, paper, false, std::min<std::size_t>(eyes, 40), kNearest, context);
      table.push_back(row(fmt::format("{}, {} samples, as the paper", id ? "id" : "patch", n), m, limit));
      (id ? id_rate : patch_rate).points.emplace_back(x, 100 * m.figures.culling_rate);
      (id ? id_frames : patch_frames).points.emplace_back(x, 1e3 / m.frame_ms);
      (id ? id_wrong : patch_wrong)
          .points.emplace_back(
              x, 1e6 * static_cast<double>(m.figures.wrong_pixels) / static_cast<double>(m.figures.pixels));
    }
    limit_rate.points.emplace_back(x, 100 * limit.culling_rate);
  }
  paper.method = VisibilityMethod::patch;
  paper.samples = 1026;
  PlotCurve by_patches = curve("1026 samples", "#36c"), frames_by_patches = by_patches;
  for (std::size_t const n : {50, 100, 200, 500, 1000, 2000}) {
    paper.patches = n;
    Measured const m = measure(model, paper, false, std::min<std::size_t>(eyes, 40), kNearest, context);
    table.push_back(row(fmt::format("{} patches asked, as the paper", n), m, limit));
    by_patches.points.emplace_back(static_cast<double>(n), 100 * m.figures.culling_rate);
    frames_by_patches.points.emplace_back(static_cast<double>(n), 1e3 / m.frame_ms);
  }

  VisibilityReport report;
  std::string const enough = fmt::format("{} of the {} samples see all that all see.", asked.enough, asked.samples);
  report.text = as_text(table) + enough + '\n';
  PlotOptions plot{"samples", "culling rate %", true};
  auto const with_labels = [&](std::string const& x, std::string const& y, bool log_y = false) {
    plot.x_label = x;
    plot.y_label = y;
    plot.log_y = log_y;
    return plot;
  };
  std::string html = html_table(table) + "<p>" + enough + "</p>";
  html += html_row({svg_plot({id_rate, patch_rate, limit_rate}, with_labels("samples", "culling rate %")),
                    svg_plot({id_frames, patch_frames}, with_labels("samples", "frames a second, CPU back end")),
                    svg_plot({id_wrong, patch_wrong}, with_labels("samples", "wrong pixels of a million"))});
  html += html_row({svg_plot({by_patches}, with_labels("patches", "culling rate %")),
                    svg_plot({frames_by_patches}, with_labels("patches", "frames a second, CPU back end"))});
  report.section = {"visibility", name, html};
  report.figures = {{"polygons", model.polygon_count()},
                    {"limit", limit.culling_rate},
                    {"samples_enough", asked.enough},
                    {"table", table}};
  return report;
}

}  // namespace scanview
