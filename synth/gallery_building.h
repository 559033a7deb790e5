#pragma once
#include <Eigen/Core>

#include "synth/patch_writer.h"

namespace scanview {

/// The plan of the gallery's building. Rooms are counted along x and z; each is kRoomTiles² tiles large, between walls
/// of kWall. A doorway is two tiles wide: in walls across x the tiles kDoorZ on, in walls across z those kDoorX on.
inline constexpr int kRoomsX = 3, kRoomsZ = 2, kRoomTiles = 10;
inline constexpr double kTile = 0.8, kWall = 0.4, kRoom = kRoomTiles * kTile;
inline constexpr double kDoorHeight = 2.56, kRoomHeight = 4;
inline constexpr int kDoorZ = 2, kDoorX = 6;

/// The corner of a room with the least x and z, on the floor.
inline Eigen::Vector3d room_corner(int x, int z) {
  return {kWall + x * (kRoom + kWall), 0, kWall + z * (kRoom + kWall)};
}

/// Floors, walls with doorways, ceilings with skylights: one closed solid.
void write_building(PatchWriter& writer);

}  // namespace scanview
