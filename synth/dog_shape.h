#pragma once
// Where the toy dog's parts are and the shapes of its fur: what the solids (dog.cpp) and the paint (dog_paint.cpp)
// share. Lengths in mm; "head" coordinates are those of dog_head_frame(), where the head looks along +z.
#include <Eigen/Core>

#include "synth/distance_field.h"

namespace scanview {

enum class DogPart { fur, nose, eye, tongue, collar, buckle, ring, tag };

inline constexpr float kDogEyeRadius = 4.1f;
inline Eigen::Vector3f const kDogEye{8.4f, 98.5f, 46.2f};  // head; of the dog's left, mirrored in x
inline Eigen::Vector3f const kDogNose{0, 92.6f, 62.5f};    // head
inline Eigen::Vector3f const kDogTag{0, 53.2f, 38.4f};     // the middle of the bone
inline constexpr float kDogCollarRadius = 15.9f, kDogCollarHalfHeight = 3.1f;
inline constexpr float kDogTagHalfLength = 6.5f;

Frame3 const& dog_head_frame();
/// From head coordinates.
Eigen::Vector3f dog_from_head(Eigen::Vector3f const& head);
/// The neck's axis is z, forward is -y.
Frame3 const& dog_collar_frame();
Frame3 const& dog_tag_frame();

/// The parts of the fur.
float dog_torso_distance(Eigen::Vector3f const& p);
float dog_leg_distance(Eigen::Vector3f const& p, int leg);  ///< 0 to 3: front left, front right, hind left, hind right
float dog_tail_distance(Eigen::Vector3f const& p);
float dog_skull_distance(Eigen::Vector3f const& head);

/// The ears, in head coordinates.
BladeShape const& dog_left_ear();   ///< hangs
BladeShape const& dog_right_ear();  ///< stands, its tip folded over

/// Distances in the plane of the flank to the outlines of the patches that are sewn on: a square on the left flank, a
/// heart on the right one; a large number on the other flank.
float dog_square_patch_distance(Eigen::Vector3f const& p);
float dog_heart_patch_distance(Eigen::Vector3f const& p);
/// To the line of the mouth on the front of the snout.
float dog_mouth_distance(Eigen::Vector3f const& head);
/// To the seam down the middle of the back, the belly and the head.
float dog_seam_distance(Eigen::Vector3f const& p);

/// All of the fur, feet flat on y = 0, with seams, patches and tufts.
float dog_fur_distance(Eigen::Vector3f const& p);

/// Noise drawn out along the direction in which the fur lies, in about [-1, 1], hairs about 1 mm thick.
float dog_hairs(Eigen::Vector3f const& p);

}  // namespace scanview
