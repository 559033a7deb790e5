#include <fmt/format.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <chrono>
#include <cmath>
#include <limits>
#include <numeric>
#include <string_view>

#include "base/error.h"
#include "base/files.h"
#include "viewer/visibility/patch_choice.h"
#include "viewer/visibility/sampled_rows.h"
#include "viewer/visibility/visibility_field.h"

namespace scanview {
namespace {

/// Adaptive patches are made of patches of so many polygons; of large models of more, to stay within memory.
constexpr std::size_t kFinePolygons = 4, kMostFinePatches = 1 << 17;

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

Patches coarser_patches(Patches fine, std::vector<std::uint32_t> const& begins) {
  std::vector<std::uint32_t> triangles;
  for (std::uint32_t const begin : begins) triangles.push_back(fine.begins[begin]);
  fine.begins = std::move(triangles);
  return fine;
}

PatchHierarchy model_patches(PolygonModel const& model, VisibilityMethod method, std::size_t count) {
  TriangleMesh opaque;
  std::vector<std::int32_t> polygons;
  std::vector<std::uint32_t> from, transparent;
  opaque.vertices = model.mesh.vertices;
  for (std::size_t i = 0; i < model.mesh.triangles.size(); ++i) {
    if (!model.transparent.empty() && model.transparent[i] != 0) {
      transparent.push_back(static_cast<std::uint32_t>(i));
      continue;
    }
    auto const polygon_of = [&](std::size_t t) {
      return model.polygons.empty() ? static_cast<std::int32_t>(t) : model.polygons[t];
    };
    bool const same = !from.empty() && polygon_of(from.back()) == polygon_of(i);
    polygons.push_back(polygons.empty() ? 0 : polygons.back() + (same ? 0 : 1));
    from.push_back(static_cast<std::uint32_t>(i));
    opaque.triangles.push_back(model.mesh.triangles[i]);
  }
  PatchTree const tree(opaque, polygons);
  PatchHierarchy hierarchy = tree.hierarchy(method == VisibilityMethod::id ? tree.polygon_count() : count);
  if (transparent.empty()) return hierarchy;
  Patches& patches = hierarchy.fine;
  auto const opaque_count = static_cast<std::uint32_t>(patches.count());
  for (auto& triangle : patches.triangles) triangle = from[triangle];
  patches.triangles.insert(patches.triangles.end(), transparent.begin(), transparent.end());
  patches.begins.push_back(static_cast<std::uint32_t>(patches.triangles.size()));
  for (auto& fusion : hierarchy.fusions) {
    if (fusion.first >= opaque_count) ++fusion.first;
    if (fusion.second >= opaque_count) ++fusion.second;
  }
  return hierarchy;
}

VisibilityField build_visibility(PolygonModel const& model, VisibilityOptions const& options, Context& context,
                                 VisibilityTimes* times) {
  options.validate();
  auto const start = std::chrono::steady_clock::now();
  VisibilityField field;
  field.method = options.method;
  std::size_t const patches =
      options.patches > 0 ? options.patches : std::max<std::size_t>(1, model.polygon_count() / 64);
  bool const adaptive = options.cut == PatchCut::adaptive && options.method == VisibilityMethod::patch;
  field.fine_patches_asked =
      adaptive ? std::max(patches, std::min(model.polygon_count() / kFinePolygons, kMostFinePatches)) : patches;
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
  PatchHierarchy hierarchy = model_patches(model, options.method, field.fine_patches_asked);
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
  VisibilityOptions sampling = options;
  if (!adaptive) sampling.cut = PatchCut::even;
  SampledRows sampled =
      sample_rows(model, hierarchy, sampling, field.center, field.radius, cameras, row_of_camera, rows, context);
  if (adaptive) {
    field.fine_begins = choose_patches(hierarchy, sampled.cost, patches);
    field.rows = fuse_columns(sampled.bits, field.fine_begins);
  } else {
    field.fine_begins.resize(hierarchy.fine.count() + 1);
    std::iota(field.fine_begins.begin(), field.fine_begins.end(), 0U);
    field.rows = std::move(sampled.bits);
  }
  field.patches = coarser_patches(std::move(hierarchy.fine), field.fine_begins);
  if (times) {
    times->sampling = seconds_since(start) - times->patches;
    times->pictures = cameras.size();
  }
  return field;
}

}  // namespace scanview
