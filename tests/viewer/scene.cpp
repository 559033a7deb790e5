#include "viewer/scene.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <opencv2/imgproc.hpp>

namespace scanview::test {
namespace {

std::uint8_t srgb(double x) {
  x = std::clamp(x, 0.0, 1.0);
  double const encoded = x <= 0.0031308 ? 12.92 * x : 1.055 * std::pow(x, 1 / 2.4) - 0.055;
  return static_cast<std::uint8_t>(std::lround(255 * encoded));
}

}  // namespace

Eigen::Vector3d paint(Eigen::Vector3d const& p) {
  auto const wave = [](double x) { return 0.5 + 0.5 * std::sin(x); };
  return {0.1 + 0.6 * wave(3 * p.x() + 1) + 0.2 * wave(40 * p.y()),
          0.1 + 0.6 * wave(4 * p.y() + 2) + 0.2 * wave(35 * p.z()),
          0.1 + 0.6 * wave(5 * p.z() + 3) + 0.2 * wave(45 * p.x())};
}

Surface sphere(Eigen::Vector3d const& center, double radius) {
  return [=](Eigen::Vector3d const& origin, Eigen::Vector3d const& direction) -> std::optional<Hit> {
    Eigen::Vector3d const from_center = origin - center;
    double const a = direction.squaredNorm(), b = from_center.dot(direction),
                 c = from_center.squaredNorm() - radius * radius;
    double const discriminant = b * b - a * c;
    if (discriminant < 0) return std::nullopt;
    double const t = (-b - std::sqrt(discriminant)) / a;
    if (t <= 0) return std::nullopt;
    return Hit{t, paint(from_center + t * direction)};
  };
}

Surface sheet(double z, double half, int side, Eigen::Vector3d const& color) {
  return [=](Eigen::Vector3d const& origin, Eigen::Vector3d const& direction) -> std::optional<Hit> {
    if (direction.z() * side >= 0) return std::nullopt;
    double const t = (z - origin.z()) / direction.z();
    Eigen::Vector3d const p = origin + t * direction;
    if (t <= 0 || std::abs(p.x()) > half || std::abs(p.y()) > half) return std::nullopt;
    return Hit{t, color};
  };
}

Surface together(std::vector<Surface> surfaces) {
  return [surfaces = std::move(surfaces)](Eigen::Vector3d const& origin, Eigen::Vector3d const& direction) {
    std::optional<Hit> nearest;
    for (auto const& surface : surfaces) {
      auto const hit = surface(origin, direction);
      if (hit && (!nearest || hit->t < nearest->t)) nearest = hit;
    }
    return nearest;
  };
}

Eigen::Isometry3d look_at(Eigen::Vector3d const& eye, Eigen::Vector3d const& target, Eigen::Vector3d const& up) {
  Eigen::Vector3d const forward = (target - eye).normalized();
  Eigen::Vector3d const right = forward.cross(up).normalized();
  Eigen::Isometry3d pose = Eigen::Isometry3d::Identity();
  pose.linear().col(0) = right;
  pose.linear().col(1) = forward.cross(right);
  pose.linear().col(2) = forward;
  pose.translation() = eye;
  return pose;
}

Eigen::Isometry3d around(double azimuth_deg, double elevation_deg, double distance) {
  constexpr double kDegree = std::numbers::pi / 180;
  double const a = azimuth_deg * kDegree, e = elevation_deg * kDegree;
  return look_at(distance * Eigen::Vector3d(std::cos(e) * std::sin(a), std::sin(e), std::cos(e) * std::cos(a)),
                 Eigen::Vector3d::Zero());
}

View capture(Surface const& surface, Camera const& camera, Eigen::Isometry3d const& object_from_camera,
             std::string const& name) {
  View view;
  view.name = name;
  view.object_from_camera = object_from_camera;
  view.image = empty_range_image(camera);
  view.image.color.create(camera.height(), camera.width());
  for (int y = 0; y < camera.height(); ++y) {
    for (int x = 0; x < camera.width(); ++x) {
      Eigen::Vector3d const direction = camera.ray_direction(x, y);
      auto const hit = surface(object_from_camera * camera.ray_origin(x, y), object_from_camera.linear() * direction);
      if (hit) {
        // Directions have z = 1 and origins z = 0, so the ray's parameter is the depth.
        view.image.depth(y, x) = static_cast<float>(hit->t);
        view.image.sigma(y, x) = 1e-3F;
        view.image.classes(y, x) = static_cast<std::uint8_t>(PixelClass::object);
        view.image.color(y, x) = {srgb(hit->color.z()), srgb(hit->color.y()), srgb(hit->color.x())};
      } else {
        view.image.classes(y, x) = static_cast<std::uint8_t>(PixelClass::background);
        view.image.color(y, x) = {255, 0, 255};  // what no picture may show
      }
    }
  }
  return view;
}

ViewMesh grid_mesh(View const& view, double step, int feather_px) {
  auto const& image = view.image;
  int const width = image.camera.width(), height = image.camera.height();
  ViewMesh result;
  result.camera = image.camera;
  cv::Mat1i index(height, width, -1);
  for (int y = 0; y < height; ++y) {
    for (int x = 0; x < width; ++x) {
      if (!image.has_depth(x, y)) continue;
      index(y, x) = static_cast<int>(result.mesh.vertices.size());
      result.mesh.vertices.push_back(image.point(x, y).cast<float>());
    }
  }
  auto const add = [&](cv::Point a, cv::Point b, cv::Point c) {
    auto const [low, high] = std::minmax({image.depth(a), image.depth(b), image.depth(c)});
    if (index(a) < 0 || index(b) < 0 || index(c) < 0 || !(high - low < step)) return;
    result.mesh.triangles.emplace_back(index(a), index(b), index(c));
    Eigen::Vector3d const pa = image.point(a.x, a.y), pb = image.point(b.x, b.y), pc = image.point(c.x, c.y);
    Eigen::Vector3d const normal = (pb - pa).cross(pc - pa).normalized();
    Eigen::Vector3d const to_camera = image.camera.is_perspective() ? Eigen::Vector3d(-(pa + pb + pc).normalized())
                                                                    : Eigen::Vector3d(-Eigen::Vector3d::UnitZ());
    result.cos_phi.push_back(static_cast<float>(std::max(0.0, normal.dot(to_camera))));
  };
  for (int y = 0; y + 1 < height; ++y) {
    for (int x = 0; x + 1 < width; ++x) {
      // The normal (b − a) × (c − a) points towards the camera.
      add({x, y}, {x, y + 1}, {x + 1, y});
      add({x + 1, y}, {x, y + 1}, {x + 1, y + 1});
    }
  }
  cv::Mat1b const inside = image.classes == static_cast<std::uint8_t>(PixelClass::object);
  cv::Mat1f distance;
  cv::Mat1b padded;
  cv::copyMakeBorder(inside, padded, 1, 1, 1, 1, cv::BORDER_CONSTANT, cv::Scalar(0));
  cv::distanceTransform(padded, distance, cv::DIST_L2, cv::DIST_MASK_PRECISE);
  result.feather.create(height, width);
  for (int y = 0; y < height; ++y) {
    for (int x = 0; x < width; ++x) {
      float const inner = std::clamp((distance(y + 1, x + 1) - 1) / static_cast<float>(feather_px), 0.0F, 1.0F);
      result.feather(y, x) = static_cast<std::uint8_t>(std::lround(255 * inner));
    }
  }
  return result;
}

Scene scan(Surface const& surface, Camera const& camera, std::vector<Eigen::Isometry3d> const& poses, double step,
           double threshold) {
  Scene scene;
  for (std::size_t i = 0; i < poses.size(); ++i) {
    scene.set.views.push_back(capture(surface, camera, poses[i], fmt::format("{:03}", i)));
    scene.meshes.push_back(grid_mesh(scene.set.views.back(), step));
  }
  scene.set.unit = Unit::arbitrary;
  scene.set.error_budget.sampling.p95 = threshold / 2;  // default_threshold()
  return scene;
}

std::unique_ptr<ViewBasedRenderer> make_renderer(BackEnd back_end, std::shared_ptr<ViewLibrary> library,
                                                 ViewBasedOptions const& options) {
  if (back_end == BackEnd::cpu) return make_cpu_renderer(std::move(library), options);
  static auto const context = make_offscreen_context();
  return make_gl_renderer(*context, std::move(library), options);
}

std::string back_end_name(testing::TestParamInfo<BackEnd> const& info) {
  return info.param == BackEnd::cpu ? "Cpu" : "OpenGl";
}

int greatest_difference(cv::Vec4b const& a, cv::Vec4b const& b) {
  int greatest = 0;
  for (int c = 0; c < 4; ++c) greatest = std::max(greatest, std::abs(a[c] - b[c]));
  return greatest;
}

cv::Mat3b bgr(cv::Mat4b const& picture) {
  cv::Mat3b result;
  cv::cvtColor(picture, result, cv::COLOR_BGRA2BGR);
  return result;
}

std::size_t drawn_pixels(cv::Mat4b const& picture) {
  std::size_t count = 0;
  for (auto const& pixel : picture) count += pixel[3] != 0;
  return count;
}

}  // namespace scanview::test
