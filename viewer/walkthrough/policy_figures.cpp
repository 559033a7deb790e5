#include "viewer/walkthrough/policy_figures.h"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <numeric>

#include "base/median.h"
#include "viewer/blend/supersampling.h"

namespace scanview {
namespace {

double mean(std::vector<double> const& values) {
  return values.empty() ? 0 : std::accumulate(values.begin(), values.end(), 0.0) / double(values.size());
}

/// Squared difference to the reference, and the share of its pixels that was not drawn.
std::pair<double, double> compare(Frame const& frame, cv::Mat4b const& centers, ReferenceFrame const& reference) {
  double sum = 0, count = 0, uncovered = 0;
  for (int y = 0; y < reference.picture.rows; ++y)
    for (int x = 0; x < reference.picture.cols; ++x) {
      if (!reference.counts.empty() && reference.counts(y, x) == 0) continue;
      ++count;
      if (centers(y, x)[3] == 0) ++uncovered;
      cv::Vec4b const& drawn = frame.color(y, x);
      for (int c = 0; c < 3; ++c) {
        double const value = drawn[3] == 0 ? 0 : double(drawn[c]);
        double const off = (value - double(reference.picture(y, x)[c])) / 255;
        sum += off * off;
      }
    }
  return count > 0 ? std::pair(sum / (3 * count), uncovered / count) : std::pair(0.0, 0.0);
}

}  // namespace

double PolicyFigures::mean_error() const { return mean(error); }

double PolicyFigures::psnr() const { return -10 * std::log10(std::max(mean_error(), 1e-10)); }

double PolicyFigures::median_milliseconds() const { return median(milliseconds); }

std::vector<PolicyFigures> measure_policies(WalkthroughRenderer& renderer, std::vector<ReferenceFrame> const& frames,
                                            std::vector<MergePolicy> const& policies, int samples_side,
                                            Context& context) {
  using Clock = std::chrono::steady_clock;
  std::vector<PolicyFigures> figures;
  for (MergePolicy const policy : policies) figures.emplace_back().policy = policy;
  WalkthroughOptions const before = renderer.options();
  for (std::size_t f = 0; f < frames.size(); ++f) {
    context.check_cancelled();
    Camera const& camera = frames[f].from.camera;
    Camera const fine = camera.resized(samples_side * camera.width(), samples_side * camera.height());
    for (PolicyFigures& of_policy : figures) {
      WalkthroughOptions options = before;
      options.policy = of_policy.policy;
      renderer.set_options(options);
      double fastest = INFINITY;
      Frame frame;
      for (int turn = 0; turn < 2; ++turn) {
        auto const start = Clock::now();
        frame = renderer.render(camera, frames[f].from.object_from_camera);
        fastest = std::min(fastest, std::chrono::duration<double, std::milli>(Clock::now() - start).count());
      }
      cv::Mat4b const centers = frame.color.clone();
      if (samples_side > 1)
        frame = box_filtered(renderer.render(fine, frames[f].from.object_from_camera), samples_side);
      auto const [error, uncovered] = compare(frame, centers, frames[f]);
      of_policy.error.push_back(error);
      of_policy.uncovered.push_back(uncovered);
      of_policy.milliseconds.push_back(fastest);
    }
    context.progress("compare", f + 1, frames.size());
  }
  renderer.set_options(before);
  return figures;
}

}  // namespace scanview
