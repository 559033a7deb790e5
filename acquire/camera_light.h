#pragma once
#include <Eigen/Core>
#include <array>

namespace scanview {

/// Light that stood still with the camera while the object turned before it (a turntable; a scanner whose lamps move
/// with it): how much a surface receives depends on its normal in camera coordinates, and so the same place has another
/// brightness in every view. The logarithm of it, R, G, B, as a polynomial of second order in the unit normal n (the
/// spherical harmonics of degrees 1 and 2, which hold 99 % of what a matt surface can show of any distant light:
/// Ramamoorthi and Hanrahan 2001); a constant would be exposure, and is View::gain.
struct CameraLight {
  static constexpr int kTerms = 8;
  using Terms = Eigen::Matrix<double, kTerms, 1>;
  /// x, y, z, xy, yz, xz, x² − y², 3z² − 1.
  static Terms terms(Eigen::Vector3d const& n) {
    Terms t;
    t << n.x(), n.y(), n.z(), n.x() * n.y(), n.y() * n.z(), n.x() * n.z(), n.x() * n.x() - n.y() * n.y(),
        3 * n.z() * n.z() - 1;
    return t;
  }
  Eigen::Matrix<double, kTerms, 3> coefficients = Eigen::Matrix<double, kTerms, 3>::Zero();
  Eigen::Vector3d logarithm(Eigen::Vector3d const& n) const { return coefficients.transpose() * terms(n); }
};

}  // namespace scanview
