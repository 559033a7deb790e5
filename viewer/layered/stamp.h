#pragma once
#include <Eigen/Geometry>
#include <cstdint>
#include <vector>

#include "acquire/scan_set.h"

namespace scanview {

/// Linear light in 0 .. kLinearOne: the squares of 8-bit numbers, so that what LDI pixels keep (square roots in 8 bits)
/// is summed without rounding.
inline constexpr int kLinearOne = 255 * 255;

/// What one pixel of a reference image says of the scene (Chang 1998, §3.1): where, and how much of a surface. All in
/// scene coordinates.
struct Stamp {
  Eigen::Vector3d center;
  Eigen::Vector3f normal;  ///< unit, towards the camera; where the surface's is not known, straight towards it
  /// From a pixel's centre to the next one's on the tangent plane, along u and along v: |a|/δ and |b|/δ of equation 2
  /// on a surface that faces the camera, longer on an oblique one.
  Eigen::Vector3f along_u, along_v;
  /// S: the geometric mean of z/fx and z/fy (spacings: orthographic), longer by 1 / cos of the angle between normal and
  /// ray: what an oblique surface is sampled at along its tilt.
  float size = 0;
  bool rim = false;  ///< a neighbour is on another surface: the colour may be a mixture of both
  std::uint16_t red = 0, green = 0, blue = 0;  ///< linear light
};

struct StampOptions {
  /// measured: from the depths around. facing: all surfaces face the camera, as in the paper.
  enum class Normals { measured, facing } normals = Normals::measured;
};

/// Stamps of one row of a view, left to right. Pixels whose depth is missing, not finite or (perspective) not positive
/// give none.
///
/// Measured normals are those of the smoothest of the neighbouring stretches of three pixels along u and along v in
/// inverse depth (in which planes are linear): creases and steps are not smoothed over. Where noise (sigma) matters, a
/// plane is fitted to what agrees with them. Surfaces steeper than kGrazing count as that steep.
class StampReader {
 public:
  static constexpr double kGrazing = 0.08;  ///< cosine between normal and ray
  /// `view` must have a pose and outlive this.
  StampReader(View const& view, StampOptions const& options);
  /// Appends to `stamps`. Thread-safe.
  void read_row(int y, std::vector<Stamp>& stamps) const;

 private:
  struct Gradient {
    double u = 0, v = 0;
    bool known = false;
  };
  double key(int x, int y) const;
  Gradient gradient(int x, int y) const;
  bool is_rim(int x, int y, Gradient const& gradient) const;
  void refine(int x, int y, Gradient& gradient) const;

  View const& view_;
  StampOptions options_;
  cv::Mat1f keys_;  ///< inverse depth, or depth (orthographic); NaN where there is none
  Eigen::Matrix3d rotation_;
  Eigen::Vector3d translation_;
  Eigen::Vector3d gain_;
};

}  // namespace scanview
