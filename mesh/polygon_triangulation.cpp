#include "mesh/polygon_triangulation.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cstdint>
#include <optional>
#include <utility>

namespace scanview {
namespace {

using Triangles = std::vector<Eigen::Vector3i>;

/// Twice the signed area of a triangle.
double turn(Eigen::Vector2d const& a, Eigen::Vector2d const& b, Eigen::Vector2d const& c) {
  Eigen::Vector2d const ab = b - a, ac = c - a;
  return ab.x() * ac.y() - ab.y() * ac.x();
}

/// The corners without the axis that the normal is nearest to, counter-clockwise; none where there is no normal.
std::vector<Eigen::Vector2d> flattened(std::vector<Eigen::Vector3d> const& corners) {
  Eigen::Vector3d normal = Eigen::Vector3d::Zero();
  for (std::size_t i = 1; i + 1 < corners.size(); ++i)
    normal += (corners[i] - corners[0]).cross(corners[i + 1] - corners[0]);
  int axis = 0;
  if (!(normal.cwiseAbs().maxCoeff(&axis) > 0)) return {};
  int u = (axis + 1) % 3, v = (axis + 2) % 3;
  if (normal[axis] < 0) std::swap(u, v);
  std::vector<Eigen::Vector2d> flat;
  for (Eigen::Vector3d const& corner : corners) flat.emplace_back(corner[u], corner[v]);
  return flat;
}

class EarCutter {
 public:
  explicit EarCutter(std::vector<Eigen::Vector2d> const& points)
      : points_(points), next_(points.size()), previous_(points.size()) {
    int const count = int(points.size());
    for (int i = 0; i < count; ++i) {
      next_[i] = (i + 1) % count;
      previous_[i] = (i + count - 1) % count;
    }
    tests_left_ = 100'000 + 1000 * std::int64_t(count);
  }

  /// Nothing where no ear is left: the polygon crosses itself.
  std::optional<Triangles> cut() {
    Triangles triangles;
    int at = 0, without = 0;
    Touching touching = Touching::hinders;
    for (int left = int(points_.size()); left > 3;) {
      int const before = previous_[at], after = next_[at];
      if (is_ear(before, at, after, touching)) {
        triangles.emplace_back(before, at, after);
        next_[before] = after;
        previous_[after] = before;
        --left;
        without = 0;
        touching = Touching::hinders;
      } else if (++without == left) {
        if (touching == Touching::allowed_last) return std::nullopt;
        touching = Touching::allowed_last;
        without = 0;
      }
      if (tests_left_ < 0) return std::nullopt;
      at = after;
    }
    triangles.emplace_back(previous_[at], at, next_[at]);
    return triangles;
  }

 private:
  /// Corners in a straight line, and corners on the border of an ear, wait until there is nothing else to cut.
  enum class Touching { hinders, allowed_last };

  bool is_ear(int a, int b, int c, Touching touching) {
    Eigen::Vector2d const &pa = points_[a], &pb = points_[b], &pc = points_[c];
    bool const strict = touching == Touching::hinders;
    double const area = turn(pa, pb, pc);
    if (strict ? area <= 0 : area < 0) return false;
    for (int v = next_[c]; v != a; v = next_[v]) {
      --tests_left_;
      Eigen::Vector2d const& p = points_[v];
      if (p == pa || p == pb || p == pc) continue;  // a hole is joined to the outside by a doubled edge
      double const least = std::min({turn(pa, pb, p), turn(pb, pc, p), turn(pc, pa, p)});
      if (strict ? least >= 0 : least > 0) return false;
    }
    return true;
  }

  std::vector<Eigen::Vector2d> const& points_;
  std::vector<int> next_, previous_;
  std::int64_t tests_left_ = 0;
};

Triangles fan(int count) {
  Triangles triangles;
  for (int k = 1; k + 1 < count; ++k) triangles.emplace_back(0, k, k + 1);
  return triangles;
}

}  // namespace

Triangles triangulate_polygon(std::vector<Eigen::Vector3d> const& corners) {
  int const count = int(corners.size());
  std::vector<Eigen::Vector2d> const flat = count > 3 ? flattened(corners) : std::vector<Eigen::Vector2d>();
  bool convex = true;
  for (std::size_t i = 0; i < flat.size() && convex; ++i)
    convex = turn(flat[i], flat[(i + 1) % count], flat[(i + 2) % count]) >= 0;
  if (convex) return fan(count);
  return EarCutter(flat).cut().value_or(fan(count));
}

}  // namespace scanview
