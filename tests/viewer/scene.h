#pragma once
#include <gtest/gtest.h>

#include <functional>
#include <optional>
#include <vector>

#include "acquire/scan_set.h"
#include "mesh/view_mesh.h"
#include "viewer/view_based/view_based_renderer.h"

namespace scanview::test {

/// Where a ray meets a surface: the ray's parameter and the colour there, linear light, R G B.
struct Hit {
  double t = 0;
  Eigen::Vector3d color;
};
using Surface = std::function<std::optional<Hit>(Eigen::Vector3d const& origin, Eigen::Vector3d const& direction)>;

/// Colour of a point of an object about two units large: smooth, different everywhere, with detail of a few degrees.
Eigen::Vector3d paint(Eigen::Vector3d const& p);

Surface sphere(Eigen::Vector3d const& center, double radius);
/// An upright rectangle in the plane z = `z`, |x|, |y| <= half, seen from the side `side` (+1 or -1) only; one colour.
Surface sheet(double z, double half, int side, Eigen::Vector3d const& color);
/// The nearest of several.
Surface together(std::vector<Surface> surfaces);

/// Looking from `eye` at `target`; `up` is up in the picture.
Eigen::Isometry3d look_at(Eigen::Vector3d const& eye, Eigen::Vector3d const& target,
                          Eigen::Vector3d const& up = Eigen::Vector3d::UnitY());

/// Looking at the origin: azimuth 0 is +z, elevation towards +y.
Eigen::Isometry3d around(double azimuth_deg, double elevation_deg, double distance = 4);

/// What an ideal scanner gives: depth and colour of every pixel's centre.
View capture(Surface const& surface, Camera const& camera, Eigen::Isometry3d const& object_from_camera,
             std::string const& name);

/// Two triangles a quad of pixels that have a depth and differ by less than `step` in depth; exact cosines; a feather
/// of `feather_px`.
ViewMesh grid_mesh(View const& view, double step, int feather_px = 8);

struct Scene {
  ScanSet set;
  std::vector<ViewMesh> meshes;
};
Scene scan(Surface const& surface, Camera const& camera, std::vector<Eigen::Isometry3d> const& poses, double step,
           double threshold);

/// A renderer of either kind; all of OpenGL share one context off screen.
std::unique_ptr<ViewBasedRenderer> make_renderer(BackEnd back_end, std::shared_ptr<ViewLibrary> library,
                                                 ViewBasedOptions const& options = {});
std::string back_end_name(testing::TestParamInfo<BackEnd> const& info);

/// Of the channels (subtraction of cv::Vec4b would end at zero).
int greatest_difference(cv::Vec4b const& a, cv::Vec4b const& b);
cv::Mat3b bgr(cv::Mat4b const& picture);
std::size_t drawn_pixels(cv::Mat4b const& picture);

}  // namespace scanview::test
