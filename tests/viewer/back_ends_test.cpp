#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <map>
#include <numbers>
#include <opencv2/core.hpp>

#include "viewer/evaluate/image_quality.h"
#include "viewer/scene.h"

// The CPU's pictures against OpenGL's. Both round vertices to 1/256 pixel, sample the same pyramid and mix by the same
// formula; what differs is single precision in another order, how a card or llvmpipe filters (8 bits of the place
// between texels) and the owner of a pixel whose centre lies on a triangle's edge.

namespace scanview {
namespace {

using namespace test;
using Eigen::Isometry3d;
using Eigen::Vector3d;

/// A ball with a smaller one in front of a part of it, so that depths have steps; about it eight views.
Scene const& scene() {
  static Scene const made = [] {
    std::vector<Isometry3d> poses;
    for (int i = 0; i < 7; ++i) poses.push_back(around(52 * i, i % 2 == 0 ? 30 : -20));
    poses.push_back(around(10, 85));
    auto const surface = together({sphere(Vector3d::Zero(), 1), sphere({0.6, 0.4, 1.1}, 0.3)});
    return scan(surface, Camera::perspective(200, 150, 190, 195, 99.25, 76.5), poses, 0.2, 0.02);
  }();
  return made;
}

std::shared_ptr<ViewLibrary> library() {
  static auto const shared = std::make_shared<ViewLibrary>(scene().set, scene().meshes);
  return shared;
}

struct Difference {
  double psnr = 0;  ///< of pixels that both drew
  int drawn = 0;    ///< by both
  int alpha = 0;    ///< drawn by one alone
  int depth = 0;    ///< of pixels that both drew: depths further apart than a thousandth
};

Difference difference(Frame const& a, Frame const& b) {
  Difference result;
  cv::Mat1b both(a.color.size(), 0);
  for (int y = 0; y < both.rows; ++y) {
    for (int x = 0; x < both.cols; ++x) {
      bool const in_a = a.color(y, x)[3] != 0, in_b = b.color(y, x)[3] != 0;
      result.alpha += in_a != in_b;
      if (!in_a || !in_b) continue;
      both(y, x) = 255;
      ++result.drawn;
      result.depth += !(std::abs(a.depth(y, x) - b.depth(y, x)) < 1e-3 * std::abs(b.depth(y, x)) + 1e-4);
    }
  }
  result.psnr = psnr(bgr(a.color), bgr(b.color), both);
  return result;
}

Difference difference(std::shared_ptr<ViewLibrary> const& of, Camera const& camera, Isometry3d const& pose,
                      ViewBasedOptions const& options = {}) {
  return difference(make_renderer(BackEnd::cpu, of, options)->render(camera, pose),
                    make_renderer(BackEnd::gl, of, options)->render(camera, pose));
}

Camera const kCamera = Camera::perspective(160, 120, 150, 155, 83.25, 56.5);

TEST(BackEnds, DrawTheSameFromAnywhere) {
  struct Place {
    char const* name;
    Camera camera;
    Isometry3d pose;
    int at_least;
    double psnr = 50;
  };
  // Where triangles are a twentieth of a pixel, 1/256 pixel of rounding changes their slopes by a tenth, and with them
  // the level of detail, each time otherwise: seen where the object is a few pixels, or one.
  for (Place const& place :
       {Place{"at a view", kCamera, *scene().set.views[2].object_from_camera, 2000},
        Place{"between views", kCamera, around(23, 8), 2000}, Place{"near a step", kCamera, around(70, 35, 2.5), 4000},
        Place{"below all views", kCamera, around(100, -80), 2000},
        Place{"orthographic", Camera::orthographic(160, 120, 0.018, 0.02, 80, 60), around(-30, 12), 5000},
        Place{"a texel covers the window", Camera::perspective(64, 48, 40000, 40000, 31, 23), around(23, 8), 64 * 48},
        Place{"a few pixels", kCamera, around(23, 8, 60), 10, 35},
        Place{"one pixel", kCamera, around(23, 8, 200), 1, 35},
        Place{"inside the ball", kCamera, look_at({0.1, 0.2, 0.1}, {0, 0, 1}), 0, -1},
        Place{"close to the surface", kCamera, look_at({0, 0.3, 1.3}, {-0.8, 0.3, 0.2}), 4000}}) {
    SCOPED_TRACE(place.name);
    auto const found = difference(library(), place.camera, place.pose);
    EXPECT_GT(found.psnr, place.psnr);
    EXPECT_GE(found.drawn, place.at_least);
    EXPECT_LE(found.alpha, 4);
    EXPECT_LE(found.depth, 4);
  }
}

TEST(BackEnds, DrawTheSameAMillionUnitsFromTheOrigin) {
  auto moved = scene();
  Eigen::Translation3d const shift(1e6, -2e6, 3e6);
  for (auto& view : moved.set.views) view.object_from_camera = shift * *view.object_from_camera;
  moved.set.center = shift * Vector3d::Zero();
  auto const found = difference(std::make_shared<ViewLibrary>(moved.set, moved.meshes), kCamera, shift * around(23, 8));
  EXPECT_GT(found.psnr, 50);
  EXPECT_GT(found.drawn, 2000);
  EXPECT_LE(found.alpha, 4);
}

TEST(BackEnds, DrawTheSameWithEveryOption) {
  using Options = ViewBasedOptions;
  struct Case {
    char const* name;
    void (*set)(Options&);
    double psnr = 50;
  };
  // Where samples of equal share meet, rounding decides whose hue a pixel gets ("winner"), and hues are as far apart as
  // colours can be: each such pixel costs as much as thousands of small differences. The same holds for the nearest of
  // samples that are almost equally near. In "weights" hues instead of similar photographs are mixed, so that a
  // difference of shares is seen whole.
  for (Case const& one :
       {Case{"threshold 0", [](Options& o) { o.threshold = 0; }, 40},
        Case{"threshold infinite", [](Options& o) { o.threshold = std::numeric_limits<double>::infinity(); }},
        Case{"no ratio", [](Options& o) { o.reliability_ratio = 0; }},
        Case{"whole ratio", [](Options& o) { o.reliability_ratio = 1; }},
        Case{"the paper's three", [](Options& o) { o.fill_views = 0; }},
        Case{"all fill", [](Options& o) { o.fill_views = 16; }},
        Case{"no barycentric", [](Options& o) { o.barycentric = false; }},
        Case{"no cosine", [](Options& o) { o.cosine = false; }},
        Case{"no feather", [](Options& o) { o.feather = false; }},
        Case{"no weights", [](Options& o) { o.barycentric = o.cosine = o.feather = false; }},
        Case{"nearest", [](Options& o) { o.visibility = Options::Visibility::nearest; }, 40},
        Case{"weights", [](Options& o) { o.show = SoftZ::Show::weights; }, 40},
        Case{"winner", [](Options& o) { o.show = SoftZ::Show::winner; }, 40}, Case{"excluded", [](Options& o) {
                                                                                     o.excluded = {0, 3};
                                                                                   }}}) {
    SCOPED_TRACE(one.name);
    ViewBasedOptions options;
    one.set(options);
    for (auto const& pose : {around(23, 8), around(70, 35, 2.5)}) {
      auto const found = difference(library(), kCamera, pose, options);
      EXPECT_GT(found.psnr, one.psnr);
      EXPECT_GT(found.drawn, 2000);
      EXPECT_LE(found.alpha, 4);
    }
  }
}

TEST(BackEnds, WireframesHaveLinesInTheViewsColours) {
  // One view with large triangles: its hue on a share of the pixels, the picture on the others.
  auto one = scan(sheet(0, 0.9, 1, {0.5, 0.5, 0.5}), kCamera, {around(0, 0)}, 0.3, 0.1);
  auto& mesh = one.meshes[0].mesh;
  TriangleMesh coarse;
  for (int y = 0; y < 4; ++y) {
    for (int x = 0; x < 4; ++x) coarse.vertices.emplace_back(-0.9F + 0.6F * float(x), -0.9F + 0.6F * float(y), 4.0F);
  }
  for (int y = 0; y < 3; ++y) {
    for (int x = 0; x < 3; ++x) {
      int const a = 4 * y + x;
      coarse.triangles.emplace_back(a, a + 4, a + 1);
      coarse.triangles.emplace_back(a + 1, a + 4, a + 5);
    }
  }
  mesh = coarse;
  one.meshes[0].cos_phi.assign(mesh.triangles.size(), 1.0F);
  Eigen::Vector3f const hue = view_hue(0);
  std::map<BackEnd, double> share;
  for (auto const back_end : {BackEnd::cpu, BackEnd::gl}) {
    auto const renderer = make_renderer(back_end, std::make_shared<ViewLibrary>(one.set, one.meshes));
    auto const plain = renderer->render(kCamera, around(5, 5, 2.5));
    ViewBasedOptions options;
    options.wireframe = true;
    renderer->set_options(options);
    auto const wires = renderer->render(kCamera, around(5, 5, 2.5));
    int lines = 0, others = 0;
    for (int y = 0; y < plain.color.rows; ++y) {
      for (int x = 0; x < plain.color.cols; ++x) {
        if (plain.color(y, x)[3] == 0 || wires.color(y, x)[3] == 0) continue;
        if (greatest_difference(plain.color(y, x), wires.color(y, x)) <= 2) {
          ++others;
        } else {
          ++lines;
          // Towards the view's hue.
          for (int c = 0; c < 3; ++c) {
            int const change = wires.color(y, x)[2 - c] - plain.color(y, x)[2 - c];
            EXPECT_TRUE(hue[c] > 0.5 ? change >= -2 : change <= 2) << x << ' ' << y;
          }
        }
      }
    }
    share[back_end] = double(lines) / (lines + others);
    EXPECT_GT(share[back_end], 0.02);
    EXPECT_LT(share[back_end], 0.5);
  }
  // OpenGL draws lines of a pixel, of which the surface they lie in hides parts; the rasteriser marks what is within
  // 0.6 pixels of an edge.
  EXPECT_NEAR(share[BackEnd::cpu], share[BackEnd::gl], 0.08);
}

TEST(BackEnds, OptionsMayChangeBetweenFrames) {
  // Back and forth: as a renderer made with them.
  for (auto const back_end : {BackEnd::cpu, BackEnd::gl}) {
    ViewBasedOptions other;
    other.fill_views = 0;
    other.threshold = 0.5;
    other.show = SoftZ::Show::weights;
    auto const renderer = make_renderer(back_end, library());
    auto const before = renderer->render(kCamera, around(23, 8));
    renderer->set_options(other);
    auto const changed = renderer->render(kCamera, around(23, 8));
    auto const fresh = make_renderer(back_end, library(), other)->render(kCamera, around(23, 8));
    EXPECT_EQ(cv::norm(changed.color, fresh.color, cv::NORM_INF), 0);
    renderer->set_options({});
    EXPECT_EQ(cv::norm(before.color, renderer->render(kCamera, around(23, 8)).color, cv::NORM_INF), 0);
  }
}

TEST(BackEnds, OneViewAloneIsTheSame) {
  auto const cpu = make_renderer(BackEnd::cpu, library()), gl = make_renderer(BackEnd::gl, library());
  for (std::size_t view = 0; view < 3; ++view) {
    auto const found =
        difference(cpu->render_alone(view, kCamera, around(23, 8)), gl->render_alone(view, kCamera, around(23, 8)));
    EXPECT_GT(found.psnr, 50);
    EXPECT_GT(found.drawn, 1000);
    EXPECT_LE(found.alpha, 4);
  }
}

}  // namespace
}  // namespace scanview
