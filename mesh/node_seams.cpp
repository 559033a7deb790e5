#include "mesh/node_seams.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <numeric>
#include <optional>

namespace scanview {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;

/// One edge of a picture, walked with the picture at its right hand (y down); places along it count pixels, their
/// centres being whole, from −½ to count − ½.
struct Frame {
  Vector2d start;  ///< the corner of the picture where it begins
  Vector2d along, inward;
  int count = 0;
  int edge = 0;  ///< SideTriangulation::beyond

  Vector2d at(double place) const { return start + (place + 0.5) * along; }
  Eigen::Vector2i pixel(int i, int row) const {
    return (at(i) + (row + 0.5) * inward).array().round().cast<int>().matrix();
  }
  /// Of a place on it; nothing beside it.
  std::optional<double> place_of(Vector2d const& position) const {
    Vector2d const offset = position - start;
    if (offset.dot(inward) != 0) return std::nullopt;
    return offset.dot(along) - 0.5;
  }
};

Frame frame_of(Camera const& camera, int edge) {
  double const w = camera.width(), h = camera.height();
  switch (edge) {
    case 0:
      return {{-0.5, -0.5}, {1, 0}, {0, 1}, camera.width(), 0};
    case 1:
      return {{w - 0.5, -0.5}, {0, 1}, {-1, 0}, camera.height(), 1};
    case 2:
      return {{w - 0.5, h - 0.5}, {-1, 0}, {0, -1}, camera.width(), 2};
    default:
      return {{-0.5, h - 0.5}, {0, -1}, {1, 0}, camera.height(), 3};
  }
}

/// Two sides that share an edge: the second walks it backwards.
struct Seam {
  std::size_t side[2];
  Frame frame[2];
  int count = 0;
  int index(int which, int i) const { return which == 0 ? i : count - 1 - i; }
};

std::vector<Seam> find_seams(std::vector<SideTriangulation> const& sides) {
  struct Edge {
    std::size_t side;
    Frame frame;
    Vector3d from, to;
  };
  std::vector<Edge> edges;
  for (std::size_t s = 0; s < sides.size(); ++s)
    for (int e = 0; e < 4; ++e) {
      Frame const frame = frame_of(sides[s].camera, e);
      auto const ray = [&](double place) -> Vector3d {
        Vector2d const p = frame.at(place);
        return sides[s].node_from_camera * sides[s].camera.ray_direction(p.x(), p.y());
      };
      edges.push_back({s, frame, ray(-0.5), ray(frame.count - 0.5)});
    }
  constexpr double kSame = 1e-9;
  std::vector<Seam> seams;
  for (std::size_t i = 0; i < edges.size(); ++i)
    for (std::size_t j = i + 1; j < edges.size(); ++j) {
      Edge const &a = edges[i], &b = edges[j];
      if (a.frame.count != b.frame.count || (a.from - b.to).norm() > kSame || (a.to - b.from).norm() > kSame) continue;
      seams.push_back({{a.side, b.side}, {a.frame, b.frame}, a.frame.count});
    }
  return seams;
}

/// What one side sees along a seam, in the seam's order.
struct Profile {
  std::vector<double> depth;    ///< linear, at the edge; continued from the two pixels next to it
  std::vector<double> reach;    ///< by how much those two differ
  std::vector<char> is_object;  ///< a pixel
  std::vector<char> linked;     ///< pixel i with the next one
  std::vector<char> goes_on;    ///< pixel i with what lies beyond the edge
};

Profile profile_of(SideTriangulation const& side, Seam const& seam, int which) {
  Profile profile;
  for (int k = 0; k < seam.count; ++k) {
    int const i = seam.index(which, k);
    Eigen::Vector2i const p = seam.frame[which].pixel(i, 0), q = seam.frame[which].pixel(i, 1);
    double const near = side.field.depth(p.y(), p.x());
    auto const& beyond = side.beyond[std::size_t(seam.frame[which].edge)];
    double const next_side = beyond.empty() ? 0 : beyond[std::size_t(i)];
    double depth = next_side > 0 ? (near + next_side) / 2 : near, reach = 0;
    if (side.links.is_object(p.x(), p.y()) && side.links.is_object(q.x(), q.y()) &&
        side.links.linked(p.x(), p.y(), q.x(), q.y())) {
      reach = std::abs(near - side.field.depth(q.y(), q.x()));
      depth = std::max(1.5 * near - 0.5 * side.field.depth(q.y(), q.x()), 0.25 * near);
    }
    profile.depth.push_back(depth);
    profile.reach.push_back(reach);
    profile.is_object.push_back(side.links.is_object(p.x(), p.y()));
    bool linked = false;
    if (k + 1 < seam.count) {
      Eigen::Vector2i const next = seam.frame[which].pixel(seam.index(which, k + 1), 0);
      linked = side.links.is_object(p.x(), p.y()) && side.links.is_object(next.x(), next.y()) &&
               side.links.linked(p.x(), p.y(), next.x(), next.y());
    }
    profile.linked.push_back(linked);
    profile.goes_on.push_back(next_side > 0);
  }
  return profile;
}

/// A vertex on a seam; its depth may differ to the left and to the right, where a step is.
struct SeamVertex {
  double place;
  double left, right;  ///< linear depth; NaN: of no surface there
};

/// Places between the ends of a run where its line has to bend.
void bend(std::vector<double> const& depth, int first, int last, double tolerance, std::vector<int>& out) {
  if (last - first < 2) return;
  int worst = -1;
  double error = tolerance;
  for (int i = first + 1; i < last; ++i) {
    double const share = double(i - first) / (last - first);
    double const off = std::abs(depth[i] - ((1 - share) * depth[first] + share * depth[last]));
    if (off > error) {
      error = off;
      worst = i;
    }
  }
  if (worst < 0) return;
  bend(depth, first, worst, tolerance, out);
  out.push_back(worst);
  bend(depth, worst, last, tolerance, out);
}

/// The vertices that both sides get along a seam.
class SeamPlan {
 public:
  SeamPlan(SideTriangulation const& a, SideTriangulation const& b, Seam const& seam, double tolerance)
      : count_(seam.count), tolerance_(tolerance), profiles_{profile_of(a, seam, 0), profile_of(b, seam, 1)} {
    for (int i = 0; i < count_; ++i) {
      double const off = std::abs(profiles_[0].depth[i] - profiles_[1].depth[i]);
      double const allowed = std::max({tolerance, profiles_[0].reach[i], profiles_[1].reach[i]});
      bool const goes_on = profiles_[0].goes_on[i] && profiles_[1].goes_on[i];
      shared_.push_back(profiles_[0].is_object[i] && profiles_[1].is_object[i] && (goes_on || off <= allowed));
      if (!shared_[i]) continue;
      double const mean = (profiles_[0].depth[i] + profiles_[1].depth[i]) / 2;
      profiles_[0].depth[i] = profiles_[1].depth[i] = mean;
    }
    find_runs();
  }

  /// Of one side, in the seam's order, from end to end.
  std::vector<SeamVertex> vertices(int which) const {
    std::vector<SeamVertex> result;
    Profile const& profile = profiles_[which];
    for (std::size_t r = 0; r < runs_.size(); ++r) {
      auto const [first, last] = runs_[r];
      result.push_back(boundary(which, r));
      if (!profile.is_object[first]) continue;
      std::vector<int> bends;
      bend(profile.depth, first, last, tolerance_, bends);
      for (int const i : bends) result.push_back({double(i), profile.depth[i], profile.depth[i]});
    }
    result.push_back(boundary(which, runs_.size()));
    return result;
  }
  bool begins_shared() const { return shared_.front(); }
  bool ends_shared() const { return shared_.back(); }

 private:
  void find_runs() {
    int first = 0;
    for (int i = 0; i < count_; ++i) {
      bool const breaks =
          i + 1 == count_ || shared_[i] != shared_[i + 1] || !profiles_[0].linked[i] || !profiles_[1].linked[i];
      if (!breaks) continue;
      runs_.emplace_back(first, i);
      first = i + 1;
    }
  }

  /// The run's line continued by half a pixel beyond its end.
  double end_of(int which, std::size_t run, bool at_last) const {
    auto const [first, last] = runs_[run];
    std::vector<double> const& depth = profiles_[which].depth;
    int const end = at_last ? last : first, before = at_last ? last - 1 : first + 1;
    if (!profiles_[which].is_object[end]) return NAN;
    if (first == last) return depth[end];
    return std::max(depth[end] + 0.5 * (depth[end] - depth[before]), 0.25 * depth[end]);
  }

  /// Between run r − 1 and run r. A side that has no step there has one vertex: where the other has one, it closes it.
  SeamVertex boundary(int which, std::size_t r) const {
    SeamVertex vertex{r < runs_.size() ? runs_[r].first - 0.5 : count_ - 0.5, NAN, NAN};
    if (r > 0) vertex.left = end_of(which, r - 1, true);
    if (r < runs_.size()) vertex.right = end_of(which, r, false);
    if (r == 0) vertex.left = vertex.right;
    if (r == runs_.size()) vertex.right = vertex.left;
    if (r == 0 || r == runs_.size()) return vertex;
    int const at = runs_[r - 1].second;
    bool const left = shared_[at], right = shared_[at + 1];
    bool const is_whole = profiles_[which].linked[at], other_is_whole = profiles_[1 - which].linked[at];
    if (left && right && (is_whole || other_is_whole)) {
      vertex.left = vertex.right = (vertex.left + vertex.right) / 2;
    } else if (is_whole) {
      if (left == right) vertex.left = (vertex.left + vertex.right) / 2;
      (left || left == right ? vertex.right : vertex.left) = left || left == right ? vertex.left : vertex.right;
    }
    return vertex;
  }

  int count_;
  double tolerance_;
  Profile profiles_[2];
  std::vector<char> shared_;
  std::vector<std::pair<int, int>> runs_;  ///< first and last pixel
};

/// Splits the border along a frame at the places of the vertices and holds all vertices on it.
void hold_frame(DepthTriangulation& m, Frame const& frame, std::vector<SeamVertex> const& vertices) {
  struct BorderEdge {
    double from, to;
    int triangle, corner;
  };
  std::vector<BorderEdge> edges;
  for (int t = 0; t < int(m.triangles().size()); ++t) {
    if (!m.alive(t)) continue;
    for (int i = 0; i < 3; ++i) {
      if (m.triangle(t).next[i] >= 0) continue;
      auto const from = frame.place_of(m.vertex(m.triangle(t).vertex[(i + 1) % 3]).position);
      auto const to = frame.place_of(m.vertex(m.triangle(t).vertex[(i + 2) % 3]).position);
      if (from && to) edges.push_back({*from, *to, t, i});
    }
  }
  for (BorderEdge edge : edges) {
    for (SeamVertex const& vertex : vertices) {
      if (vertex.place < edge.from || vertex.place > edge.to) continue;
      DepthTriangulation::Triangle const& t = m.triangle(edge.triangle);
      if (vertex.place == edge.from) {
        if (!std::isnan(vertex.right)) m.hold(t.vertex[(edge.corner + 1) % 3], vertex.right);
      } else if (vertex.place == edge.to) {
        if (!std::isnan(vertex.left)) m.hold(t.vertex[(edge.corner + 2) % 3], vertex.left);
      } else if (!std::isnan(vertex.left)) {
        int const added = m.split_edge(edge.triangle, edge.corner, frame.at(vertex.place), vertex.left);
        m.hold(added, vertex.left);
        edge = {vertex.place, edge.to, int(m.triangles().size()) - 1, 0};
      }
    }
  }
}

/// The vertices in the seam's order as its second side walks it.
std::vector<SeamVertex> backwards(std::vector<SeamVertex> vertices, int count) {
  std::reverse(vertices.begin(), vertices.end());
  for (SeamVertex& v : vertices) v = {count - 1 - v.place, v.right, v.left};
  return vertices;
}

/// The ends of seams that meet in a corner: sides joined by shared ones agree.
struct Corner {
  struct End {
    std::size_t side[2];
    double depth[2];
    bool shared;
  };
  std::vector<End> ends;
  std::map<std::size_t, Vector2d> place_of_side;

  /// Linear depth of every side.
  std::map<std::size_t, double> depths() const {
    std::map<std::size_t, std::size_t> group;
    for (auto const& [side, place] : place_of_side) group[side] = side;
    for (End const& end : ends) {
      if (!end.shared) continue;
      std::size_t const from = group[end.side[1]], to = group[end.side[0]];
      for (auto& [side, of] : group)
        if (of == from) of = to;
    }
    struct Mean {
      double sum = 0;
      int count = 0;
    };
    std::map<std::size_t, std::array<Mean, 2>> means;  // of a group: over its shared seams; over the others
    for (End const& end : ends)
      for (int w = 0; w < 2; ++w) {
        if (std::isnan(end.depth[w])) continue;
        Mean& mean = means[group[end.side[w]]][end.shared ? 0 : 1];
        mean.sum += end.depth[w];
        ++mean.count;
      }
    std::map<std::size_t, double> result;
    for (auto const& [side, of] : group)
      for (Mean const& mean : means[of])
        if (mean.count > 0) {
          result[side] = mean.sum / mean.count;
          break;
        }
    return result;
  }
};

void hold_corner(DepthTriangulation& m, Vector2d const& place, double depth) {
  for (int v = 0; v < int(m.vertices().size()); ++v)
    if (m.vertex(v).triangle >= 0 && m.vertex(v).position == place) m.hold(v, depth);
}

}  // namespace

std::array<long, 3> seam_key(Camera const& camera, Eigen::Matrix3d const& node_from_camera, Vector2d const& place) {
  Vector3d ray = node_from_camera * camera.ray_direction(place.x(), place.y());
  ray /= ray.cwiseAbs().maxCoeff();
  std::array<long, 3> key;
  for (int c = 0; c < 3; ++c) key[c] = std::lround(std::ldexp(ray[c], 24));
  return key;
}

void join_seams(std::vector<SideTriangulation>& sides, double tolerance) {
  std::map<std::array<long, 3>, Corner> corners;
  for (Seam const& seam : find_seams(sides)) {
    SeamPlan const plan(sides[seam.side[0]], sides[seam.side[1]], seam, tolerance);
    std::vector<SeamVertex> const of[2] = {plan.vertices(0), plan.vertices(1)};
    hold_frame(sides[seam.side[0]].triangulation, seam.frame[0], of[0]);
    hold_frame(sides[seam.side[1]].triangulation, seam.frame[1], backwards(of[1], seam.count));
    for (bool const last : {false, true}) {
      double const place = last ? seam.count - 0.5 : -0.5;
      Corner::End end{{seam.side[0], seam.side[1]}, {}, last ? plan.ends_shared() : plan.begins_shared()};
      for (int w = 0; w < 2; ++w) end.depth[w] = last ? of[w].back().left : of[w].front().right;
      SideTriangulation const& first = sides[seam.side[0]];
      Corner& corner = corners[seam_key(first.camera, first.node_from_camera, seam.frame[0].at(place))];
      corner.ends.push_back(end);
      corner.place_of_side[seam.side[0]] = seam.frame[0].at(place);
      corner.place_of_side[seam.side[1]] = seam.frame[1].at(seam.count - 1 - place);
    }
  }
  for (auto const& [key, corner] : corners)
    for (auto const& [side, depth] : corner.depths())
      hold_corner(sides[side].triangulation, corner.place_of_side.at(side), depth);
}

std::size_t count_seam_vertices(std::vector<SideTriangulation> const& sides, double tolerance) {
  std::size_t count = 0;
  for (Seam const& seam : find_seams(sides))
    count += SeamPlan(sides[seam.side[0]], sides[seam.side[1]], seam, tolerance).vertices(0).size();
  return count;
}

}  // namespace scanview
