#include "acquire/captured_node.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <stdexcept>

#include "base/error.h"
#include "base/srgb.h"

namespace scanview {
namespace {

/// The first of two pixels around the middle of pixel `at` of the coarser picture, whose pixels are of one size, two
/// and more, all over the finer one.
int first_of_two(int at, int coarse, int fine) {
  double const middle = (at + 0.5) * fine / coarse - 0.5;
  return std::clamp(int(std::lround(middle - 0.5)), 0, std::max(fine - 2, 0));
}

RangeImage half_image(RangeImage const& image) {
  Camera const& camera = image.camera;
  RangeImage half =
      empty_range_image(camera.resized(std::max(1, camera.width() / 2), std::max(1, camera.height() / 2)));
  half.color.create(half.depth.size());
  auto const& linear = linear_from_srgb8();
  constexpr float kSameSurface = 1.02F;
  for (int y = 0; y < half.depth.rows; ++y)
    for (int x = 0; x < half.depth.cols; ++x) {
      double light[3] = {}, inverse = 0, sigma = 0;
      float nearest = std::numeric_limits<float>::infinity();
      int pixels = 0, depths = 0;
      int const left = first_of_two(x, half.depth.cols, image.depth.cols);
      int const top = first_of_two(y, half.depth.rows, image.depth.rows);
      auto const for_each = [&](auto const& act) {
        for (int v = top; v < std::min(top + 2, image.depth.rows); ++v)
          for (int u = left; u < std::min(left + 2, image.depth.cols); ++u) act(u, v);
      };
      for_each([&](int u, int v) {
        ++pixels;
        for (int c = 0; c < 3; ++c) light[c] += linear[image.color(v, u)[c]];
        if (image.has_depth(u, v)) nearest = std::min(nearest, image.depth(v, u));
      });
      for_each([&](int u, int v) {
        if (!image.has_depth(u, v) || image.depth(v, u) > kSameSurface * nearest) return;
        inverse += 1 / double(image.depth(v, u));
        sigma = std::max(sigma, double(image.sigma(v, u)));
        ++depths;
      });
      for (int c = 0; c < 3; ++c)
        half.color(y, x)[c] = cv::saturate_cast<uchar>(255 * srgb_from_linear(light[c] / pixels));
      half.classes(y, x) = depths > 0 ? static_cast<uchar>(PixelClass::object) : image.classes(top, left);
      if (depths == 0) continue;
      half.depth(y, x) = float(depths / inverse);
      half.sigma(y, x) = float(sigma);
    }
  return half;
}

}  // namespace

void CapturedNode::check() const {
  if (sides.empty()) throw std::logic_error("a node without sides");
  for (View const& side : sides) {
    side.image.check();
    if (!side.image.camera.is_perspective()) throw std::logic_error("a side of a node that is not perspective");
    if (!side.object_from_camera) throw std::logic_error("a side of a node without a pose");
    double const scale = 1 + position.norm();
    if ((side.eye() - position).norm() > 1e-9 * scale) throw std::logic_error("sides of a node with several eyes");
  }
}

CapturedNode half_resolution(CapturedNode const& node) {
  CapturedNode half{node.name, node.position, {}};
  for (View const& side : node.sides) {
    View smaller = side;
    smaller.image = half_image(side.image);
    half.sides.push_back(std::move(smaller));
  }
  return half;
}

std::string cube_side_name(int side) {
  static char const* const names[kCubeSides] = {"px", "nx", "py", "ny", "pz", "nz"};
  return names[side];
}

Camera cube_side_camera(int size) {
  if (size < 1) throw Error(ErrorCode::usage, {}, "the sides of a node must have at least one pixel");
  return Camera::perspective(size, size, 0.5 * size, 0.5 * size, 0.5 * (size - 1), 0.5 * (size - 1));
}

Eigen::Isometry3d scene_from_cube_side(int side, Eigen::Vector3d const& position) {
  double const sign = side % 2 == 0 ? 1 : -1;
  Eigen::Vector3d const forward = sign * Eigen::Vector3d::Unit(side / 2);
  Eigen::Vector3d const down =
      side / 2 == 1 ? Eigen::Vector3d(sign * Eigen::Vector3d::UnitZ()) : Eigen::Vector3d(-Eigen::Vector3d::UnitY());
  Eigen::Isometry3d pose = Eigen::Isometry3d::Identity();
  pose.linear() << down.cross(forward), down, forward;
  pose.translation() = position;
  return pose;
}

}  // namespace scanview
