#pragma once
#include <Eigen/Core>
#include <algorithm>

#include "calib/camera.h"
#include "synth/ray_scene.h"

namespace scanview {

/// The rays of a perspective camera's pixels, cast at a scene from an eye in the scene's coordinates. Directions have
/// z = 1 in the camera, so that a ray's parameter is the depth. The scene must outlive this.
class PixelRays {
 public:
  PixelRays(RayScene const& scene, Camera const& camera, Eigen::Matrix3d const& rotation, Eigen::Vector3d const& eye)
      : scene_(scene), camera_(camera), rotation_(rotation), eye_(eye) {}

  Eigen::Vector3d const& eye() const { return eye_; }
  Eigen::Vector3d direction(double u, double v) const { return rotation_ * camera_.ray_direction(u, v); }
  /// Of the ray through a pixel's centre.
  RayHit center_hit(int x, int y) const { return scene_.first_hit(eye_.cast<float>(), direction(x, y).cast<float>()); }

  /// Calls `work(x, hit)` for the rays through the centres of a row's pixels.
  template <class Work>
  void for_each_center(int y, Work const& work) const {
    RayDirections directions;
    for (int first = 0; first < camera_.width(); first += kPacket) {
      int const count = std::min(camera_.width() - first, kPacket);
      for (int i = 0; i < kPacket; ++i) directions[i] = direction(first + std::min(i, count - 1), y).cast<float>();
      auto const hits = scene_.first_hits(eye_.cast<float>(), directions);
      for (int i = 0; i < count; ++i) work(first + i, hits[i]);
    }
  }

  /// Calls `work(hit, direction)` for `side` x `side` rays spread evenly over a pixel, row by row.
  template <class Work>
  void for_each_sample(int x, int y, int side, Work const& work) const {
    RayDirections directions;
    for (int first = 0; first < side * side; first += kPacket) {
      int const count = std::min(side * side - first, kPacket);
      for (int i = 0; i < kPacket; ++i) {
        int const sample = first + std::min(i, count - 1);
        double const u = x + (sample % side + 0.5) / side - 0.5, v = y + (sample / side + 0.5) / side - 0.5;
        directions[i] = direction(u, v).cast<float>();
      }
      auto const hits = scene_.first_hits(eye_.cast<float>(), directions);
      for (int i = 0; i < count; ++i) work(hits[i], directions[i]);
    }
  }

 private:
  RayScene const& scene_;
  Camera camera_;
  Eigen::Matrix3d rotation_;
  Eigen::Vector3d eye_;
};

}  // namespace scanview
