#include "viewer/evaluate/held_out.h"

#include <algorithm>
#include <boost/math/distributions/students_t.hpp>
#include <chrono>
#include <cmath>
#include <numeric>
#include <opencv2/core.hpp>

#include "base/error.h"
#include "base/srgb.h"
#include "viewer/blend/supersampling.h"
#include "viewer/evaluate/image_quality.h"

namespace scanview {
namespace {

/// Samples of a border's pixel, each way: as in a photograph, such pixels are mixtures.
constexpr int kSupersampling = 2;

std::uint8_t times_gain(std::uint8_t value, double gain) {
  double const linear = std::clamp(linear_from_srgb(value / 255.0) * gain, 0.0, 1.0);
  return static_cast<std::uint8_t>(std::lround(255 * srgb_from_linear(linear)));
}

void check_views(ScanSet const& set, std::vector<std::size_t> const& views) {
  for (std::size_t const view : views) {
    if (view >= set.views.size()) throw Error(ErrorCode::usage, {}, "there is no view " + std::to_string(view));
    if (!set.views[view].object_from_camera)
      throw Error(ErrorCode::bad_input, {}, "view " + set.views[view].name + " has no pose");
  }
}

/// On the pixels that both drew.
void compare_with_ours(ViewFigures const& ours, ViewFigures& theirs) {
  cv::Mat1b const common = theirs.object & theirs.drawn & ours.drawn;
  theirs.psnr_common = psnr(theirs.photograph, theirs.rendered, common);
  theirs.ssim_common = ssim(theirs.photograph, theirs.rendered, common);
  theirs.psnr_lead = psnr(ours.photograph, ours.rendered, common) - theirs.psnr_common;
  theirs.ssim_lead = ssim(ours.photograph, ours.rendered, common) - theirs.ssim_common;
}

}  // namespace

cv::Mat3b exposed_photograph(View const& view) {
  cv::Mat3b result = view.image.color.clone();
  if (view.gain == Eigen::Vector3d::Ones()) return result;
  for (auto& pixel : result) {
    for (int c = 0; c < 3; ++c) pixel[c] = times_gain(pixel[c], view.gain[2 - c]);
  }
  return result;
}

ViewFigures compare_with_photograph(Renderer& renderer, ScanSet const& set, std::size_t index) {
  check_views(set, {index});
  View const& view = set.views[index];
  Camera const& camera = view.image.camera;
  auto const start = std::chrono::steady_clock::now();
  Frame const frame = renderer.render(camera, *view.object_from_camera);
  std::chrono::duration<double, std::milli> const took = std::chrono::steady_clock::now() - start;

  ViewFigures figures;
  figures.view = index;
  figures.name = view.name;
  figures.milliseconds = took.count();
  figures.photograph = exposed_photograph(view);
  figures.rendered = cv::Mat3b(camera.height(), camera.width(), cv::Vec3b(0, 0, 0));
  figures.difference = figures.rendered.clone();
  figures.drawn = cv::Mat1b(camera.height(), camera.width(), static_cast<std::uint8_t>(0));
  figures.object = figures.drawn.clone();
  int outside = 0;
  for (int y = 0; y < camera.height(); ++y) {
    for (int x = 0; x < camera.width(); ++x) {
      auto const& pixel = frame.color(y, x);
      bool const drawn = pixel[3] >= 128;  // half of a border's samples or more
      if (drawn) {
        figures.drawn(y, x) = 255;
        figures.rendered(y, x) = {pixel[0], pixel[1], pixel[2]};
      }
      if (!view.image.has_depth(x, y)) {
        figures.photograph(y, x) = {0, 0, 0};
        bool const background = view.image.classes(y, x) == static_cast<std::uint8_t>(PixelClass::background);
        outside += background && drawn;
        continue;
      }
      figures.object(y, x) = 255;
      for (int c = 0; c < 3; ++c) {
        int const difference = std::abs(figures.rendered(y, x)[c] - figures.photograph(y, x)[c]);
        figures.difference(y, x)[c] = static_cast<std::uint8_t>(std::min(255, 4 * difference));
      }
    }
  }
  cv::Mat1b const common = figures.object & figures.drawn;
  figures.psnr_common = psnr(figures.photograph, figures.rendered, common);
  figures.ssim_common = ssim(figures.photograph, figures.rendered, common);
  figures.psnr_all = psnr(figures.photograph, figures.rendered, figures.object);
  figures.ssim = ssim(figures.photograph, figures.rendered, figures.object);
  double const object_pixels = std::max(1, cv::countNonZero(figures.object));
  figures.coverage = cv::countNonZero(common) / object_pixels;
  figures.outside = outside / object_pixels;
  return figures;
}

Interval confidence_interval(std::vector<double> const& values) {
  if (values.empty()) return {};
  auto const n = static_cast<double>(values.size());
  double const mean = std::accumulate(values.begin(), values.end(), 0.0) / n;
  if (values.size() < 2) return {mean, mean, mean};
  double sum = 0;
  for (double const value : values) sum += (value - mean) * (value - mean);
  double const error = std::sqrt(sum / (n - 1) / n);
  double const t = boost::math::quantile(boost::math::students_t(n - 1), 0.975);
  return {mean, mean - t * error, mean + t * error};
}

std::vector<ContenderFigures> evaluate_held_out(std::vector<Contender>& contenders, ScanSet const& set,
                                                std::vector<std::size_t> const& views, HoldOut how, Context& context) {
  check_views(set, views);
  std::vector<ContenderFigures> result;
  for (auto const& contender : contenders) result.push_back({contender.name, contender.title, {}, {}, {}});
  for (std::size_t i = 0; i < views.size(); ++i) {
    for (std::size_t c = 0; c < contenders.size(); ++c) {
      context.check_cancelled();
      auto& renderer = *contenders[c].renderer;
      if (how == HoldOut::each) {
        renderer.exclude({views[i]});
      } else if (i == 0) {
        renderer.exclude(views);
      }
      View const& view = set.views[views[i]];
      // The first frame reads pictures and makes room.
      renderer.render(view.image.camera, *view.object_from_camera);
      SupersamplingRenderer smooth(renderer, kSupersampling);
      result[c].views.push_back(compare_with_photograph(smooth, set, views[i]));
      if (c > 0) compare_with_ours(result[0].views.back(), result[c].views.back());
    }
    context.progress("evaluate", i + 1, views.size());
  }
  for (std::size_t c = 1; c < result.size(); ++c) {
    std::vector<double> psnr_leads, ssim_leads;
    for (auto const& figures : result[c].views) {
      psnr_leads.push_back(figures.psnr_lead);
      ssim_leads.push_back(figures.ssim_lead);
    }
    result[c].psnr_lead = confidence_interval(psnr_leads);
    result[c].ssim_lead = confidence_interval(ssim_leads);
  }
  return result;
}

std::vector<ViewFigures> evaluate_source_views(std::shared_ptr<ViewLibrary> library, ScanSet const& set,
                                               std::vector<std::size_t> const& views, ViewBasedOptions const& options,
                                               Context& context) {
  check_views(set, views);
  auto const renderer = make_cpu_renderer(std::move(library), options, context.threads);
  SupersamplingRenderer smooth(*renderer, kSupersampling);
  std::vector<ViewFigures> result;
  for (std::size_t const view : views) {
    context.check_cancelled();
    result.push_back(compare_with_photograph(smooth, set, view));
  }
  return result;
}

}  // namespace scanview
