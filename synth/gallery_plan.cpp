#include "synth/gallery_plan.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cstdint>
#include <numbers>
#include <vector>

#include "synth/building_shapes.h"
#include "synth/gallery.h"
#include "synth/gallery_building.h"
#include "synth/paint.h"

namespace scanview {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;
using Eigen::Vector3i;

constexpr double kSunk = 0.02;  // things reach so deep into what they stand on or hang at
constexpr std::uint32_t kMarble = 0xe2ddd2, kPlinth = 0xd8d3c9, kIron = 0x3c4046, kBrass = 0xb08a3e;

/// Of a colour circle, at full strength.
cv::Vec3b hue(double turn) {
  auto const channel = [&](double at) {
    double const away = std::abs(turn - at - std::round(turn - at)) * 6;  // 0 to 3
    return static_cast<float>(0.12 + 0.76 * std::clamp(2 - away, 0.0, 1.0));
  };
  return bgr_from_paint({channel(0), channel(1.0 / 3), channel(2.0 / 3)});
}

enum class Wall { low_x, high_x, low_z, high_z };
enum class Pattern { stripes, bars, frames, diagonals, mosaic };

struct Picture {
  int room_x, room_z;
  Wall wall;
  double along;  ///< its middle, from the room's corner
  double width, height;
  Pattern pattern;
  std::vector<std::uint32_t> colors;
};

std::uint32_t pattern_color(Picture const& picture, Vector2d const& cells, int column, int row) {
  std::size_t at = 0;
  switch (picture.pattern) {
    case Pattern::stripes:
      at = column;
      break;
    case Pattern::bars:
      at = row;
      break;
    case Pattern::frames:
      at = std::min({column, row, static_cast<int>(cells.x()) - 1 - column, static_cast<int>(cells.y()) - 1 - row});
      break;
    case Pattern::diagonals:
      at = column + row;
      break;
    case Pattern::mosaic:
      at = column * column + 3 * row + column * row;
      break;
  }
  return picture.colors[at % picture.colors.size()];
}

void write_picture(PatchWriter& writer, Picture const& picture) {
  constexpr double kFrame = 0.08, kFrameDepth = 0.05, kPanelDepth = 0.06, kMiddle = 1.65, kCell = 0.25;
  bool const across_x = picture.wall == Wall::low_x || picture.wall == Wall::high_x;
  bool const is_low = picture.wall == Wall::low_x || picture.wall == Wall::low_z;
  int const out = across_x ? 0 : 2, side = 2 - out;
  Vector3d const corner = room_corner(picture.room_x, picture.room_z);
  double const wall = corner[out] + (is_low ? 0 : kRoom), sign = is_low ? 1 : -1;
  auto const depths = [&](double depth) {
    return is_low ? std::vector{wall - kSunk, wall + depth} : std::vector{wall - depth, wall + kSunk};
  };
  double const middle = corner[side] + picture.along;
  Vector2d const half(0.5 * picture.width, 0.5 * picture.height), inner = half - Vector2d(kFrame, kFrame);
  Vector2d const cells = (2 * inner / kCell).array().round();

  Vector3d low, high;
  low[out] = depths(kFrameDepth).front();
  high[out] = depths(kFrameDepth).back();
  low[side] = middle - half.x();
  high[side] = middle + half.x();
  low.y() = kMiddle - half.y();
  high.y() = kMiddle + half.y();
  write_box(writer, low, high, bgr_from_paint(kBrass));

  Blocks panel;
  panel.lines[out] = depths(kPanelDepth);
  panel.lines[side] = even_lines(middle - inner.x(), middle + inner.x(), static_cast<int>(cells.x()));
  panel.lines[1] = even_lines(kMiddle - inner.y(), kMiddle + inner.y(), static_cast<int>(cells.y()));
  panel.is_solid = [](Vector3i const&) { return true; };
  panel.color = [&](Vector3i const& cell, int axis, int face) {
    bool const is_front = axis == out && face == static_cast<int>(sign);
    return bgr_from_paint(is_front ? pattern_color(picture, cells, cell[side], cell.y()) : kIron);
  };
  write_blocks(writer, panel);
}

void write_column(PatchWriter& writer, Vector3d const& foot) {
  constexpr int kFlutes = 12;
  cv::Vec3b const marble = bgr_from_paint(kMarble);
  write_box(writer, foot + Vector3d(-0.42, -kSunk, -0.42), foot + Vector3d(0.42, 0.16, 0.42), marble);
  write_box(writer, foot + Vector3d(-0.42, kRoomHeight - 0.16, -0.42), foot + Vector3d(0.42, kRoomHeight + kSunk, 0.42),
            marble);
  Profile const base = {{{0, 0.14}, {0.41, 0.14}, {0.41, 0.22}, {0.3, 0.34}}, marble, 0};
  Profile const shaft = {{{0.3, 0.34}, {0.28, 1.6}, {0.24, 3.5}}, marble, kFlutes};
  Profile const capital = {{{0.24, 3.5}, {0.29, 3.55}, {0.4, 3.78}, {0.4, 3.86}, {0, 3.86}}, marble, 0};
  write_lathe(writer, foot, {base, shaft, capital}, 24);
}

void write_pole(PatchWriter& writer, Vector3d const& foot, double height, double radius, std::uint32_t color) {
  write_lathe(writer, foot,
              {{{{0, -kSunk}, {radius, -kSunk}, {radius, height}, {0, height}}, bgr_from_paint(color), 0}}, 8);
}

/// A sphere on a plinth of a square base.
void write_exhibit(PatchWriter& writer, Vector3d const& foot, double plinth_height, double radius,
                   std::uint32_t color) {
  double const half = std::max(0.3, 0.7 * radius);
  write_box(writer, foot - Vector3d(half, kSunk, half), foot + Vector3d(half, plinth_height, half),
            bgr_from_paint(kPlinth));
  write_sphere(writer, foot + Vector3d(0, plinth_height + radius - 0.5 * kSunk, 0), radius, bgr_from_paint(color));
}

/// Along x or z, `posts` of them.
void write_railing(PatchWriter& writer, Vector3d const& from, Vector3d const& to, int posts) {
  constexpr double kHeight = 1, kHalf = 0.025;
  for (int i = 0; i < posts; ++i) write_pole(writer, from + (to - from) * i / (posts - 1), kHeight, 0.02, kIron);
  for (double const height : {0.5, kHeight})
    write_box(writer, from + Vector3d(-kHalf, height - kHalf, -kHalf), to + Vector3d(kHalf, height + kHalf, kHalf),
              bgr_from_paint(kBrass));
}

std::vector<Picture> pictures() {
  std::vector<std::uint32_t> const primary = {0xc8372d, 0xf0efe8, 0x24508f, 0xe9b92f, 0x222326},
                                   sea = {0x12355b, 0x2d7f9d, 0x9fd0c9, 0xf2e6c2},
                                   fire = {0x7a1f1f, 0xc9472b, 0xee9b3a, 0xf7dc7c}, ink = {0x1d1e22, 0xf1efe9},
                                   garden = {0x1f4d2b, 0x6ea24a, 0xd6d66b, 0xc2477d};
  return {{0, 0, Wall::low_x, 4, 2.6, 1.6, Pattern::stripes, primary},
          {0, 0, Wall::low_z, 4, 2.2, 1.6, Pattern::frames, fire},
          {0, 0, Wall::high_x, 5.8, 1.6, 1.2, Pattern::diagonals, ink},
          {1, 0, Wall::low_z, 2.2, 1.8, 1.8, Pattern::mosaic, primary},
          {1, 0, Wall::low_z, 5.8, 1.8, 1.8, Pattern::frames, ink},
          {1, 0, Wall::high_x, 5.8, 2.2, 1.4, Pattern::bars, sea},
          {2, 0, Wall::high_x, 4, 3, 1.6, Pattern::diagonals, garden},
          {2, 0, Wall::low_z, 4, 2.2, 1.4, Pattern::mosaic, sea},
          {0, 1, Wall::low_x, 4, 3, 1.8, Pattern::mosaic, fire},
          {0, 1, Wall::high_z, 4, 2.2, 1.6, Pattern::stripes, sea},
          {1, 1, Wall::high_z, 2.4, 1.8, 1.4, Pattern::bars, garden},
          {1, 1, Wall::high_x, 5.8, 2, 1.6, Pattern::frames, primary},
          {2, 1, Wall::high_x, 4, 2.6, 1.8, Pattern::stripes, ink},
          {2, 1, Wall::high_z, 4, 3, 1.6, Pattern::mosaic, garden},
          {2, 1, Wall::low_z, 2.4, 1.8, 1.4, Pattern::diagonals, fire}};
}

void write_spheres_room(PatchWriter& writer, Vector3d const& room) {
  write_exhibit(writer, room + Vector3d(1.8, 0, 2), 1, 0.4, 0xb8322a);
  write_exhibit(writer, room + Vector3d(3.4, 0, 4.2), 0.8, 0.55, 0xe0b02c);
  write_exhibit(writer, room + Vector3d(1.8, 0, 6.2), 1, 0.4, 0x2a559c);
}

void write_torus_room(PatchWriter& writer, Vector3d const& room) {
  Torus torus;
  torus.radius = 1.25;
  torus.tube = 0.42;
  torus.center = room + Vector3d(3.2, 0.25 + torus.radius + torus.tube - 2 * kSunk, 5);
  torus.rotation = Eigen::AngleAxisd(-0.5, Vector3d::UnitY()).toRotationMatrix();
  torus.color = [&](int band) { return hue(static_cast<double>(band) / torus.bands); };
  write_torus(writer, torus);
  write_box(writer, room + Vector3d(2.1, -kSunk, 4.1), room + Vector3d(4.3, 0.25, 5.9), bgr_from_paint(kPlinth));
}

void write_columns_room(PatchWriter& writer, Vector3d const& room) {
  for (double const x : {1.5, 6.5})
    for (double const z : {4.4, 7.0}) write_column(writer, room + Vector3d(x, 0, z));
  write_exhibit(writer, room + Vector3d(5.2, 0, 1.9), 0.6, 0.7, 0x3f8f6b);
}

void write_railing_room(PatchWriter& writer, Vector3d const& room) {
  write_exhibit(writer, room + Vector3d(3, 0, 4.4), 0.3, 0.9, 0xc7662f);
  for (double const z : {2.8, 6.0}) write_railing(writer, room + Vector3d(1.4, 0, z), room + Vector3d(4.6, 0, z), 9);
  write_column(writer, room + Vector3d(6.6, 0, 6.6));
}

void write_steps_room(PatchWriter& writer, Vector3d const& room) {
  Vector3d const middle = room + Vector3d(2.6, 0, 5.2);
  for (int step = 0; step < 4; ++step) {
    double const half = 1.5 - 0.35 * step, top = 0.3 * (step + 1);
    write_box(writer, middle + Vector3d(-half, top - 0.3 - kSunk, -half), middle + Vector3d(half, top, half),
              bgr_from_paint(step % 2 == 0 ? 0xc9b79a : 0x9d8b70));
  }
  write_sphere(writer, middle + Vector3d(0, 1.58, 0), 0.4, bgr_from_paint(kBrass));
  for (int pole = 0; pole < 5; ++pole) {
    Vector3d const foot = room + Vector3d(6.8, 0, 4.4 + 0.7 * pole);
    write_pole(writer, foot, 2 + 0.3 * pole, 0.02, kIron);
    write_sphere(writer, foot + Vector3d(0, 2 + 0.3 * pole, 0), 0.12, hue(0.2 * pole));
  }
}

void write_last_room(PatchWriter& writer, Vector3d const& room) {
  write_exhibit(writer, room + Vector3d(2.2, 0, 6.4), 0.9, 0.3, 0x8e44a0);
  write_exhibit(writer, room + Vector3d(4, 0, 6.4), 0.7, 0.5, 0x2f9aa0);
  write_exhibit(writer, room + Vector3d(6.0, 0, 6.4), 0.5, 0.7, 0xd05a7a);
  write_railing(writer, room + Vector3d(1.2, 0, 5), room + Vector3d(6.8, 0, 5), 15);
}

}  // namespace

void write_gallery(PatchWriter& writer) {
  write_building(writer);
  for (Picture const& picture : pictures()) write_picture(writer, picture);
  write_spheres_room(writer, room_corner(0, 0));
  write_torus_room(writer, room_corner(1, 0));
  write_columns_room(writer, room_corner(2, 0));
  write_railing_room(writer, room_corner(0, 1));
  write_steps_room(writer, room_corner(1, 1));
  write_last_room(writer, room_corner(2, 1));
}

Eigen::AlignedBox3d gallery_walk_box() {
  constexpr double kEye = 1.6, kMargin = 0.6;
  Vector3d const low = room_corner(0, 0), high = room_corner(kRoomsX - 1, kRoomsZ - 1) + Vector3d(kRoom, 0, kRoom);
  Vector3d const margin(kMargin, 0, kMargin), eye(0, kEye, 0);
  return {low + margin + eye, high - margin + eye};
}

}  // namespace scanview
