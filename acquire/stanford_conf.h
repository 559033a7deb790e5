#pragma once
#include <Eigen/Geometry>
#include <filesystem>
#include <string>
#include <vector>

namespace scanview {

/// A line "bmesh FILE tx ty tz qx qy qz qw" of a Stanford .conf: p_object = R(q)ᵀ p_scan + t, quaternion scalar last.
struct StanfordScan {
  std::string file;
  Eigen::Isometry3d object_from_scan;
};

/// The scans of a .conf in order; "camera" and "mesh" lines are left out. Throws Error{bad_input} where a line cannot
/// be read, a quaternion is not of unit length within 1 %, or there is no scan.
std::vector<StanfordScan> read_stanford_conf(std::filesystem::path const& path);
std::vector<StanfordScan> parse_stanford_conf(std::string const& text, std::filesystem::path const& name_in_errors);

/// Scans have x right, y up and look along -z; cameras x right, y down and look along +z. The camera of an imported
/// scan has the scan's origin.
Eigen::Isometry3d scan_from_camera();

}  // namespace scanview
