#include "viewer/window/line_drawing.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <opencv2/imgproc.hpp>
#include <optional>

namespace scanview {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;

/// On the screen; key: 1/z (perspective) or −z, greater is nearer, linear along a line.
struct LineEnd {
  Vector2d pixel;
  double key;
};

LineEnd between(LineEnd const& a, LineEnd const& b, double t) {
  return {a.pixel + t * (b.pixel - a.pixel), a.key + t * (b.key - a.key)};
}

/// What is farthest away within a pixel, as a key; −infinity: nothing is there.
cv::Mat1d farthest_keys(cv::Mat1f const& depth, bool perspective) {
  cv::Mat1d keys(depth.size());
  for (int y = 0; y < depth.rows; ++y) {
    for (int x = 0; x < depth.cols; ++x) {
      double const z = depth(y, x);
      keys(y, x) = std::isnan(z) ? -std::numeric_limits<double>::infinity() : perspective ? 1 / z : -z;
    }
  }
  // Beyond the border nothing is known.
  cv::erode(keys, keys, cv::Mat::ones(3, 3, CV_8U), {-1, -1}, 1, cv::BORDER_REPLICATE);
  return keys;
}

/// Cuts off what is nearer than `near`; nothing where that is all.
bool clip_near(Vector3d& a, Vector3d& b, double near) {
  if (a.z() < near && b.z() < near) return false;
  if (a.z() < near) a += (near - a.z()) / (b.z() - a.z()) * (b - a);
  if (b.z() < near) b += (near - b.z()) / (a.z() - b.z()) * (a - b);
  return true;
}

/// Cuts off what lies outside the picture (Liang and Barsky 1984); false where that is all.
bool clip_to_picture(LineEnd& a, LineEnd& b, cv::Size const& size) {
  double begin = 0, end = 1;
  Vector2d const step = b.pixel - a.pixel;
  for (int axis = 0; axis < 2; ++axis) {
    double const most = (axis == 0 ? size.width : size.height) - 0.5;
    for (double const sign : {-1.0, 1.0}) {
      double const rise = sign * step[axis], room = (sign > 0 ? most : 0.5) - sign * a.pixel[axis];
      if (rise == 0) {
        if (room < 0) return false;
      } else if (rise > 0) {
        end = std::min(end, room / rise);
      } else {
        begin = std::max(begin, room / rise);
      }
    }
  }
  if (!(begin < end)) return false;
  LineEnd const from = between(a, b, begin);
  b = between(a, b, end);
  a = from;
  return true;
}

void draw_run(cv::Mat4b& picture, LineEnd const& a, LineEnd const& b, cv::Vec4b const& color) {
  constexpr int kBits = 8;
  auto const place = [](Vector2d const& p) {
    return cv::Point(static_cast<int>(std::lround(p.x() * (1 << kBits))),
                     static_cast<int>(std::lround(p.y() * (1 << kBits))));
  };
  cv::line(picture, place(a.pixel), place(b.pixel), cv::Scalar(color), 1, cv::LINE_AA, kBits);
}

}  // namespace

void draw_seen_lines(cv::Mat4b& picture, cv::Mat1f const& depth, Camera const& camera,
                     Eigen::Isometry3d const& object_from_camera, std::vector<Eigen::Vector3f> const& vertices,
                     std::vector<Eigen::Vector2i> const& lines, std::vector<cv::Vec4b> const& colors) {
  if (lines.empty() || picture.empty()) return;
  cv::Mat1d const farthest = farthest_keys(depth, camera.is_perspective());
  Eigen::Isometry3d const camera_from_object = object_from_camera.inverse();
  // Nearer than all that is drawn there is no line either.
  double nearest = std::numeric_limits<double>::infinity();
  for (float const z : depth) nearest = z < nearest ? z : nearest;
  if (!std::isfinite(nearest)) return;
  double const near = camera.is_perspective() ? 0.5 * nearest : -std::numeric_limits<double>::infinity();
  for (std::size_t i = 0; i < lines.size(); ++i) {
    Eigen::Vector2i const& line = lines[i];
    Vector3d ends[2];
    for (int k = 0; k < 2; ++k)
      ends[k] = camera_from_object * vertices[static_cast<std::size_t>(line[k])].cast<double>();
    if (!clip_near(ends[0], ends[1], near)) continue;
    auto const on_screen = [&](Vector3d const& p) {
      return LineEnd{camera.project(p), camera.is_perspective() ? 1 / p.z() : -p.z()};
    };
    LineEnd a = on_screen(ends[0]), b = on_screen(ends[1]);
    if (!clip_to_picture(a, b, picture.size())) continue;
    int const steps = std::max(1, static_cast<int>(std::ceil((b.pixel - a.pixel).lpNorm<Eigen::Infinity>())));
    auto const is_seen = [&](int step) {
      LineEnd const middle = between(a, b, (step + 0.5) / steps);
      int const x = std::clamp(static_cast<int>(std::lround(middle.pixel.x())), 0, picture.cols - 1);
      int const y = std::clamp(static_cast<int>(std::lround(middle.pixel.y())), 0, picture.rows - 1);
      return farthest(y, x) <= middle.key + 1e-4 * std::abs(middle.key);
    };
    for (int begin = 0, end = 0; begin < steps; begin = end + 1) {
      end = begin;
      while (end < steps && is_seen(end)) ++end;
      if (end > begin)
        draw_run(picture, between(a, b, static_cast<double>(begin) / steps),
                 between(a, b, static_cast<double>(end) / steps), colors.empty() ? cv::Vec4b(0, 0, 0, 255) : colors[i]);
    }
  }
}

}  // namespace scanview
