#pragma once
#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <opencv2/core/mat.hpp>
#include <vector>

#include "acquire/acquire.h"

namespace scanview {

/// A small scene with an exact answer: surfaces, light and cameras are formulas, in the left camera's frame and in mm.
/// The light is a fan of planes from one point: how far it has moved where it hits a point is a number `share`, 0 to 1.
struct LightScene {
  enum class Shape { plane, sphere, step };  ///< a slanted plane; with a sphere or a board in front of it
  Shape shape = Shape::sphere;
  StereoRig rig;
  Eigen::Vector3d light = {60, -30, 0};
  double middle = -0.12, spread = 1.0;  ///< share = 0.5 + spread (tangent of the light's direction - middle)
  bool along_rows = false;              ///< the planes hold the x axis: a code is a row, the same all along it
  std::function<double(Eigen::Vector3d const&)> paint = [](Eigen::Vector3d const&) { return 1.0; };

  /// 96 × 72 pixels, the right camera 120 mm beside the left one and turned towards the middle of the scene.
  LightScene();
  /// Depth along a ray of direction d (z = 1) from o; infinite where nothing is.
  double depth(Eigen::Vector3d const& o, Eigen::Vector3d const& d) const;
  double share(Eigen::Vector3d const& p) const;
  bool is_lit(Eigen::Vector3d const& p) const;
  LensCamera const& camera(Side side) const { return side == Side::left ? rig.left : rig.right; }
  /// Depth of each pixel of the ideal left camera.
  cv::Mat1d true_depth() const;
  /// Pixels of the ideal left camera around which, `radius` pixels each way, there is one lit surface that both cameras
  /// see.
  cv::Mat1b smooth_part(int radius) const;
};

/// 0 to 1: how bright the stripes of a Gray code's bit are at a column, their edges blurred over half a column.
double gray_stripe(double column, int bit);

/// What is added to a picture, in levels of 8 bits.
struct CameraNoise {
  double read = 1.0, gain = 0.01;  ///< standard deviation, and variance a level
  std::uint64_t seed = 1;
};

struct LightOptions {
  int steps = 32;   ///< of a sweep
  double beam = 1;  ///< its standard deviation, in steps
  int bits = 5;     ///< of a Gray code, columns over share 0 to 1
  double height = 180, ambient = 12;
  bool is_16_bit = false;
  CameraNoise noise;
};

/// One camera's pictures of a scene. A pixel is the mean of kSamples places across its width.
class LightPictures {
 public:
  static constexpr int kSamples = 4;
  LightPictures(LightScene const& scene, Side side, LightOptions const& options);
  cv::Mat sweep(int k) const;
  /// The picture of a Gray sequence: white, black or a bit, whose stripes have edges half a column wide.
  cv::Mat gray(GrayFrame const& frame, int number) const;

 private:
  cv::Mat picture(std::function<double(double)> const& light, int number) const;
  LightOptions options_;
  std::uint64_t stream_;
  cv::Size size_;
  std::vector<std::array<float, kSamples>> share_, paint_;  // NaN where unlit
};

/// A capture in a folder: pictures, capture.json and rig.yml.
enum class GrayKind { none, inverses, levels };
Capture write_capture(std::filesystem::path const& folder, LightScene const& scene, LightOptions const& options,
                      GrayKind gray = GrayKind::none);

/// Of the depths on `part`: how many there are, RMS of error / sigma of those within five sigma, and the share beyond.
struct DepthErrors {
  std::size_t depths = 0, pixels = 0;
  double ratio = 0, wrong = 0;
};
DepthErrors depth_errors(RangeImage const& image, LightScene const& scene, cv::Mat1b const& part);

}  // namespace scanview
