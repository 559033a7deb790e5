#include "synth/scanner.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

#include "base/error.h"
#include "base/parallel.h"
#include "base/random.h"
#include "synth/disturbed_pose.h"
#include "synth/linear_color.h"
#include "synth/pixel_rays.h"
#include "synth/ray_scene.h"
#include "synth/surface_light.h"

namespace scanview {
namespace {

using Eigen::Isometry3d;
using Eigen::Vector3d;
using Eigen::Vector3f;

constexpr int kBandRows = 8;     // a task
constexpr int kSamplesSide = 4;  // rays a side of a pixel for colour

/// From the object's centre to the eye of a view, unit.
Vector3d eye_direction(SynthOptions const& options, int view) {
  if (options.layout == SynthOptions::Layout::circle) {
    double const azimuth = 2 * std::numbers::pi * view / options.views;
    double const elevation = options.elevation_deg * std::numbers::pi / 180;
    return {std::sin(azimuth) * std::cos(elevation), std::sin(elevation), std::cos(azimuth) * std::cos(elevation)};
  }
  double const y = 1 - (2.0 * view + 1) / options.views;
  double const r = std::sqrt(1 - y * y), azimuth = std::numbers::pi * (3 - std::sqrt(5.0)) * view;
  return {r * std::sin(azimuth), y, r * std::cos(azimuth)};
}

/// One focal length for all views: as long as the model stays within 94 % of every picture's width and height, and no
/// shorter than for 106° of view (of a camera inside the model or close to it, the picture shows a part).
Camera make_camera(SynthOptions const& options, CenteredModel const& model, std::vector<Isometry3d> const& poses,
                   Context& context) {
  double const half_width = 0.47 * options.width, half_height = 0.47 * options.height;
  std::vector<double> fits(poses.size());
  for_each_index(context, poses.size(), [&](std::size_t i) {
    Isometry3d const camera_from_model = poses[i].inverse() * Eigen::Translation3d(model.center);
    double f = std::numeric_limits<double>::infinity();
    for (auto const& vertex : model.vertices) {
      Vector3d const p = camera_from_model * vertex.cast<double>();
      double const z = std::max(p.z(), 0.0);
      f = std::min({f, half_width * z / std::abs(p.x()), half_height * z / std::abs(p.y())});
    }
    fits[i] = f;
  });
  double const widest = 0.75 * std::min(half_width, half_height);
  double f = widest;
  double const fit = *std::min_element(fits.begin(), fits.end());
  if (std::isfinite(fit)) f = std::max(f, fit);
  return Camera::perspective(options.width, options.height, f, f, 0.5 * (options.width - 1),
                             0.5 * (options.height - 1));
}

cv::Vec3b encoded(Vector3f const& linear, double noise_sigma, CounterRandom& random) {
  cv::Vec3d bgr = bgr_from_linear(linear);
  for (int c = 0; c < 3 && noise_sigma > 0; ++c) bgr[c] += noise_sigma * random.normal();
  return bgr;
}

void require(bool good, char const* what) {
  if (!good) throw Error(ErrorCode::usage, {}, what);
}

}  // namespace

void SynthOptions::validate() const {
  require(views >= 1 && views <= 100000, "views: must be 1 to 100000");
  require(width >= 1 && width <= 16384, "width: must be 1 to 16384");
  require(height >= 1 && height <= 16384, "height: must be 1 to 16384");
  require(elevation_deg >= -90 && elevation_deg <= 90, "elevation_deg: must be -90 to 90");
  require(distance > 0 && distance <= 1e4, "distance: must be above 0 and at most 10000 radii");
  disturbance.validate();
  require(noise.depth_sigma >= 0 && noise.depth_sigma <= 1,
          "noise.depth_sigma: must be 0 to 1 (a share of the radius)");
  require(noise.color_sigma >= 0 && noise.color_sigma <= 255, "noise.color_sigma: must be 0 to 255");
}

SynthResult synthesize(TriangleMesh const& model, SynthOptions const& options, Context& context) {
  options.validate();
  model.check();
  CenteredModel const object = centered(model);
  RayScene const scene(object.vertices, model.triangles);
  SurfaceLight light(object.vertices, model.triangles, model.colors);
  Vector3f const background = linear_from_hex(kSkyColor);

  double const noise_sigma = options.noise.depth_sigma * object.radius;
  double const sigma = std::hypot(noise_sigma, kSynthDepthFloor * object.radius);
  auto const pixels = static_cast<std::uint64_t>(options.width) * options.height;

  SynthResult result;
  result.radius = object.radius;
  result.set.unit = Unit::mm;
  result.set.center = object.center;
  result.set.error_budget.sampling = {sigma, 1.959964 * sigma};  // normal distribution
  for (int v = 0; v < options.views; ++v)
    result.true_poses.push_back(
        look_at(object.center + options.distance * object.radius * eye_direction(options, v), object.center));
  Camera const camera = make_camera(options, object, result.true_poses, context);
  for (int v = 0; v < options.views; ++v) {
    Isometry3d const& pose = result.true_poses[v];
    View view;
    view.name = fmt::format("{:03d}", v);
    view.image = empty_range_image(camera);
    view.image.color.create(options.height, options.width);
    view.image.classes.setTo(static_cast<int>(PixelClass::background));
    view.object_from_camera =
        v == 0 ? pose : disturbed_pose(pose, object, options.disturbance, CounterRandom(context.seed, v, pixels));
    result.set.views.push_back(std::move(view));
    result.true_depth.emplace_back(options.height, options.width, kMissing);
  }

  auto const bands = static_cast<std::size_t>((options.height + kBandRows - 1) / kBandRows);
  auto const for_each_pixel = [&](std::string const& stage, auto const& work) {
    for_each_index(
        context, bands * result.true_poses.size(),
        [&](std::size_t task) {
          std::size_t const v = task / bands;
          Isometry3d const& pose = result.true_poses[v];
          PixelRays const rays(scene, camera, pose.linear(), pose.translation() - object.center);
          int const first = static_cast<int>(task % bands) * kBandRows;
          for (int y = first; y < std::min(first + kBandRows, options.height); ++y)
            for (int x = 0; x < options.width; ++x) work(rays, v, x, y);
        },
        stage);
  };
  for_each_pixel("look", [&](PixelRays const& rays, std::size_t, int x, int y) {
    rays.for_each_sample(x, y, kSamplesSide, [&](RayHit const& hit, Vector3f const& direction) {
      if (hit.triangle >= 0) light.mark_seen(hit.triangle, direction);
    });
  });
  light.light(scene, static_cast<float>(object.radius), context, "light");
  for_each_pixel("scan", [&](PixelRays const& rays, std::size_t v, int x, int y) {
    CounterRandom random(context.seed, v, static_cast<std::uint64_t>(y) * options.width + x);
    RangeImage& image = result.set.views[v].image;
    RayHit const hit = rays.center_hit(x, y);
    float const depth = hit.triangle < 0 ? kMissing
                                         : static_cast<float>(exact_distance(object, model.triangles[hit.triangle], hit,
                                                                             rays.eye(), rays.direction(x, y)));
    result.true_depth[v](y, x) = depth;
    auto const measured = static_cast<float>(depth + noise_sigma * random.normal());
    if (measured > 0) {
      image.depth(y, x) = measured;
      image.sigma(y, x) = static_cast<float>(sigma);
      image.classes(y, x) = static_cast<uchar>(PixelClass::object);
    } else if (depth > 0) {
      image.classes(y, x) = static_cast<uchar>(PixelClass::no_depth);  // noise carried it behind the camera
    }
    Vector3f sum = Vector3f::Zero();
    rays.for_each_sample(x, y, kSamplesSide, [&](RayHit const& hit, Vector3f const& direction) {
      sum += hit.triangle < 0 ? background : light.leaving(hit, direction);
    });
    image.color(y, x) = encoded(sum / kPacket, options.noise.color_sigma, random);
  });
  for (View const& view : result.set.views) view.image.check();
  return result;
}

}  // namespace scanview
