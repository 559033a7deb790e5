#include "viewer/blend/supersampling.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "base/error.h"
#include "base/srgb.h"

namespace scanview {
namespace {

std::uint8_t encode(double linear) { return static_cast<std::uint8_t>(std::lround(255 * srgb_from_linear(linear))); }

/// Whether the samples of a pixel of `camera` are not all of one surface: some were not drawn, or depths differ by more
/// than a surface at 80 degrees explains.
bool has_border(Frame const& samples, Camera const& camera, int x, int y, int factor) {
  float nearest = std::numeric_limits<float>::infinity(), farthest = 0;
  bool any = false, all = true;
  for (int v = y * factor; v < (y + 1) * factor; ++v)
    for (int u = x * factor; u < (x + 1) * factor; ++u) {
      float const depth = samples.depth(v, u);
      if (std::isnan(depth)) {
        all = false;
        continue;
      }
      any = true;
      nearest = std::min(nearest, depth);
      farthest = std::max(farthest, depth);
    }
  if (!any) return false;
  constexpr double kSteepest = 5.7;  // tan 80°
  return !all || farthest - nearest > kSteepest * camera.pixel_size(nearest);
}

}  // namespace

Frame box_filtered(Frame const& frame, int factor) {
  if (factor == 1) return frame;
  auto const& linear = linear_from_srgb8();
  float const missing = std::numeric_limits<float>::quiet_NaN();
  int const width = frame.color.cols / factor, height = frame.color.rows / factor;
  Frame small{cv::Mat4b(height, width), cv::Mat1f(height, width)};
  for (int y = 0; y < height; ++y)
    for (int x = 0; x < width; ++x) {
      double sum[3] = {}, alpha = 0;
      float nearest = missing;
      for (int v = y * factor; v < (y + 1) * factor; ++v)
        for (int u = x * factor; u < (x + 1) * factor; ++u) {
          cv::Vec4b const& sample = frame.color(v, u);
          for (int c = 0; c < 3; ++c) sum[c] += sample[3] * linear[sample[c]];
          alpha += sample[3];
          nearest = std::fmin(nearest, frame.depth(v, u));  // fmin takes the other where one is NaN
        }
      cv::Vec4b pixel(0, 0, 0, 0);
      if (alpha > 0) {
        for (int c = 0; c < 3; ++c) pixel[c] = encode(sum[c] / alpha);
        // What was drawn at all stays visible: a depth never stands under an alpha of 0.
        pixel[3] = static_cast<std::uint8_t>(std::max(1L, std::lround(alpha / (factor * factor))));
      }
      small.color(y, x) = pixel;
      small.depth(y, x) = alpha > 0 ? nearest : missing;
    }
  return small;
}

SupersamplingRenderer::SupersamplingRenderer(Renderer& renderer, int factor) : renderer_(renderer), factor_(factor) {
  if (factor < 1 || factor > 8) throw Error(ErrorCode::usage, {}, "supersampling must be between 1 and 8");
}

Frame SupersamplingRenderer::render(Camera const& camera, Eigen::Isometry3d const& object_from_camera) {
  Frame frame = renderer_.render(camera, object_from_camera);
  if (factor_ == 1) return frame;
  Camera const larger = camera.resized(camera.width() * factor_, camera.height() * factor_);
  Frame const samples = renderer_.render(larger, object_from_camera);
  Frame const mean = box_filtered(samples, factor_);
  for (int y = 0; y < frame.color.rows; ++y)
    for (int x = 0; x < frame.color.cols; ++x)
      if (has_border(samples, camera, x, y, factor_)) {
        frame.color(y, x) = mean.color(y, x);
        frame.depth(y, x) = mean.depth(y, x);
      }
  return frame;
}

}  // namespace scanview
