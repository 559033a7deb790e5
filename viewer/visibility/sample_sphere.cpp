#include "viewer/visibility/sample_sphere.h"

#include <fmt/format.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <map>
#include <numbers>

#include "base/error.h"
#include "viewer/select/sphere_hull.h"

namespace scanview {
namespace {

using Eigen::Vector3d;
using Eigen::Vector3i;

constexpr int kMostLevels = 8;

std::size_t octahedron_size(int level) { return (std::size_t{4} << (2 * level)) + 2; }

double triple(Vector3d const& a, Vector3d const& b, Vector3d const& c) { return a.dot(b.cross(c)); }

/// Oosterom and Strackee 1983.
double solid_angle(Vector3d const& a, Vector3d const& b, Vector3d const& c) {
  return 2 * std::atan2(triple(a, b, c), 1 + a.dot(b) + b.dot(c) + c.dot(a));
}

/// Which octant's face comes first in the list, bit k: component k negative.
int octant(Vector3d const& d) { return (d.x() < 0 ? 1 : 0) + (d.y() < 0 ? 2 : 0) + (d.z() < 0 ? 4 : 0); }

}  // namespace

SampleSphere SampleSphere::octahedron(int level) {
  if (level < 0 || level > kMostLevels)
    throw Error(ErrorCode::usage, {}, fmt::format("the octahedron is cut 0 to {} times", kMostLevels));
  SampleSphere sphere;
  sphere.octahedron_ = true;
  auto& points = sphere.directions_;
  points = {Vector3d::UnitX(),  -Vector3d::UnitX(), Vector3d::UnitY(),
            -Vector3d::UnitY(), Vector3d::UnitZ(),  -Vector3d::UnitZ()};
  sphere.between_.assign(6, {-1, -1, -1, -1});
  for (int i = 0; i < 8; ++i) {
    int const x = i & 1, y = 2 + (i >> 1 & 1), z = 4 + (i >> 2 & 1);
    bool const mirrored = ((i ^ (i >> 1) ^ (i >> 2)) & 1) != 0;
    sphere.faces_.emplace_back(x, mirrored ? z : y, mirrored ? y : z);
  }
  for (int l = 0; l < level; ++l) {
    std::map<std::pair<int, int>, int> middles;
    auto const middle = [&](int a, int b, int opposite) {
      auto const [found, is_new] = middles.try_emplace(std::minmax(a, b), static_cast<int>(points.size()));
      if (is_new) {
        points.push_back((points[static_cast<std::size_t>(a)] + points[static_cast<std::size_t>(b)]).normalized());
        sphere.between_.push_back({std::min(a, b), std::max(a, b), opposite, -1});
      } else {
        sphere.between_[static_cast<std::size_t>(found->second)][3] = opposite;
      }
      return found->second;
    };
    std::vector<Vector3i> finer;
    std::vector<Cut> cuts;
    for (Vector3i const& face : sphere.faces_) {
      int const ab = middle(face[0], face[1], face[2]), bc = middle(face[1], face[2], face[0]),
                ca = middle(face[2], face[0], face[1]);
      finer.emplace_back(face[0], ab, ca);
      finer.emplace_back(ab, face[1], bc);
      finer.emplace_back(ca, bc, face[2]);
      finer.emplace_back(ab, bc, ca);
      auto const normal = [&](int from, int to) {
        return points[static_cast<std::size_t>(from)].cross(points[static_cast<std::size_t>(to)]);
      };
      cuts.push_back({{normal(ab, ca), normal(bc, ab), normal(ca, bc)}});
      for (int k = 0; k < 3; ++k) {
        Vector3d& side = cuts.back().normal[k];
        if (side.dot(points[static_cast<std::size_t>(face[k])]) < 0) side = -side;
      }
    }
    sphere.faces_ = std::move(finer);
    sphere.cuts_.push_back(std::move(cuts));
  }
  for (std::size_t i = 0; i < points.size(); ++i) sphere.representative_.push_back(i);
  sphere.link();
  return sphere;
}

int SampleSphere::octahedron_level(std::size_t directions) {
  for (int level = 0; level <= kMostLevels; ++level) {
    if (octahedron_size(level) == directions) return level;
  }
  throw Error(
      ErrorCode::usage, {},
      fmt::format("{} samples: the octahedron's subdivisions have 6, 18, 66, 258, 1026, 4098, 16386 ...", directions));
}

SampleSphere SampleSphere::hull(std::vector<Vector3d> const& directions) {
  constexpr double kSame = 1e-6;
  SampleSphere sphere;
  // Sorted by x, so that only a few have to be compared.
  std::vector<std::pair<double, std::size_t>> by_x;
  for (Vector3d const& given : directions) {
    if (!given.allFinite() || given.norm() == 0)
      throw Error(ErrorCode::bad_input, {}, "a camera stands at the model's centre or nowhere");
    by_x.emplace_back(given.normalized().x(), by_x.size());
  }
  std::sort(by_x.begin(), by_x.end());
  sphere.representative_.assign(directions.size(), directions.size());
  for (std::size_t k = 0; k < by_x.size(); ++k) {
    std::size_t const i = by_x[k].second;
    if (sphere.representative_[i] != directions.size()) continue;
    sphere.representative_[i] = sphere.directions_.size();
    // Unit vectors stay as they are, to the bit.
    double const length = directions[i].norm();
    Vector3d const unit = std::abs(length - 1) < 1e-15 ? directions[i] : Vector3d(directions[i] / length);
    for (std::size_t j = k + 1; j < by_x.size() && by_x[j].first <= by_x[k].first + kSame; ++j) {
      std::size_t const other = by_x[j].second;
      if ((directions[other].normalized() - unit).norm() < kSame)
        sphere.representative_[other] = sphere.directions_.size();
    }
    sphere.directions_.push_back(unit);
  }
  sphere.between_.assign(sphere.directions_.size(), {-1, -1, -1, -1});
  // Directions in one plane have no hull (sphere_hull demands one).
  Vector3d normal = Vector3d::Zero();
  for (Vector3d const& d : sphere.directions_) {
    Vector3d const n = (d - sphere.directions_[0]).cross(sphere.directions_.back() - sphere.directions_[0]);
    if (n.norm() > normal.norm()) normal = n;
  }
  bool const flat = std::all_of(sphere.directions_.begin(), sphere.directions_.end(), [&](Vector3d const& d) {
    return std::abs(normal.normalized().dot(d - sphere.directions_[0])) < kSame;
  });
  if (sphere.directions_.size() >= 4 && !flat) {
    for (Vector3i const& face : sphere_hull(sphere.directions_)) {
      auto const corner = [&](int k) { return sphere.directions_[static_cast<std::size_t>(face[k])]; };
      if (triple(corner(0), corner(1), corner(2)) > 1e-12) sphere.faces_.push_back(face);
    }
  }
  sphere.link();
  return sphere;
}

void SampleSphere::link() {
  std::map<std::pair<int, int>, int> third;  // corner of the face on whose left the edge runs
  for (Vector3i const& face : faces_) {
    for (int k = 0; k < 3; ++k) third[{face[k], face[(k + 1) % 3]}] = face[(k + 2) % 3];
  }
  opposite_.clear();
  for (Vector3i const& face : faces_) {
    Vector3i across;
    for (int k = 0; k < 3; ++k) {
      auto const found = third.find({face[(k + 2) % 3], face[(k + 1) % 3]});
      across[k] = found == third.end() ? -1 : found->second;
    }
    opposite_.push_back(across);
  }
}

double SampleSphere::coverage() const {
  double sum = 0;
  for (Vector3i const& face : faces_) {
    auto const corner = [&](int k) { return directions_[static_cast<std::size_t>(face[k])]; };
    sum += solid_angle(corner(0), corner(1), corner(2));
  }
  return sum / (4 * std::numbers::pi);
}

double SampleSphere::radius() const {
  double widest = 0;
  for (Vector3i const& face : faces_) {
    auto const corner = [&](int k) { return directions_[static_cast<std::size_t>(face[k])]; };
    Vector3d const a = corner(0), center = (corner(1) - a).cross(corner(2) - a).normalized();
    widest = std::max(widest, std::acos(std::clamp(center.dot(a), -1.0, 1.0)));
  }
  return widest;
}

std::optional<SampleSphere::Location> SampleSphere::locate(Vector3d const& direction) const {
  if (!direction.allFinite() || direction.isZero(0)) return std::nullopt;
  if (octahedron_) {
    Location at{static_cast<std::size_t>(octant(direction)), 3};
    for (auto const& level : cuts_) {
      Cut const& cut = level[at.face];
      std::size_t child = 0;
      while (child < 3) {
        ++at.tests;
        if (cut.normal[child].dot(direction) >= 0) break;
        ++child;
      }
      at.face = 4 * at.face + child;
    }
    return at;
  }
  Vector3d const unit = direction.normalized();
  Location at;
  for (; at.face < faces_.size(); ++at.face) {
    bool inside = true;
    for (int k = 0; k < 3 && inside; ++k) {
      ++at.tests;
      auto const corner = [&](int i) { return directions_[static_cast<std::size_t>(faces_[at.face][i % 3])]; };
      inside = triple(unit, corner(k), corner(k + 1)) >= -1e-12;
    }
    if (inside) return at;
  }
  return std::nullopt;
}

}  // namespace scanview
