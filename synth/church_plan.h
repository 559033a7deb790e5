#pragma once
#include "synth/patch_writer.h"

namespace scanview {

/// The plan of the church (church.h): bays along x, mirrored about z = 0.
inline constexpr int kBays = 8;
inline constexpr double kBay = 5, kNaveEnd = kBays * kBay;
inline constexpr double kNaveHalf = 7, kArcade = 1.2, kAisle = 3.8, kAisleWall = 0.8;
inline constexpr double kAisleFrom = kNaveHalf + kArcade, kAisleTo = kAisleFrom + kAisle;  ///< |z| of its floor
inline constexpr double kArcadeMiddle = kNaveHalf + kArcade / 2;                           ///< |z| of the columns
inline constexpr double kArcadeSpring = 5.8, kArcadeTop = 8.3;
inline constexpr double kVaultSpring = 9;
inline constexpr double kEastWall = 1, kApseX = kNaveEnd + kEastWall, kApseRadius = 5.05, kApseSpring = 7;
inline constexpr double kChoirFrom = 31.4, kChoirFloor = 0.45;
inline constexpr double kJoint = 0.02;  ///< things reach so deep into what they stand on or hang at

void write_church_building(PatchWriter& writer);   ///< church_building.cpp and church_apse.cpp
void write_church_furniture(PatchWriter& writer);  ///< what can be carried away, and what hangs on walls

/// The nave's east wall with the arch of the apse, the apse and its half dome.
void write_church_apse(PatchWriter& writer);

}  // namespace scanview
