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
#include "viewer/select/camera_path.h"
#include "viewer/visibility/hidden_cells.h"
#include "viewer/visibility/patch_choice.h"
#include "viewer/visibility/sampled_rows.h"
#include "viewer/visibility/visibility_field.h"

namespace scanview {
namespace {

/// Adaptive patches are made of patches of so many polygons; of large models of more, to stay within memory.
constexpr std::size_t kPolygonsAPatch = 64, kFinePolygons = 4, kMostFinePatches = 1 << 17;

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

std::size_t patches_wanted(PolygonModel const& model, VisibilityOptions const& options) {
  return options.patches > 0 ? options.patches : std::max<std::size_t>(1, model.polygon_count() / kPolygonsAPatch);
}

/// Every fine patch is a patch.
void take_all(Patches fine, VisibilityField& field) {
  field.fine_begins.resize(fine.count() + 1);
  std::iota(field.fine_begins.begin(), field.fine_begins.end(), 0U);
  field.patches = std::move(fine);
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
  require(!conservative || cameras.empty(), "conservative mode takes no cameras of its own");
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

VisibilityField field_of(PolygonModel const& model, VisibilityOptions const& options) {
  options.validate();
  VisibilityField field = field_ball(model);
  field.method = options.method;
  field.model_hash = model_hash(model.mesh);
  return field;
}

VisibilityField field_ball(PolygonModel const& model) {
  VisibilityField field;
  auto const for_each_corner = [&](auto const& use) {
    for (auto const& triangle : model.mesh.triangles) {
      for (int k = 0; k < 3; ++k) use(model.mesh.vertices[static_cast<std::size_t>(triangle[k])].cast<double>().eval());
    }
  };
  Eigen::AlignedBox3d box;
  for_each_corner([&](Eigen::Vector3d const& v) { box.extend(v); });
  if (box.isEmpty() || !(box.diagonal().norm() > 0))
    throw Error(ErrorCode::usage, {}, "the model has no extent: nothing to be seen");
  field.center = box.center();
  for_each_corner([&](Eigen::Vector3d const& v) { field.radius = std::max(field.radius, (v - field.center).norm()); });
  return field;
}

void sample_field(PolygonModel const& model, VisibilityOptions options, std::vector<SampleCamera> const& cameras,
                  std::vector<std::size_t> const& row_of_camera, std::size_t rows, VisibilityField& field,
                  Context& context, VisibilityTimes* times) {
  auto const start = std::chrono::steady_clock::now();
  std::size_t const patches = patches_wanted(model, options);
  if (options.method == VisibilityMethod::id) options.cut = PatchCut::even;
  bool const adaptive = options.cut == PatchCut::adaptive;
  field.fine_patches_asked =
      adaptive ? std::max(patches, std::min(model.polygon_count() / kFinePolygons, kMostFinePatches)) : patches;
  PatchHierarchy hierarchy = model_patches(model, options.method, field.fine_patches_asked);
  double const patch_seconds = seconds_since(start);
  SampledRows sampled =
      sample_rows(model, hierarchy, options, field.center, field.radius, cameras, row_of_camera, rows, context);
  if (adaptive) {
    field.fine_begins = choose_patches(hierarchy, sampled.cost, patches);
    field.rows = fuse_columns(sampled.bits, field.fine_begins);
    field.patches = coarser_patches(std::move(hierarchy.fine), field.fine_begins);
  } else {
    take_all(std::move(hierarchy.fine), field);
    field.rows = std::move(sampled.bits);
  }
  if (times) *times = {patch_seconds, seconds_since(start) - patch_seconds, cameras.size()};
}

namespace {

VisibilityField build_conservative(PolygonModel const& model, VisibilityOptions const& options, Context& context,
                                   VisibilityTimes* times) {
  auto const start = std::chrono::steady_clock::now();
  VisibilityField field = field_of(model, options);
  field.fine_patches_asked = patches_wanted(model, options);
  take_all(model_patches(model, options.method, field.fine_patches_asked).fine, field);
  double const patch_seconds = seconds_since(start);
  TriangleMesh const drawn = drawn_mesh(model.mesh, field.patches);
  auto const transparent = static_cast<std::size_t>(std::count(model.transparent.begin(), model.transparent.end(), 1));
  HiddenCellOptions cells;
  cells.nearest = options.shells.front();
  find_hidden_cells(field, drawn, drawn.triangles.size() - transparent,
                    SampleSphere::octahedron(SampleSphere::octahedron_level(options.samples)), cells, context);
  if (times) *times = {patch_seconds, seconds_since(start) - patch_seconds, 0};
  return field;
}

}  // namespace

VisibilityField build_visibility(PolygonModel const& model, VisibilityOptions const& options, Context& context,
                                 VisibilityTimes* times) {
  options.validate();
  if (options.conservative) return build_conservative(model, options, context, times);
  VisibilityField field = field_of(model, options);
  SphereLookup lookup;
  lookup.opposite = options.opposite || options.method == VisibilityMethod::id;
  std::vector<SampleCamera> cameras;
  std::vector<std::size_t> row_of_camera;
  if (options.cameras.empty()) {
    lookup.sphere = SampleSphere::octahedron(SampleSphere::octahedron_level(options.samples));
    lookup.shells = options.shells;
    for (double const shell : lookup.shells) {
      for (auto const& direction : lookup.sphere.directions()) {
        cameras.push_back(ball_camera(field.center, field.radius, direction, shell, options.resolution));
        row_of_camera.push_back(row_of_camera.size());
      }
    }
  } else {
    cameras = options.cameras;
    std::vector<Eigen::Vector3d> directions;
    double nearest = std::numeric_limits<double>::infinity();
    for (auto const& camera : cameras) {
      directions.push_back(camera.object_from_camera.translation() - field.center);
      nearest = std::min(nearest, directions.back().norm() / field.radius);
    }
    lookup.sphere = SampleSphere::hull(directions);
    lookup.shells = {nearest};
    row_of_camera = lookup.sphere.representative();
    if (lookup.sphere.coverage() < 0.9999)
      context.warn(fmt::format("the cameras surround {:.1f} % of all directions; from the rest everything is drawn",
                               100 * lookup.sphere.coverage()));
  }
  double const off = options.widening * lookup.sphere.radius();
  double const turn = lookup.sphere.radius() + turn_between(lookup.shells);
  for (auto& camera : cameras) {
    double const distance = (camera.object_from_camera.translation() - field.center).norm();
    camera.movement = camera.camera.is_perspective() ? off * distance : off;
    camera.turn = turn;
  }
  std::size_t const rows = lookup.shells.size() * lookup.sphere.directions().size();
  field.lookup = std::move(lookup);
  sample_field(model, options, cameras, row_of_camera, rows, field, context, times);
  return field;
}

VisibilityField build_path_visibility(PolygonModel const& model, std::vector<SampleCamera> cameras, std::size_t stretch,
                                      VisibilityOptions const& options, Context& context, VisibilityTimes* times) {
  if (cameras.empty() || stretch == 0)
    throw Error(ErrorCode::usage, {}, "a path of at least one frame, stretches of at least one");
  VisibilityField field = field_of(model, options);
  PathLookup lookup;
  lookup.stretch = stretch;
  std::vector<std::size_t> row_of_camera;
  for (std::size_t i = 0; i < cameras.size(); ++i) {
    lookup.eyes.push_back(cameras[i].object_from_camera.translation());
    row_of_camera.push_back(i / stretch);
  }
  std::size_t const rows = row_of_camera.back() + 1;
  field.lookup = std::move(lookup);
  sample_field(model, options, cameras, row_of_camera, rows, field, context, times);
  return field;
}

VisibilityField build_grid_visibility(PolygonModel const& model, Eigen::AlignedBox3d const& box,
                                      Eigen::Vector3i const& cells, VisibilityOptions const& options, Context& context,
                                      VisibilityTimes* times) {
  if (box.isEmpty() || cells.minCoeff() < 1 || cells.maxCoeff() > 1024)
    throw Error(ErrorCode::usage, {}, "a grid: a box that is not empty, 1 to 1024 cells a side");
  VisibilityField field = field_of(model, options);
  field.lookup = GridLookup{box, cells};
  double const middle = (options.resolution - 1) / 2.0, focal = options.resolution / 2.0;
  Camera const side = Camera::perspective(options.resolution, options.resolution, focal, focal, middle, middle);
  Eigen::Vector3d const cell = box.sizes().cwiseQuotient(cells.cast<double>());
  std::vector<SampleCamera> cameras;
  std::vector<std::size_t> row_of_camera;
  for (int z = 0; z < cells.z(); ++z) {
    for (int y = 0; y < cells.y(); ++y) {
      for (int x = 0; x < cells.x(); ++x) {
        std::size_t const row = cameras.size() / 6;
        Eigen::Vector3d const eye = box.min() + cell.cwiseProduct(Eigen::Vector3d(x + 0.5, y + 0.5, z + 0.5));
        for (int k = 0; k < 6; ++k) {
          Eigen::Vector3d const ahead = (k < 3 ? 1 : -1) * Eigen::Vector3d::Unit(k % 3);
          SampleCamera camera{side, look_at(eye, eye + ahead, Eigen::Vector3d::Unit((k + 1) % 3))};
          camera.movement = 0.5 * cell.norm();
          camera.turn = 1.5;  // inside a cell lines of sight turn any way
          cameras.push_back(camera);
          row_of_camera.push_back(row);
        }
      }
    }
  }
  sample_field(model, options, cameras, row_of_camera, cameras.size() / 6, field, context, times);
  return field;
}

}  // namespace scanview
