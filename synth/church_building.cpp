#include <algorithm>
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

constexpr std::uint32_t kStone = 0xd9d0bd, kPaleStone = 0xe9e3d6, kGreyStone = 0xa39d92, kPlaster = 0xefe8d8;
constexpr std::uint32_t kOutside = 0xb7a793;
// Where the solids end in the west, one behind the other, so that no two ends lie in one plane.
constexpr double kFloorWest = -0.5, kAislesWest = -0.2, kVaultWest = -0.1, kFriezeWest = -0.05, kCorniceWest = 0.05;

double middle(std::vector<double> const& lines, int cell) { return 0.5 * (lines[cell] + lines[cell + 1]); }

/// A stone of the floor, whose squares in the nave are of rings about their middles.
std::uint32_t floor_color(double x, double z) {
  constexpr std::uint32_t kRings[] = {0xe8e0cf, 0x8c3b2f, 0xd8b56a, 0x34404d};
  auto const parity = [](double a, double b) { return (std::lround(std::floor(a)) + std::lround(std::floor(b))) & 1; };
  if (std::abs(z) > kAisleFrom) return parity(x, z) ? 0x4d5a55 : 0xddd6c6;
  if (std::abs(z) > kNaveHalf) return 0x7b746a;
  if (std::abs(z) < 1) return parity(2 * x, 2 * z) ? 0x9c4a3c : (std::abs(z) > 0.5 ? 0xe4d3a2 : 0xf1ebdd);
  double const in_x = std::abs(x - 4 * std::floor(x / 4) - 2);
  double const in_z = std::abs(std::abs(z) - 4);
  int const ring = static_cast<int>(std::floor(2 * std::max(in_x, in_z * 2 / 3)));
  if (ring >= 3) return parity(2 * x, 2 * z) ? 0x34404d : 0xe8e0cf;
  return kRings[ring];
}

void write_floor(PatchWriter& writer) {
  constexpr double kEast = 47, kThick = 0.6, kApseSide = 6;
  auto const tiles = static_cast<int>(2 * kEast);
  Blocks floor;
  floor.lines[0] = even_lines(0, kEast, tiles);
  floor.lines[0].insert(floor.lines[0].begin(), kFloorWest);
  floor.lines[1] = {-kThick, 0};
  constexpr double kOuter = kAisleTo + kAisleWall;
  floor.lines[2] = {-kOuter, -kAisleTo, -11, -10, -9, -kAisleFrom};
  for (double const z : even_lines(-kNaveHalf, kNaveHalf, static_cast<int>(4 * kNaveHalf))) floor.lines[2].push_back(z);
  for (double const z : {kAisleFrom, 9.0, 10.0, 11.0, kAisleTo, kOuter}) floor.lines[2].push_back(z);
  floor.is_solid = [&](Vector3i const& cell) {
    return middle(floor.lines[0], cell.x()) < kApseX || std::abs(middle(floor.lines[2], cell.z())) < kApseSide;
  };
  floor.color = [&](Vector3i const& cell, int axis, int sign) {
    if (axis != 1 || sign < 0 || cell.x() == 0) return bgr_from_paint(kOutside);
    return bgr_from_paint(floor_color(middle(floor.lines[0], cell.x()), middle(floor.lines[2], cell.z())));
  };
  write_blocks(writer, floor);
}

/// Outer walls with pilasters and courses of two stones, roofs with beams, ends in the east: one solid a side.
class Aisles {
 public:
  Aisles() {
    auto& x = blocks_.lines[0];
    x = {kAislesWest, kPilaster};
    for (int bay = 0; bay < kBays; ++bay) {
      for (double const side : {-kPictureSide, -kWindowSide, kWindowSide, kPictureSide})
        x.push_back(kBay * (bay + 0.5) + side);
      x.push_back(kBay * (bay + 1) - kPilaster);
      x.push_back(bay + 1 < kBays ? kBay * (bay + 1) + kPilaster : kNaveEnd);
    }
    x.push_back(kApseX);
    blocks_.lines[1] = {-kJoint, 1.2, 1.54, 2.4, 3.3, 4.26, 4.51, 5.5, 6.5, 7.49, 8.0, 8.2, 8.9};
    blocks_.lines[2] = {-kOuter, -kAisleTo, -kFace, -kInner, kInner, kFace, kAisleTo, kOuter};
    blocks_.is_solid = [this](Vector3i const& cell) { return is_solid(cell); };
    blocks_.color = [this](Vector3i const& cell, int axis, int sign) {
      return bgr_from_paint(is_outside(cell, axis, sign) ? kOutside : color(cell, axis));
    };
  }
  Aisles(Aisles const&) = delete;
  Aisles& operator=(Aisles const&) = delete;
  Blocks const& blocks() const { return blocks_; }

 private:
  // Lines of the walls pass close around what hangs there: what is behind it is dark.
  static constexpr double kPictureSide = 1.36, kWindowSide = 1.04;
  static constexpr double kPilaster = 0.4, kFace = kAisleTo - 0.3, kOuter = kAisleTo + kAisleWall;
  static constexpr double kInner = kAisleFrom - 0.1;
  static constexpr int kColumns = 6;  // of lines in a bay, the first its pilaster
  static constexpr int kEast = kColumns * kBays + 1, kDado = 0, kBand = 5, kBeams = 10, kRoof = 11;

  static int from_outside(Vector3i const& cell) { return std::min(cell.z(), 6 - cell.z()); }

  static bool is_solid(Vector3i const& cell) {
    if (from_outside(cell) == 3) return false;
    if (from_outside(cell) == 0 || cell.x() == kEast || cell.y() == kRoof) return true;
    return cell.x() % kColumns == 0 && (from_outside(cell) == 1 || cell.y() == kBeams);
  }

  static bool is_outside(Vector3i const& cell, int axis, int sign) {
    if (axis == 0) return sign < 0 ? cell.x() == 0 : cell.x() == kEast;
    if (axis == 1) return sign < 0 ? cell.y() == 0 : cell.y() == kRoof;
    return from_outside(cell) == 0 && (sign < 0) == (cell.z() == 0);
  }

  static std::uint32_t color(Vector3i const& cell, int axis) {
    if (cell.y() == kBeams) return 0x8a5f3c;
    if (axis == 1) return 0xd4dde0;
    if (cell.y() == kDado) return 0x77655a;
    if (from_outside(cell) == 1 && cell.x() != kEast) return kPaleStone;
    if (cell.y() == kBand) return 0x9c4f42;
    return cell.y() % 2 ? 0xe6d3b3 : 0xd8bd9a;
  }

  Blocks blocks_;
};

constexpr double kAbacus = 0.76;  // half the side: it shows on all sides of the arches that stand on it

void write_column(PatchWriter& writer, Vector3d const& foot) {
  cv::Vec3b const shaft = bgr_from_paint(0xc9b9a2), stone = bgr_from_paint(kPaleStone);
  write_box(writer, foot + Vector3d(-0.75, -kJoint, -0.75), foot + Vector3d(0.75, 0.3, 0.75),
            bgr_from_paint(kGreyStone));
  write_lathe(writer, foot,
              {{{{0, 0.28}, {0.6, 0.28}, {0.68, 0.38}, {0.6, 0.48}, {0.57, 0.5}, {0.62, 0.58}, {0.55, 0.66}}, stone, 0},
               {{{0.55, 0.66}, {0.55, 2.2}, {0.47, 4.85}}, shaft, 16},
               {{{0.47, 4.85}, {0.53, 4.9}, {0.53, 5.0}}, bgr_from_paint(0xb8923f), 0},
               {{{0.53, 5.0}, {0.55, 5.15}, {0.72, 5.45}, {0.72, 5.52}, {0, 5.52}}, stone, 0}},
              24);
  write_box(writer, foot + Vector3d(-kAbacus, 5.5, -kAbacus), foot + Vector3d(kAbacus, kArcadeSpring, kAbacus), stone);
}

/// Rows of columns, half piers at their ends, and the arches that they carry.
void write_arcades(PatchWriter& writer) {
  constexpr double kPierWest = -0.02, kPierHalf = 0.66;
  for (int const side : {-1, 1}) {
    double const z = side * kArcadeMiddle;
    for (int i = 1; i < kBays; ++i) write_column(writer, {kBay * i, 0, z});
    auto const write_pier = [&](double from, double to) {
      write_box(writer, {from, -kJoint, z - kPierHalf}, {to, kArcadeSpring, z + kPierHalf}, bgr_from_paint(kPaleStone));
    };
    write_pier(kPierWest, kAbacus);
    write_pier(kNaveEnd - kAbacus, kNaveEnd + kEastWall / 2);
    Arch arch;
    arch.depth = kArcade;
    arch.bottom = arch.spring = kArcadeSpring;
    arch.radius = 1.8;
    arch.half = kBay / 2;
    arch.ring = 0.4;
    arch.top = kArcadeTop;
    arch.stones = 16;
    arch.ring_color = [](int stone) { return bgr_from_paint(stone % 2 ? kPaleStone : 0xa8574a); };
    arch.wall_color = bgr_from_paint(kPlaster);
    for (int bay = 0; bay < kBays; ++bay) {
      arch.foot = {kBay * (bay + 0.5), 0, z - kArcade / 2};
      write_arch(writer, arch);
    }
  }
}

/// Between arcade and vault: a band of mosaic and a cornice with dentils.
void write_entablature(PatchWriter& writer, int side) {
  constexpr std::uint32_t kMosaic[] = {0x27476f, 0xd9b45a, 0x9a3a30, 0xd9b45a};
  constexpr int kPieces = 120;
  auto const facing = [side](double near, double far) {
    return side > 0 ? std::vector{near, far} : std::vector{-far, -near};
  };
  Blocks frieze;
  frieze.lines[0] = even_lines(0, kNaveEnd + 0.3, kPieces);
  frieze.lines[0].front() = kFriezeWest;
  frieze.lines[1] = {kArcadeTop - kJoint, 8.4, 8.55, 8.75, 8.9, kVaultSpring + kJoint};
  frieze.lines[2] = facing(kNaveHalf - 0.05, kAisleFrom);
  frieze.is_solid = [](Vector3i const&) { return true; };
  frieze.color = [&](Vector3i const& cell, int axis, int sign) {
    if (axis == 0 || (axis == 2 && sign == side)) return bgr_from_paint(kOutside);
    if (axis != 2 || cell.y() == 0 || cell.y() == 4) return bgr_from_paint(kStone);
    return bgr_from_paint(kMosaic[(cell.x() + (cell.y() == 2 ? 2 : 0)) % 4]);
  };
  write_blocks(writer, frieze);

  Blocks cornice;
  cornice.lines[0] = even_lines(kCorniceWest, kNaveEnd + 0.1, 2 * kPieces);
  cornice.lines[1] = {8.95, 9.08, 9.2};
  cornice.lines[2] = side > 0 ? std::vector{6.6, 6.75, 7.1} : std::vector{-7.1, -6.75, -6.6};
  cornice.is_solid = [side](Vector3i const& cell) {
    bool const is_front = cell.z() == (side > 0 ? 0 : 1);
    return cell.y() == 1 || !is_front || cell.x() % 2 == 0;
  };
  cornice.color = [](Vector3i const&, int, int) { return bgr_from_paint(kPaleStone); };
  write_blocks(writer, cornice);
}

/// Along a row of `count` coffers with ribs between and at the ends: lines of rib, margin, inner field, margin.
std::vector<double> coffer_lines(double low, double high, int count, double rib) {
  double const coffer = (high - low - rib) / count, field = coffer - rib;
  std::vector<double> lines;
  for (int i = 0; i < count; ++i) {
    double const from = low + coffer * i;
    for (double const at : {0.0, rib, rib + 0.25 * field, rib + 0.75 * field}) lines.push_back(from + at);
  }
  lines.push_back(high - rib);
  lines.push_back(high);
  return lines;
}

void write_vault(PatchWriter& writer) {
  constexpr double kDeep = 0.25, kThick = 0.8;
  constexpr int kAround = 9, kAlong = 2 * kBays;
  Blocks vault;
  vault.lines[0] = coffer_lines(0, std::numbers::pi * kNaveHalf, kAround, 0.5);
  vault.lines[1] = {0, kDeep, kThick};
  vault.lines[2] = coffer_lines(kVaultWest, kNaveEnd + 0.3, kAlong, 0.6);
  auto const part = [](int cell) { return cell % 4; };  // 0: rib, 2: the coffer's field
  vault.is_solid = [&](Vector3i const& cell) { return cell.y() == 1 || part(cell.x()) == 0 || part(cell.z()) == 0; };
  vault.color = [&](Vector3i const& cell, int axis, int sign) {
    if ((axis == 1 && sign > 0) || (axis == 2 && (cell.z() == 0 || cell.z() == 4 * kAlong) && cell.y() == 1))
      return bgr_from_paint(kOutside);
    if (axis != 1) return bgr_from_paint(0xc8a75c);
    if (cell.y() == 0) return bgr_from_paint(part(cell.x()) == 0 && part(cell.z()) == 0 ? 0xc99a45 : kPaleStone);
    if (part(cell.x()) == 2 && part(cell.z()) == 2)
      return bgr_from_paint((cell.x() / 4 + cell.z() / 4) % 2 ? 0xe4c36b : 0xb65a45);
    return bgr_from_paint((cell.x() / 4 + cell.z() / 4) % 2 ? 0x3f6a94 : 0x6c94ab);
  };
  vault.place = [](Vector3d const& at) -> Vector3d {
    double const angle = at.x() / kNaveHalf, radius = kNaveHalf + at.y();
    return {at.z(), kVaultSpring + radius * std::sin(angle), radius * std::cos(angle)};
  };
  write_blocks(writer, vault);
}

/// Steps up to the choir, and its floor.
void write_choir(PatchWriter& writer) {
  constexpr double kHalf = 6.6, kStep = 0.4;
  for (int step = 0; step < 3; ++step) {
    Blocks plate;
    plate.lines[0] = even_lines(kChoirFrom + kStep * step, kNaveEnd + 0.2 * (step + 1), 12);
    plate.lines[1] = {kChoirFloor / 3 * step - kJoint, kChoirFloor / 3 * (step + 1)};
    plate.lines[2] = even_lines(-kHalf - 0.05 * (2 - step), kHalf + 0.05 * (2 - step), 20);
    plate.is_solid = [](Vector3i const&) { return true; };
    plate.color = [&](Vector3i const& cell, int axis, int) {
      if (step < 2 || axis != 1) return bgr_from_paint(step % 2 ? 0xc9bfae : 0xe0d8ca);
      return bgr_from_paint((cell.x() + cell.z()) % 2 ? 0x5b2f33 : 0xdccfb4);
    };
    write_blocks(writer, plate);
  }
}

}  // namespace

void write_church_building(PatchWriter& writer) {
  write_floor(writer);
  write_blocks(writer, Aisles().blocks());
  write_arcades(writer);
  for (int const side : {-1, 1}) write_entablature(writer, side);
  write_vault(writer);
  write_choir(writer);
  write_church_apse(writer);
}

}  // namespace scanview
