#include "viewer/select/view_sphere.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <numbers>
#include <string>

#include "base/error.h"
#include "viewer/select/sphere_hull.h"

namespace scanview {
namespace {

using Eigen::Vector3d;
using Eigen::Vector3i;

constexpr double kSameDirection = 1e-6;  ///< radians
constexpr double kCoplanar = 1e-6;
/// Of the widest cap that needs no virtual corner; and of one that touches a virtual corner already: there another
/// would only spoil the symmetry of a turntable, as long as the centre stays well inside the hull.
double const kEmptyCap = std::cos(55.0 * std::numbers::pi / 180.0);
double const kEmptyCapAtVirtual = std::cos(80.0 * std::numbers::pi / 180.0);
constexpr double kRealShare = 0.35;  ///< below it weights fade into the virtual corner's mixture

/// Cosine of the radius of a face's empty cap: the distance of its plane from the centre (negative: centre outside).
double cap_cosine(std::vector<Vector3d> const& corners, Vector3i const& face, Vector3d& normal) {
  Vector3d const& a = corners[static_cast<std::size_t>(face[0])];
  normal = (corners[static_cast<std::size_t>(face[1])] - a)
               .cross(corners[static_cast<std::size_t>(face[2])] - a)
               .normalized();
  return normal.dot(a);
}

/// Adds directions until the hull is a solid; most sets need none.
void make_solid(std::vector<Vector3d>& corners) {
  auto const farthest = [&](auto const& distance) {
    std::size_t best = 0;
    for (std::size_t i = 0; i < corners.size(); ++i) {
      if (distance(corners[i]) > distance(corners[best])) best = i;
    }
    return best;
  };
  Vector3d const a = corners[0];
  Vector3d b = corners[farthest([&](Vector3d const& p) { return (p - a).norm(); })];
  if ((b - a).norm() <= kCoplanar) {
    b = -a;
    corners.push_back(b);
  }
  Vector3d line = (b - a).normalized();
  auto const from_line = [&](Vector3d const& p) { return (p - a).cross(line).norm(); };
  Vector3d c = corners[farthest(from_line)];
  if (from_line(c) <= kCoplanar) {
    Vector3d const middle = a + b;
    c = middle.norm() > kCoplanar ? Vector3d(-middle.normalized()) : a.unitOrthogonal();
    corners.push_back(c);
  }
  Vector3d normal = line.cross(c - a).normalized();
  if (normal.dot(a) < 0) normal = -normal;
  auto const from_plane = [&](Vector3d const& p) { return std::abs((p - a).dot(normal)); };
  if (from_plane(corners[farthest(from_plane)]) <= kCoplanar) {
    corners.push_back(-normal);
    if (normal.dot(a) < kEmptyCap) corners.push_back(normal);
  }
}

}  // namespace

ViewSphere::ViewSphere(std::vector<Vector3d> const& directions) {
  if (directions.empty()) throw Error(ErrorCode::bad_input, {}, "view sphere: no views");
  for (std::size_t i = 0; i < directions.size(); ++i) {
    double const length = directions[i].stableNorm();
    if (!std::isfinite(length) || length == 0) {
      throw Error(ErrorCode::bad_input, {}, "view sphere: view " + std::to_string(i) + " has no direction");
    }
    Vector3d const direction = (directions[i] / length).normalized();
    std::size_t at = 0;
    while (at < corners_.size() && (corners_[at] - direction).norm() > kSameDirection) ++at;
    if (at == corners_.size()) {
      corners_.push_back(direction);
      views_at_.emplace_back();
    }
    views_at_[at].push_back(i);
  }
  fill_caps();
  mix_for_virtual_corners();
  link_faces();
  for (auto const& face : faces_) {
    if (face.maxCoeff() >= static_cast<int>(views_at_.size())) continue;
    Vector3i triangle;
    for (int k = 0; k < 3; ++k) triangle[k] = static_cast<int>(views_at_[static_cast<std::size_t>(face[k])].front());
    triangles_.push_back(triangle);
  }
}

void ViewSphere::fill_caps() {
  make_solid(corners_);
  for (;;) {
    faces_ = sphere_hull(corners_);
    double widest = std::numeric_limits<double>::infinity();
    Vector3d middle = Vector3d::Zero();
    for (auto const& face : faces_) {
      Vector3d normal;
      double const cosine = cap_cosine(corners_, face, normal);
      bool const at_virtual = face.maxCoeff() >= static_cast<int>(views_at_.size());
      // A little slack: caps that are equal but for rounding are filled in the order of the faces.
      if (cosine < (at_virtual ? kEmptyCapAtVirtual : kEmptyCap) && cosine < widest - 1e-9) {
        widest = cosine;
        middle = normal;
      }
    }
    if (std::isinf(widest)) return;
    // Every new corner is more than 55 degrees from all others: there can be no more than a dozen.
    corners_.push_back(middle);
  }
}

void ViewSphere::mix_for_virtual_corners() {
  std::size_t const real = views_at_.size();
  for (std::size_t v = real; v < corners_.size(); ++v) {
    std::vector<std::size_t> around;
    for (auto const& face : faces_) {
      if ((face.array() != static_cast<int>(v)).all()) continue;
      for (int const corner : face) {
        auto const c = static_cast<std::size_t>(corner);
        if (c < real && std::find(around.begin(), around.end(), c) == around.end()) around.push_back(c);
      }
    }
    if (around.empty()) {
      for (std::size_t c = 0; c < real; ++c) around.push_back(c);
    }
    std::sort(around.begin(), around.end());

    // The nearest, and the two that stand closest to a third of a turn from it: they surround the virtual corner.
    Vector3d const axis = corners_[v];
    auto const nearest = *std::max_element(around.begin(), around.end(), [&](std::size_t i, std::size_t j) {
      return corners_[i].dot(axis) < corners_[j].dot(axis) - 1e-9;
    });
    std::vector<std::size_t> mixture{nearest};
    Vector3d const x = axis.cross(corners_[nearest]);
    for (double const wanted : {2 * std::numbers::pi / 3, -2 * std::numbers::pi / 3}) {
      double best_distance = std::numeric_limits<double>::infinity();
      std::size_t best = nearest;
      for (std::size_t const c : around) {
        if (std::find(mixture.begin(), mixture.end(), c) != mixture.end()) continue;
        Vector3d const y = axis.cross(corners_[c]);
        double const turn = std::atan2(x.cross(y).dot(axis), x.dot(y));
        double const distance = std::abs(std::remainder(turn - wanted, 2 * std::numbers::pi));
        if (distance < best_distance - 1e-9) {
          best_distance = distance;
          best = c;
        }
      }
      if (best != nearest) mixture.push_back(best);
    }
    mixture_.push_back(std::move(mixture));
  }
}

void ViewSphere::link_faces() {
  std::map<std::pair<int, int>, int> face_of_edge;  // directed
  for (std::size_t f = 0; f < faces_.size(); ++f) {
    for (int k = 0; k < 3; ++k) face_of_edge[{faces_[f][k], faces_[f][(k + 1) % 3]}] = static_cast<int>(f);
  }
  for (auto const& face : faces_) {
    Vector3i across;
    for (int k = 0; k < 3; ++k) across[k] = face_of_edge.at({face[(k + 2) % 3], face[(k + 1) % 3]});
    across_.push_back(across);
  }
}

/// Barycentric coordinates where the ray meets the face's plane; all negative where that is behind the eye's back.
Vector3d ViewSphere::share_of(Vector3d const& eye, std::size_t face) const {
  Vector3d const& a = corners_[static_cast<std::size_t>(faces_[face][0])];
  Vector3d const& b = corners_[static_cast<std::size_t>(faces_[face][1])];
  Vector3d const& c = corners_[static_cast<std::size_t>(faces_[face][2])];
  Vector3d const share(eye.dot(b.cross(c)), eye.dot(c.cross(a)), eye.dot(a.cross(b)));
  double const sum = share.sum();
  return sum > 0 ? Vector3d(share / sum) : Vector3d::Constant(-std::numeric_limits<double>::infinity());
}

/// The face the ray leaves through.
std::size_t ViewSphere::locate(Vector3d const& eye, std::size_t face) const {
  if (face >= faces_.size()) face = 0;
  // A Delaunay triangulation is walked without cycles, towards the side of the worst edge; the bound is for rounding.
  for (std::size_t step = 0; step < faces_.size(); ++step) {
    Vector3d const& a = corners_[static_cast<std::size_t>(faces_[face][0])];
    Vector3d const& b = corners_[static_cast<std::size_t>(faces_[face][1])];
    Vector3d const& c = corners_[static_cast<std::size_t>(faces_[face][2])];
    Vector3d const sides(eye.dot(b.cross(c)), eye.dot(c.cross(a)), eye.dot(a.cross(b)));
    int worst = 0;
    // On an edge, nearly, the scan below decides, so that the same face is found from wherever the walk began.
    constexpr double kOnEdge = 1e-12;
    double const least = sides.minCoeff(&worst);
    if (least > kOnEdge) return face;
    if (least > -kOnEdge) break;
    face = static_cast<std::size_t>(across_[face][worst]);
  }
  // The one where the least barycentric coordinate is greatest, which is right on edges and under rounding too.
  std::size_t best = 0;
  double best_least = -std::numeric_limits<double>::infinity();
  for (std::size_t f = 0; f < faces_.size(); ++f) {
    double const least = share_of(eye, f).minCoeff();
    if (least > best_least) {
      best_least = least;
      best = f;
    }
  }
  return best;
}

std::vector<ViewWeight> ViewSphere::weights(Vector3d const& direction, std::size_t& face) const {
  double const length = direction.stableNorm();
  if (!std::isfinite(length) || length == 0) {
    throw Error(ErrorCode::bad_input, {}, "view sphere: the eye has no direction");
  }
  Vector3d const eye = (direction / length).normalized();
  face = locate(eye, face);
  Vector3i const best_face = faces_[face];
  Vector3d best_share = share_of(eye, face);
  best_share = best_share.cwiseMax(0.0);
  best_share /= best_share.sum();

  std::size_t const real = views_at_.size();
  double real_share = 0;
  for (int k = 0; k < 3; ++k) {
    if (static_cast<std::size_t>(best_face[k]) < real) real_share += best_share[k];
  }
  double const fade = std::max(0.0, 1 - real_share / kRealShare);
  // (1 − real)(1 − fade) / real without dividing by a vanishing real share.
  double const enlarge = 1 + (1 - real_share) / std::max(real_share, kRealShare);
  std::vector<double> of_corner(real, 0.0);
  for (int k = 0; k < 3; ++k) {
    auto const corner = static_cast<std::size_t>(best_face[k]);
    if (corner < real) {
      of_corner[corner] += best_share[k] * enlarge;
    } else {
      auto const& mixture = mixture_[corner - real];
      for (std::size_t const c : mixture) of_corner[c] += best_share[k] * fade / static_cast<double>(mixture.size());
    }
  }

  std::vector<ViewWeight> result;
  double sum = 0;
  for (std::size_t corner = 0; corner < real; ++corner) {
    if (of_corner[corner] < 1e-12) continue;
    sum += of_corner[corner];
    for (std::size_t const view : views_at_[corner]) {
      result.push_back({view, of_corner[corner] / static_cast<double>(views_at_[corner].size())});
    }
  }
  for (auto& weight : result) weight.weight /= sum;
  std::sort(result.begin(), result.end(), [](ViewWeight const& a, ViewWeight const& b) { return a.view < b.view; });
  return result;
}

}  // namespace scanview
