#include "viewer/ldi_scenes.h"

#include <cmath>

#include "base/srgb.h"

namespace scanview::test {

PlanePaint plain_paint(cv::Vec3b const& color) {
  return [=](Eigen::Vector3d const&) { return color; };
}

PlanePaint wavy_paint(double period) {
  return [=](Eigen::Vector3d const& p) {
    auto const wave = [&](double x) { return static_cast<uchar>(128 + 100 * std::sin(6.28 * x / period)); };
    return cv::Vec3b(wave(p.x() + 0.3 * p.z()), wave(p.y() - 0.2 * p.x()), wave(p.z() + 0.4 * p.y()));
  };
}

Eigen::Isometry3d toward(Eigen::Vector3d const& eye, Eigen::Vector3d const& target) {
  Eigen::Vector3d const forward = (target - eye).normalized();
  Eigen::Isometry3d pose = Eigen::Isometry3d::Identity();
  pose.linear().col(0) = forward.cross(Eigen::Vector3d::UnitY()).normalized();
  pose.linear().col(1) = forward.cross(pose.linear().col(0));
  pose.linear().col(2) = forward;
  pose.translation() = eye;
  return pose;
}

Camera square_view(int size) {
  return Camera::perspective(size, size, size / 2.0, size / 2.0, (size - 1) / 2.0, (size - 1) / 2.0);
}

View plane_view(std::string const& name, Camera const& camera, Eigen::Isometry3d const& object_from_camera,
                Eigen::Vector3d const& normal, double offset, PlanePaint const& paint) {
  View view;
  view.name = name;
  view.object_from_camera = object_from_camera;
  view.image = empty_range_image(camera);
  view.image.color.create(camera.height(), camera.width());
  view.image.color.setTo(cv::Scalar::all(0));
  for (int y = 0; y < camera.height(); ++y)
    for (int x = 0; x < camera.width(); ++x) {
      Eigen::Vector3d const origin = object_from_camera * camera.ray_origin(x, y);
      Eigen::Vector3d const ray = object_from_camera.linear() * camera.ray_direction(x, y);
      double const z = (offset - normal.dot(origin)) / normal.dot(ray);
      if (normal.dot(ray) >= 0 || !(z > 0)) continue;
      view.image.depth(y, x) = static_cast<float>(z);
      view.image.sigma(y, x) = static_cast<float>(1e-6 * z);
      view.image.classes(y, x) = static_cast<uchar>(PixelClass::object);
      view.image.color(y, x) = paint(origin + z * ray);
    }
  return view;
}

View panel_view(Eigen::Vector3d const& normal, Eigen::Vector3d const& middle, double half, double spacing,
                PlanePaint const& paint) {
  int const size = static_cast<int>(std::lround(2 * half / spacing));
  double const center = (size - 1) / 2.0;
  return plane_view("panel", Camera::orthographic(size, size, spacing, spacing, center, center),
                    toward(middle + 50 * normal, middle), normal, normal.dot(middle), paint);
}

View nearest_of(std::vector<View> const& views) {
  View all = views[0];
  for (View const& view : views)
    for (int y = 0; y < all.image.depth.rows; ++y)
      for (int x = 0; x < all.image.depth.cols; ++x) {
        if (!view.image.has_depth(x, y)) continue;
        if (all.image.has_depth(x, y) && all.image.depth(y, x) <= view.image.depth(y, x)) continue;
        all.image.depth(y, x) = view.image.depth(y, x);
        all.image.sigma(y, x) = view.image.sigma(y, x);
        all.image.classes(y, x) = view.image.classes(y, x);
        all.image.color(y, x) = view.image.color(y, x);
      }
  return all;
}

View corner_view(std::string const& name, int size, Eigen::Vector3d const& eye) {
  Camera const camera = square_view(size);
  Eigen::Isometry3d const pose = toward(eye, {-2, -1.5, -2});
  std::vector<View> planes;
  Eigen::Vector3d const offsets(-2, -1.5, -2);
  for (int k = 0; k < 3; ++k)
    planes.push_back(plane_view(name, camera, pose, Eigen::Vector3d::Unit(k), offsets[k], wavy_paint(1.5)));
  return nearest_of(planes);
}

double kept(int srgb) {
  double const root = std::round(255 * std::sqrt(linear_from_srgb8()[static_cast<std::size_t>(srgb)]));
  return 255 * srgb_from_linear(root * root / (255.0 * 255.0));
}

View pixel_view(Camera const& camera, Eigen::Isometry3d const& object_from_camera, float depth,
                cv::Vec3b const& color) {
  View view;
  view.name = "pixel";
  view.object_from_camera = object_from_camera;
  view.image = empty_range_image(camera);
  int const x = camera.width() / 2, y = camera.height() / 2;
  view.image.depth(y, x) = depth;
  view.image.sigma(y, x) = 1e-6F * depth;
  view.image.classes(y, x) = static_cast<uchar>(PixelClass::object);
  view.image.color.create(camera.height(), camera.width());
  view.image.color.setTo(cv::Scalar(color[0], color[1], color[2]));
  return view;
}

LdiBuilder builder_of(std::vector<View> const& views, LdiOptions const& options, int threads) {
  Context context;
  context.threads = threads;
  LdiBuilder builder(options);
  builder.add(views, context);
  return builder;
}

LdiTree tree_of(std::vector<View> const& views, LdiOptions const& options, int threads) {
  Context context;
  context.threads = threads;
  return builder_of(views, options, threads).build(Unit::m, context);
}

std::vector<PlacedPixel> pixels_of(LdiTree const& tree) {
  std::vector<PlacedPixel> all;
  for (LdiCell const& cell : tree.cells) {
    LdiPixels const p = tree.pixels(cell);
    for (LdiBlock const& block : tree.blocks(cell))
      for (std::uint32_t i = block.first; i < block.first + block.count; ++i) {
        PlacedPixel one;
        one.level = cell.key.level;
        one.face = block.face;
        one.kind = block.kind;
        int const axis = block.face / 2;
        Eigen::Vector3d steps;
        steps[(axis + 1) % 3] = p.x[i] + 0.5;
        steps[(axis + 2) % 3] = p.y[i] + 0.5;
        steps[axis] = p.depth[i] * double(tree.options.resolution) / 65536;
        one.at = ldi_corner(cell.key, tree.options.resolution) + ldi_step(cell.key.level) * steps;
        one.alpha = (p.color[i] >> 24) / 255.0;
        for (int c = 0; c < 3; ++c) one.linear[c] = std::pow((p.color[i] >> 8 * c & 255) / 255.0, 2);
        all.push_back(one);
      }
  }
  return all;
}

}  // namespace scanview::test
