#pragma once
#include <Eigen/Core>
#include <opencv2/core/mat.hpp>
#include <vector>

#include "viewer/visibility/visibility_selector.h"

namespace scanview {

/// Eyes in random directions, at distances evenly between two numbers of radii: none of them a sample's.
std::vector<Eigen::Vector3d> unseen_eyes(VisibilityField const& field, std::size_t count, double nearest,
                                         double farthest, std::uint64_t seed);

/// A camera at the eye that looks at the model and just holds it.
SampleCamera eye_camera(VisibilityField const& field, Eigen::Vector3d const& eye, int resolution);

/// How a selection does, over some eyes.
struct VisibilityFigures {
  double culling_rate = 0;       ///< share of polygons not drawn, mean
  double visible = 0;            ///< share of polygons with a pixel in the whole model's picture, mean
  std::size_t wrong_pixels = 0;  ///< that show something else than they would with the whole model
  std::size_t pixels = 0;        ///< of all pictures
  double ranges = 0;             ///< mean
  double patches = 0;            ///< seen, mean
};

/// Compares ID pictures of what is drawn with those of the whole model. `polygons`: of the model (PolygonModel).
VisibilityFigures check_visibility(VisibilityField const& field, TriangleMesh const& drawn,
                                   std::vector<std::int32_t> const& polygons, bool facing,
                                   std::vector<Eigen::Vector3d> const& eyes, int resolution, Context& context);

/// The whole model's picture in grey; in red where the ranges lack what it shows.
struct MissedPixels {
  cv::Mat3b picture;
  std::size_t count = 0;
};
MissedPixels missed_pixels(TriangleMesh const& drawn, std::span<IndexRange const> ranges, SampleCamera const& camera);

/// The picture of what is in these ranges, in grey, two-sided: of a selection also from where it was not made for.
cv::Mat3b selection_picture(TriangleMesh const& drawn, std::span<IndexRange const> ranges, SampleCamera const& camera);

}  // namespace scanview
