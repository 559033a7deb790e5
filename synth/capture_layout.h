#pragma once
#include <Eigen/Geometry>
#include <vector>

#include "calib/stereo_rig.h"
#include "synth/capture_options.h"
#include "synth/centered_model.h"

namespace scanview {

/// Where everything stands. The room has y up and its origin on top of the turntable; cameras and lamp are fixed in it,
/// on the side of +z, and look slightly down; the object lies on the turntable, turned for every view.
struct CaptureLayout {
  StereoRig rig;         ///< as it was calibrated
  StereoRig rig_in_use;  ///< as it took the pictures: another one where the rig moved
  Eigen::Isometry3d room_from_left = Eigen::Isometry3d::Identity();
  Eigen::Isometry3d room_from_light = Eigen::Isometry3d::Identity();  ///< like a camera: z ahead, y down
  std::vector<Eigen::Isometry3d> room_from_object;                    ///< of each view
  Eigen::Vector3d target = Eigen::Vector3d::Zero();                   ///< what all look at, room
  double sweep_low = 0, sweep_high = 0;  ///< angles about the lamp's y axis, rad: what the light covers
  double tallest = 0;                    ///< the largest |y / z| of the object as the lamp sees it
  double disc_radius = 0;                ///< of the turntable
  double backdrop_z = 0;                 ///< the backdrop is the plane z = backdrop_z

  Eigen::Isometry3d room_from_right() const { return room_from_left * rig_in_use.right_from_left.inverse(); }
  Eigen::Isometry3d object_from_left(std::size_t view) const {
    return room_from_object[view].inverse() * room_from_left;
  }
  double lamp_distance() const { return (room_from_light.translation() - target).norm(); }
};

/// Two cameras of about 1.3 picture widths focal length, each with a lens of its own, just so far away that the model
/// stays within three quarters of their pictures in every view; the lamp between and above them.
CaptureLayout make_layout(CenteredModel const& model, CaptureOptions const& options);

/// The left camera without its lens: what depths are delivered in.
Camera ideal_left_camera(StereoRig const& rig);

}  // namespace scanview
