#include <fmt/format.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <chrono>
#include <cmath>
#include <limits>
#include <string_view>

#include "base/error.h"
#include "base/files.h"
#include "viewer/visibility/sampled_rows.h"
#include "viewer/visibility/visibility_field.h"

namespace scanview {
namespace {

double seconds_since(std::chrono::steady_clock::time_point start) {
  return std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
}

/// The widest angle by which the line of sight to a point of the ball differs between an eye and one in the same
/// direction on the nearer of the shells around it.
double turn_between(std::vector<double> const& shells) {
  double widest = 0;
  for (std::size_t i = 0; i < shells.size(); ++i) {
    double const farther = i + 1 < shells.size() ? shells[i + 1] : std::numeric_limits<double>::infinity();
    widest = std::max(widest, (std::asin(1 / shells[i]) - std::asin(1 / farther)) / 2);
  }
  return widest;
}

}  // namespace

std::vector<double> VisibilityOptions::default_shells() { return {2, 3.3, std::numeric_limits<double>::infinity()}; }

void VisibilityOptions::validate() const {
  auto const require = [](bool holds, char const* text) {
    if (!holds) throw Error(ErrorCode::usage, {}, text);
  };
  if (cameras.empty()) SampleSphere::octahedron_level(samples);
  require(resolution >= 16 && resolution <= 16384, "resolution: 16 to 16384 pixels");
  require(widening >= 0 && widening <= 10, "widening: 0 to 10");
  require(fill >= -1, "fill: a number of times, or -1 for as long as there are any");
  require(!shells.empty(), "shells: at least one distance");
  for (std::size_t i = 0; i < shells.size(); ++i) {
    require(shells[i] > 1, "shells: distances of more than one radius");
    require(i == 0 || shells[i] > shells[i - 1], "shells: ascending distances");
  }
}

std::string model_hash(TriangleMesh const& mesh) {
  auto const bytes = [](auto const& list) {
    return std::string_view(reinterpret_cast<char const*>(list.data()), list.size() * sizeof(list[0]));
  };
  return hash_bytes(hash_bytes(bytes(mesh.vertices)) + hash_bytes(bytes(mesh.triangles)));
}

TriangleMesh drawn_mesh(TriangleMesh const& mesh, Patches const& patches) {
  TriangleMesh drawn;
  drawn.triangles.reserve(patches.triangles.size());
  // Vertices in the order of their first use: neighbours in the picture are neighbours in memory.
  std::vector<std::int32_t> place(mesh.vertices.size(), -1);
  for (std::uint32_t const triangle : patches.triangles) {
    Eigen::Vector3i corners;
    for (int k = 0; k < 3; ++k) {
      auto const vertex = static_cast<std::size_t>(mesh.triangles[triangle][k]);
      if (place[vertex] < 0) {
        place[vertex] = static_cast<std::int32_t>(drawn.vertices.size());
        drawn.vertices.push_back(mesh.vertices[vertex]);
        if (!mesh.colors.empty()) drawn.colors.push_back(mesh.colors[vertex]);
      }
      corners[k] = place[vertex];
    }
    drawn.triangles.push_back(corners);
  }
  return drawn;
}

Patches model_patches(PolygonModel const& model, VisibilityMethod method, std::size_t count) {
  if (model.transparent.empty()) {
    PatchTree const tree(model.mesh, model.polygons);
    return tree.cut(method == VisibilityMethod::id ? tree.polygon_count() : count);
  }
  TriangleMesh opaque;
  std::vector<std::int32_t> polygons;
  std::vector<std::uint32_t> from;
  for (std::size_t i = 0; i < model.mesh.triangles.size(); ++i) {
    if (model.transparent[i] != 0) continue;
    from.push_back(static_cast<std::uint32_t>(i));
    opaque.triangles.push_back(model.mesh.triangles[i]);
    std::int32_t const polygon = model.polygons.empty() ? static_cast<std::int32_t>(i) : model.polygons[i];
    bool const same = from.size() > 1 && !model.polygons.empty() && model.polygons[from[from.size() - 2]] == polygon;
    polygons.push_back(polygons.empty() ? 0 : polygons.back() + (same ? 0 : 1));
  }
  opaque.vertices = model.mesh.vertices;
  PatchTree const tree(opaque, polygons);
  Patches patches = tree.cut(method == VisibilityMethod::id ? tree.polygon_count() : count);
  for (auto& triangle : patches.triangles) triangle = from[triangle];
  std::size_t const opaque_count = patches.triangles.size();
  for (std::size_t i = 0; i < model.transparent.size(); ++i) {
    if (model.transparent[i] != 0) patches.triangles.push_back(static_cast<std::uint32_t>(i));
  }
  if (patches.triangles.size() > opaque_count)
    patches.begins.push_back(static_cast<std::uint32_t>(patches.triangles.size()));
  return patches;
}

VisibilityField build_visibility(PolygonModel const& model, VisibilityOptions const& options, Context& context,
                                 VisibilityTimes* times) {
  options.validate();
  auto const start = std::chrono::steady_clock::now();
  VisibilityField field;
  field.method = options.method;
  field.patches_asked = options.patches > 0 ? options.patches : std::max<std::size_t>(1, model.polygon_count() / 32);
  field.model_hash = model_hash(model.mesh);
  Eigen::AlignedBox3d box;
  for (auto const& triangle : model.mesh.triangles) {
    for (int k = 0; k < 3; ++k) box.extend(model.mesh.vertices[static_cast<std::size_t>(triangle[k])].cast<double>());
  }
  if (box.isEmpty() || !(box.diagonal().norm() > 0))
    throw Error(ErrorCode::usage, {}, "the model has no extent: nothing to be seen");
  field.center = box.center();
  for (auto const& triangle : model.mesh.triangles) {
    for (int k = 0; k < 3; ++k) {
      auto const vertex = model.mesh.vertices[static_cast<std::size_t>(triangle[k])].cast<double>();
      field.radius = std::max(field.radius, (vertex - field.center).norm());
    }
  }
  field.patches = model_patches(model, options.method, field.patches_asked);
  if (times) times->patches = seconds_since(start);

  SphereLookup lookup;
  lookup.opposite = options.opposite || options.method == VisibilityMethod::id;
  std::vector<SampleCamera> cameras;
  if (options.cameras.empty()) {
    lookup.sphere = SampleSphere::octahedron(SampleSphere::octahedron_level(options.samples));
    lookup.shells = options.shells;
  } else {
    std::vector<Eigen::Vector3d> directions;
    double nearest = std::numeric_limits<double>::infinity();
    for (auto const& camera : options.cameras) {
      directions.push_back(camera.object_from_camera.translation() - field.center);
      nearest = std::min(nearest, directions.back().norm() / field.radius);
    }
    lookup.sphere = SampleSphere::hull(directions);
    lookup.shells = {nearest};
    if (lookup.sphere.coverage() < 0.9999)
      context.warn(fmt::format("the cameras surround {:.1f} % of all directions; from the rest everything is drawn",
                               100 * lookup.sphere.coverage()));
  }
  double const off = options.widening * lookup.sphere.radius();
  double const turn = lookup.sphere.radius() + turn_between(lookup.shells);
  std::vector<std::size_t> row_of_camera;
  if (options.cameras.empty()) {
    for (double const shell : lookup.shells) {
      for (auto const& direction : lookup.sphere.directions()) {
        cameras.push_back(ball_camera(field.center, field.radius, direction, shell, options.resolution));
        cameras.back().movement = std::isfinite(shell) ? off * shell * field.radius : off;
        cameras.back().turn = turn;
        row_of_camera.push_back(row_of_camera.size());
      }
    }
  } else {
    cameras = options.cameras;
    row_of_camera = lookup.sphere.representative();
    for (auto& camera : cameras) {
      double const distance = (camera.object_from_camera.translation() - field.center).norm();
      camera.movement = camera.camera.is_perspective() ? off * distance : off;
      camera.turn = turn;
    }
  }
  std::size_t const rows = lookup.shells.size() * lookup.sphere.directions().size();
  field.lookup = std::move(lookup);
  sample_rows(model, options, cameras, row_of_camera, rows, field, context);
  if (times) {
    times->sampling = seconds_since(start) - times->patches;
    times->pictures = cameras.size();
  }
  return field;
}

}  // namespace scanview
