#include "viewer/visibility/solid_interior.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <numeric>

namespace scanview {
namespace {

using Eigen::Vector3f;

enum Kind : std::uint8_t { unknown, outside, surface, inside };

/// Squared distances along one line, in steps (Felzenszwalb and Huttenlocher 2012).
void lower_envelope(std::vector<float> const& from, std::vector<float>& to, std::vector<int>& parabola,
                    std::vector<float>& begins) {
  auto const n = static_cast<int>(from.size());
  parabola.resize(from.size());
  begins.resize(from.size() + 1);
  auto const value = [&](int i) { return from[static_cast<std::size_t>(i)]; };
  auto const crossing = [&](int a, int b) {
    return ((value(b) + static_cast<float>(b) * static_cast<float>(b)) -
            (value(a) + static_cast<float>(a) * static_cast<float>(a))) /
           static_cast<float>(2 * (b - a));
  };
  std::size_t last = 0;
  parabola[0] = 0;
  begins[0] = -std::numeric_limits<float>::infinity();
  begins[1] = std::numeric_limits<float>::infinity();
  for (int i = 1; i < n; ++i) {
    float s = crossing(parabola[last], i);
    while (s <= begins[last]) s = crossing(parabola[--last], i);
    parabola[++last] = i;
    begins[last] = s;
    begins[last + 1] = std::numeric_limits<float>::infinity();
  }
  std::size_t k = 0;
  for (int i = 0; i < n; ++i) {
    while (begins[k + 1] < static_cast<float>(i)) ++k;
    auto const d = static_cast<float>(i - parabola[k]);
    to[static_cast<std::size_t>(i)] = d * d + value(parabola[k]);
  }
}

}  // namespace

SolidInterior::SolidInterior(TriangleMesh const& mesh, int resolution) {
  Eigen::AlignedBox3f box;
  for (auto const& triangle : mesh.triangles) {
    for (int k = 0; k < 3; ++k) box.extend(mesh.vertices[static_cast<std::size_t>(triangle[k])]);
  }
  if (box.isEmpty()) return;
  voxel_ = std::max(box.sizes().maxCoeff() / static_cast<float>(resolution), std::numeric_limits<float>::min());
  // Two voxels around: the outside hangs together.
  low_ = box.min() - Vector3f::Constant(2.5F * voxel_);
  size_ = (box.sizes() / voxel_).array().ceil().cast<int>() + 6;
  kind_.assign(at(0, 0, size_.z()), unknown);
  close_holes(mesh);
  mark_surface();
  find_inside();
  measure_clearance();
}

void SolidInterior::close_holes(TriangleMesh const& mesh) {
  // Equal positions are one point.
  std::vector<std::size_t> order(mesh.vertices.size());
  std::iota(order.begin(), order.end(), std::size_t{0});
  auto const less = [&](std::size_t a, std::size_t b) {
    return std::lexicographical_compare(mesh.vertices[a].begin(), mesh.vertices[a].end(), mesh.vertices[b].begin(),
                                        mesh.vertices[b].end());
  };
  std::sort(order.begin(), order.end(), less);
  std::vector<std::size_t> point(mesh.vertices.size());
  for (std::size_t k = 0; k < order.size(); ++k)
    point[order[k]] = k > 0 && !less(order[k - 1], order[k]) ? point[order[k - 1]] : order[k];

  // The boundary as a chain: how often each edge is run along more in one direction than in the other.
  std::map<std::pair<std::size_t, std::size_t>, int> chain;
  for (auto const& triangle : mesh.triangles) {
    std::array<Vector3f, 3> corners;
    for (int k = 0; k < 3; ++k) {
      corners[static_cast<std::size_t>(k)] = mesh.vertices[static_cast<std::size_t>(triangle[k])];
      std::size_t const a = point[static_cast<std::size_t>(triangle[k])],
                        b = point[static_cast<std::size_t>(triangle[(k + 1) % 3])];
      if (a != b) chain[std::minmax(a, b)] += a < b ? 1 : -1;
    }
    triangles_.push_back(corners);
  }
  std::erase_if(chain, [](auto const& edge) { return edge.second == 0; });
  // Each part of the chain is closed by a fan about its middle.
  std::map<std::size_t, std::size_t> part;
  auto const find = [&](std::size_t v) {
    while (part.try_emplace(v, v).first->second != v) v = part[v] = part[part[v]];
    return v;
  };
  for (auto const& [edge, times] : chain) part[find(edge.first)] = find(edge.second);
  struct Hole {
    Vector3f sum = Vector3f::Zero();
    float count = 0, radius = 0;
  };
  std::map<std::size_t, Hole> holes;
  std::vector<std::size_t> members;
  for (auto const& [vertex, unused] : part) members.push_back(vertex);
  for (std::size_t const vertex : members) {
    Hole& hole = holes[find(vertex)];
    hole.sum += mesh.vertices[vertex];
    hole.count += 1;
  }
  for (std::size_t const vertex : members) {
    Hole& hole = holes[find(vertex)];
    hole.radius = std::max(hole.radius, (mesh.vertices[vertex] - hole.sum / hole.count).norm());
  }
  for (auto const& [edge, times] : chain) {
    Hole const& hole = holes[find(edge.first)];
    Vector3f const a = mesh.vertices[edge.first], b = mesh.vertices[edge.second];
    for (int k = 0; k < std::abs(times); ++k) {
      if (times > 0) {
        triangles_.push_back({b, a, hole.sum / hole.count});
      } else {
        triangles_.push_back({a, b, hole.sum / hole.count});
      }
    }
  }
  for (auto const& [unused, hole] : holes) windows_.push_back({hole.sum / hole.count, hole.radius + voxel_});
}

void SolidInterior::mark_surface() {
  for (auto const& corners : triangles_) {
    Eigen::AlignedBox3f box;
    for (auto const& corner : corners) box.extend(corner);
    // A touch more than the voxels it meets, for rounding.
    Eigen::Vector3i const low = ((box.min() - low_) / voxel_ - Vector3f::Constant(0.01F)).array().floor().cast<int>();
    Eigen::Vector3i const high = ((box.max() - low_) / voxel_ + Vector3f::Constant(0.01F)).array().floor().cast<int>();
    Vector3f const normal = (corners[1] - corners[0]).cross(corners[2] - corners[0]);
    float const reach = 0.51F * voxel_ * normal.lpNorm<1>();
    for (int z = std::max(low.z(), 0); z <= std::min(high.z(), size_.z() - 1); ++z) {
      for (int y = std::max(low.y(), 0); y <= std::min(high.y(), size_.y() - 1); ++y) {
        for (int x = std::max(low.x(), 0); x <= std::min(high.x(), size_.x() - 1); ++x) {
          Vector3f const middle =
              low_ + voxel_ * (Vector3f(static_cast<float>(x), static_cast<float>(y), static_cast<float>(z)) +
                               Vector3f::Constant(0.5F));
          if (std::abs(normal.dot(middle - corners[0])) <= reach) kind_[at(x, y, z)] = surface;
        }
      }
    }
  }
}

void SolidInterior::find_inside() {
  // The winding number along each row of voxels' middles, from what it crosses; places of triangles in its plane are
  // compared in double precision, an edge belongs to one of its sides.
  std::vector<std::int16_t> steps(kind_.size());  // of the winding number on the way into a voxel's middle
  for (auto const& corners : triangles_) {
    auto const c = [&](std::size_t k) -> Eigen::Vector3d {
      return ((corners[k] - low_) / voxel_).cast<double>() - Eigen::Vector3d::Constant(0.5);
    };
    Eigen::Vector3d a = c(0), b = c(1), d = c(2);
    double const area = (b.y() - a.y()) * (d.z() - a.z()) - (b.z() - a.z()) * (d.y() - a.y());
    if (area == 0) continue;
    if (area < 0) std::swap(b, d);
    int const y0 = std::max(static_cast<int>(std::ceil(std::min({a.y(), b.y(), d.y()}))), 0);
    int const y1 = std::min(static_cast<int>(std::floor(std::max({a.y(), b.y(), d.y()}))), size_.y() - 1);
    int const z0 = std::max(static_cast<int>(std::ceil(std::min({a.z(), b.z(), d.z()}))), 0);
    int const z1 = std::min(static_cast<int>(std::floor(std::max({a.z(), b.z(), d.z()}))), size_.z() - 1);
    auto const edge = [](Eigen::Vector3d const& from, Eigen::Vector3d const& to, double y, double z) {
      double const e = (to.y() - from.y()) * (z - from.z()) - (to.z() - from.z()) * (y - from.y());
      bool const owns = to.z() > from.z() || (to.z() == from.z() && to.y() < from.y());
      return e > 0 || (e == 0 && owns);
    };
    Eigen::Vector3d const normal = (b - a).cross(d - a);
    for (int z = z0; z <= z1; ++z) {
      for (int y = y0; y <= y1; ++y) {
        if (!edge(a, b, y, z) || !edge(b, d, y, z) || !edge(d, a, y, z)) continue;
        double const x = a.x() - (normal.y() * (y - a.y()) + normal.z() * (z - a.z())) / normal.x();
        int const next = std::clamp(static_cast<int>(std::ceil(x)), 0, size_.x() - 1);
        steps[at(next, y, z)] = static_cast<std::int16_t>(steps[at(next, y, z)] + (area > 0 ? 1 : -1));
      }
    }
  }
  // Voxels that hang together have one winding number: rounding may spoil a row, not most of them.
  std::vector<std::int32_t> winding(kind_.size());
  for (int z = 0; z < size_.z(); ++z) {
    for (int y = 0; y < size_.y(); ++y) {
      std::int32_t sum = 0;
      for (int x = 0; x < size_.x(); ++x) winding[at(x, y, z)] = sum += steps[at(x, y, z)];
    }
  }
  std::vector<Eigen::Vector3i> reached;
  for (std::size_t start = 0; start < kind_.size(); ++start) {
    if (kind_[start] != unknown) continue;
    auto const across = static_cast<std::size_t>(size_.x()), layer = across * static_cast<std::size_t>(size_.y());
    reached.assign(1, {static_cast<int>(start % across), static_cast<int>(start % layer / across),
                       static_cast<int>(start / layer)});
    kind_[start] = outside;
    std::size_t wound = 0;
    bool open = false;
    for (std::size_t k = 0; k < reached.size(); ++k) {
      Eigen::Vector3i const v = reached[k];
      if (winding[at(v.x(), v.y(), v.z())] != 0) ++wound;
      for (int axis = 0; axis < 3; ++axis) {
        for (int const step : {-1, 1}) {
          Eigen::Vector3i next = v;
          next[axis] += step;
          if (next[axis] < 0 || next[axis] >= size_[axis]) {
            open = true;
            continue;
          }
          std::uint8_t& kind = kind_[at(next.x(), next.y(), next.z())];
          if (kind != unknown) continue;
          kind = outside;
          reached.push_back(next);
        }
      }
    }
    if (open || 2 * wound <= reached.size()) continue;
    for (auto const& v : reached) kind_[at(v.x(), v.y(), v.z())] = inside;
  }
}

void SolidInterior::measure_clearance() {
  clearance_.resize(kind_.size());
  for (std::size_t i = 0; i < kind_.size(); ++i) clearance_[i] = kind_[i] == inside ? 1e12F : 0.0F;
  std::vector<float> line, out, begins;
  std::vector<int> parabola;
  std::size_t const strides[] = {1, static_cast<std::size_t>(size_.x()), at(0, 0, 1)};
  for (int axis = 0; axis < 3; ++axis) {
    int const u = (axis + 1) % 3, v = (axis + 2) % 3;
    line.resize(static_cast<std::size_t>(size_[axis]));
    out.resize(line.size());
    for (int j = 0; j < size_[v]; ++j) {
      for (int i = 0; i < size_[u]; ++i) {
        std::size_t const first = static_cast<std::size_t>(i) * strides[u] + static_cast<std::size_t>(j) * strides[v];
        for (std::size_t k = 0; k < line.size(); ++k) line[k] = clearance_[first + k * strides[axis]];
        lower_envelope(line, out, parabola, begins);
        for (std::size_t k = 0; k < line.size(); ++k) clearance_[first + k * strides[axis]] = out[k];
      }
    }
  }
  // Between the middles of two voxels; a point of one and a point of the other are nearer by at most a diagonal.
  for (float& c : clearance_) c = std::max(0.0F, (std::sqrt(c) - 1.7321F) * voxel_);
}

float SolidInterior::clearance(Vector3f const& p) const {
  if (kind_.empty()) return 0;
  Vector3f const place = (p - low_) / voxel_;
  if (!(place.minCoeff() >= 0)) return 0;
  Eigen::Vector3i const v = place.cast<int>();
  if ((v.array() >= size_.array()).any()) return 0;
  return clearance_[at(v.x(), v.y(), v.z())];
}

}  // namespace scanview
