#include "synth/paint.h"

#include <algorithm>
#include <cmath>
#include <opencv2/imgproc.hpp>

#include "synth/distance_field.h"

namespace scanview {

using Eigen::Vector3f;

Vector3f rgb(std::uint32_t hex) {
  return Vector3f(static_cast<float>(hex >> 16), static_cast<float>((hex >> 8) & 255), static_cast<float>(hex & 255)) /
         255.0f;
}

cv::Vec3b bgr_from_paint(Vector3f const& color) {
  return {cv::saturate_cast<uchar>(255 * color.z()), cv::saturate_cast<uchar>(255 * color.y()),
          cv::saturate_cast<uchar>(255 * color.x())};
}

cv::Vec3b bgr_from_paint(std::uint32_t hex) { return bgr_from_paint(rgb(hex)); }

Vector3f within_albedo(Vector3f const& color) {
  constexpr float kDarkest = 0.2209f, kLightest = 0.9547f;  // sRGB of the linear 0.04 and 0.9
  return color.cwiseMax(kDarkest).cwiseMin(kLightest);
}

Vector3f mix(Vector3f const& a, Vector3f const& b, float t) { return a + (b - a) * t; }

float soft_step(float edge, float x, float width) {
  float const t = std::clamp((x - edge) / width + 0.5f, 0.0f, 1.0f);
  return t * t * (3 - 2 * t);
}

float inside(float distance, float width) { return 1 - soft_step(0, distance, width); }

float spots_distance(Vector3f const& p, float cell, float radius) {
  Vector3f const index = (p / cell).array().floor();
  Vector3f const jitter(value_noise(index * 2.7f), value_noise(index * 3.9f + Vector3f::Constant(9)),
                        value_noise(index * 5.1f + Vector3f::Constant(5)));
  Vector3f const spot = (index + Vector3f::Constant(0.5f) + 0.25f * jitter) * cell;
  return (p - spot).norm() - radius * (1 + 0.8f * jitter.x());
}

Lettering::Lettering(char const* words) {
  int baseline = 0;
  cv::Size const size = cv::getTextSize(words, cv::FONT_HERSHEY_DUPLEX, kScale, kThickness, &baseline);
  ink_ = cv::Mat1b(kHeight, size.width + 8, static_cast<uchar>(0));
  cv::putText(ink_, words, {4, kHeight - 16}, cv::FONT_HERSHEY_DUPLEX, kScale, cv::Scalar(255), kThickness, cv::LINE_8);
  cv::GaussianBlur(ink_, ink_, {5, 5}, 0);
}

float Lettering::ink(float x, float y) const {
  int const u = static_cast<int>(std::floor(x * kHeight)), v = static_cast<int>(std::floor((1 - y) * kHeight));
  if (u < 0 || v < 0 || u >= ink_.cols || v >= ink_.rows) return 0;
  return static_cast<float>(ink_(v, u)) / 255.0f;
}

}  // namespace scanview
