#pragma once
#include <Eigen/Core>
#include <vector>

namespace scanview {

/// Where the light was: fitted to a view's own matches, so the light source needs no calibration. A match is (a, b, q):
/// direction (x/z, y/z) and inverse depth in the rectified frame, and its code c.
///
/// All sheets of light meet in the source's axis (a projector, a lamp or a mirror that turns), so a code is a function
/// of one ratio: h(c) = p1·(a, b, 1, q) / p2·(a, b, 1, q), a camera with one coordinate. h is monotone and otherwise
/// free (how the light was moved need not be even). A match whose ratio says another code joins pixels that saw
/// different surfaces: two points of one epipolar plane may well be lit at once, and both cameras see both.
class LightSheets {
 public:
  struct Match {
    double a, b, q;
    double code;
    double sigma;  ///< of the difference of both cameras' codes
  };
  /// Robust: up to a third of the matches may be wrong. Not usable where there are fewer than 300, or where they do not
  /// agree on any such source to within `kMostScatter` of the range of codes, nor where all lie on one plane: there
  /// p1 and p2 may both be the plane itself.
  explicit LightSheets(std::vector<Match> const& matches);

  bool usable() const { return usable_; }
  /// Difference between the code that the place says and the one that was seen, in codes.
  double residual(Match const& match) const;
  /// What the residual of a right match stays below: five standard deviations, of half its sigma (light from between
  /// the cameras has half of each camera's error) and of what scatters beyond that.
  double tolerance(Match const& match) const;
  /// Standard deviation of what the codes' own errors do not explain, in codes.
  double scatter() const { return scatter_; }
  /// Standard deviation of right matches' residuals, whatever the reason: how well a place on a sheet is known.
  double residual_sigma() const { return residual_sigma_; }

 private:
  Eigen::Vector4d normalised(Match const& match) const;
  double ratio(Match const& match) const;
  double code_of(double ratio) const;
  void fit_source(std::vector<Match> const& matches, std::vector<double> const& weights);
  void fit_motion(std::vector<Match> const& matches, std::vector<double> const& weights);

  Eigen::Vector3d middle_ = Eigen::Vector3d::Zero(), spread_ = Eigen::Vector3d::Ones();
  Eigen::Vector4d above_ = Eigen::Vector4d::Zero(), below_ = Eigen::Vector4d::Zero();
  double low_ = 0, high_ = 1;   // codes
  std::vector<double> motion_;  // h at evenly spaced codes
  double scatter_ = 0, residual_sigma_ = 0;
  bool usable_ = false;
};

}  // namespace scanview
