#pragma once
#include <Eigen/Geometry>
#include <filesystem>
#include <string>
#include <vector>

namespace scanview {

/// One `bmesh FILE tx ty tz qx qy qz qw` line of a Stanford .conf. Its numbers are checked when its pose is asked for,
/// so that a bad line costs one view.
struct ConfLine {
  std::string file;
  std::vector<double> numbers;  ///< NaN for a word that is none
};

/// The lines of `text`; others (a viewer's camera, scans without a grid) are passed over. Throws Error{bad_input, path}
/// where there is none.
std::vector<ConfLine> parse_conf(std::string const& text, std::filesystem::path const& path);

/// world = R(q)^T p + t: the conf's quaternion is that of the inverse rotation. Throws Error{bad_input, path} naming
/// the file whose pose is none.
Eigen::Isometry3d world_from_scan(ConfLine const& line, std::filesystem::path const& path);
/// The line from which world_from_scan reads this pose.
std::string format_conf_line(std::string const& file, Eigen::Isometry3d const& world_from_scan);

}  // namespace scanview
