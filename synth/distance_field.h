#pragma once
#include <Eigen/Geometry>
#include <array>

namespace scanview {

/// Signed distances (negative inside) of the solids that procedural objects are put together from, after Quilez,
/// "Distance functions". All lengths in the unit of p.

float sphere_distance(Eigen::Vector3f const& p, Eigen::Vector3f const& center, float radius);
/// First-order distance: exact on the surface, up to about half off the distance elsewhere.
float ellipsoid_distance(Eigen::Vector3f const& p, Eigen::Vector3f const& center, Eigen::Vector3f const& radii);
/// A rod with round ends whose radius goes from ra at a to rb at b.
float rod_distance(Eigen::Vector3f const& p, Eigen::Vector3f const& a, Eigen::Vector3f const& b, float ra, float rb);
/// A rod bent along the quadratic Bezier curve a, b, c.
float bent_rod_distance(Eigen::Vector3f const& p, Eigen::Vector3f const& a, Eigen::Vector3f const& b,
                        Eigen::Vector3f const& c, float ra, float rc);
/// A box about the origin from -half to half, its edges rounded.
float box_distance(Eigen::Vector3f const& p, Eigen::Vector3f const& half, float rounding);

/// A bent plate with a rounded edge: an ear, a petal, a leaf. Its outline runs from a tip at a to a tip at c, widest in
/// the middle: half_width · sqrt(1 - |u|^fullness), u from -1 to 1; 2 is an ellipse, more is blunter.
struct Blade {
  Eigen::Vector3f a, b, c;  ///< its spine is this quadratic Bezier curve; not straight: it is flat across their plane
  float half_width, half_thickness;
  float start = 0;  ///< of the outline this share is missing at a: 0.5 starts where it is widest
  float fullness = 2;
};

class BladeShape {
 public:
  explicit BladeShape(Blade const& blade);
  /// First-order distance, exact on the surface; far away a lower bound.
  float distance(Eigen::Vector3f const& p) const;
  Blade const& blade() const { return blade_; }
  /// A sphere that holds it.
  Eigen::Vector3f const& center() const { return center_; }
  float radius() const { return radius_; }

 private:
  static constexpr int kPieces = 10;
  struct Piece {
    Eigen::Vector3f from, along;
    float inverse_squared, u_per_length;  // of the length of `along`; how fast u runs
  };
  Blade blade_;
  Eigen::Vector3f across_, center_;
  float radius_;
  std::array<Piece, kPieces> pieces_;
};

/// A ring around the z axis.
float ring_distance(Eigen::Vector3f const& p, float major, float minor);
/// A disc around the y axis from y = low to high, its edges rounded.
float disc_distance(Eigen::Vector3f const& p, float radius, float low, float high, float rounding);

/// min(a, b) with a fillet: equal to it where |a - b| > k, lower by up to k/4 in between.
float smooth_union(float a, float b, float k);

/// A turned and moved coordinate system for a part of an object.
class Frame3 {
 public:
  /// Turns about `axis` (need not be unit) through `pivot`.
  Frame3(Eigen::Vector3f const& pivot, Eigen::Vector3f const& axis, float angle_rad);
  /// The frame with its origin at `origin` and its z axis along `z`.
  static Frame3 facing(Eigen::Vector3f const& origin, Eigen::Vector3f const& z);
  Eigen::Vector3f local(Eigen::Vector3f const& p) const { return to_local_ * (p - origin_) + pivot_; }

 private:
  Frame3() = default;
  Eigen::Matrix3f to_local_;
  Eigen::Vector3f origin_, pivot_;
};

/// Smooth noise in about [-1, 1] with features about 1 wide, from a hash of the integer lattice.
float value_noise(Eigen::Vector3f const& p);
/// Sum of `octaves` of it, each half as wide and half as strong; about [-1, 1].
float fractal_noise(Eigen::Vector3f const& p, int octaves);

}  // namespace scanview
