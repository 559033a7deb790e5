// Surface nets: S. Gibson, "Constrained elastic surface nets", MICCAI 1998, without the elastic part: a vertex starts
// at the mean of the crossings of its cell's edges and takes Newton steps onto the surface.
#include "synth/isosurface.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "base/parallel.h"

namespace scanview {
namespace {

using Eigen::Vector3f;
using Eigen::Vector3i;
using Distance = std::function<float(Vector3f const&)>;

constexpr int kBlock = 8;        // samples a side of the blocks that are skipped or halved
constexpr int kLeaf = 2;         // samples a side of those that are evaluated one by one
constexpr float kCloser = 1.5f;  // so much more slack for halves: the approximate distances that `slack` speaks of
                                 // are worst, relatively, close to the surface
constexpr std::size_t kChunk = 1 << 13;  // vertices a task

/// The corners of a cell: corner c is at (c & 1, c >> 1 & 1, c >> 2).
Vector3i corner_offset(int c) { return {c & 1, (c >> 1) & 1, c >> 2}; }

class Grid {
 public:
  Grid(Distance const& distance, Eigen::AlignedBox3f const& box, float spacing, float slack, Context& context)
      : origin_(box.min()), spacing_(spacing) {
    Vector3i const blocks = (box.sizes() / (spacing * kBlock)).array().ceil().cast<int>() + 1;
    size_ = blocks * kBlock;
    values_.assign(static_cast<std::size_t>(size_.x()) * size_.y() * size_.z(), 0.0f);
    for_each_index(context, static_cast<std::size_t>(blocks.z()), [&](std::size_t bz) {
      for (int by = 0; by < blocks.y(); ++by)
        for (int bx = 0; bx < blocks.x(); ++bx)
          fill(distance, slack, kBlock * Vector3i(bx, by, static_cast<int>(bz)), kBlock);
    });
  }

  Vector3i size() const { return size_; }
  float at(int x, int y, int z) const { return values_[index(x, y, z)]; }
  Vector3f point(Vector3f const& sample) const { return origin_ + spacing_ * sample; }

  /// Mean of the zero crossings of the edges of a cell.
  Vector3f mean_crossing(int x, int y, int z) const {
    std::array<float, 8> value;
    for (int c = 0; c < 8; ++c) value[c] = at(x + (c & 1), y + ((c >> 1) & 1), z + (c >> 2));
    Vector3f sum = Vector3f::Zero();
    int count = 0;
    for (int c = 0; c < 8; ++c)
      for (int axis = 0; axis < 3; ++axis) {
        int const d = c | (1 << axis);
        if (d == c || (value[c] < 0) == (value[d] < 0)) continue;
        Vector3f crossing = corner_offset(c).cast<float>();
        crossing[axis] = value[c] / (value[c] - value[d]);
        sum += crossing;
        ++count;
      }
    return point(Vector3f(x, y, z) + sum / static_cast<float>(count));
  }

 private:
  /// The samples of the cube of `side` samples from `first` on. Far from the surface its centre's value stands for all
  /// of them, for only their sign matters.
  void fill(Distance const& distance, float slack, Vector3i const& first, int side) {
    // A sample of a cell that the surface crosses lies within a cell's diagonal of the surface.
    float const reach = (side < kBlock ? kCloser : 1.0f) * slack * spacing_ * std::sqrt(3.0f) * (0.5f * side + 1.0f);
    float const centre = distance(point(first.cast<float>() + Vector3f::Constant(0.5f * (side - 1))));
    bool const near = std::abs(centre) < reach;
    if (near && side > kLeaf) {
      for (int c = 0; c < 8; ++c) fill(distance, slack, first + side / 2 * corner_offset(c), side / 2);
      return;
    }
    for (int z = first.z(); z < first.z() + side; ++z)
      for (int y = first.y(); y < first.y() + side; ++y)
        for (int x = first.x(); x < first.x() + side; ++x)
          values_[index(x, y, z)] = near ? distance(point(Vector3f(x, y, z))) : centre;
  }
  std::size_t index(int x, int y, int z) const { return (static_cast<std::size_t>(z) * size_.y() + y) * size_.x() + x; }
  Vector3f origin_;
  float spacing_;
  Vector3i size_;
  std::vector<float> values_;
};

/// Vertices and triangles of all cells, slice by slice.
class SurfaceNet {
 public:
  explicit SurfaceNet(Grid const& grid) : grid_(grid), size_(grid.size()) {
    std::size_t const slice = static_cast<std::size_t>(size_.x()) * size_.y();
    below_.assign(slice, -1);
    here_.assign(slice, -1);
    for (int z = 0; z + 1 < size_.z(); ++z) {
      add_vertices(z);
      add_quads(z);
      std::swap(below_, here_);
    }
  }
  TriangleMesh mesh;

 private:
  std::size_t at(int x, int y) const { return static_cast<std::size_t>(y) * size_.x() + x; }

  void add_vertices(int z) {
    for (int y = 0; y + 1 < size_.y(); ++y)
      for (int x = 0; x + 1 < size_.x(); ++x) {
        int inside = 0;
        for (int c = 0; c < 8; ++c) inside += grid_.at(x + (c & 1), y + ((c >> 1) & 1), z + (c >> 2)) < 0;
        if (inside == 0 || inside == 8) {
          here_[at(x, y)] = -1;
          continue;
        }
        here_[at(x, y)] = static_cast<int>(mesh.vertices.size());
        mesh.vertices.push_back(grid_.mean_crossing(x, y, z));
      }
  }

  /// The quadrilaterals around the grid edges that start at the samples of slice z; the cells around an edge are the
  /// four that share it, counter-clockwise seen from the edge's end.
  void add_quads(int z) {
    for (int y = 1; y + 1 < size_.y(); ++y)
      for (int x = 1; x + 1 < size_.x(); ++x) {
        bool const inside = grid_.at(x, y, z) < 0;
        if (z > 0 && inside != (grid_.at(x + 1, y, z) < 0))
          add_quad({below_[at(x, y - 1)], below_[at(x, y)], here_[at(x, y)], here_[at(x, y - 1)]}, !inside);
        if (z > 0 && inside != (grid_.at(x, y + 1, z) < 0))
          add_quad({below_[at(x - 1, y)], below_[at(x, y)], here_[at(x, y)], here_[at(x - 1, y)]}, inside);
        if (inside != (grid_.at(x, y, z + 1) < 0))
          add_quad({here_[at(x - 1, y - 1)], here_[at(x, y - 1)], here_[at(x, y)], here_[at(x - 1, y)]}, !inside);
      }
  }

  void add_quad(std::array<int, 4> q, bool flip) {
    if (flip) std::swap(q[1], q[3]);
    auto const squared = [&](int a, int b) { return (mesh.vertices[a] - mesh.vertices[b]).squaredNorm(); };
    if (squared(q[0], q[2]) <= squared(q[1], q[3])) {
      mesh.triangles.emplace_back(q[0], q[1], q[2]);
      mesh.triangles.emplace_back(q[0], q[2], q[3]);
    } else {
      mesh.triangles.emplace_back(q[0], q[1], q[3]);
      mesh.triangles.emplace_back(q[1], q[2], q[3]);
    }
  }

  Grid const& grid_;
  Vector3i size_;
  std::vector<int> below_, here_;  // vertex of each cell of the slices z - 1 and z, -1 where there is none
};

/// Newton steps along the gradient, kept within the vertex's own cell so that triangles do not fold at creases.
Vector3f onto_surface(Distance const& distance, Vector3f p, float spacing) {
  Vector3f const start = p;
  float const step = 0.1f * spacing, limit = 0.5f * spacing;
  for (int iteration = 0; iteration < 2; ++iteration) {
    float const d = distance(p);
    if (std::abs(d) < 1e-3f * spacing) break;
    Vector3f gradient;
    for (int axis = 0; axis < 3; ++axis) {
      Vector3f const e = step * Vector3f::Unit(axis);
      gradient[axis] = (distance(p + e) - distance(p - e)) / (2 * step);
    }
    float const squared = gradient.squaredNorm();
    if (!(squared > 0.05f)) break;
    p -= d / squared * gradient;
    p = start + (p - start).cwiseMax(-limit).cwiseMin(limit);
  }
  return p;
}

}  // namespace

TriangleMesh polygonise(Distance const& distance, Eigen::AlignedBox3f const& box, float spacing, float slack,
                        Context& context) {
  Grid const grid(distance, box, spacing, slack, context);
  TriangleMesh mesh = SurfaceNet(grid).mesh;
  for_each_index(context, (mesh.vertices.size() + kChunk - 1) / kChunk, [&](std::size_t chunk) {
    std::size_t const end = std::min(mesh.vertices.size(), (chunk + 1) * kChunk);
    for (std::size_t i = chunk * kChunk; i < end; ++i)
      mesh.vertices[i] = onto_surface(distance, mesh.vertices[i], spacing);
  });
  return mesh;
}

}  // namespace scanview
