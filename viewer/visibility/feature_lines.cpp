#include "viewer/visibility/feature_lines.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <numbers>
#include <tuple>

#include "base/error.h"
#include "mesh/equal_vertices.h"

namespace scanview {
namespace {

/// A triangle's side, its ends in ascending order.
struct HalfEdge {
  int low, high;
  std::uint32_t triangle;
  bool falls;  ///< runs from the high end to the low one
};

std::vector<HalfEdge> half_edges(TriangleMesh const& mesh) {
  std::vector<int> const place = first_of_equals(mesh.vertices);
  std::vector<HalfEdge> all;
  all.reserve(3 * mesh.triangles.size());
  for (std::size_t i = 0; i < mesh.triangles.size(); ++i) {
    int corners[3];
    for (int k = 0; k < 3; ++k) corners[k] = place[static_cast<std::size_t>(mesh.triangles[i][k])];
    // What lies beside a triangle of two corners meets without it.
    if (corners[0] == corners[1] || corners[1] == corners[2] || corners[2] == corners[0]) continue;
    for (int k = 0; k < 3; ++k) {
      int const from = corners[k], to = corners[(k + 1) % 3];
      all.push_back({std::min(from, to), std::max(from, to), static_cast<std::uint32_t>(i), from > to});
    }
  }
  std::sort(all.begin(), all.end(), [](HalfEdge const& a, HalfEdge const& b) {
    return std::tie(a.low, a.high, a.triangle) < std::tie(b.low, b.high, b.triangle);
  });
  return all;
}

TrianglePlanes planes_of(TriangleMesh const& mesh) {
  Eigen::AlignedBox3d box;
  for (auto const& vertex : mesh.vertices) box.extend(vertex.cast<double>());
  if (box.isEmpty()) return {mesh, Eigen::Vector3d::Zero(), 1};
  double const radius = 0.5 * box.diagonal().norm();
  return {mesh, box.center(), radius > 0 ? radius : 1};
}

}  // namespace

FeatureLines::FeatureLines(TriangleMesh const& drawn, double crease_angle) : planes_(planes_of(drawn)) {
  if (!(crease_angle >= 0 && crease_angle <= std::numbers::pi))
    throw Error(ErrorCode::usage, {}, "crease_angle: 0 to pi");
  auto const normal = [&](std::uint32_t i) { return Eigen::Vector3d(planes_.x[i], planes_.y[i], planes_.z[i]); };
  std::vector<HalfEdge> const halves = half_edges(drawn);
  double const least_cosine = std::cos(crease_angle);
  first_edge_.assign(drawn.triangles.size() + 1, 0);
  for (std::size_t begin = 0, end = 0; begin < halves.size(); begin = end) {
    HalfEdge const& first = halves[begin];
    while (end < halves.size() && halves[end].low == first.low && halves[end].high == first.high) ++end;
    ends_.emplace_back(first.low, first.high);
    first_side_.push_back(static_cast<std::uint32_t>(sides_.size()));
    for (std::size_t i = begin; i < end; ++i) {
      sides_.push_back({halves[i].triangle, i > begin && halves[i].falls == first.falls});
      ++first_edge_[halves[i].triangle + 1];
    }
    bool always = end - begin != 2;
    if (!always) {
      Eigen::Vector3d const a = normal(first.triangle), b = normal(halves[begin + 1].triangle);
      double const cosine = sides_.back().against ? -a.dot(b) : a.dot(b);
      always = !a.isZero() && !b.isZero() && cosine < least_cosine;
    }
    always_.push_back(always ? 1 : 0);
  }
  first_side_.push_back(static_cast<std::uint32_t>(sides_.size()));
  for (std::size_t i = 1; i < first_edge_.size(); ++i) first_edge_[i] += first_edge_[i - 1];
  edges_of_.resize(sides_.size());
  std::vector<std::uint32_t> next(first_edge_.begin(), first_edge_.end() - 1);
  for (std::size_t edge = 0; edge < ends_.size(); ++edge) {
    for (std::uint32_t s = first_side_[edge]; s < first_side_[edge + 1]; ++s)
      edges_of_[next[sides_[s].triangle]++] = static_cast<std::uint32_t>(edge);
  }
}

bool FeatureLines::shows(std::size_t edge, EyePoint const& eye) const {
  if (always_[edge] != 0) return true;
  Side const &a = sides_[first_side_[edge]], &b = sides_[first_side_[edge] + 1];
  auto const has_area = [&](std::uint32_t i) { return planes_.x[i] != 0 || planes_.y[i] != 0 || planes_.z[i] != 0; };
  if (!has_area(a.triangle) || !has_area(b.triangle)) return false;
  bool const a_faces = planes_.height(a.triangle, eye) > 0, b_faces = planes_.height(b.triangle, eye) > 0;
  return a_faces != (b_faces != b.against);
}

std::vector<Eigen::Vector2i> FeatureLines::lines(Eigen::Vector3d const& eye, std::span<IndexRange const> ranges) const {
  std::vector<std::uint8_t> chosen(first_edge_.size() - 1);
  for (IndexRange const& range : ranges)
    std::fill_n(chosen.begin() + static_cast<std::ptrdiff_t>(range.first), range.count, std::uint8_t{1});
  EyePoint const at = planes_.eye(eye);
  std::vector<Eigen::Vector2i> found;
  for (IndexRange const& range : ranges) {
    for (std::uint32_t triangle = range.first; triangle < range.first + range.count; ++triangle) {
      for (std::uint32_t e = first_edge_[triangle]; e < first_edge_[triangle + 1]; ++e) {
        std::uint32_t const edge = edges_of_[e];
        // Another triangle of the edge may have been here before.
        std::uint32_t first = first_side_[edge];
        while (chosen[sides_[first].triangle] == 0) ++first;
        if (sides_[first].triangle == triangle && shows(edge, at)) found.push_back(ends_[edge]);
      }
    }
  }
  return found;
}

}  // namespace scanview
