#pragma once
#include <Eigen/Core>
#include <functional>

#include "synth/patch_writer.h"

namespace scanview {

/// A piece of wall with an opening under a semicircle, which may stand on straight jambs.
struct Arch {
  Eigen::Vector3d foot = Eigen::Vector3d::Zero();     ///< the middle of the opening, on the wall's front, at height 0
  Eigen::Vector3d across = Eigen::Vector3d::UnitX();  ///< unit, level: the wall reaches back along across x up
  double depth = 1;
  double bottom = 0;      ///< height of the jambs' feet
  double radius, spring;  ///< of the opening's semicircle; its centre's height
  double half;            ///< of the wall's width
  double ring;            ///< of stones around the opening, within the wall
  /// straight: up to the height `top`; round: from jambs up to `top` on a semicircle of radius `half`.
  enum class Outline { straight, round } outline = Outline::straight;
  double top;
  int stones = 12;                                 ///< of the semicircle, a multiple of 4
  std::function<cv::Vec3b(int stone)> ring_color;  ///< of the opening's soffit too; counted from `across`'s low end
  cv::Vec3b wall_color;
};
void write_arch(PatchWriter& writer, Arch const& arch);

}  // namespace scanview
