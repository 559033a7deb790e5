#include "synth/church_arch.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <cstddef>
#include <numbers>
#include <vector>

#include "synth/building_shapes.h"

namespace scanview {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;
using Eigen::Vector3i;

constexpr double kHalfTurn = std::numbers::pi;
constexpr double kStone = 0.9;  // height of one in the jambs

/// A place along the opening: up one jamb, around, down the other.
struct Station {
  double jamb = 0;   ///< the share of its height, 0 to 1 (and all around)
  double angle = 0;  ///< 0 on the first jamb, half a turn on the other
};

class ArchShape {
 public:
  explicit ArchShape(Arch const& arch) : arch_(arch), jamb_(arch.spring - arch.bottom), arc_(kHalfTurn * arch.radius) {}

  std::vector<double> lines() const {
    int const courses = jamb_ > 0 ? std::max(1, static_cast<int>(std::lround(jamb_ / kStone))) : 0;
    std::vector<double> result;
    int const count = 2 * courses + arch_.stones + 1;
    result.reserve(static_cast<std::size_t>(count));
    for (int i = 0; i < courses; ++i) result.push_back(jamb_ * i / courses);
    for (int i = 0; i < arch_.stones; ++i) result.push_back(jamb_ + arc_ * i / arch_.stones);
    for (int i = 0; i <= courses; ++i)
      result.push_back(courses > 0 ? jamb_ + arc_ + jamb_ * i / courses : jamb_ + arc_);
    return result;
  }

  /// Where along the opening, how far out, how deep. A straight wall's corners are at an eighth of a turn.
  Vector3d place(Vector3d const& parameters, double span) const {
    Station const at = station(parameters.x());
    Vector2d const radial(-std::cos(at.angle), std::sin(at.angle));
    Vector2d const inner =
        level(at, arch_.spring) + std::min(parameters.y(), arch_.ring) * radial + arch_.radius * radial;
    double const share = std::max(0.0, parameters.y() - arch_.ring) / (span - arch_.ring);
    Vector2d const point = inner + share * (outer(at) - inner);
    Vector3d const up = Vector3d::UnitY();
    return arch_.foot + point.x() * arch_.across + point.y() * up + parameters.z() * arch_.across.cross(up);
  }

 private:
  Station station(double along) const {
    if (along < jamb_) return {along / jamb_, 0};
    if (along <= jamb_ + arc_) return {1, (along - jamb_) / arch_.radius};
    return {1 - (along - jamb_ - arc_) / jamb_, kHalfTurn};
  }
  Vector2d level(Station const& at, double spring) const {
    return {0, arch_.bottom + at.jamb * (spring - arch_.bottom)};
  }
  Vector2d outer(Station const& at) const {
    Vector2d const radial(-std::cos(at.angle), std::sin(at.angle));
    if (arch_.outline == Arch::Outline::round) return level(at, arch_.top) + arch_.half * radial;
    Vector2d const square = radial / radial.cwiseAbs().maxCoeff();
    return level(at, arch_.spring) + Vector2d(arch_.half * square.x(), (arch_.top - arch_.spring) * square.y());
  }

  Arch const& arch_;
  double jamb_, arc_;
};

}  // namespace

void write_arch(PatchWriter& writer, Arch const& arch) {
  ArchShape const shape(arch);
  double const span = std::max(arch.half, arch.top - arch.spring + arch.half) - arch.radius;
  Blocks blocks;
  blocks.lines = {shape.lines(), {0, arch.ring, span}, {0, arch.depth}};
  blocks.is_solid = [](Vector3i const&) { return true; };
  blocks.color = [&](Vector3i const& cell, int axis, int sign) {
    bool const is_soffit = axis == 1 && sign < 0, is_ring = axis == 2 && cell.y() == 0;
    return is_soffit || is_ring ? arch.ring_color(cell.x()) : arch.wall_color;
  };
  blocks.place = [&](Vector3d const& parameters) { return shape.place(parameters, span); };
  write_blocks(writer, blocks);
}

}  // namespace scanview
