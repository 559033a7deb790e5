#include "range_scene.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <numbers>

#include "base/random.h"

namespace scanview::scene {

Solid blob() {
  auto const f = [](Eigen::Vector3d const& p) {
    double const bumps = 0.10 * std::sin(3.1 * p.x() + 0.5) * std::sin(2.7 * p.y()) +
                         0.08 * std::sin(4.3 * p.z() + p.x()) + 0.05 * std::sin(6.0 * p.y() - 2.0 * p.z());
    return p.norm() - 1.0 - bumps;
  };
  return {f, 2.3, {}};
}

Solid sphere() {
  return {[](Eigen::Vector3d const& p) { return p.norm() - 1.0; }, 1, {}};
}

Solid plane() {
  return {[](Eigen::Vector3d const& p) { return -p.z(); }, 1, {}};
}

Solid cylinder(Eigen::Vector3d const& axis) {
  return {[axis = axis.normalized().eval()](Eigen::Vector3d const& p) { return (p - axis.dot(p) * axis).norm() - 1.0; },
          1,
          {}};
}

Solid parallel_planes() {
  auto const f = [](Eigen::Vector3d const& p) {
    Eigen::Vector2d const beside(std::abs(p.z() + 0.5) - 0.001, p.x());
    double const sheet = beside.cwiseMax(0).norm() + std::min(0.0, beside.maxCoeff());
    return std::min(-p.z(), sheet);
  };
  return {f, 1, {}};
}

Solid corner() {
  // The rows are the planes' normals, towards the cameras.
  Eigen::Matrix3d normals;
  double const slant = 1 / std::sqrt(3.0);
  normals << std::sqrt(2.0 / 3), 0, -slant,         //
      -std::sqrt(1.0 / 6), std::sqrt(0.5), -slant,  //
      -std::sqrt(1.0 / 6), -std::sqrt(0.5), -slant;
  return {[normals](Eigen::Vector3d const& p) { return (normals * p).minCoeff(); }, 1, {}};
}

Eigen::Vector3d print(Eigen::Vector3d const& p) {
  double const coarse = std::sin(9 * p.x() + 1) * std::sin(8 * p.y()) + std::sin(10 * p.z() + 2 * p.x());
  double const fine = std::sin(23 * p.x()) * std::sin(19 * p.z() + 1) + std::sin(21 * p.y() + 7 * p.x());
  double const value = 128 + 45 * std::tanh(2 * coarse) + 35 * std::tanh(2 * fine);
  return {value, value, 0.9 * value};
}

Solid printed_box() {
  auto const f = [](Eigen::Vector3d const& p) {
    Eigen::Vector3d const q = p.cwiseAbs() - Eigen::Vector3d(0.7, 0.5, 0.9);
    return q.cwiseMax(0).norm() + std::min(0.0, q.maxCoeff());
  };
  return {f, 1, print};
}

RangeImage capture(Solid const& solid, Camera const& camera, Eigen::Isometry3d const& pose, Noise const& noise,
                   double far) {
  RangeImage image = empty_range_image(camera);
  image.color = cv::Mat3b(camera.height(), camera.width(), cv::Vec3b(0, 0, 0));
  for (int y = 0; y < camera.height(); ++y)
    for (int x = 0; x < camera.width(); ++x) {
      Eigen::Vector3d const origin = pose * camera.ray_origin(x, y);
      Eigen::Vector3d const ray = pose.linear() * camera.ray_direction(x, y);
      double const length = ray.norm();
      double z = 0;
      bool hit = false;
      for (int i = 0; i < 400 && z < far; ++i) {
        double const value = solid.f(origin + z * ray);
        if (value < 1e-9) {
          hit = true;
          break;
        }
        z += value / solid.slope / length;
      }
      if (!hit || z >= far) continue;
      CounterRandom random(noise.seed, static_cast<std::uint64_t>(y), static_cast<std::uint64_t>(x));
      if (random.uniform() < noise.missing) continue;
      Eigen::Vector3d const p = origin + z * ray;
      image.depth(y, x) = static_cast<float>(z + noise.depth * random.normal());
      image.sigma(y, x) = static_cast<float>(std::max(noise.depth, 1e-5));
      image.classes(y, x) = static_cast<std::uint8_t>(PixelClass::object);
      if (!solid.color) continue;
      Eigen::Vector3d const color = solid.color(p);
      for (int k = 0; k < 3; ++k)
        image.color(y, x)[k] =
            static_cast<uchar>(std::clamp(std::lround(color[k] + noise.color * random.normal()), 0L, 255L));
    }
  if (!solid.color) image.color = cv::Mat3b();
  return image;
}

Eigen::Isometry3d look_at_origin(Eigen::Vector3d const& eye) {
  Eigen::Vector3d const z = -eye.normalized();
  Eigen::Vector3d down(0, 1, 0);
  if (std::abs(z.dot(down)) > 0.99) down = Eigen::Vector3d(1, 0, 0);
  Eigen::Vector3d const x = down.cross(z).normalized();
  Eigen::Isometry3d pose = Eigen::Isometry3d::Identity();
  pose.linear() << x, z.cross(x), z;
  pose.translation() = eye;
  return pose;
}

ScanSet ring(Solid const& solid, int count, double height, Noise const& noise, bool orthographic) {
  ScanSet set;
  set.unit = Unit::m;
  Camera const camera = orthographic ? Camera::orthographic(160, 160, 0.017, 0.017, 79.5, 79.5)
                                     : Camera::perspective(160, 160, 220, 220, 79.5, 79.5);
  for (int i = 0; i < count; ++i) {
    double const angle = 2 * std::numbers::pi * i / count;
    View view;
    char name[16];
    std::snprintf(name, sizeof name, "%03d", i);
    view.name = name;
    view.object_from_camera = look_at_origin({4 * std::cos(angle), height, 4 * std::sin(angle)});
    Noise one = noise;
    one.seed = noise.seed * 1000 + static_cast<std::uint64_t>(i);
    view.image = capture(solid, camera, *view.object_from_camera, one);
    set.views.push_back(std::move(view));
  }
  return set;
}

ScanSet two_views(Solid const& solid, Noise noise) {
  ScanSet set;
  Camera const camera = Camera::perspective(120, 120, 200, 200, 59.5, 59.5);
  for (int i = 0; i < 2; ++i) {
    View view;
    view.name = std::string("00") + static_cast<char>('0' + i);
    view.object_from_camera = look_at_origin({i == 0 ? -0.3 : 0.3, 0.1, -4});
    noise.seed += 17;
    view.image = capture(solid, camera, *view.object_from_camera, noise);
    set.views.push_back(std::move(view));
  }
  return set;
}

std::vector<Eigen::Isometry3d> disturbed(std::vector<Eigen::Isometry3d> const& poses, double degrees, double length,
                                         std::uint64_t seed) {
  std::vector<Eigen::Isometry3d> result = poses;
  for (std::size_t i = 1; i < poses.size(); ++i) {
    CounterRandom random(seed, i);
    Eigen::Vector3d const axis = Eigen::Vector3d(random.normal(), random.normal(), random.normal()).normalized();
    Eigen::Vector3d const way = Eigen::Vector3d(random.normal(), random.normal(), random.normal()).normalized();
    Eigen::Isometry3d change = Eigen::Isometry3d::Identity();
    change.linear() = Eigen::AngleAxisd(degrees * std::numbers::pi / 180, axis).toRotationMatrix();
    change.translation() = length * way;
    result[i] = change * poses[i];
  }
  return result;
}

std::vector<Eigen::Isometry3d> poses_of(ScanSet const& set) {
  std::vector<Eigen::Isometry3d> poses;
  for (View const& view : set.views) poses.push_back(*view.object_from_camera);
  return poses;
}

void set_poses(ScanSet& set, std::vector<Eigen::Isometry3d> const& poses) {
  for (std::size_t i = 0; i < poses.size(); ++i) set.views[i].object_from_camera = poses[i];
}

}  // namespace scanview::scene
