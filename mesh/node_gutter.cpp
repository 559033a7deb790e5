#include "mesh/node_gutter.h"

#include <algorithm>
#include <cmath>
#include <opencv2/core.hpp>

namespace scanview {
namespace {

using Eigen::Vector3d;

/// Linear depth of a place in a picture, and the nearest pixel's depth and sigma.
struct Seen {
  PixelClass what = PixelClass::no_depth;
  double linear = 0, depth = 0, sigma = 0;
};

/// Both ends included: a direction along an edge of the cube is seen by one of its two sides at least.
bool holds(Camera const& camera, Eigen::Vector2d const& place) {
  constexpr double kEdge = 0.5 + 1e-6;
  return place.x() >= -kEdge && place.y() >= -kEdge && place.x() <= camera.width() - 1 + kEdge &&
         place.y() <= camera.height() - 1 + kEdge;
}

Seen look_up(RangeImage const& image, Eigen::Vector2d const& place) {
  int const width = image.camera.width(), height = image.camera.height();
  int const x = std::clamp(int(std::lround(place.x())), 0, width - 1);
  int const y = std::clamp(int(std::lround(place.y())), 0, height - 1);
  Seen seen;
  seen.what = static_cast<PixelClass>(image.classes(y, x));
  if (!image.has_depth(x, y)) return seen;
  seen.depth = image.depth(y, x);
  seen.sigma = image.sigma(y, x);
  seen.linear = 1 / seen.depth;
  // Beyond the outermost centres the two next to it go on.
  int const left = std::clamp(int(std::floor(place.x())), 0, std::max(width - 2, 0));
  int const top = std::clamp(int(std::floor(place.y())), 0, std::max(height - 2, 0));
  double value[2][2], least = INFINITY, most = 0;
  for (int v = 0; v < 2; ++v)
    for (int u = 0; u < 2; ++u) {
      int const px = std::min(left + u, width - 1), py = std::min(top + v, height - 1);
      if (!image.has_depth(px, py)) return seen;
      value[v][u] = 1 / double(image.depth(py, px));
      least = std::min(least, value[v][u]);
      most = std::max(most, value[v][u]);
    }
  constexpr double kApart = 1.5;
  if (most > kApart * least) return seen;
  double const right = place.x() - left, down = place.y() - top;
  seen.linear = (1 - down) * ((1 - right) * value[0][0] + right * value[0][1]) +
                down * ((1 - right) * value[1][0] + right * value[1][1]);
  return seen;
}

}  // namespace

RangeImage with_gutter(std::vector<View> const& sides, std::size_t side, int pixels) {
  RangeImage const& image = sides[side].image;
  Camera const& camera = image.camera;
  Eigen::Matrix3d const node_from_camera = sides[side].object_from_camera->linear();
  int const width = camera.width(), height = camera.height();
  RangeImage wide = empty_range_image(camera.cropped(-pixels, -pixels, width + 2 * pixels, height + 2 * pixels));
  cv::Rect const inside(pixels, pixels, width, height);
  image.depth.copyTo(wide.depth(inside));
  image.sigma.copyTo(wide.sigma(inside));
  image.classes.copyTo(wide.classes(inside));
  for (int y = 0; y < wide.depth.rows; ++y)
    for (int x = 0; x < wide.depth.cols; ++x) {
      if (inside.contains({x, y})) {
        x += width - 1;
        continue;
      }
      Vector3d const ray = node_from_camera * wide.camera.ray_direction(x, y);
      for (std::size_t s = 0; s < sides.size(); ++s) {
        if (s == side) continue;
        Vector3d const seen_ray = sides[s].object_from_camera->linear().transpose() * ray;
        if (!(seen_ray.z() > 0)) continue;
        Eigen::Vector2d const place = sides[s].image.camera.project(seen_ray);
        if (!holds(sides[s].image.camera, place)) continue;
        Seen const seen = look_up(sides[s].image, place);
        if (seen.what == PixelClass::object) {
          // Of two depths of one point, along the two cameras' axes, the rays' z say how one follows from the other.
          wide.depth(y, x) = float(1 / (seen.linear * seen_ray.z()));
          wide.sigma(y, x) = float(seen.sigma / seen_ray.z());
        }
        wide.classes(y, x) = static_cast<uchar>(seen.what);
        break;
      }
    }
  return wide;
}

SurfaceLinks without_gutter(SurfaceLinks const& links, int pixels) {
  cv::Rect const inside(pixels, pixels, links.object.cols - 2 * pixels, links.object.rows - 2 * pixels);
  SurfaceLinks result;
  result.object = links.object(inside).clone();
  result.right = links.right(inside).clone();
  result.down = links.down(inside).clone();
  result.right.col(inside.width - 1).setTo(0);
  result.down.row(inside.height - 1).setTo(0);
  result.dropped = links.dropped;
  return result;
}

std::array<std::vector<double>, 4> beyond_edges(RangeImage const& wide, SurfaceLinks const& links, int pixels) {
  int const left = pixels, top = pixels, right = wide.depth.cols - pixels - 1, bottom = wide.depth.rows - pixels - 1;
  std::array<std::vector<double>, 4> beyond;
  auto const add = [&](std::size_t edge, int x, int y, int dx, int dy) {
    bool const linked = links.is_object(x, y) && links.is_object(x + dx, y + dy) && links.linked(x, y, x + dx, y + dy);
    beyond[edge].push_back(linked ? 1 / double(wide.depth(y + dy, x + dx)) : 0);
  };
  for (int x = left; x <= right; ++x) add(0, x, top, 0, -1);
  for (int y = top; y <= bottom; ++y) add(1, right, y, 1, 0);
  for (int x = right; x >= left; --x) add(2, x, bottom, 0, 1);
  for (int y = bottom; y >= top; --y) add(3, left, y, -1, 0);
  return beyond;
}

}  // namespace scanview
