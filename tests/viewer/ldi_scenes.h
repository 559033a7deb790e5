#pragma once
#include <functional>
#include <string>
#include <vector>

#include "acquire/scan_set.h"
#include "viewer/layered/ldi_builder.h"

// Reference images of planes with exact depths, and trees of them.

namespace scanview::test {

/// 8-bit sRGB, blue first, of a point.
using PlanePaint = std::function<cv::Vec3b(Eigen::Vector3d const&)>;
PlanePaint plain_paint(cv::Vec3b const& color);
/// Different everywhere, smooth, with a period of about `period` units.
PlanePaint wavy_paint(double period);

/// Looking from `eye` at `target`; y up.
Eigen::Isometry3d toward(Eigen::Vector3d const& eye, Eigen::Vector3d const& target);
/// 90 degrees wide.
Camera square_view(int size);

/// What a camera sees of the plane normal · p = offset; nothing where it is behind the camera or seen from behind.
View plane_view(std::string const& name, Camera const& camera, Eigen::Isometry3d const& object_from_camera,
                Eigen::Vector3d const& normal, double offset, PlanePaint const& paint);
/// A square of side 2 `half` on the plane through `middle`, from straight above: pixels of a size, borders on borders.
View panel_view(Eigen::Vector3d const& normal, Eigen::Vector3d const& middle, double half, double spacing,
                PlanePaint const& paint);
/// Of images of one camera the nearest at each pixel.
View nearest_of(std::vector<View> const& views);
/// The corner of a room, from within: of planes x = -2, y = -1.5 and z = -2, no pixel without depth.
View corner_view(std::string const& name, int size, Eigen::Vector3d const& eye);
/// What an 8-bit sRGB value is when it has been kept as the square root of linear light in 8 bits: sRGB, 0 to 255.
double kept(int srgb);
/// One pixel at the middle of an image of one pixel, of a surface that faces the camera.
View pixel_view(Camera const& camera, Eigen::Isometry3d const& object_from_camera, float depth, cv::Vec3b const& color);

LdiBuilder builder_of(std::vector<View> const& views, LdiOptions const& options = {}, int threads = 0);
LdiTree tree_of(std::vector<View> const& views, LdiOptions const& options = {}, int threads = 0);

/// An LDI pixel in the scene.
struct PlacedPixel {
  Eigen::Vector3d at;
  int level = 0, face = 0;
  LdiKind kind = LdiKind::unfiltered;
  double alpha = 0;           ///< 0 to 1
  cv::Vec3d linear{0, 0, 0};  ///< red first, 0 to 1
};
std::vector<PlacedPixel> pixels_of(LdiTree const& tree);

}  // namespace scanview::test
