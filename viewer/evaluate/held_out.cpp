#include "viewer/evaluate/held_out.h"

#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <opencv2/core.hpp>

#include "base/error.h"
#include "base/srgb.h"
#include "viewer/blend/supersampling.h"
#include "viewer/evaluate/image_quality.h"

namespace scanview {
namespace {

std::uint8_t times_gain(std::uint8_t value, double gain) {
  double const linear = std::clamp(linear_from_srgb(value / 255.0) * gain, 0.0, 1.0);
  return static_cast<std::uint8_t>(std::lround(255 * srgb_from_linear(linear)));
}

/// Samples of a border's pixel, each way: as in a photograph, such pixels are mixtures.
constexpr int kSupersampling = 2;

/// The photograph in the set's common exposure, which is what is rendered.
cv::Mat3b exposed(View const& view) {
  cv::Mat3b result = view.image.color.clone();
  if (view.gain == Eigen::Vector3d::Ones()) return result;
  for (auto& pixel : result) {
    for (int c = 0; c < 3; ++c) pixel[c] = times_gain(pixel[c], view.gain[2 - c]);
  }
  return result;
}

std::vector<ViewFigures> evaluate(GlContext& gl, ScanSet const& set, std::vector<ViewMesh> const& meshes,
                                  std::vector<std::size_t> const& views, ViewBasedOptions const& options, bool hold_out,
                                  Context& context) {
  for (std::size_t const view : views) {
    if (view >= set.views.size()) throw Error(ErrorCode::usage, {}, "there is no view " + std::to_string(view));
  }
  auto const renderer = make_gl_renderer(gl, std::make_shared<ViewLibrary>(set, meshes), options);
  std::vector<ViewFigures> result;
  for (std::size_t const view : views) {
    context.check_cancelled();
    if (hold_out) {
      auto excluded = options.excluded;
      excluded.push_back(view);
      renderer->exclude(excluded);
    }
    SupersamplingRenderer smooth(*renderer, kSupersampling);
    // The very first frame makes room and compiles.
    if (result.empty() && set.views[view].object_from_camera)
      smooth.render(set.views[view].image.camera, *set.views[view].object_from_camera);
    result.push_back(compare_with_photograph(smooth, set, view));
    context.progress("evaluate", result.size(), views.size());
  }
  return result;
}

}  // namespace

ViewFigures compare_with_photograph(Renderer& renderer, ScanSet const& set, std::size_t index) {
  View const& view = set.views.at(index);
  Camera const& camera = view.image.camera;
  if (!view.object_from_camera) throw Error(ErrorCode::bad_input, {}, "view " + view.name + " has no pose");
  auto const start = std::chrono::steady_clock::now();
  Frame const frame = renderer.render(camera, *view.object_from_camera);
  std::chrono::duration<double, std::milli> const took = std::chrono::steady_clock::now() - start;

  ViewFigures figures;
  figures.view = index;
  figures.name = view.name;
  figures.milliseconds = took.count();
  figures.photograph = exposed(view);
  figures.rendered = cv::Mat3b(camera.height(), camera.width(), cv::Vec3b(0, 0, 0));
  figures.difference = figures.rendered.clone();
  cv::Mat1b object(camera.height(), camera.width(), static_cast<std::uint8_t>(0)), common = object.clone();
  for (int y = 0; y < camera.height(); ++y) {
    for (int x = 0; x < camera.width(); ++x) {
      auto const& drawn = frame.color(y, x);
      if (drawn[3] != 0) figures.rendered(y, x) = {drawn[0], drawn[1], drawn[2]};
      if (!view.image.has_depth(x, y)) {
        figures.photograph(y, x) = {0, 0, 0};
        continue;
      }
      object(y, x) = 255;
      if (drawn[3] != 0) common(y, x) = 255;
      for (int c = 0; c < 3; ++c) {
        int const difference = std::abs(figures.rendered(y, x)[c] - figures.photograph(y, x)[c]);
        figures.difference(y, x)[c] = static_cast<std::uint8_t>(std::min(255, 4 * difference));
      }
    }
  }
  figures.psnr_common = psnr(figures.photograph, figures.rendered, common);
  figures.psnr_all = psnr(figures.photograph, figures.rendered, object);
  figures.ssim = ssim(figures.photograph, figures.rendered, object);
  int const object_pixels = cv::countNonZero(object);
  figures.coverage = object_pixels == 0 ? 0 : static_cast<double>(cv::countNonZero(common)) / object_pixels;
  return figures;
}

std::vector<ViewFigures> evaluate_held_out(GlContext& gl, ScanSet const& set, std::vector<ViewMesh> const& meshes,
                                           std::vector<std::size_t> const& views, ViewBasedOptions const& options,
                                           Context& context) {
  return evaluate(gl, set, meshes, views, options, true, context);
}

std::vector<ViewFigures> evaluate_source_views(GlContext& gl, ScanSet const& set, std::vector<ViewMesh> const& meshes,
                                               std::vector<std::size_t> const& views, ViewBasedOptions const& options,
                                               Context& context) {
  return evaluate(gl, set, meshes, views, options, false, context);
}

ReportSection evaluate_section(std::vector<ViewFigures> const& held_out, std::vector<ViewFigures> const& source) {
  std::string html;
  auto const table = [&](std::vector<ViewFigures> const& all) {
    std::vector<std::vector<std::string>> rows{
        {"view", "PSNR, drawn pixels (dB)", "PSNR, all object pixels (dB)", "SSIM", "coverage (%)"}};
    for (auto const& f : all) {
      rows.push_back({f.name, fmt::format("{:.1f}", f.psnr_common), fmt::format("{:.1f}", f.psnr_all),
                      fmt::format("{:.3f}", f.ssim), fmt::format("{:.1f}", 100 * f.coverage)});
    }
    return html_table(rows);
  };
  if (!held_out.empty()) {
    html +=
        "<p>Each view was left out and rendered from the others. What no other view saw stays black, and counts as "
        "black in the figures over all object pixels.</p>";
    for (auto const& f : held_out) {
      html += html_row({html_jpeg(f.photograph, "view " + f.name + ": photograph", 320),
                        html_jpeg(f.rendered, fmt::format("rendered without it: {:.1f} dB", f.psnr_common), 320),
                        html_jpeg(f.difference, "difference, four times enlarged", 320)});
    }
    html += table(held_out);
  }
  if (!source.empty()) {
    html += "<p>Rendered from the camera of a view, with that view in use:</p>" + table(source);
  }
  return {"evaluate", "Held-out views", html};
}

}  // namespace scanview
