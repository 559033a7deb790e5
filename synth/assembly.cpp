#include "synth/assembly.h"

#include <algorithm>
#include <cmath>

#include "base/parallel.h"
#include "synth/distance_field.h"
#include "synth/isosurface.h"
#include "synth/paint.h"

namespace scanview {
namespace {

using Eigen::Vector3f;
using Eigen::Vector3i;

constexpr std::size_t kChunk = 1 << 13;  // vertices a task
constexpr float kCells = 24;             // of the index, along the longest side of the box

struct Nearest {
  float distance = 1e9f;
  std::size_t solid = 0;
};

/// Finds the nearest solid: a coarse grid over the box, each cell with all solids in the order of how near their
/// spheres can be to a point in it.
class SolidIndex {
 public:
  SolidIndex(std::vector<Solid> const& solids, Eigen::AlignedBox3f const& box)
      : solids_(solids), origin_(box.min()), cell_(box.sizes().maxCoeff() / kCells) {
    size_ = (box.sizes() / cell_).array().ceil().cast<int>().max(1);
    float const half_diagonal = 0.5f * cell_ * std::sqrt(3.0f);
    cells_.resize(static_cast<std::size_t>(size_.prod()));
    for (int z = 0; z < size_.z(); ++z)
      for (int y = 0; y < size_.y(); ++y)
        for (int x = 0; x < size_.x(); ++x) {
          std::vector<Candidate>& cell = cells_[index({x, y, z})];
          Vector3f const center = origin_ + cell_ * (Vector3f(x, y, z) + Vector3f::Constant(0.5f));
          for (std::size_t i = 0; i < solids.size(); ++i)
            cell.push_back({sphere_distance(center, solids[i].center, solids[i].radius) - half_diagonal, i});
          std::stable_sort(cell.begin(), cell.end(),
                           [](Candidate const& a, Candidate const& b) { return a.at_least < b.at_least; });
        }
  }

  Nearest nearest(Vector3f const& p) const {
    Vector3i const at = ((p - origin_) / cell_).array().floor().cast<int>();
    bool const within = (at.array() >= 0).all() && (at.array() < size_.array()).all();
    Nearest nearest;
    for (Candidate const& each : within ? cells_[index(at)] : cells_.front()) {
      if (within && each.at_least > nearest.distance) break;
      Solid const& solid = solids_[each.solid];
      if (sphere_distance(p, solid.center, solid.radius) > nearest.distance) continue;
      float const d = solid.distance(p);
      if (d < nearest.distance || (d == nearest.distance && each.solid < nearest.solid)) nearest = {d, each.solid};
    }
    return nearest;
  }

 private:
  struct Candidate {
    float at_least;  // its distance from any point in the cell
    std::size_t solid;
  };
  std::size_t index(Vector3i const& at) const {
    return (static_cast<std::size_t>(at.z()) * size_.y() + at.y()) * size_.x() + at.x();
  }
  std::vector<Solid> const& solids_;
  Vector3f origin_;
  float cell_;
  Vector3i size_;
  std::vector<std::vector<Candidate>> cells_;
};

}  // namespace

TriangleMesh make_assembly(std::vector<Solid> const& solids, Eigen::AlignedBox3f const& box, float spacing, float slack,
                           Context& context) {
  SolidIndex const index(solids, box);
  TriangleMesh mesh =
      polygonise([&](Vector3f const& p) { return index.nearest(p).distance; }, box, spacing, slack, context);
  mesh.colors.resize(mesh.vertices.size());
  for_each_index(context, (mesh.vertices.size() + kChunk - 1) / kChunk, [&](std::size_t chunk) {
    std::size_t const end = std::min(mesh.vertices.size(), (chunk + 1) * kChunk);
    for (std::size_t i = chunk * kChunk; i < end; ++i) {
      Vector3f const& p = mesh.vertices[i];
      mesh.colors[i] = bgr_from_paint(solids[index.nearest(p).solid].paint(p));
    }
  });
  return mesh;
}

}  // namespace scanview
