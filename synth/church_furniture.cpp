#include <cmath>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <vector>

#include "synth/building_shapes.h"
#include "synth/church_plan.h"
#include "synth/paint.h"

namespace scanview {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;
using Eigen::Vector3i;

constexpr std::uint32_t kMarble = 0xe4ded2, kBrass = 0xb98f3c, kIron = 0x4a4d52, kOak = 0x7d5433, kDarkOak = 0x5f3f29;

/// A picture of little squares in a frame, on a wall.
struct Panel {
  Vector3d middle;  ///< on the wall's face
  Vector3d out;     ///< of the wall: along x or z
  Vector2d size;
  double cell = 0.16, frame = 0.12;
  std::uint32_t frame_color = kBrass;
  std::function<std::uint32_t(int column, int row, Vector2d const& cells)> color;
};

void write_panel(PatchWriter& writer, Panel const& panel) {
  constexpr double kFrameDepth = 0.07, kDepth = 0.04;
  int const out = panel.out.x() != 0 ? 0 : 2, side = 2 - out;
  double const sign = panel.out[out];
  Vector2d const half = 0.5 * panel.size;
  auto const count = [&](double length) { return static_cast<int>(std::lround(length / panel.cell)); };
  auto const lines = [&](double at, double reach) {
    std::vector<double> result = even_lines(at - reach, at + reach, count(2 * reach));
    result.insert(result.begin(), at - reach - panel.frame);
    result.push_back(at + reach + panel.frame);
    return result;
  };
  double const face = panel.middle[out];
  Blocks blocks;
  blocks.lines[1] = lines(panel.middle.y(), half.y());
  blocks.lines[side] = lines(panel.middle[side], half.x());
  blocks.lines[out] = sign > 0 ? std::vector{face - kJoint, face + kDepth, face + kFrameDepth}
                               : std::vector{face - kFrameDepth, face - kDepth, face + kJoint};
  int const columns = count(panel.size.x()), rows = count(panel.size.y());
  int const front = sign > 0 ? 1 : 0;
  auto const is_picture = [&](Vector3i const& cell) {
    return cell[side] >= 1 && cell[side] <= columns && cell.y() >= 1 && cell.y() <= rows;
  };
  blocks.is_solid = [&](Vector3i const& cell) { return cell[out] != front || !is_picture(cell); };
  blocks.color = [&](Vector3i const& cell, int axis, int) {
    if (axis != out || !is_picture(cell)) return bgr_from_paint(panel.frame_color);
    return bgr_from_paint(panel.color(cell[side] - 1, cell.y() - 1, Vector2d(columns, rows)));
  };
  write_blocks(writer, blocks);
}

constexpr std::size_t kTones = 5;
constexpr std::uint32_t kPalettes[][kTones] = {{0x7a1f1f, 0xc9472b, 0xee9b3a, 0xf3dfa0, 0x2b3a55},
                                               {0x17375e, 0x2d7f9d, 0x9fd0c9, 0xf2e6c2, 0xb98b32},
                                               {0x1f4d2b, 0x6ea24a, 0xd6d66b, 0xc2477d, 0xf4efe2},
                                               {0x4a2a5a, 0x8c5aa0, 0xd8b8d8, 0xe8c46a, 0x2f2f45}};

/// A picture: hills under a sky, and a figure with a halo before them.
std::uint32_t picture_color(int which, int column, int row, Vector2d const& cells) {
  auto const& tones = kPalettes[which % 4];
  Vector2d const at((column + 0.5) / cells.x() - 0.5, (row + 0.5) / cells.y());
  double const lean = 0.12 * std::sin(2.4 * which);
  if ((at - Vector2d(lean, 0.72)).norm() < 0.09) return 0xe9c9a2;
  if ((at - Vector2d(lean, 0.74)).norm() < 0.17) return 0xe3b53d;
  if (at.y() < 0.66 && std::abs(at.x() - lean) < 0.1 + 0.22 * (0.66 - at.y()))
    return tones[(column + row) % 7 == 0 ? 3 : (std::abs(at.x() - lean) < 0.06 ? 1 : 0)];
  double const hill = 0.35 + 0.12 * std::sin(9 * at.x() + which);
  if (at.y() < hill) return tones[(column * column + 3 * row + which) % 3 == 0 ? 2 : 4];
  return (row + column / 3) % 4 == 0 ? tones[3] : tones[2];
}

std::uint32_t glass_color(int which, int column, int row, Vector2d const& cells) {
  constexpr std::uint32_t kGlass[] = {0xf7f0dc, 0xe4eef4, 0xf8e6b8, 0xe2f0dc};
  bool const is_lead = column % 4 == 0 || row % 5 == 0 || column == static_cast<int>(cells.x()) - 1;
  if (is_lead) return 0x6b6f75;
  return kGlass[(column / 4 + 2 * (row / 5) + which) % 4];
}

void write_statue(PatchWriter& writer, Vector3d const& foot, std::uint32_t robe) {
  cv::Vec3b const stone = bgr_from_paint(kMarble);
  write_box(writer, foot - Vector3d(0.45, kJoint, 0.45), foot + Vector3d(0.45, 0.2, 0.45), bgr_from_paint(0x8c857a));
  write_box(writer, foot + Vector3d(-0.36, 0.18, -0.36), foot + Vector3d(0.36, 1.2, 0.36), stone);
  write_lathe(writer, foot + Vector3d(0, 1.2, 0),
              {{{{0, -kJoint}, {0.34, -kJoint}, {0.32, 0.12}, {0.24, 0.7}, {0.22, 1.0}}, bgr_from_paint(robe), 9},
               {{{0.22, 1.0}, {0.29, 1.25}, {0.27, 1.4}, {0.09, 1.5}}, stone, 0},
               {{{0.09, 1.5}, {0.14, 1.62}, {0.14, 1.74}, {0.08, 1.84}, {0, 1.87}}, bgr_from_paint(0xe0c4a4), 0}},
              18);
}

void write_candlestick(PatchWriter& writer, Vector3d const& foot, double scale) {
  auto const scaled = [&](std::vector<Vector2d> points) {
    for (Vector2d& point : points) point *= scale;
    return points;
  };
  write_lathe(writer, foot,
              {{scaled({{0, -0.01},
                        {0.16, -0.01},
                        {0.16, 0.04},
                        {0.04, 0.14},
                        {0.07, 0.3},
                        {0.03, 0.42},
                        {0.03, 0.8},
                        {0.07, 0.86},
                        {0.07, 0.9}}),
                bgr_from_paint(kBrass), 0},
               {scaled({{0.07, 0.9}, {0.035, 0.9}, {0.035, 1.2}, {0, 1.22}}), bgr_from_paint(0xf3ead2), 0}},
              12);
}

/// A bench with a back, its ends higher than its seat; sits people who look east.
void write_pew(PatchWriter& writer, double x, double z_low, double z_high) {
  cv::Vec3b const oak = bgr_from_paint(kOak), dark = bgr_from_paint(kDarkOak);
  for (double const z : {z_low, z_high - 0.08})
    write_box(writer, {x - 0.06, -kJoint, z}, {x + 0.55, 0.98, z + 0.08}, dark);
  write_box(writer, {x + 0.02, 0.42, z_low + 0.04}, {x + 0.5, 0.48, z_high - 0.04}, oak);
  Blocks back;
  back.lines = {std::vector{x - 0.02, x + 0.04}, {0.02, 0.75, 0.93}, even_lines(z_low + 0.04, z_high - 0.04, 8)};
  back.is_solid = [](Vector3i const&) { return true; };
  back.color = [&](Vector3i const& cell, int, int) {
    return cell.y() == 1 ? dark : (cell.z() % 2 ? oak : bgr_from_paint(0x936540));
  };
  write_blocks(writer, back);
}

void write_pews(PatchWriter& writer) {
  for (int row = 0; row < 8; ++row)
    for (int const side : {-1, 1}) {
      double const x = 9.2 + 1.9 * row;
      write_pew(writer, x, side > 0 ? 1.5 : -5.2, side > 0 ? 5.2 : -1.5);
    }
}

void write_aisle_walls(PatchWriter& writer) {
  for (int const side : {-1, 1})
    for (int bay = 0; bay < kBays; ++bay) {
      int const which = 2 * bay + (side > 0);
      double const x = kBay * (bay + 0.5);
      Panel picture{{x, 2.9, side * kAisleTo}, {0, 0, -1.0 * side}, {2.4, 2.4}, 0.15, 0.12, kBrass, {}};
      picture.color = [&](int column, int row, Vector2d const& cells) {
        return picture_color(which, column, row, cells);
      };
      write_panel(writer, picture);
      Panel window{{x, 6.0, side * kAisleTo}, {0, 0, -1.0 * side}, {1.7, 2.6}, 0.17, 0.15, kMarble, {}};
      window.color = [&](int column, int row, Vector2d const& cells) { return glass_color(which, column, row, cells); };
      write_panel(writer, window);
      if (bay % 2 == 1) write_statue(writer, {kBay * bay, 0, side * (kAisleTo - 0.85)}, side > 0 ? 0x86a0a8 : 0xb08a7a);
    }
  for (int const side : {-1, 1}) {
    Panel altar{{kNaveEnd, 3.2, side * (kAisleFrom + kAisle / 2)}, {-1, 0, 0}, {2.4, 3.6}, 0.12, 0.2, kMarble, {}};
    altar.color = [&](int column, int row, Vector2d const& cells) {
      return picture_color(5 + side, column, row, cells);
    };
    write_panel(writer, altar);
  }
}

void write_altar(PatchWriter& writer) {
  constexpr double kFloor = kChoirFloor + 0.03, kX = 42.2, kTop = kFloor + 1.05;
  write_box(writer, {kX - 0.9, kFloor - kJoint, -2}, {kX + 1.5, kFloor + 0.16, 2}, bgr_from_paint(0xb9ac98));
  Blocks table;
  table.lines = {
      std::vector{kX, kX + 0.9}, {kFloor + 0.14, kFloor + 0.3, kFloor + 0.9, kTop}, even_lines(-1.5, 1.5, 15)};
  table.is_solid = [](Vector3i const&) { return true; };
  table.color = [](Vector3i const& cell, int axis, int) {
    if (axis == 1 || cell.y() == 2) return bgr_from_paint(0xf1ece1);
    if (cell.y() == 0) return bgr_from_paint(kBrass);
    return bgr_from_paint(cell.z() % 3 == 1 ? 0xe0bd5a : 0x8e1f2f);
  };
  write_blocks(writer, table);
  for (int i = 0; i < 6; ++i) write_candlestick(writer, {kX + 0.6, kTop, -1.25 + 0.5 * i}, 0.75);
  double const retable = kX + 1.3;
  write_box(writer, {retable, kFloor + 0.14, -1.7}, {retable + 0.3, kFloor + 3.9, 1.7}, bgr_from_paint(kMarble));
  Panel panel{{retable, kFloor + 2.5, 0}, {-1, 0, 0}, {2.6, 2.4}, 0.08, 0.16, kBrass, {}};
  panel.color = [](int column, int row, Vector2d const& cells) { return picture_color(4, column, row, cells); };
  write_panel(writer, panel);
}

/// On a chain from the vault.
void write_lamp(PatchWriter& writer, double x) {
  constexpr double kVaultTop = kVaultSpring + kNaveHalf, kBowl = 6.4;
  write_lathe(writer, {x, kBowl, 0},
              {{{{0, 0}, {0.12, 0.05}, {0.42, 0.3}, {0.5, 0.55}}, bgr_from_paint(kBrass), 0},
               {{{0.5, 0.55}, {0.42, 0.6}, {0.2, 0.75}, {0.1, 0.8}}, bgr_from_paint(0xf6e7c0), 0},
               {{{0.1, 0.8}, {0.03, 0.9}, {0.03, kVaultTop + 0.3 - kBowl}, {0, kVaultTop + 0.3 - kBowl}},
                bgr_from_paint(kIron),
                0}},
              16);
}

/// A bowl on a foot: of a font, and of a pulpit.
void write_font(PatchWriter& writer, Vector3d const& foot) {
  write_lathe(writer, foot,
              {{{{0, -kJoint}, {0.75, -kJoint}, {0.75, 0.18}, {0.5, 0.22}}, bgr_from_paint(0x8d8478), 0},
               {{{0.5, 0.22}, {0.22, 0.4}, {0.2, 0.7}, {0.55, 0.95}, {0.65, 1.12}}, bgr_from_paint(0xc47d62), 0},
               {{{0.65, 1.12}, {0.6, 1.2}, {0.5, 1.05}, {0, 1.0}}, bgr_from_paint(0xb9cdd0), 0}},
              24);
}

void write_pulpit(PatchWriter& writer, Vector3d const& foot) {
  write_lathe(
      writer, foot,
      {{{{0, -kJoint}, {0.55, -kJoint}, {0.5, 0.2}, {0.22, 0.35}, {0.22, 1.3}, {0.5, 1.65}, {0.85, 1.9}},
        bgr_from_paint(0x9a8f80),
        0},
       {{{0.85, 1.9}, {0.85, 2.8}}, bgr_from_paint(0xb46a4f), 12},
       {{{0.85, 2.8}, {0.95, 2.85}, {0.95, 2.95}, {0.75, 2.95}, {0.75, 2.0}, {0, 2.0}}, bgr_from_paint(kMarble), 0}},
      36);
}

}  // namespace

void write_church_furniture(PatchWriter& writer) {
  write_pews(writer);
  write_aisle_walls(writer);
  write_altar(writer);
  for (double const x : {7.5, 17.5, 27.5}) write_lamp(writer, x);
  write_font(writer, {5, 0, 2.8});
  write_pulpit(writer, {27.6, 0, -5.2});
  for (int const side : {-1, 1}) {
    write_statue(writer, {39.2, kChoirFloor, side * 6.0}, side > 0 ? 0x7f4f7a : 0x4f7f6a);
    for (double const x : {33.2, 38.0}) write_candlestick(writer, {x, kChoirFloor, side * 3.4}, 1.5);
  }
}

}  // namespace scanview
