#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <opencv2/core.hpp>

#include "viewer/evaluate/image_quality.h"
#include "viewer/scene.h"
#include "viewer/view_based/view_based_renderer.h"

namespace scanview {
namespace {

using namespace test;
using Eigen::Isometry3d;
using Eigen::Vector3d;
constexpr double kDegree = std::numbers::pi / 180;

/// The plane z = 0 turned by 55 degrees about its upright axis, with a chart of waves on it. No wave is shorter than 16
/// pixels of the source picture at its far side: bilinear interpolation of a wave of L pixels is off by (π / L)² / 2 of
/// its amplitude at most, 2 % here, of an amplitude of 51 levels 1 level, 48 dB.
Surface slanted_chart() {
  return [](Vector3d const& origin, Vector3d const& direction) -> std::optional<Hit> {
    Eigen::Matrix3d const turn = Eigen::AngleAxisd(55 * kDegree, Vector3d::UnitY()).toRotationMatrix();
    Vector3d const normal = turn.col(2);
    double const t = -normal.dot(origin) / normal.dot(direction);
    if (!(t > 0)) return std::nullopt;
    Vector3d const p = turn.transpose() * (origin + t * direction);
    if (std::abs(p.x()) > 1 || std::abs(p.y()) > 0.7) return std::nullopt;
    auto const wave = [](double x) { return 0.5 + 0.2 * std::sin(x); };
    Vector3d const srgb(wave(18 * p.x()), wave(14 * p.y() + 1), wave(9 * p.x() - 11 * p.y()));
    // The camera's transfer curve, undone.
    return Hit{t, srgb.unaryExpr([](double s) { return std::pow((s + 0.055) / 1.055, 2.4); })};
  };
}

/// The view's triangles drawn by a ray a pixel, with texture coordinates interpolated over each 3-D triangle: plain
/// (s, t), or homogeneous (s w, t w, w).
cv::Mat3b draw(ViewMesh const& view_mesh, View const& view, Camera const& camera, Isometry3d const& pose,
               bool homogeneous) {
  cv::Mat3b picture(camera.height(), camera.width(), cv::Vec3b(0, 0, 0));
  Isometry3d const source_from_camera = view.object_from_camera->inverse() * pose;
  for (int y = 0; y < camera.height(); ++y)
    for (int x = 0; x < camera.width(); ++x)
      for (Eigen::Vector3i const& triangle : view_mesh.mesh.triangles) {
        Eigen::Matrix3d corners;
        for (int i = 0; i < 3; ++i) corners.col(i) = view_mesh.mesh.vertices[triangle[i]].cast<double>();
        Vector3d const origin = source_from_camera * camera.ray_origin(x, y);
        Vector3d const direction = source_from_camera.linear() * camera.ray_direction(x, y);
        Eigen::Matrix3d system;
        system << corners.col(1) - corners.col(0), corners.col(2) - corners.col(0), -direction;
        Vector3d const solved = system.inverse() * (origin - corners.col(0));
        Vector3d const weights(1 - solved.x() - solved.y(), solved.x(), solved.y());
        if (!(weights.minCoeff() >= 0)) continue;
        Eigen::Vector2d st(0, 0);
        double w = 0;
        for (int i = 0; i < 3; ++i) {
          double const depth = homogeneous ? corners(2, i) : 1;
          st += weights[i] * depth * view_mesh.camera.project(corners.col(i));
          w += weights[i] * depth;
        }
        st /= w;
        int const left = std::clamp(int(std::floor(st.x())), 0, view_mesh.camera.width() - 2);
        int const top = std::clamp(int(std::floor(st.y())), 0, view_mesh.camera.height() - 2);
        double const a = st.x() - left, b = st.y() - top;
        auto const at = [&](int dx, int dy) { return cv::Vec3d(view.image.color(top + dy, left + dx)); };
        picture(y, x) = cv::Vec3b((1 - b) * ((1 - a) * at(0, 0) + a * at(1, 0)) +
                                  b * ((1 - a) * at(0, 1) + a * at(1, 1)) + cv::Vec3d(0.5, 0.5, 0.5));
      }
  return picture;
}

TEST(ProjectiveTexture, AChartOnASlantedPlaneIsExactFromItsCameraAndFromAside) {
  Camera const camera = Camera::perspective(512, 384, 620, 620, 255.5, 191.5);
  Isometry3d const source = look_at({0, 0, 2.6}, Vector3d::Zero());
  Scene scene = scan(slanted_chart(), camera, {source}, 1e-3, 0.01);
  Context context;
  scene.meshes[0] = mesh_range_image(scene.set.views[0].image, {}, context).view_mesh;
  // The mesher, not the pixels' grid, so that the triangles are large and what is wrong with (s, t) shows.
  ASSERT_LT(scene.meshes[0].mesh.triangles.size(), 100u);
  auto const gl = make_offscreen_context();
  auto const renderer = make_gl_renderer(*gl, std::make_shared<ViewLibrary>(scene.set, scene.meshes));
  for (double const aside : {0.0, 40.0}) {
    SCOPED_TRACE(aside);
    Isometry3d const pose =
        look_at(2.6 * Vector3d(std::sin(aside * kDegree), 0, std::cos(aside * kDegree)), Vector3d::Zero());
    View const truth = capture(slanted_chart(), camera, pose, "truth");
    Frame const frame = renderer->render(camera, pose);
    cv::Mat1b drawn;
    cv::extractChannel(frame.color, drawn, 3);
    // Inside: on the rim a pixel's share of the plane is another question.
    cv::Mat1b inside = (drawn == 255) & (truth.image.classes == 255);
    cv::Mat1b const whole = inside.clone();
    for (int y = 2; y + 2 < inside.rows; ++y)
      for (int x = 2; x + 2 < inside.cols; ++x)
        if (cv::countNonZero(whole(cv::Rect(x - 2, y - 2, 5, 5))) < 25) inside(y, x) = 0;
    ASSERT_GT(cv::countNonZero(inside), 5000);
    EXPECT_GE(psnr(bgr(frame.color), truth.image.color, inside), 45);
    View const& view = scene.set.views[0];
    double const homogeneous = psnr(draw(scene.meshes[0], view, camera, pose, true), truth.image.color, inside);
    double const plain = psnr(draw(scene.meshes[0], view, camera, pose, false), truth.image.color, inside);
    EXPECT_GE(homogeneous, 45);
    EXPECT_LT(plain, homogeneous - 10);
  }
}

}  // namespace
}  // namespace scanview
