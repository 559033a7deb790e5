#pragma once
#include <Eigen/Geometry>
#include <cstddef>
#include <filesystem>
#include <string>
#include <vector>

#include "acquire/captured_node.h"
#include "base/context.h"

namespace scanview {

/// One colour and one depth picture of everything around a point, and how to read them.
struct PanoramaFiles {
  std::string name;
  std::filesystem::path color, depth;
  double depth_unit = 1;             ///< of one step of the stored ray length, in the scene's unit
  std::vector<int> missing{0}, sky;  ///< 16-bit values that say "no depth" and "infinitely far"
  Eigen::Isometry3d scene_from_panorama = Eigen::Isometry3d::Identity();
};

/// Equirectangular panoramas with depth, as nodes of a walkthrough. A folder with panoramas.json:
///
///   { "format": 1, "unit": "m", "nodes": [ {
///     "color": "a.png", "depth": "a_depth.png",   paths relative to the file; .exr: channel Z
///     "name": "a",                                optional: "000", "001" ...
///     "depth_unit": 0.001,                        optional: 0.001 for 16 bits, 1 for EXR
///     "missing": [0], "sky": [65535],             optional, of 16 bits; EXR has NaN (or <= 0) and +inf
///     "scene_from_panorama": [16 numbers, row by row] } ] }   optional: identity
///
/// Pictures are twice as wide as high; depth may be of another size than colour. Depth is the length of the ray. A
/// panorama's frame is x right, y up; the picture's centre looks along -z, its columns are longitudes towards +x, its
/// rows latitudes, the upper edge is +y: of pixel (u, v), with a = 2 pi ((u + ½) / W - ½) and b = pi (½ - (v + ½) / H),
/// the direction is (cos b sin a, sin b, -cos b cos a).
class PanoramaReader {
 public:
  /// Reads panoramas.json, which `path` is or lies in. A key that is unknown, missing or of the wrong kind, a doubled
  /// or unsafe name is Error{bad_input} naming it. Whether the pictures exist is not looked at here.
  explicit PanoramaReader(std::filesystem::path const& path);
  Unit unit() const { return unit_; }
  std::size_t count() const { return panoramas_.size(); }
  PanoramaFiles const& files(std::size_t node) const { return panoramas_[node]; }
  /// One node, resampled to the sides of a cube of `size` pixels (0: a quarter of the colour's width). Throws
  /// Error{bad_input} naming the picture that is missing, damaged, or not 2:1. See resample_panorama.
  CapturedNode read(std::size_t node, int size, Context& context) const;

 private:
  Unit unit_ = Unit::m;
  std::vector<PanoramaFiles> panoramas_;
};

/// A panorama in memory: 8-bit sRGB, and ray lengths: NaN missing, +inf sky.
struct Panorama {
  cv::Mat3b color;
  cv::Mat1f ray;
  double quantum = 0;  ///< one step of a stored ray length; 0: floating point
};

/// The side of a cube about the panorama's eye (captured_node.h), in a picture of `size` pixels.
///
/// Colour is the mean in linear light of samples in the pixel, about two a panorama's pixel and direction. Depth is
/// that of the plane of three panorama samples about the ray, where they are of one surface, so that a plane stays that
/// plane to within the rounding of the samples: |error| <= w quantum / 2 (r / r_min)^2 of the ray length, r_min the
/// least of the three; w is 1, up to 1.6 where rows bend, next to a pole. Across a step nothing is mixed: there the
/// nearest sample's ray length counts. One surface: a slope of up to 80 degrees, or one that goes on as it was in 1 /
/// r. Missing becomes no_depth, sky background; sigma is the rounding's, as z. About a
/// microsecond a pixel.
RangeImage resample_panorama(Panorama const& panorama, Eigen::Matrix3d const& scene_from_panorama, int side, int size);

}  // namespace scanview
