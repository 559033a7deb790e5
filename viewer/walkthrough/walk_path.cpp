#include "viewer/walkthrough/walk_path.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include "base/error.h"

namespace scanview {
namespace {

using Eigen::Vector3d;

PathCamera looking(Vector3d const& eye, Vector3d const& heading, Vector3d const& up, Camera const& camera,
                   std::size_t index) {
  return {camera, look_at(eye, eye + heading, up), fmt::format("{:04}", index)};
}

}  // namespace

Camera walking_camera(int width, int height, double angle_deg) {
  double const focal = 0.5 * width / std::tan(angle_deg * std::numbers::pi / 360);
  return Camera::perspective(width, height, focal, focal, 0.5 * (width - 1), 0.5 * (height - 1));
}

std::vector<PathCamera> straight_walk(Vector3d const& from, Vector3d const& to, Vector3d const& heading,
                                      Vector3d const& up, double turn_deg, std::size_t frames, Camera const& camera) {
  std::vector<PathCamera> path;
  for (std::size_t i = 0; i < frames; ++i) {
    double const t = frames > 1 ? double(i) / double(frames - 1) : 0;
    Eigen::AngleAxisd const turn(t * turn_deg * std::numbers::pi / 180, up.normalized());
    path.push_back(looking((1 - t) * from + t * to, turn * heading, up, camera, i));
  }
  return path;
}

std::vector<PathCamera> walk_through(std::vector<Vector3d> const& places, Vector3d const& up, std::size_t frames,
                                     Camera const& camera) {
  if (places.empty()) throw Error(ErrorCode::usage, {}, "a walk needs at least one place");
  std::vector<double> length = {0};
  for (std::size_t i = 1; i < places.size(); ++i) length.push_back(length.back() + (places[i] - places[i - 1]).norm());
  auto const at = [&](double s) -> Vector3d {
    s = std::clamp(s, 0.0, length.back());
    std::size_t const next =
        std::min(std::size_t(std::upper_bound(length.begin(), length.end(), s) - length.begin()), places.size() - 1);
    if (next == 0 || length[next] == length[next - 1]) return places[next];
    double const t = (s - length[next - 1]) / (length[next] - length[next - 1]);
    return (1 - t) * places[next - 1] + t * places[next];
  };
  std::vector<PathCamera> path;
  double const ahead = places.size() > 1 ? length.back() / double(places.size() - 1) / 2 : 0;
  Vector3d heading = up.unitOrthogonal();
  for (std::size_t i = 0; i < frames; ++i) {
    double const s = frames > 1 ? length.back() * double(i) / double(frames - 1) : 0;
    Vector3d const way = at(s + ahead) - at(s);
    // Straight up and down says nothing about where to look; at the end of the way the last direction stays.
    Vector3d const level = way - way.dot(up) * up;
    if (level.norm() > 1e-3 * ahead && ahead > 0) heading = level.normalized();
    path.push_back(looking(at(s), heading, up, camera, i));
  }
  return path;
}

std::vector<Vector3d> tour(std::vector<Vector3d> const& places) {
  std::vector<Vector3d> left = places, result;
  while (!left.empty()) {
    auto next = left.begin();
    if (!result.empty())
      next = std::min_element(left.begin(), left.end(), [&](Vector3d const& a, Vector3d const& b) {
        return (a - result.back()).squaredNorm() < (b - result.back()).squaredNorm();
      });
    result.push_back(*next);
    left.erase(next);
  }
  return result;
}

std::vector<PathCamera> read_walk_path(std::filesystem::path const& file, int width, int height) {
  // 90 degrees of the shorter side, as framing_camera() has them for an eye outside of a sphere of 0.64 of its
  // distance.
  OrbitFrame const frame{Vector3d::UnitY(), Vector3d::UnitZ(), 1, std::sqrt(0.5) / 1.1};
  return read_camera_path(file, ScanSet{}, frame, width, height, PathMotion::straight);
}

}  // namespace scanview
