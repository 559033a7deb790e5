#include "viewer/visibility/sampled_rows.h"

#include <tbb/enumerable_thread_specific.h>

#include <algorithm>
#include <bit>
#include <numeric>

#include "base/parallel.h"
#include "viewer/visibility/triangle_planes.h"
#include "viewer/visibility/visibility_kernels.h"

namespace scanview {
namespace {

/// What a thread keeps while it draws.
struct Worker {
  TriangleSampler sampler;
  std::vector<std::uint8_t> is_seen;    // a patch: bit 0 its fronts, bit 1 its backs
  std::vector<std::uint64_t> in_front;  // a bit a triangle: the eye is before it
  std::vector<std::uint32_t> fronts;    // a node: triangles that the eye is before
  std::vector<std::uint64_t> cost;
};

/// What all threads read.
class Sampling {
 public:
  Sampling(PolygonModel const& model, PatchHierarchy const& hierarchy, VisibilityOptions const& options,
           Eigen::Vector3d const& center, double radius)
      : options_(options),
        hierarchy_(hierarchy),
        patches_(hierarchy.fine),
        mesh_(drawn_mesh(model.mesh, patches_)),
        planes_(mesh_, center, radius) {
    for (auto const& vertex : mesh_.vertices) bounds_.extend(vertex.cast<double>());
    has_transparent_ = std::find(model.transparent.begin(), model.transparent.end(), 1) != model.transparent.end();
    for (std::size_t p = 0; p < patches_.count(); ++p)
      triangles_of_node_.push_back(patches_.begins[p + 1] - patches_.begins[p]);
    for (auto const& [first, second] : hierarchy.fusions)
      triangles_of_node_.push_back(triangles_of_node_[first] + triangles_of_node_[second]);
    std::vector<std::int32_t> patch(mesh_.triangles.size());
    for (std::size_t p = 0; p < patches_.count(); ++p)
      std::fill(patch.begin() + patches_.begins[p], patch.begin() + patches_.begins[p + 1],
                static_cast<std::int32_t>(p));
    if (options.fill != 0) neighbors_ = polygon_neighbors(mesh_, patch, patches_.count());
    patch_of_ = std::move(patch);
    TriangleMesh opaque = mesh_;
    if (has_transparent_) opaque.triangles.resize(patches_.begins[patches_.count() - 1]);
    std::vector<std::uint32_t> labels(opaque.triangles.size());
    std::iota(labels.begin(), labels.end(), 0U);
    raster_ = raster_mesh(opaque, std::move(labels));
  }

  Worker worker() const {
    std::size_t const nodes = patches_.count() + hierarchy_.fusions.size();
    return {TriangleSampler(raster_, planes_, bounds_), std::vector<std::uint8_t>(nodes),
            std::vector<std::uint64_t>(mesh_.triangles.size() / 64 + 2), std::vector<std::uint32_t>(nodes),
            std::vector<std::uint64_t>(nodes)};
  }

  void look(SampleCamera const& camera, std::size_t row, Worker& worker, BitRows& rows) const {
    SeenTriangles const& seen = worker.sampler.sample(camera, options_.seen);
    EyePoint const eye = planes_.eye(camera);
    std::fill(worker.is_seen.begin(), worker.is_seen.end(), 0);
    mark(seen.front, 1, worker.is_seen);
    mark(seen.back, 2, worker.is_seen);
    if (options_.fill != 0) fill(eye, worker.is_seen);
    if (has_transparent_) worker.is_seen[patches_.count() - 1] = 3;
    for (std::size_t p = 0; p < patches_.count(); ++p) {
      if ((worker.is_seen[p] & 1) != 0) rows.set(row, 2 * p);
      if ((worker.is_seen[p] & 2) != 0) rows.set(row, 2 * p + 1);
    }
    if (options_.cut == PatchCut::adaptive) add_cost(eye, worker);
  }

 private:
  void mark(std::vector<std::uint64_t> const& seen, std::uint8_t side, std::vector<std::uint8_t>& is_seen) const {
    for (std::size_t w = 0; w < seen.size(); ++w) {
      for (std::uint64_t bits = seen[w]; bits != 0; bits &= bits - 1)
        is_seen[static_cast<std::size_t>(patch_of_[64 * w + static_cast<std::size_t>(std::countr_zero(bits))])] |= side;
    }
  }

  bool faces(std::size_t patch, EyePoint const& eye) const {
    for (std::size_t t = patches_.begins[patch]; t < patches_.begins[patch + 1]; ++t) {
      if (planes_.height(t, eye) > 0) return true;
    }
    return false;
  }

  void fill(EyePoint const& eye, std::vector<std::uint8_t>& is_seen) const {
    std::vector<std::uint32_t> reached;
    for (std::uint32_t p = 0; p < patches_.count(); ++p) {
      if (is_seen[p] != 0) reached.push_back(p);
    }
    for (int ring = 0; ring != options_.fill && !reached.empty(); ++ring) {
      std::vector<std::uint32_t> next;
      for (std::uint32_t const p : reached) {
        for (std::uint32_t const q : neighbors_[p]) {
          if (is_seen[q] != 0 || !faces(q, eye)) continue;
          is_seen[q] = 1;
          next.push_back(q);
        }
      }
      reached = std::move(next);
    }
  }

  void add_cost(EyePoint const& eye, Worker& worker) const {
    std::fill(worker.in_front.begin(), worker.in_front.end(), 0);
    facing_bits(planes_.arrays(), {eye.x, eye.y, eye.z, eye.w}, 1, 0, mesh_.triangles.size(), worker.in_front.data());
    std::size_t const fine = patches_.count();
    auto const pay = [&](std::size_t node) {
      std::uint32_t const fronts = worker.fronts[node];
      if ((worker.is_seen[node] & 1) != 0) worker.cost[node] += fronts;
      if ((worker.is_seen[node] & 2) != 0) worker.cost[node] += triangles_of_node_[node] - fronts;
    };
    for (std::size_t p = 0; p < fine; ++p) {
      std::size_t const begin = patches_.begins[p], end = patches_.begins[p + 1];
      std::uint32_t fronts = 0;
      for (std::size_t at = begin; at < end; at = (at / 64 + 1) * 64) {
        std::uint64_t bits = worker.in_front[at / 64] >> (at % 64);
        if (end < (at / 64 + 1) * 64) bits &= ~(~std::uint64_t{0} << (end - at));
        fronts += static_cast<std::uint32_t>(std::popcount(bits));
      }
      worker.fronts[p] = fronts;
      pay(p);
    }
    for (std::size_t j = 0; j < hierarchy_.fusions.size(); ++j) {
      auto const& [first, second] = hierarchy_.fusions[j];
      std::size_t const node = fine + j;
      worker.is_seen[node] = worker.is_seen[first] | worker.is_seen[second];
      worker.fronts[node] = worker.fronts[first] + worker.fronts[second];
      pay(node);
    }
  }

  VisibilityOptions const& options_;
  PatchHierarchy const& hierarchy_;
  Patches const& patches_;
  TriangleMesh mesh_;
  TrianglePlanes planes_;
  Eigen::AlignedBox3d bounds_;
  RasterMesh raster_;
  std::vector<std::int32_t> patch_of_;
  std::vector<std::vector<std::uint32_t>> neighbors_;
  bool has_transparent_ = false;
  std::vector<std::uint32_t> triangles_of_node_;
};

}  // namespace

SampledRows sample_rows(PolygonModel const& model, PatchHierarchy const& hierarchy, VisibilityOptions const& options,
                        Eigen::Vector3d const& center, double radius, std::vector<SampleCamera> const& cameras,
                        std::vector<std::size_t> const& row_of_camera, std::size_t rows, Context& context) {
  Sampling const sampling(model, hierarchy, options, center, radius);
  SampledRows result;
  result.bits = BitRows(rows, 2 * hierarchy.fine.count());
  tbb::enumerable_thread_specific<Worker> workers([&] { return sampling.worker(); });
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
  auto const work = [&](std::size_t task) {
    Worker& worker = workers.local();
    for (std::size_t r = task * kRowsATask; r < std::min((task + 1) * kRowsATask, sampled); ++r) {
      for (std::size_t k = begins[r]; k < begins[r + 1]; ++k)
        sampling.look(cameras[order[k]], row_of_camera[order[k]], worker, result.bits);
    }
  };
  for_each_index(context, (sampled + kRowsATask - 1) / kRowsATask, work, "sampling");
  result.cost.assign(hierarchy.fine.count() + hierarchy.fusions.size(), 0);
  for (Worker const& worker : workers) {
    for (std::size_t node = 0; node < result.cost.size(); ++node) result.cost[node] += worker.cost[node];
  }
  return result;
}

BitRows fuse_columns(BitRows const& bits, std::vector<std::uint32_t> const& begins) {
  std::vector<std::uint32_t> patch_of(bits.columns() / 2);
  for (std::size_t k = 0; k + 1 < begins.size(); ++k)
    std::fill(patch_of.begin() + begins[k], patch_of.begin() + begins[k + 1], static_cast<std::uint32_t>(k));
  BitRows fused(bits.rows(), 2 * (begins.size() - 1));
  for (std::size_t row = 0; row < bits.rows(); ++row) {
    std::size_t const rows[] = {row};
    bits.visit_union(rows, [&](std::size_t word, std::uint64_t set) {
      for (; set != 0; set &= set - 1) {
        std::size_t const column = 64 * word + static_cast<std::size_t>(std::countr_zero(set));
        fused.set(row, 2 * std::size_t{patch_of[column / 2]} + column % 2);
      }
    });
  }
  return fused;
}

}  // namespace scanview
