#include "viewer/visibility/sampled_rows.h"

#include <tbb/enumerable_thread_specific.h>

#include <algorithm>
#include <bit>
#include <numeric>

#include "base/parallel.h"
#include "viewer/visibility/triangle_planes.h"

namespace scanview {
namespace {

/// What a thread keeps while it draws.
struct Worker {
  TriangleSampler sampler;
  std::vector<std::uint8_t> is_seen;  // scratch of fill: a patch
};

/// Patches that share an edge.
std::vector<std::vector<std::uint32_t>> neighbor_patches(TriangleMesh const& drawn, Patches const& patches) {
  std::vector<std::int32_t> patch_of_triangle(drawn.triangles.size());
  for (std::size_t p = 0; p < patches.count(); ++p) {
    std::fill(patch_of_triangle.begin() + patches.begins[p], patch_of_triangle.begin() + patches.begins[p + 1],
              static_cast<std::int32_t>(p));
  }
  return polygon_neighbors(drawn, patch_of_triangle, patches.count());
}

}  // namespace

void sample_rows(PolygonModel const& model, VisibilityOptions const& options, std::vector<SampleCamera> const& cameras,
                 std::vector<std::size_t> const& row_of_camera, std::size_t rows, VisibilityField& field,
                 Context& context) {
  TriangleMesh mesh = drawn_mesh(model.mesh, field.patches);
  std::size_t const triangles = mesh.triangles.size();
  bool const has_transparent = std::find_if(model.transparent.begin(), model.transparent.end(),
                                            [](auto t) { return t != 0; }) != model.transparent.end();
  std::size_t const opaque = has_transparent ? field.patches.begins[field.patches.count() - 1] : triangles;
  TrianglePlanes const planes(mesh, field.center, field.radius);
  Eigen::AlignedBox3d bounds;
  for (auto const& vertex : mesh.vertices) bounds.extend(vertex.cast<double>());
  std::vector<std::vector<std::uint32_t>> neighbors;
  if (options.fill != 0) neighbors = neighbor_patches(mesh, field.patches);
  mesh.triangles.resize(opaque);
  std::vector<std::uint32_t> labels(opaque);
  std::iota(labels.begin(), labels.end(), 0U);
  RasterMesh const raster = raster_mesh(mesh, std::move(labels));
  std::vector<std::uint32_t> patch_of(triangles);
  for (std::size_t p = 0; p < field.patches.count(); ++p) {
    std::fill(patch_of.begin() + field.patches.begins[p], patch_of.begin() + field.patches.begins[p + 1],
              static_cast<std::uint32_t>(p));
  }

  field.rows = BitRows(rows, 2 * field.patches.count());
  tbb::enumerable_thread_specific<Worker> workers([&] { return Worker{TriangleSampler(raster, planes, bounds), {}}; });
  auto const look = [&](std::size_t i, std::size_t row) {
    Worker& worker = workers.local();
    SampleCamera const& camera = cameras[i];
    SeenTriangles const& seen = worker.sampler.sample(camera, options.seen);
    EyePoint const eye = planes.eye(camera);
    auto const take = [&](std::vector<std::uint64_t> const& triangles_seen, std::size_t side) {
      std::uint32_t last = ~0U;
      for (std::size_t w = 0; w < triangles_seen.size(); ++w) {
        for (std::uint64_t bits = triangles_seen[w]; bits != 0; bits &= bits - 1) {
          std::size_t const triangle = 64 * w + static_cast<std::size_t>(std::countr_zero(bits));
          if (patch_of[triangle] == last) continue;
          last = patch_of[triangle];
          field.rows.set(row, 2 * last + side);
        }
      }
    };
    take(seen.front, 0);
    take(seen.back, 1);
    if (options.fill != 0) {
      worker.is_seen.assign(field.patches.count(), 0);
      std::vector<std::uint32_t> front;
      for (std::uint32_t p = 0; p < field.patches.count(); ++p) {
        if (!field.rows.test(row, 2 * p) && !field.rows.test(row, 2 * p + 1)) continue;
        worker.is_seen[p] = 1;
        front.push_back(p);
      }
      auto const faces_camera = [&](std::uint32_t p) {
        for (std::size_t t = field.patches.begins[p]; t < field.patches.begins[p + 1]; ++t) {
          if (planes.cosine(t, eye) > 0) return true;
        }
        return false;
      };
      for (int ring = 0; ring != options.fill && !front.empty(); ++ring) {
        std::vector<std::uint32_t> next;
        for (std::uint32_t const p : front) {
          for (std::uint32_t const q : neighbors[p]) {
            if (worker.is_seen[q] != 0 || !faces_camera(q)) continue;
            worker.is_seen[q] = 1;
            field.rows.set(row, 2 * q);
            next.push_back(q);
          }
        }
        front = std::move(next);
      }
    }
    if (has_transparent) {
      for (std::size_t side : {0, 1}) field.rows.set(row, 2 * (field.patches.count() - 1) + side);
    }
  };
  // A row's cameras one after the other, rows side by side.
  std::vector<std::size_t> order(cameras.size());
  std::iota(order.begin(), order.end(), std::size_t{0});
  std::stable_sort(order.begin(), order.end(),
                   [&](std::size_t a, std::size_t b) { return row_of_camera[a] < row_of_camera[b]; });
  std::vector<std::size_t> begins;
  for (std::size_t k = 0; k < order.size(); ++k) {
    if (k == 0 || row_of_camera[order[k]] != row_of_camera[order[k - 1]]) begins.push_back(k);
  }
  begins.push_back(order.size());
  constexpr std::size_t kRowsATask = 8;
  std::size_t const sampled = begins.size() - 1;
  for_each_index(
      context, (sampled + kRowsATask - 1) / kRowsATask,
      [&](std::size_t task) {
        for (std::size_t r = task * kRowsATask; r < std::min((task + 1) * kRowsATask, sampled); ++r) {
          for (std::size_t k = begins[r]; k < begins[r + 1]; ++k) look(order[k], row_of_camera[order[k]]);
        }
      },
      "sampling");
}

}  // namespace scanview
