#include "synth/model_camera.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numbers>
#include <utility>
#include <vector>

#include "base/error.h"
#include "base/parallel.h"
#include "synth/centered_model.h"
#include "synth/pixel_rays.h"

namespace scanview {
namespace {

using Eigen::Isometry3d;
using Eigen::Vector3d;
using Eigen::Vector3f;

constexpr int kBandRows = 4;                // a task
constexpr float kSigma = 1e-6f;             // of the depth
constexpr int kLookPackets = 38;            // directions of look_around, in packets
constexpr std::size_t kEdgeSamples = 4096;  // triangles whose edges tell how fine the model is

void require(bool good, char const* what) {
  if (!good) throw Error(ErrorCode::usage, {}, what);
}

/// Where single precision should have its zero: at the model's centre along the axes on which the model is far from 0
/// (there the difference is exact), else at 0, so that coordinates keep all their digits.
Vector3d exact_origin(Vector3d const& center, double radius) {
  Vector3d origin = Vector3d::Zero();
  for (int axis = 0; axis < 3; ++axis)
    if (std::abs(center[axis]) > 4 * radius) origin[axis] = static_cast<float>(center[axis]);
  return origin;
}

double median_edge(TriangleMesh const& mesh) {
  std::vector<double> edges;
  std::size_t const step = std::max<std::size_t>(1, mesh.triangles.size() / kEdgeSamples);
  for (std::size_t t = 0; t < mesh.triangles.size(); t += step)
    edges.push_back((mesh.vertices[mesh.triangles[t][1]] - mesh.vertices[mesh.triangles[t][0]]).norm());
  auto const middle = edges.begin() + static_cast<std::ptrdiff_t>(edges.size() / 2);
  std::nth_element(edges.begin(), middle, edges.end());
  return *middle;
}

template <class Work>
void for_each_row(Context& context, int height, Work const& work) {
  for_each_index(context, static_cast<std::size_t>((height + kBandRows - 1) / kBandRows), [&](std::size_t band) {
    int const first = static_cast<int>(band) * kBandRows;
    for (int y = first; y < std::min(first + kBandRows, height); ++y) work(y);
  });
}

}  // namespace

void ModelCameraOptions::validate() const {
  require(samples_side >= 1 && samples_side <= 64, "samples_side: must be 1 to 64");
  require(surface.directions >= kPacket && surface.directions <= 1 << 16 && surface.directions % kPacket == 0,
          "surface.directions: must be a multiple of 16, up to 65536");
  require(surface.exposure > 0 && std::isfinite(surface.exposure), "surface.exposure: must be above 0");
  require(surface.fill >= 0 && surface.fill <= 1, "surface.fill: must be 0 to 1");
  require(surface.fill_reach > 0 && std::isfinite(surface.fill_reach), "surface.fill_reach: must be above 0");
}

ModelCamera::ModelCamera(TriangleMesh model, ModelCameraOptions const& options, Context& context)
    : ModelCamera(PolygonModel{std::move(model), {}, {}, {}, {}}, options, context) {}

ModelCamera::ModelCamera(PolygonModel model, ModelCameraOptions const& options, Context& context)
    : mesh_(std::move(model.mesh)),
      textures_(std::move(model.textures)),
      options_(options),
      paint_(mesh_.triangles, mesh_.colors, textures_),
      background_(linear_from_hex(options.background)) {
  options_.validate();
  mesh_.check();
  textures_.check(mesh_.triangles.size());
  context.check_cancelled();
  Eigen::AlignedBox3d box;
  for (auto const& t : mesh_.triangles)
    for (int c = 0; c < 3; ++c) box.extend(mesh_.vertices[t[c]].cast<double>());
  double const radius = box.isEmpty() ? 0 : 0.5 * box.diagonal().norm();
  if (!(radius > 0)) throw Error(ErrorCode::bad_input, {}, "a model without triangles or extent: nothing to see");
  origin_ = exact_origin(box.center(), radius);
  if (!origin_.isZero(0))
    for (Vector3f& vertex : mesh_.vertices) vertex = (vertex.cast<double>() - origin_).cast<float>();
  scene_.emplace(mesh_.vertices, mesh_.triangles);
  if (options_.light == ModelCameraOptions::Light::painted) return;
  options_.surface.fill_reach *= static_cast<float>(radius);
  light_.emplace(mesh_.vertices, mesh_.triangles, paint_, options_.surface);
  // A fine model has details that shade each other at smaller distances.
  light_radius_ = static_cast<float>(std::clamp(40 * median_edge(mesh_), 4e-3 * radius, radius));
}

Vector3d ModelCamera::corner(int triangle, int which) const {
  return mesh_.vertices[mesh_.triangles[triangle][which]].cast<double>();
}

double ModelCamera::depth(RayHit const& hit, Vector3d const& eye, Vector3d const& direction,
                          Vector3d const& forward) const {
  std::array<Vector3d, 3> const corners = {corner(hit.triangle, 0), corner(hit.triangle, 1), corner(hit.triangle, 2)};
  double const exact = exact_distance(corners, hit, eye, direction, std::numeric_limits<double>::infinity());
  // A triangle that is seen edge-on has no plane to speak of, but corners.
  double low = std::numeric_limits<double>::infinity(), high = -low;
  for (Vector3d const& each : corners) {
    double const along = (each - eye).dot(forward);
    low = std::min(low, along);
    high = std::max(high, along);
  }
  return std::clamp(exact, low, high);
}

cv::Mat3b ModelCamera::picture(Camera const& camera, Isometry3d const& scene_from_camera, Context& context) {
  require(camera.is_perspective(), "the camera: must be perspective");
  PixelRays const rays(*scene_, camera, scene_from_camera.linear(), scene_from_camera.translation() - origin_);
  cv::Mat3b color(camera.height(), camera.width());
  cv::Mat1b waits(color.size());
  auto const take = [&](int x, int y) {
    Vector3f sum = Vector3f::Zero();
    waits(y, x) = 0;
    rays.for_each_sample(x, y, options_.samples_side, [&](RayHit const& hit, Vector3f const& direction) {
      if (hit.triangle < 0) {
        sum += background_;
      } else if (!light_) {
        sum += paint_.at(hit);
      } else if (light_->is_lit(hit.triangle, direction)) {
        sum += light_->leaving(hit, direction);
      } else {
        light_->mark_seen(hit.triangle, direction);
        waits(y, x) = 1;
      }
    });
    color(y, x) = bgr_from_linear(sum / static_cast<float>(options_.samples_side * options_.samples_side));
  };
  for_each_row(context, camera.height(), [&](int y) {
    for (int x = 0; x < camera.width(); ++x) take(x, y);
  });
  if (!light_) return color;
  light_->light(*scene_, light_radius_, context);
  for_each_row(context, camera.height(), [&](int y) {
    for (int x = 0; x < camera.width(); ++x)
      if (waits(y, x) != 0) take(x, y);
  });
  return color;
}

RangeImage ModelCamera::capture(Camera const& camera, Isometry3d const& scene_from_camera, Context& context) {
  RangeImage image = empty_range_image(camera);
  image.color = picture(camera, scene_from_camera, context);
  cv::Vec3b const sky = bgr_from_linear(background_);
  Vector3d const forward = scene_from_camera.linear().col(2);
  PixelRays const rays(*scene_, camera, scene_from_camera.linear(), scene_from_camera.translation() - origin_);
  for_each_row(context, camera.height(), [&](int y) {
    rays.for_each_center(y, [&](int x, RayHit const& hit) {
      if (hit.triangle < 0) {
        image.color(y, x) = sky;
        image.classes(y, x) = static_cast<uchar>(PixelClass::background);
        return;
      }
      auto const z = static_cast<float>(depth(hit, rays.eye(), rays.direction(x, y), forward));
      float const sigma = kSigma * z;
      if (!(sigma > 0)) return;  // the eye is on the surface
      image.depth(y, x) = z;
      image.sigma(y, x) = sigma;
      image.classes(y, x) = static_cast<uchar>(PixelClass::object);
    });
  });
  image.check();
  return image;
}

ModelCamera::Surroundings ModelCamera::look_around(Vector3d const& position) const {
  constexpr int kDirections = kLookPackets * kPacket;
  Vector3d const eye = position - origin_;
  Surroundings result{0, std::numeric_limits<double>::infinity()};
  for (int packet = 0; packet < kLookPackets; ++packet) {
    RayDirections directions;
    for (int i = 0; i < kPacket; ++i) {
      int const n = packet * kPacket + i;  // Fibonacci spiral
      double const y = 1 - (2.0 * n + 1) / kDirections, r = std::sqrt(1 - y * y);
      double const azimuth = std::numbers::pi * (3 - std::sqrt(5.0)) * n;
      directions[i] = Vector3d(r * std::sin(azimuth), y, r * std::cos(azimuth)).cast<float>();
    }
    auto const hits = scene_->first_hits(eye.cast<float>(), directions);
    for (int i = 0; i < kPacket; ++i) {
      int const t = hits[i].triangle;
      if (t < 0) continue;
      Vector3d const normal = (corner(t, 1) - corner(t, 0)).cross(corner(t, 2) - corner(t, 0));
      if (normal.dot(directions[i].cast<double>()) > 0) result.share_of_backs += 1.0 / kDirections;
      result.clearance = std::min(result.clearance, double{hits[i].distance});
    }
  }
  return result;
}

double ModelCamera::share_of_backs(Vector3d const& position) const { return look_around(position).share_of_backs; }

double ModelCamera::clearance(Vector3d const& position) const { return look_around(position).clearance; }

CapturedNode capture_node(ModelCamera& camera, Vector3d const& position, int size, std::string const& name,
                          Context& context) {
  if (camera.share_of_backs(position) > 0.5)
    throw Error(ErrorCode::bad_input, {},
                fmt::format("a node at ({:.6g}, {:.6g}, {:.6g}): this is inside an object", position.x(), position.y(),
                            position.z()));
  CapturedNode node;
  node.name = name;
  node.position = position;
  for (int side = 0; side < kCubeSides; ++side) {
    View view;
    view.name = cube_side_name(side);
    view.object_from_camera = scene_from_cube_side(side, position);
    view.image = camera.capture(cube_side_camera(size), *view.object_from_camera, context);
    node.sides.push_back(std::move(view));
  }
  node.check();
  return node;
}

}  // namespace scanview
