#pragma once
#include <Eigen/Geometry>
#include <filesystem>
#include <string>
#include <vector>

namespace scanview {

/// One pose of a trajectory file.
struct TrajectoryPose {
  double time = 0;  ///< seconds; of formats without a clock, the number of the pose
  Eigen::Isometry3d world_from_camera = Eigen::Isometry3d::Identity();
  std::string problem;  ///< why it is no pose, naming the line; mostly empty. One bad pose costs one view.
};

// Poses in the file's order, whose words are numbers: else Error{bad_input} naming the line. Lines that start with '#'
// are left out.

/// TUM RGB-D: "time tx ty tz qx qy qz qw" a line.
std::vector<TrajectoryPose> read_tum_trajectory(std::filesystem::path const& path);
/// Redwood and Open3D (.log): blocks of a line of three integers and a 4x4 matrix, row by row.
std::vector<TrajectoryPose> read_redwood_trajectory(std::filesystem::path const& path);

}  // namespace scanview
