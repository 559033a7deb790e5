#include <cmath>
#include <cstdint>
#include <numbers>
#include <vector>

#include "synth/building_shapes.h"
#include "synth/church_arch.h"
#include "synth/church_plan.h"
#include "synth/paint.h"

namespace scanview {
namespace {

using Eigen::Vector3d;
using Eigen::Vector3i;

constexpr double kHalfTurn = std::numbers::pi, kThick = 0.7, kNiche = 0.25;
constexpr double kInWall = 0.02;  // angle by which the apse begins within the east wall
constexpr std::uint32_t kPale = 0xe9e3d6, kOutside = 0xb7a793, kGold = 0xc99a45;

/// Parameters: length along the wall from north to south, outwards, up.
Vector3d place_around(Vector3d const& at) {
  double const angle = at.x() / kApseRadius, radius = kApseRadius + at.y();
  return {kApseX + radius * std::cos(angle), at.z(), radius * std::sin(angle)};
}

std::vector<double> around_lines(int steps) {
  double const half = kApseRadius * (kHalfTurn / 2 + kInWall);
  return even_lines(-half, half, steps);
}

void write_east_wall(PatchWriter& writer) {
  Arch arch;
  arch.foot = {kNaveEnd, 0, 0};
  arch.across = -Vector3d::UnitZ();
  arch.depth = kEastWall;
  arch.bottom = -kJoint;
  arch.radius = 5;
  arch.spring = kApseSpring;
  arch.ring = 0.7;
  arch.outline = Arch::Outline::round;
  arch.half = kNaveHalf + 0.75;
  arch.top = kVaultSpring;
  arch.stones = 28;
  arch.ring_color = [](int stone) { return bgr_from_paint(stone % 2 ? 0xe9e3d6 : 0x8f5148); };
  arch.wall_color = bgr_from_paint(0xe7d9bd);
  write_arch(writer, arch);
}

/// Nine fields between pilasters: niches, and windows above some of them.
void write_apse_wall(PatchWriter& writer) {
  constexpr int kFields = 9, kSteps = 4 * kFields + 1;
  Blocks wall;
  wall.lines = {around_lines(kSteps),
                {0, kNiche, kThick},
                {-kJoint, 1.2, 1.4, 2.2, 3.0, 3.8, 4.1, 4.7, 5.3, 5.9, 6.5, kApseSpring + kJoint}};
  auto const is_field = [](Vector3i const& cell) { return cell.x() % 4 != 0 && cell.z() >= 2 && cell.z() <= 9; };
  wall.is_solid = [&](Vector3i const& cell) { return cell.y() == 1 || !is_field(cell) || cell.z() == 5; };
  wall.color = [&](Vector3i const& cell, int axis, int sign) {
    constexpr std::uint32_t kMosaic[] = {0xd0a848, 0x2f5d57, 0xb2443a, 0xe8d9ae, 0x31507c};
    constexpr std::uint32_t kGlass[] = {0xf4ead0, 0xe3eef2, 0xf6e3b5};
    int const field = cell.x() / 4;
    if (axis == 1 && sign > 0) return bgr_from_paint(kOutside);
    if (axis != 1 || !is_field(cell) || cell.z() == 5) return bgr_from_paint(cell.z() == 0 ? 0x6d4a45 : kPale);
    bool const is_window = cell.z() > 5 && field % 2 == 0;
    if (is_window) return bgr_from_paint(kGlass[(cell.x() + cell.z()) % 3]);
    return bgr_from_paint(kMosaic[(cell.x() * cell.x() + 3 * cell.z() + field) % 5]);
  };
  wall.place = place_around;
  write_blocks(writer, wall);

  Blocks cornice;
  cornice.lines = {around_lines(2 * kSteps), {-0.3, -0.15, 0.1}, {6.72, 6.88, 7.04}};
  cornice.is_solid = [](Vector3i const& cell) { return cell.z() == 1 || cell.y() == 1 || cell.x() % 2 == 0; };
  cornice.color = [](Vector3i const& cell, int, int) { return bgr_from_paint(cell.z() == 1 ? kPale : kGold); };
  cornice.place = place_around;
  write_blocks(writer, cornice);
}

/// A shell whose rays meet in the east, where a sphere closes it.
void write_half_dome(PatchWriter& writer) {
  constexpr int kRays = 15, kRings = 8;
  constexpr double kFirst = 0.07;  // angle from the pole
  Blocks dome;
  dome.lines = {even_lines(0, kApseRadius * kHalfTurn, kRays),
                even_lines(kApseRadius * kFirst, kApseRadius * (kHalfTurn / 2 + kInWall), kRings),
                {0, 0.12, kThick}};
  dome.is_solid = [](Vector3i const& cell) { return cell.z() == 1 || cell.x() % 2 == 0 || cell.y() == kRings - 1; };
  dome.color = [](Vector3i const& cell, int axis, int sign) {
    constexpr std::uint32_t kShell[] = {0x2d5a86, 0x3c7396, 0x5490a6, 0x2d5a86};
    if (axis == 2 && sign > 0) return bgr_from_paint(kOutside);
    if (axis != 2 || cell.y() == kRings - 1) return bgr_from_paint(kGold);
    return bgr_from_paint(cell.z() == 1 ? kShell[cell.y() % 4] : (cell.y() % 2 ? 0xf0e6cf : 0xe2c98c));
  };
  dome.place = [](Vector3d const& at) -> Vector3d {
    double const turn = at.x() / kApseRadius, polar = at.y() / kApseRadius, radius = kApseRadius + at.z();
    return {kApseX + radius * std::cos(polar), kApseSpring + radius * std::sin(polar) * std::sin(turn),
            radius * std::sin(polar) * std::cos(turn)};
  };
  write_blocks(writer, dome);
  write_sphere(writer, {kApseX + kApseRadius - 0.1, kApseSpring + 0.1, 0}, 0.5, bgr_from_paint(kGold));
}

/// Rings of marble, a little above the choir's floor.
void write_apse_floor(PatchWriter& writer) {
  constexpr double kTop = kChoirFloor + 0.03;
  write_lathe(writer, {kApseX, 0, 0},
              {{{{0, -kJoint}, {5.4, -kJoint}, {5.4, kTop}, {4.4, kTop}}, bgr_from_paint(0xd8ccb4), 0},
               {{{4.4, kTop}, {3.6, kTop}}, bgr_from_paint(0x6e3b36), 0},
               {{{3.6, kTop}, {2.4, kTop}}, bgr_from_paint(0xe6dcc6), 0},
               {{{2.4, kTop}, {1.8, kTop}}, bgr_from_paint(0x41545c), 0},
               {{{1.8, kTop}, {0, kTop}}, bgr_from_paint(0xd9bd7c), 0}},
              48);
}

}  // namespace

void write_church_apse(PatchWriter& writer) {
  write_east_wall(writer);
  write_apse_wall(writer);
  write_half_dome(writer);
  write_apse_floor(writer);
}

}  // namespace scanview
