#include "acquire/rectification.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "base/error.h"

namespace scanview {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;

constexpr int kGrid = 4;          // pixels between exact places
constexpr double kLargest = 3;    // a rectified picture is at most so many times as wide or high as the camera's
constexpr int kBorderSteps = 32;  // places looked at along each side

/// What part of the plane z = 1 of the rectified frame a camera sees.
Eigen::AlignedBox2d seen_part(LensCamera const& camera, Matrix3d const& rectified_from_camera) {
  Eigen::AlignedBox2d box;
  double const w = camera.camera.width() - 1, h = camera.camera.height() - 1;
  for (int i = 0; i <= kBorderSteps; ++i)
    for (Eigen::Vector2d const& pixel :
         {Eigen::Vector2d(w * i / kBorderSteps, 0), Eigen::Vector2d(w * i / kBorderSteps, h),
          Eigen::Vector2d(0, h * i / kBorderSteps), Eigen::Vector2d(w, h * i / kBorderSteps)}) {
      Vector3d const ray = rectified_from_camera * camera.ray(pixel);
      if (!(ray.z() > 0.05 * ray.norm()))
        throw Error(ErrorCode::no_solution, {},
                    "the cameras look along the line between them: the light moves along the epipolar lines, and depth "
                    "cannot be found this way (place the cameras side by side)");
      box.extend(ray.head<2>() / ray.z());
    }
  return box;
}

}  // namespace

Rectification rectify(StereoRig const& rig) {
  Matrix3d const left_from_right = rig.right_from_left.linear().transpose();
  Vector3d const right_eye = -(left_from_right * rig.right_from_left.translation());
  Rectification result;
  result.baseline = right_eye.norm();
  Vector3d const x = right_eye / result.baseline;
  Vector3d const axes = Vector3d::UnitZ() + left_from_right.col(2);
  Vector3d z = axes - axes.dot(x) * x;
  z = z.norm() > 1e-6 ? Vector3d(z.normalized()) : x.unitOrthogonal();
  result.rectified_from_left.row(0) = x;
  result.rectified_from_left.row(1) = z.cross(x);
  result.rectified_from_left.row(2) = z;
  result.rectified_from_right = result.rectified_from_left * left_from_right;

  auto const part_left = seen_part(rig.left, result.rectified_from_left);
  auto const part_right = seen_part(rig.right, result.rectified_from_right);
  double const focal =
      std::max({rig.left.camera.fx(), rig.left.camera.fy(), rig.right.camera.fx(), rig.right.camera.fy()});
  // Rows that only one camera sees have no partner.
  double const top = std::max(part_left.min().y(), part_right.min().y());
  double const bottom = std::min(part_left.max().y(), part_right.max().y());
  if (!(bottom > top)) throw Error(ErrorCode::no_solution, {}, "the two cameras see no common epipolar line");
  auto const camera = [&](Eigen::AlignedBox2d const& part, Camera const& real) {
    double const width = focal * (part.max().x() - part.min().x()) + 1, height = focal * (bottom - top) + 1;
    double const most = kLargest * std::max(real.width(), real.height());
    if (width > most || height > most)
      throw Error(ErrorCode::no_solution, {},
                  "the cameras look nearly along the line between them: rectified pictures would be huge (place the "
                  "cameras more side by side)");
    return Camera::perspective(static_cast<int>(std::ceil(width)), static_cast<int>(std::ceil(height)), focal, focal,
                               -focal * part.min().x(), -focal * top);
  };
  result.left = camera(part_left, rig.left.camera);
  result.right = camera(part_right, rig.right.camera);
  return result;
}

PictureMap::PictureMap(Camera const& target, Matrix3d const& target_from_camera, LensCamera const& camera)
    : size_(target.width(), target.height()),
      // One place beyond the last pixel, so that every pixel has a whole cell.
      exact_((target.height() - 1) / kGrid + 2, (target.width() - 1) / kGrid + 2) {
  Matrix3d const camera_from_target = target_from_camera.transpose();
  for (int j = 0; j < exact_.rows; ++j)
    for (int i = 0; i < exact_.cols; ++i) {
      Eigen::Vector2d const pixel = camera.project(camera_from_target * target.ray_direction(i * kGrid, j * kGrid));
      exact_(j, i) = {static_cast<float>(pixel.x()), static_cast<float>(pixel.y())};
    }
}

cv::Vec2f PictureMap::at(int x, int y) const {
  int const i = x / kGrid, j = y / kGrid;
  float const u = static_cast<float>(x - i * kGrid) / kGrid, v = static_cast<float>(y - j * kGrid) / kGrid;
  cv::Vec2f const before = exact_(j, i) * (1 - v) + exact_(j + 1, i) * v;
  cv::Vec2f const after = exact_(j, i + 1) * (1 - v) + exact_(j + 1, i + 1) * v;
  return before * (1 - u) + after * u;
}

void PictureMap::row(int y, std::vector<cv::Vec2f>& places) const {
  places.resize(static_cast<std::size_t>(size_.width));
  int const j = y / kGrid;
  float const v = static_cast<float>(y - j * kGrid) / kGrid;
  cv::Vec2f const *const above = exact_[j], *const below = exact_[j + 1];
  cv::Vec2f before = above[0] * (1 - v) + below[0] * v;
  std::size_t x = 0;
  for (int i = 1; i < exact_.cols; ++i) {
    cv::Vec2f const after = above[i] * (1 - v) + below[i] * v;
    for (int k = 0; k < kGrid && x < places.size(); ++k, ++x) {
      float const u = static_cast<float>(k) / kGrid;
      places[x] = before * (1 - u) + after * u;
    }
    before = after;
  }
}

}  // namespace scanview
