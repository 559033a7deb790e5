#pragma once
// Where the statuette's parts are: what its shape (statuette.cpp) and its paint (statuette_paint.cpp) share. Lengths in
// mm.
#include <Eigen/Core>
#include <cmath>

#include "synth/distance_field.h"

namespace scanview {

enum class StatuettePart { plinth, dog, nose, tongue, collar, tag, hoop, stem, leaf, petals, button, ladybird };

inline constexpr float kPlinthRadius = 38, kPlinthTop = 12;
inline constexpr float kEyeRadius = 3.1f;
inline constexpr float kHoopMajor = 12.8f, kHoopMinor = 2.2f;
inline constexpr int kPetals = 7;
inline Eigen::Vector3f const kEye{6.4f, 80.6f, 20.0f};  // of the dog's left, in the head's frame; mirrored in x
inline Eigen::Vector3f const kTag{0, 52.2f, 17.2f};
inline Eigen::Vector3f const kHoop{-24.5f, 26.2f, 15.5f};
inline Eigen::Vector3f const kFlower{30.5f, 53, 17};
inline Eigen::Vector3f const kLadybird{13.5f, 12.6f, 31.5f};

/// The head is tilted about the neck and turned a little towards the flower.
inline Frame3 const& head_frame() {
  static Frame3 const frame({0, 64, 6}, {-0.15f, 0.55f, -1}, 0.20f);
  return frame;
}
inline Eigen::Vector3f head_frame_inverse(Eigen::Vector3f const& h) {
  return Frame3({0, 64, 6}, {-0.15f, 0.55f, -1}, -0.20f).local(h);
}
/// The ear on the side x > 0, hanging from the temple, in the head's frame.
inline float ear_distance(Eigen::Vector3f const& h) {
  static Frame3 const frame({12, 86, 5}, {0, 0, 1}, 0.46f);
  Eigen::Vector3f const e = frame.local(h);
  float const bend = 0.012f * (e.y() - 84) * (e.y() - 84);
  return ellipsoid_distance({e.x() + bend, e.y(), e.z()}, {13.0f, 74.5f, 6}, {2.1f, 12.5f, 7.2f});
}
inline Frame3 const& hoop_frame() {
  static Frame3 const frame = Frame3::facing(kHoop, {-0.45f, 0.22f, 0.9f});
  return frame;
}
inline Frame3 const& flower_frame() {
  static Frame3 const frame = Frame3::facing(kFlower, {0.35f, 0.32f, 0.9f});
  return frame;
}
/// Long side along x, flat in y.
inline Frame3 leaf_frame(int which) {
  return which == 0 ? Frame3::facing({33.5f, 24.5f, 16}, {0.45f, 0.3f, 1})
                    : Frame3::facing({21.5f, 33, 16}, {0.5f, 0.25f, 1});
}
inline Frame3 const& ladybird_frame() {
  static Frame3 const frame(kLadybird, {0, 1, 0}, 0.9f);
  return frame;
}

}  // namespace scanview
