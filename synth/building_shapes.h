#pragma once
#include <Eigen/Core>
#include <array>
#include <functional>
#include <vector>

#include "synth/patch_writer.h"

namespace scanview {

/// What buildings and what stands in them are made of. Every shape is closed and oriented outwards; y is up, lengths in
/// metres; colours are sRGB in OpenCV's order and change at hard edges only, whatever the fineness.

/// Blocks between lines along x, y and z: a union of boxes without walls between them. They may be bent: then the lines
/// are those of three parameters.
struct Blocks {
  std::array<std::vector<double>, 3> lines;
  std::function<bool(Eigen::Vector3i const& cell)> is_solid;  ///< asked for cells within the lines only
  /// Of a face of a solid cell that an empty one follows along the axis, on the side of `sign`.
  std::function<cv::Vec3b(Eigen::Vector3i const& cell, int axis, int sign)> color;
  /// Where a point of the parameters is; it must keep right hands right. Empty: there. The parameters' lengths are what
  /// the blocks are divided by.
  std::function<Eigen::Vector3d(Eigen::Vector3d const& parameters)> place;
};
void write_blocks(PatchWriter& writer, Blocks const& blocks);

/// Of so many equal cells: one line more.
std::vector<double> even_lines(double low, double high, int cells);

void write_box(PatchWriter& writer, Eigen::Vector3d const& low, Eigen::Vector3d const& high, cv::Vec3b const& color);

/// A part of the outline that turns about a vertical axis: straight lines through points (radius, height) that ascend
/// along the outside.
struct Profile {
  std::vector<Eigen::Vector2d> points;
  cv::Vec3b color;
  int flutes = 0;  ///< hollows around, their ridges at the profile's radius
};
/// The parts follow each other, from one point on the axis to another.
void write_lathe(PatchWriter& writer, Eigen::Vector3d const& foot, std::vector<Profile> const& parts, int least_around);

void write_sphere(PatchWriter& writer, Eigen::Vector3d const& center, double radius, cv::Vec3b const& color);

struct Torus {
  Eigen::Vector3d center = Eigen::Vector3d::Zero();
  Eigen::Matrix3d rotation = Eigen::Matrix3d::Identity();  ///< its axis is the third column
  double radius = 1, tube = 0.25;
  int bands = 12;  ///< around the tube
  std::function<cv::Vec3b(int band)> color;
};
void write_torus(PatchWriter& writer, Torus const& torus);

}  // namespace scanview
