#pragma once
#include <filesystem>
#include <optional>

#include "acquire/rgbd_manifest.h"

namespace scanview {

/// Recognises a folder without rgbd.json by its files; nothing where it is none of these:
///   * 7-Scenes: frame-NNNNNN.color.(png|jpg), .depth.png, .pose.txt, camera-intrinsics.txt (3x3; without it the
///   Kinect's
///     585 585 320 240); depth in mm, 0 and 65535 missing.
///   * TUM: rgb.txt and depth.txt (time stamp, file), nearest stamps within 0.02 s; groundtruth.txt (time stamp,
///     translation, quaternion x y z w); 5000 steps a metre. The sets name no intrinsics: those published for
///     freiburg1..3 are taken by the folder's name, else the Kinect's 525 525 319.5 239.5; either way with a warning.
///   * Redwood and Open3D: color|image|rgb and depth, files in sorted order, camera_intrinsic.json (or intrinsic.json),
///     trajectory.log (or *.log); depth in mm.
/// Throws Error{bad_input} where a layout is recognised but its files contradict each other.
std::optional<RgbdSource> read_rgbd_layout(std::filesystem::path const& folder);

/// The name of the layout ("7-Scenes", "TUM", "Redwood") or nothing, without reading more than the folder.
std::optional<std::string> recognise_rgbd_layout(std::filesystem::path const& folder);

}  // namespace scanview
