#include "synth/building_shapes.h"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace scanview {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;
using Eigen::Vector3i;

constexpr double kTurn = 2 * std::numbers::pi;
constexpr double kFluteDepth = 0.09;  // of the radius
constexpr double kFluteEnd = 0.15;    // over which a flute begins
constexpr double kSmall = 0.2;        // radius of a sphere that few triangles are enough for
constexpr int kStepsAFlute = 3;       // at least

/// Of step `i` of `count` around; the last is the first, bit by bit.
double angle_at(int i, int count) { return kTurn * (i % count) / count; }

}  // namespace

void write_blocks(PatchWriter& writer, Blocks const& blocks) {
  std::array<std::vector<std::vector<double>>, 3> ways;
  Vector3i cells;
  for (int axis = 0; axis < 3; ++axis) {
    ways[axis] = writer.divided(blocks.lines[axis]);
    cells[axis] = static_cast<int>(ways[axis].size());
  }
  auto const is_solid = [&](Vector3i const& cell) {
    return (cell.array() >= 0).all() && (cell.array() < cells.array()).all() && blocks.is_solid(cell);
  };
  auto const write_face = [&](Vector3i const& cell, int axis, int sign) {
    int const u = (axis + (sign > 0 ? 1 : 2)) % 3, v = (axis + (sign > 0 ? 2 : 1)) % 3;
    auto const &columns = ways[u][cell[u]], &rows = ways[v][cell[v]];
    double const level = blocks.lines[axis][cell[axis] + (sign > 0 ? 1 : 0)];
    Patch patch;
    patch.columns = static_cast<int>(columns.size()) - 1;
    patch.rows = static_cast<int>(rows.size()) - 1;
    patch.color = blocks.color(cell, axis, sign);
    patch.point = [&](int column, int row) -> Vector3d {
      Vector3d point;
      point[axis] = level;
      point[u] = columns[column];
      point[v] = rows[row];
      return blocks.place ? blocks.place(point) : point;
    };
    writer.add(patch);
  };
  for (int z = 0; z < cells.z(); ++z)
    for (int y = 0; y < cells.y(); ++y)
      for (int x = 0; x < cells.x(); ++x) {
        Vector3i const cell(x, y, z);
        if (!is_solid(cell)) continue;
        for (int axis = 0; axis < 3; ++axis)
          for (int const sign : {-1, 1})
            if (!is_solid(cell + sign * Vector3i::Unit(axis))) write_face(cell, axis, sign);
      }
}

std::vector<double> even_lines(double low, double high, int cells) {
  std::vector<double> lines;
  lines.reserve(static_cast<std::size_t>(cells) + 1);
  for (int i = 0; i < cells; ++i) lines.push_back(low + (high - low) * i / cells);
  lines.push_back(high);
  return lines;
}

void write_box(PatchWriter& writer, Vector3d const& low, Vector3d const& high, cv::Vec3b const& color) {
  Blocks box;
  for (int axis = 0; axis < 3; ++axis) box.lines[axis] = {low[axis], high[axis]};
  box.is_solid = [](Vector3i const&) { return true; };
  box.color = [&](Vector3i const&, int, int) { return color; };
  write_blocks(writer, box);
}

void write_lathe(PatchWriter& writer, Vector3d const& foot, std::vector<Profile> const& parts, int least_around) {
  double widest = 0;
  int flutes = 1;
  for (Profile const& part : parts) {
    for (Vector2d const& point : part.points) widest = std::max(widest, point.x());
    flutes = std::max(flutes, part.flutes);
  }
  int const wanted = writer.round_steps(kTurn * widest, least_around);
  int const around = flutes > 1 ? flutes * std::max(kStepsAFlute, wanted / flutes) : wanted;
  for (Profile const& part : parts) {
    std::vector<Vector2d> line;
    for (std::size_t i = 0; i + 1 < part.points.size(); ++i) {
      Vector2d const &from = part.points[i], &to = part.points[i + 1];
      int const count = writer.steps((to - from).norm());
      for (int k = 0; k < count; ++k) line.push_back(from + (to - from) * k / count);
    }
    line.push_back(part.points.back());
    Patch patch;
    patch.columns = around;
    patch.rows = static_cast<int>(line.size()) - 1;
    patch.closed = Patch::Closed::around;
    bool const has_first = line.front().x() == 0, has_last = line.back().x() == 0;
    if (has_first) patch.pole = has_last ? Patch::Pole::both : Patch::Pole::first;
    if (has_last && !has_first) patch.pole = Patch::Pole::last;
    patch.color = part.color;
    patch.point = [&](int column, int row) -> Vector3d {
      double const angle = angle_at(column, around);
      double const from_end = std::min(line[row].y() - line.front().y(), line.back().y() - line[row].y());
      double const depth = kFluteDepth * std::min(1.0, from_end / kFluteEnd);
      double const hollow = part.flutes > 0 ? depth * std::abs(std::sin(0.5 * part.flutes * angle)) : 0;
      double const radius = line[row].x() * (1 - hollow);
      return foot + Vector3d(radius * std::sin(angle), line[row].y(), radius * std::cos(angle));
    };
    writer.add(patch);
  }
}

void write_sphere(PatchWriter& writer, Vector3d const& center, double radius, cv::Vec3b const& color) {
  int const around = writer.round_steps(kTurn * radius, radius < kSmall ? 8 : 16);
  Patch patch;
  patch.columns = around;
  patch.rows = around / 2;
  patch.closed = Patch::Closed::around;
  patch.pole = Patch::Pole::both;
  patch.color = color;
  patch.point = [&](int column, int row) -> Vector3d {
    double const height = std::cos(0.5 * kTurn * row / patch.rows), angle = angle_at(column, around);
    double const ring = row == 0 || row == patch.rows ? 0 : std::sin(0.5 * kTurn * row / patch.rows);
    return center + radius * Vector3d(ring * std::sin(angle), -height, ring * std::cos(angle));
  };
  writer.add(patch);
}

void write_torus(PatchWriter& writer, Torus const& torus) {
  int const around = writer.round_steps(kTurn * torus.radius, 36);
  int const rows = writer.round_steps(kTurn * torus.tube / torus.bands, 1);
  for (int band = 0; band < torus.bands; ++band) {
    Patch patch;
    patch.columns = around;
    patch.rows = rows;
    patch.closed = Patch::Closed::around;
    patch.color = torus.color(band);
    patch.point = [&](int column, int row) -> Vector3d {
      double const major = angle_at(column, around), minor = angle_at(band * rows + row, torus.bands * rows);
      double const radius = torus.radius + torus.tube * std::cos(minor);
      return torus.center + torus.rotation * Vector3d(radius * std::cos(major), radius * std::sin(major),
                                                      torus.tube * std::sin(minor));
    };
    writer.add(patch);
  }
}

}  // namespace scanview
