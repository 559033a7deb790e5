#include "synth/gallery_building.h"

#include <cstdint>
#include <utility>
#include <vector>

#include "synth/building_shapes.h"
#include "synth/paint.h"

namespace scanview {
namespace {

using Eigen::Vector3i;

constexpr std::uint32_t kWalls[kRoomsZ][kRoomsX] = {{0xefe4cf, 0xcfdeea, 0xd6e6cd}, {0xecd3cf, 0xf0e3b4, 0xddd4ea}};
constexpr std::uint32_t kFloors[kRoomsZ][kRoomsX][2] = {
    {{0x3a424d, 0xe4e0d6}, {0x97473a, 0xe8d9c6}, {0x3d6155, 0xe4e6d6}},
    {{0x574a7c, 0xdbd6e4}, {0x6b5342, 0xe7ddc7}, {0x2d547c, 0xe0e5ea}}};
constexpr std::uint32_t kCeiling = 0xefece6, kReveal = 0xe6e2da, kThreshold = 0x8b8378, kOutside = 0xb9b4ab;
constexpr std::uint32_t kSkirting = 0x6a6058;

enum Level { slab, foot, door, above, roof };

/// What lies between two lines of the plan along one axis.
struct Stretch {
  int room = -1;  ///< none: a wall
  int tile = -1;
  int wall = -1;
};

struct Axis {
  std::vector<double> lines;
  std::vector<Stretch> stretches;
};

Axis make_axis(int rooms) {
  Axis axis;
  axis.lines.push_back(0);
  for (int room = 0; room <= rooms; ++room) {
    double const corner = kWall + room * (kRoom + kWall);
    axis.stretches.push_back({-1, -1, room});
    axis.lines.push_back(corner);
    for (int tile = 0; tile < kRoomTiles && room < rooms; ++tile) {
      axis.stretches.push_back({room, tile, -1});
      axis.lines.push_back(corner + kTile * (tile + 1));
    }
  }
  return axis;
}

bool is_skylight(int tile) { return (tile >= 1 && tile <= 3) || (tile >= 6 && tile <= 8); }

class Building {
 public:
  Building() : x_(make_axis(kRoomsX)), z_(make_axis(kRoomsZ)) {}

  Blocks blocks() const {
    Blocks result;
    result.lines = {x_.lines, {-kWall, 0, 0.16, kDoorHeight, kRoomHeight, kRoomHeight + kWall}, z_.lines};
    result.is_solid = [this](Vector3i const& cell) { return is_solid(cell); };
    result.color = [this](Vector3i const& cell, int axis, int sign) {
      return bgr_from_paint(color(cell, axis, cell + sign * Vector3i::Unit(axis)));
    };
    return result;
  }

 private:
  static bool is_inside(int wall, int rooms) { return wall > 0 && wall < rooms; }

  bool is_solid(Vector3i const& cell) const {
    Stretch const &x = x_.stretches[cell.x()], &z = z_.stretches[cell.z()];
    bool const in_room = x.room >= 0 && z.room >= 0;
    if (cell.y() == slab) return true;
    if (cell.y() == roof) return !in_room || !is_skylight(x.tile) || !is_skylight(z.tile);
    if (in_room) return false;
    bool const is_door = (is_inside(x.wall, kRoomsX) && (z.tile == kDoorZ || z.tile == kDoorZ + 1)) ||
                         (is_inside(z.wall, kRoomsZ) && (x.tile == kDoorX || x.tile == kDoorX + 1));
    return !is_door || cell.y() == above;
  }

  /// Of the face that the empty cell `next` shows.
  std::uint32_t color(Vector3i const& cell, int axis, Vector3i const& next) const {
    if (next.x() < 0 || next.z() < 0 || next.x() >= int(x_.stretches.size()) || next.z() >= int(z_.stretches.size()) ||
        next.y() < 0 || next.y() > roof)
      return kOutside;
    Stretch const &x = x_.stretches[next.x()], &z = z_.stretches[next.z()];
    bool const in_room = x.room >= 0 && z.room >= 0;
    if (next.y() == roof || (axis == 1 && cell.y() == roof)) return kCeiling;
    if (axis == 1 && cell.y() == slab) return in_room ? kFloors[z.room][x.room][(x.tile + z.tile) % 2] : kThreshold;
    if (!in_room) return kReveal;
    return next.y() == foot ? kSkirting : kWalls[z.room][x.room];
  }

  Axis x_, z_;
};

}  // namespace

void write_building(PatchWriter& writer) {
  Building const building;
  write_blocks(writer, building.blocks());
}

}  // namespace scanview
