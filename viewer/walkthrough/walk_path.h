#pragma once
#include <Eigen/Core>
#include <cstddef>
#include <filesystem>
#include <vector>

#include "viewer/select/camera_path.h"
#include "viewer/walkthrough/walkthrough_file.h"

namespace scanview {

/// A camera that looks ahead: `angle_deg` across the picture's width.
Camera walking_camera(int width, int height, double angle_deg = 90);

/// Straight from one place to another in equal steps, both ends included (Darsa 1998, figure 23), looking along
/// `heading` (not parallel to up), which turns about up by `turn_deg` on the way.
std::vector<PathCamera> straight_walk(Eigen::Vector3d const& from, Eigen::Vector3d const& to,
                                      Eigen::Vector3d const& heading, Eigen::Vector3d const& up, double turn_deg,
                                      std::size_t frames, Camera const& camera);

/// Through the places in their order, with speed even all the way, looking where the way leads a little later.
std::vector<PathCamera> walk_through(std::vector<Eigen::Vector3d> const& places, Eigen::Vector3d const& up,
                                     std::size_t frames, Camera const& camera);

/// The nodes' positions in an order in which each is near the one before: nearest neighbour from the first on.
std::vector<Eigen::Vector3d> tour(std::vector<Eigen::Vector3d> const& places);

/// A camera path file (read_camera_path), with straight ways between its keyframes; cameras that it has none of are
/// walking_camera().
std::vector<PathCamera> read_walk_path(std::filesystem::path const& file, int width, int height);

}  // namespace scanview
