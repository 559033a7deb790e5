#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <memory>
#include <numbers>
#include <set>
#include <tuple>

#include "base/random.h"
#include "base/srgb.h"
#include "viewer/layered/ldi_renderer.h"
#include "viewer/ldi_scenes.h"

// How LDI pixels are drawn, as squares and blended: pictures of planes, of which everything is known.

namespace scanview::test {
namespace {

using Eigen::Vector3d;
using Splats = LdiRenderOptions::Splats;
using Gaps = LdiRenderOptions::Gaps;

constexpr double kStep = 1.0 / 16;
/// Of reference images: grids have steps of kStep, and no grid point lies on a pixel's border all along a row.
constexpr double kSpacing = 1.02 * kStep;
cv::Vec3b const kFront(10, 200, 240), kRear(240, 0, 20);
Vector3d const kMiddle(0.3, 0.2, 0.1);

std::shared_ptr<LdiTree const> shared_tree(std::vector<View> const& views, LdiOptions const& options = {}) {
  return std::make_shared<LdiTree>(tree_of(views, options));
}
std::shared_ptr<LdiTree const> panel(double half = 16, LdiOptions const& options = {}) {
  return shared_tree({panel_view(Vector3d::UnitZ(), kMiddle, half, kSpacing, plain_paint(kFront))}, options);
}

LdiRenderOptions with(Splats splats, double stamp_px = 1, Gaps gaps = Gaps::filled) {
  LdiRenderOptions options;
  options.splats = splats;
  options.stamp_px = stamp_px;
  options.gaps = gaps;
  return options;
}

/// A picture of 64 x 64 pixels, 28 degrees wide.
Camera small_camera() { return Camera::perspective(64, 64, 128, 128, 31.5, 31.5); }

/// Of the plane through kMiddle: from where grid steps are so many pixels there, so many degrees off its normal.
Eigen::Isometry3d oblique(double tilt, double roll, double step_px) {
  double const distance = kStep * 128 / step_px, radians = std::numbers::pi / 180;
  Vector3d const from = Eigen::AngleAxisd(tilt * radians, Vector3d::UnitX()) * Vector3d::UnitZ();
  Eigen::Isometry3d pose = toward(kMiddle + distance * from, kMiddle);
  pose.linear() = pose.linear() * Eigen::AngleAxisd(roll * radians, Vector3d::UnitZ()).toRotationMatrix();
  return pose;
}

/// Depth of the plane normal · p = offset at a pixel.
double depth_at(Camera const& camera, Eigen::Isometry3d const& pose, int x, int y, Vector3d const& normal,
                double offset) {
  Vector3d const origin = pose * camera.ray_origin(x, y), ray = pose.linear() * camera.ray_direction(x, y);
  return (offset - normal.dot(origin)) / normal.dot(ray);
}

std::size_t uncovered(Frame const& frame) {
  std::size_t count = 0;
  for (cv::Vec4b const& pixel : frame.color) count += pixel[3] == 0;
  return count;
}

/// The greatest difference between a picture's colours and one that was kept in a tree.
double color_error(Frame const& frame, cv::Vec3b const& color) {
  double most = 0;
  for (cv::Vec4b const& pixel : frame.color)
    for (int c = 0; c < 3; ++c) most = std::max(most, std::abs(double(pixel[c]) - kept(color[c])));
  return most;
}
/// Of blended pixels: rounded to 8 bits, after half an entry of an encoding table in which nine or more make one value.
constexpr double kExact = 0.5 + 0.5 / 9;

/// Calls work(tilt, step_px, stamp_px) for planes seen head on to obliquely, along one of the screen's axes, in grids
/// finer and coarser than the picture.
template <typename Work>
void for_each_view(Work const& work) {
  for (double const tilt : {0.0, 20.0, 45.0, 60.0})
    for (double const step_px : {0.9, 1.0, 1.4, 2.0, 5.0})
      for (double const stamp_px : {1.0, 1.4, 2.0}) {
        SCOPED_TRACE(testing::Message() << tilt << " degrees, steps of " << step_px << " px, stamps of " << stamp_px);
        work(tilt, step_px, stamp_px);
      }
}

TEST(LdiSquares, CoverAPlaneInItsColour) {
  // Rows of squares of 1.2 steps, a step apart: none is bare, however the other axis is foreshortened. A colour is
  // summed without rounding and kept as a root in 8 bits.
  auto const tree = panel();
  for_each_view([&](double tilt, double step_px, double stamp_px) {
    LdiRenderer renderer(tree, with(Splats::squares, stamp_px));
    Frame const frame = renderer.render(small_camera(), oblique(tilt, 0, step_px));
    EXPECT_EQ(uncovered(frame), 0U);
    EXPECT_EQ(renderer.uncovered(), 0U);
    EXPECT_LE(color_error(frame, kFront), 0.5);
  });
}

TEST(LdiSquares, CoverAPlaneHoweverItsGridLies) {
  // Turned on the screen, and on planes that are turned from the face that they lie on: by 45 degrees at most.
  for (Vector3d const& direction : {Vector3d(0, 0, 1), Vector3d(0, 0.5, 1), Vector3d(0, 0.95, 1)}) {
    Vector3d const normal = direction.normalized();
    auto const tree = shared_tree({panel_view(normal, kMiddle, 8, kSpacing, plain_paint(kFront))});
    for (double const roll : {0.0, 20.0, 45.0})
      for (double const step_px : {1.0, 2.0}) {
        Eigen::Isometry3d pose = toward(kMiddle + kStep * 128 / step_px * normal, kMiddle);
        pose.linear() *= Eigen::AngleAxisd(roll * std::numbers::pi / 180, Vector3d::UnitZ()).toRotationMatrix();
        EXPECT_EQ(uncovered(LdiRenderer(tree, with(Splats::squares)).render(small_camera(), pose)), 0U)
            << direction.transpose() << ", rolled by " << roll << ", steps of " << step_px << " px";
      }
  }
}

TEST(LdiSquares, OfTwoPlanesTheNearerIsSeen) {
  // A square counts as up to 4 steps farther at its edge, 8 at its corner: from where stamps of 2 px are drawn, steps
  // are twice as long.
  double const most_bias = 8 * 2 * kStep;
  auto const tree = shared_tree(
      {panel_view(Vector3d::UnitZ(), kMiddle, 16, kSpacing, plain_paint(kFront)),
       panel_view(Vector3d::UnitZ(), kMiddle - 2 * most_bias * Vector3d::UnitZ(), 24, kSpacing, plain_paint(kRear))});
  Camera const camera = small_camera();
  for_each_view([&](double tilt, double step_px, double stamp_px) {
    Eigen::Isometry3d const pose = oblique(tilt, 0, step_px);
    Frame const frame = LdiRenderer(tree, with(Splats::squares, stamp_px)).render(camera, pose);
    EXPECT_LE(color_error(frame, kFront), 0.5);
    double most = 0;
    for (int y = 0; y < 64; ++y)
      for (int x = 0; x < 64; ++x)
        most = std::max(
            most, std::abs(double(frame.depth(y, x)) - depth_at(camera, pose, x, y, Vector3d::UnitZ(), kMiddle.z())));
    // Squares face the camera: on an oblique plane they are off by half their side times the tangent, 1.73 at most.
    EXPECT_LE(most, most_bias + 0.6 * 1.8 * 2 * kStep);
  });
}

TEST(LdiSquares, AreTheSameInAnyOrderAndOnAnyThreads) {
  std::vector<View> const views = {corner_view("a", 96, {1, 1.2, 1.5}), corner_view("b", 80, {2, 0.5, 0.4})};
  LdiOptions options;
  options.resolution = 8;
  auto const tree = shared_tree(views, options);
  Camera const camera = square_view(100);
  Eigen::Isometry3d const pose = toward({1.4, 1, 0.8}, {-2, -1, -1.5});
  TraversalOptions how;
  std::vector<CellPart> parts;
  for (TraversedCell const& at : traverse(*tree, camera, pose, how)) {
    parts.push_back({at.cell, LdiKind::unfiltered});
    parts.push_back({at.cell, LdiKind::patch});
    if (!at.descended) parts.push_back({at.cell, LdiKind::filtered});
  }
  ASSERT_GT(parts.size(), 50U);
  SquareCanvas canvas;
  auto const draw = [&](int threads) {
    Context context;
    context.threads = threads;
    Frame frame;
    canvas.draw(*tree, parts, camera, pose, frame, context);
    return frame;
  };
  Frame const once = draw(1);
  for (std::uint64_t seed = 0; seed < 10; ++seed) {
    CounterRandom random(seed, 0);
    for (std::size_t i = parts.size(); i > 1; --i)
      std::swap(parts[i - 1], parts[random.below(static_cast<std::uint32_t>(i))]);
    Frame const other = draw(seed % 2 == 0 ? 2 : 1);
    EXPECT_EQ(cv::norm(other.color, once.color, cv::NORM_INF), 0) << "seed " << seed;
    EXPECT_EQ(cv::countNonZero(other.depth != once.depth), cv::countNonZero(once.depth != once.depth))
        << "seed " << seed;
  }
}

TEST(LdiSplats, OrthographicPicturesAreOfTheSamePlane) {
  auto const tree = panel();
  for (Splats const splats : {Splats::squares, Splats::blended})
    for (double const spacing : {0.7 * kStep, 1.1 * kStep, 3 * kStep}) {
      SCOPED_TRACE(testing::Message() << (splats == Splats::squares ? "squares, " : "blended, ") << spacing);
      Camera const camera = Camera::orthographic(64, 64, spacing, spacing, 31.5, 31.5);
      Eigen::Isometry3d const pose = oblique(45, 0, 1);
      LdiRenderer renderer(tree, with(splats));
      Frame const frame = renderer.render(camera, pose);
      EXPECT_EQ(uncovered(frame), 0U);
      EXPECT_LE(color_error(frame, kFront), splats == Splats::squares ? 0.5 : kExact);
      int coarsest = -100;
      for (TraversedCell const& at : renderer.traversed())
        coarsest = std::max(coarsest, tree->cells[static_cast<std::size_t>(at.cell)].key.level);
      double most = 0;
      for (int y = 0; y < 64; ++y)
        for (int x = 0; x < 64; ++x)
          most = std::max(
              most, std::abs(double(frame.depth(y, x)) - depth_at(camera, pose, x, y, Vector3d::UnitZ(), kMiddle.z())));
      // Squares are farther at their edges and do not follow the plane (see above).
      EXPECT_LE(most,
                splats == Splats::squares ? (8 + 0.6) * ldi_step(coarsest) : tree->options.merge_distance(coarsest));
    }
}

TEST(LdiSplats, BackSidesAreThoseOfSurfacesWithMeasuredNormals) {
  for (LdiOptions::Normals const normals : {LdiOptions::Normals::measured, LdiOptions::Normals::facing}) {
    bool const measured = normals == LdiOptions::Normals::measured;
    LdiOptions options;
    options.normals = normals;
    auto const tree = panel(8, options);
    for (Splats const splats : {Splats::squares, Splats::blended}) {
      for (Camera const& camera : {small_camera(), Camera::orthographic(64, 64, 0.1, 0.1, 31.5, 31.5)})
        for (double const tilt : {0.0, 45.0}) {
          SCOPED_TRACE(testing::Message() << (measured ? "measured" : "facing") << static_cast<int>(splats) << ' '
                                          << camera.is_perspective() << ' ' << tilt);
          LdiRenderer renderer(tree, with(splats));
          Frame const back = renderer.render(camera, oblique(180 + tilt, 0, 1)),
                      front = renderer.render(camera, oblique(tilt, 0, 1));
          EXPECT_GT(front.color(32, 32)[3], 0);
          EXPECT_EQ(back.color(32, 32)[3] > 0, !measured);
          EXPECT_EQ(uncovered(back) == back.color.total(), measured);
        }
    }
  }
}

TEST(LdiBlended, APlaneKeepsItsColourAndIsOpaqueAndWhereItIs) {
  auto const tree = panel();
  Camera const camera = small_camera();
  for_each_view([&](double tilt, double step_px, double stamp_px) {
    for (double const roll : {0.0, 45.0}) {
      Eigen::Isometry3d const pose = oblique(tilt, roll, step_px);
      LdiRenderer renderer(tree, with(Splats::blended, stamp_px));
      Frame const frame = renderer.render(camera, pose);
      EXPECT_LE(color_error(frame, kFront), kExact);
      // From stamps' to pixels' size steps double.
      double const within = tree->options.merge_distance(tree->cells.back().key.level) * (step_px < stamp_px ? 2 : 1);
      double most = 0;
      int least = 255;
      for (int y = 0; y < 64; ++y)
        for (int x = 0; x < 64; ++x) {
          least = std::min(least, int(frame.color(y, x)[3]));
          most = std::max(
              most, std::abs(double(frame.depth(y, x)) - depth_at(camera, pose, x, y, Vector3d::UnitZ(), kMiddle.z())));
        }
      EXPECT_EQ(least, 255);
      EXPECT_LE(most, within);
    }
  });
}

/// Levels that are drawn whole.
std::set<int> levels_of(LdiRenderer const& renderer) {
  std::set<int> levels;
  for (TraversedCell const& at : renderer.traversed())
    if (!at.descended) levels.insert(renderer.tree().cells[static_cast<std::size_t>(at.cell)].key.level);
  return levels;
}

TEST(LdiBlended, NothingShinesThroughAPlane) {
  // Farther apart than merge distances and what oblique planes add to them.
  Vector3d const rear = kMiddle - 16 * kStep * Vector3d::UnitZ();
  auto const tree = shared_tree({panel_view(Vector3d::UnitZ(), kMiddle, 16, kSpacing, plain_paint(kFront)),
                                 panel_view(Vector3d::UnitZ(), rear, 24, kSpacing, plain_paint(kRear))});
  // Kernels are narrower than the grid, so that weights differ from 1: they are at least 0.94 along each axis of a grid
  // that is along the screen's, and 0.94² with the gain of 1.25 is more than 1.
  int count = 0;
  for_each_view([&](double tilt, double step_px, double stamp_px) {
    if (tilt > 50) return;  // perspective turns the grid on the screen
    LdiRenderer renderer(tree, with(Splats::blended, stamp_px));
    Frame const frame = renderer.render(small_camera(), oblique(tilt, 0, step_px));
    if (levels_of(renderer).size() > 1) return;  // kernels of two grids
    ++count;
    EXPECT_LE(color_error(frame, kFront), kExact);
  });
  EXPECT_GT(count, 20);
}

TEST(LdiBlended, NothingShinesThroughAPlaneHoweverItsGridsLie) {
  // Turned and foreshortened on the screen, and where a coarser grid meets a finer one: what is covered is opaque.
  Vector3d const rear = kMiddle - 16 * kStep * Vector3d::UnitZ();
  auto const tree = shared_tree({panel_view(Vector3d::UnitZ(), kMiddle, 16, kSpacing, plain_paint(kFront)),
                                 panel_view(Vector3d::UnitZ(), rear, 24, kSpacing, plain_paint(kRear))});
  for_each_view([&](double tilt, double step_px, double stamp_px) {
    double most = 0;
    for (double const roll : {0.0, 20.0, 45.0})
      most = std::max(
          most,
          color_error(
              LdiRenderer(tree, with(Splats::blended, stamp_px)).render(small_camera(), oblique(tilt, roll, step_px)),
              kFront));
    EXPECT_LE(most, kExact);
  });
}

TEST(LdiSplats, OutlinesLieWhereTheyAre) {
  // A front square before a rear plane. Where a row of the picture turns from one's colour to the other's: by shares of
  // the red channel in linear light, of which the rear has none.
  Vector3d const rear = kMiddle - 16 * kStep * Vector3d::UnitZ();
  double const half = 40 * kSpacing;
  cv::Vec3b const white(255, 255, 255), black(0, 0, 0);
  auto const tree = shared_tree({panel_view(Vector3d::UnitZ(), kMiddle, half, kSpacing, plain_paint(white)),
                                 panel_view(Vector3d::UnitZ(), rear, 16, kSpacing, plain_paint(black))});
  auto const& linear = linear_from_srgb8();
  constexpr int kSize = 200;
  for (Splats const splats : {Splats::blended, Splats::squares})
    for (double const step_px : {0.75, 1.0, 1.7}) {
      Camera const camera = Camera::perspective(kSize, kSize, 128, 128, kSize / 2.0, kSize / 2.0);
      Eigen::Isometry3d const pose = oblique(0, 0, step_px);
      Frame const frame = LdiRenderer(tree, with(splats)).render(camera, pose);
      double const exact = 2 * half / kStep * step_px;  // its width on the screen
      for (int y = kSize / 2 - 20; y < kSize / 2 + 20; ++y) {
        double left = 0, right = 0;
        for (int x = 0; x < kSize; ++x) {
          double const share = linear[frame.color(y, x)[2]];
          (x < kSize / 2 ? left : right) += share;
        }
        double const middle = kSize / 2.0;
        // Pixels cover half a pixel more to both sides; those up to kSize / 2 − 1 are left ones.
        EXPECT_NEAR(middle - 0.5 - left, middle - exact / 2, 0.5 + 0.5 * step_px) << y << " steps of " << step_px;
        EXPECT_NEAR(middle - 0.5 + right, middle + exact / 2, 0.5 + 0.5 * step_px) << y << " steps of " << step_px;
      }
    }
}

TEST(LdiNoise, FillsNoBinAfterBinAndIsOneSurface) {
  // Noise of 4 steps, no more than three standard deviations: no two depths differ by more than 24 steps, the images'
  // error, and what tangent planes add on the way to a grid point.
  constexpr int kImages = 8, kSize = 96;
  constexpr double kSigma = 4 * kStep, kSpread = 6 * kSigma;
  LdiOptions options;
  options.depth_error = kSpread + 2 * kStep;
  int const level = -4;
  ASSERT_EQ(ldi_step(level), kStep);
  EXPECT_EQ(options.bin_shift(level), 4);  // 16 steps are less than 26, 32 are more
  // In the middle of its cells' depth, and where two cells meet.
  for (double const depth : {32.3, 64.0}) {
    SCOPED_TRACE(depth);
    double const z = ldi_origin().z() + depth * kStep;
    std::vector<View> views;
    for (int i = 0; i < kImages; ++i) {
      Vector3d const middle(0.03 * i, 0.02 * i, z);
      views.push_back(panel_view(Vector3d::UnitZ(), middle, kSize / 2 * kSpacing, kSpacing, plain_paint(kFront)));
      CounterRandom random(7, static_cast<std::uint64_t>(i));
      for (float& one : views.back().image.depth) {
        double noise = 0;
        do noise = random.normal();
        while (std::abs(noise) > 3);
        one += static_cast<float>(kSigma * noise);
      }
      views.back().image.sigma.setTo(kSigma);
    }
    Vector3d const rear(0, 0, z - 4 * kSpread);
    views.push_back(panel_view(Vector3d::UnitZ(), rear, kSize * kSpacing, kSpacing, plain_paint(kRear)));
    LdiBuilder const builder = builder_of(views, options);
    Context context;
    LdiTree const tree = builder.build(Unit::m, context);

    std::size_t sums = 0, points = 0;
    for (auto const& [key, cell] : builder.sums()) {
      if (key.level != level) continue;
      for (int y = 0; y < options.resolution; ++y)
        for (int x = 0; x < options.resolution; ++x) {
          Vector3d const at = ldi_corner(key, options.resolution) + kStep * Vector3d(x + 0.5, y + 0.5, 0);
          // Away from the images' rims, where slopes are less certain; and of the front alone.
          if ((at.head<2>() - Eigen::Vector2d(0.1, 0.1)).cwiseAbs().maxCoeff() > 32 * kSpacing) continue;
          std::size_t here = 0;
          for (std::uint32_t k = cell->first(5, x, y); k != 0; k = (*cell)[k].next)
            here += std::abs(at.z() + 16 * kStep * ((*cell)[k].bin + 0.5) - z) < 2 * kSpread;
          sums += here;
          points += here > 0;
        }
    }
    // 26 steps lie in three bins of 16 at most; and cells begin where bins do.
    EXPECT_GE(points, 64U * 64U);
    EXPECT_LE(sums, 3 * points);

    std::map<std::tuple<double, double>, int> layers;
    for (PlacedPixel const& pixel : pixels_of(tree))
      if (pixel.level == level && pixel.at.head<2>().cwiseAbs().maxCoeff() < 32 * kSpacing)
        if (std::abs(pixel.at.z() - z) < 2 * kSpread) ++layers[{pixel.at.x(), pixel.at.y()}];
    int most = 0;
    for (auto const& [at, count] : layers) most = std::max(most, count);
    EXPECT_GE(most, 1);
    EXPECT_LE(most, depth == 64.0 ? 2 : 1);

    Camera const camera = Camera::orthographic(48, 48, kStep, kStep, 23.5, 23.5);
    Eigen::Isometry3d const pose = toward({0.1, 0.1, z + 20}, {0.1, 0.1, z});
    Frame const frame = LdiRenderer(std::make_shared<LdiTree>(tree), {}).render(camera, pose);
    EXPECT_LE(color_error(frame, kFront), kExact);
    for (float const one : frame.depth) EXPECT_NEAR(one, 20, kSpread / 2 + 2 * kStep);
  }
}

}  // namespace
}  // namespace scanview::test
