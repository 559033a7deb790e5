#pragma once
#include <Eigen/Geometry>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "acquire/scan_set.h"
#include "calib/stereo_rig.h"

namespace scanview {

/// One colour and one depth file, and where they were taken from.
struct RgbdFrame {
  std::string name;  ///< of the view
  std::filesystem::path color, depth;
  std::optional<std::filesystem::path> pose_file;  ///< 4x4 text, object_from_camera
  std::optional<Eigen::Isometry3d> pose;           ///< where the pose does not come from a file of its own
  std::string problem;                             ///< why this frame alone cannot be used; mostly empty
};

/// A sequence of colour and depth frames: what rgbd.json says, or what a known layout implies.
struct RgbdSource {
  std::vector<RgbdFrame> frames;
  double depth_unit = 0.001;  ///< of one step of the 16-bit value, in `unit`
  Unit unit = Unit::m;
  std::vector<int> missing{0};  ///< values (after the rotation) that say "no depth"
  int depth_rotate_right = 0;   ///< bits; SUN RGB-D and some robots store rotated values
  LensCamera color;
  std::optional<LensCamera> depth;  ///< where the depth camera is not the colour camera
  Eigen::Isometry3d color_from_depth = Eigen::Isometry3d::Identity();
  bool fixed_camera = false;                 ///< the object turned, so the background stays
  std::vector<std::filesystem::path> files;  ///< that were read to know all this
  std::vector<std::string> warnings;
};

/// Reads rgbd.json (DESIGN §3); paths in it are relative to its folder. A key that is unknown, missing or of the wrong
/// kind is Error{bad_input} naming it. Whether the frames' files exist is not looked at here.
RgbdSource read_rgbd_manifest(std::filesystem::path const& path);

/// "{}" becomes the index, "{:06d}" the padded index. Throws Error{bad_input, path} where the pattern has other braces
/// or no place for the index.
std::string format_index(std::string const& pattern, int index, std::filesystem::path const& path);

/// Sixteen numbers (or twelve: the last row left out) of a text file, row by row: a rigid pose, or Error{bad_input}.
Eigen::Isometry3d read_pose_text(std::filesystem::path const& path);

}  // namespace scanview
