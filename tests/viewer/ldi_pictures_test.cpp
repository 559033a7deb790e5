#include <fmt/format.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <memory>
#include <opencv2/imgproc.hpp>

#include "base/error.h"
#include "base/files.h"
#include "base/random.h"
#include "tests/temporary_folder.h"
#include "viewer/layered/ldi_file.h"
#include "viewer/layered/ldi_renderer.h"
#include "viewer/ldi_scenes.h"
#include "viewer/raster/kernels.h"

// Hard cases, seen in pictures.

namespace scanview::test {
namespace {

using Eigen::Vector3d;

Frame picture(LdiTree const& tree, Camera const& camera, Eigen::Isometry3d const& pose, int threads = 0) {
  return LdiRenderer(std::make_shared<LdiTree>(tree), {}, threads).render(camera, pose);
}

std::size_t reachable(LdiTree const& tree, std::vector<std::int32_t> const& from) {
  std::size_t count = 0;
  for (std::int32_t const number : from) {
    std::vector<std::int32_t> children;
    for (std::int32_t const child : tree.cells[static_cast<std::size_t>(number)].children)
      if (child >= 0) children.push_back(child);
    count += 1 + reachable(tree, children);
  }
  return count;
}

/// How a picture differs from what a camera saw, away from the picture's rim, as shares of the pixels that it saw.
struct Difference {
  double missing = 0, depth = 0, color = 0;  ///< mean differences: relative, of 255
};
Difference difference(Frame const& frame, View const& view, int rim) {
  Difference result;
  double seen = 0, drawn = 0;
  for (int y = rim; y < frame.color.rows - rim; ++y)
    for (int x = rim; x < frame.color.cols - rim; ++x) {
      if (!view.image.has_depth(x, y)) continue;
      ++seen;
      if (frame.color(y, x)[3] < 128) {
        ++result.missing;
        continue;
      }
      ++drawn;
      float const z = view.image.depth(y, x);
      result.depth += std::abs(double(frame.depth(y, x) - z) / double(z));
      for (int c = 0; c < 3; ++c)
        result.color += std::abs(double(frame.color(y, x)[c]) - double(view.image.color(y, x)[c])) / 3;
    }
  return {result.missing / seen, result.depth / drawn, result.color / drawn};
}

View slanted(Camera const& camera, Eigen::Isometry3d const& pose, Vector3d const& shift = {0, 0, 0}) {
  Vector3d const normal = Vector3d(0.3, -0.4, 1).normalized();
  auto const paint = wavy_paint(2.5);
  Eigen::Isometry3d moved = pose;
  moved.translation() += shift;
  return plane_view("a", camera, moved, normal, normal.dot(shift) - 1,
                    [=](Vector3d const& p) { return paint(p - shift); });
}

TEST(LdiPictures, OfASinglePixel) {
  Eigen::Isometry3d const pose = toward({1, 2, 3}, {0.3, 0.2, -1});
  for (int const resolution : {1, 64}) {
    LdiOptions options;
    options.resolution = resolution;
    View const view = pixel_view(Camera::perspective(1, 1, 10, 10, 0, 0), pose, 4, {50, 100, 220});
    LdiTree const tree = tree_of({view}, options);
    EXPECT_EQ(tree.input_pixels, 1U);
    EXPECT_EQ(reachable(tree, tree.roots), tree.cells.size());
    Vector3d const at = pose * Vector3d(0, 0, 4);
    double const step = ldi_step(tree.cells.back().key.level);
    EXPECT_LT((tree.center - at).norm(), 2 * step);
    EXPECT_GT(tree.radius, 0);
    EXPECT_LT(tree.radius, 4 * step);
    // It covers ten pixels of a tenth.
    Frame const frame = picture(tree, Camera::perspective(51, 51, 100, 100, 25, 25), pose);
    cv::Vec4b const middle = frame.color(25, 25);
    EXPECT_GT(middle[3], 150);
    EXPECT_NEAR(middle[0], 50, 2);
    EXPECT_NEAR(middle[1], 100, 2);
    EXPECT_NEAR(middle[2], 220, 2);
    EXPECT_NEAR(frame.depth(25, 25), 4, 0.2);
    EXPECT_EQ(frame.color(0, 0)[3], 0);
  }
}

TEST(LdiPictures, OfPixelsTooFaintToBeSeenFromAfar) {
  // Stamps of an eighth of a grid step's area, a thousand steps apart: cells above them have no pixels of their own.
  LdiOptions options;
  options.resolution = 8;
  options.coarseness = 4;
  Camera const one = Camera::orthographic(1, 1, 0.3, 0.3, 0, 0);
  std::vector<View> views;
  for (Vector3d const& eye : {Vector3d(2000, 1, 5), Vector3d(3000, 2, 6)})
    views.push_back(pixel_view(one, toward(eye, eye - Vector3d(0, 0, 1)), 2, {90, 90, 90}));
  LdiTree const tree = tree_of(views, options);
  EXPECT_GT(tree.cells.size(), 8U);
  EXPECT_EQ(tree.cells.front().pixels, 0U);
  EXPECT_EQ(reachable(tree, tree.roots), tree.cells.size());
  EXPECT_NEAR(tree.center.y(), 1.5, 3);
  EXPECT_GE(tree.center.x(), 1990);
  EXPECT_LE(tree.center.x(), 3010);
  EXPECT_GT(tree.radius, 400);
  for (View const& view : views) {
    Camera const near = Camera::orthographic(9, 9, 0.3, 0.3, 4, 4);
    Frame const frame = picture(tree, near, *view.object_from_camera);
    EXPECT_GT(frame.color(4, 4)[3], 0);
    EXPECT_NEAR(frame.depth(4, 4), 2, 0.1);
  }
}

TEST(LdiPictures, AtEveryResolutionShowWhatTheCameraSaw) {
  Camera const camera = square_view(64);
  Eigen::Isometry3d const pose = toward({0.3, 0.2, 1}, {0, 0, -2});
  View const view = slanted(camera, pose);
  for (int const resolution : {1, 2, 5, 64, 256}) {
    LdiOptions options;
    options.resolution = resolution;
    LdiTree const tree = tree_of({view}, options);
    EXPECT_EQ(reachable(tree, tree.roots), tree.cells.size()) << resolution;
    LdiRenderer renderer(std::make_shared<LdiTree>(tree), {});
    Difference const d = difference(renderer.render(camera, pose), view, 3);
    EXPECT_EQ(d.missing, 0) << resolution;
    EXPECT_LT(d.depth, 2e-3) << resolution;
    EXPECT_LT(d.color, 6) << resolution;
  }
}

TEST(LdiPictures, OfASceneAMillionUnitsAwayAreTheSame) {
  Camera const camera = square_view(64);
  Eigen::Isometry3d const pose = toward({0.3, 0.2, 1}, {0, 0, -2});
  Vector3d const shift(1 << 20, -(1 << 20), 1 << 21);  // multiples of all cells
  LdiTree const here = tree_of({slanted(camera, pose)}), there = tree_of({slanted(camera, pose, shift)});
  ASSERT_EQ(there.cells.size(), here.cells.size());
  EXPECT_EQ(there.pixel_count(), here.pixel_count());
  EXPECT_LT((there.center - shift - here.center).norm(), 1e-6);
  EXPECT_NEAR(there.radius, here.radius, 1e-6);
  Eigen::Isometry3d from = toward({0.5, 0, 0.6}, {0.2, 0, -2});
  Frame const a = picture(here, camera, from);
  from.translation() += shift;
  Frame const b = picture(there, camera, from);
  EXPECT_LE(cv::norm(a.color, b.color, cv::NORM_INF), 2);
  for (int y = 0; y < 64; ++y)
    for (int x = 0; x < 64; ++x)
      if (a.color(y, x)[3] > 128) {
        EXPECT_NEAR(a.depth(y, x), b.depth(y, x), 1e-3) << x << ' ' << y;
      }
}

TEST(LdiPictures, OfOrthographicReferences) {
  Eigen::Isometry3d const pose = toward({0.3, 0.2, 6}, {0, 0, -2});
  Camera const reference = Camera::orthographic(96, 96, 0.05, 0.05, 47.5, 47.5);
  View const view = slanted(reference, pose);
  LdiTree const tree = tree_of({view});
  Difference const same = difference(picture(tree, reference, pose), view, 3);
  EXPECT_EQ(same.missing, 0);
  EXPECT_LT(same.depth, 1e-3);
  EXPECT_LT(same.color, 4);
  Camera const camera = Camera::perspective(48, 48, 100, 100, 23.5, 23.5);
  Eigen::Isometry3d const other = toward({-0.5, 0.4, 4}, {0, 0, -1});
  Difference const d = difference(picture(tree, camera, other), slanted(camera, other), 2);
  EXPECT_EQ(d.missing, 0);
  EXPECT_LT(d.depth, 2e-3);
  EXPECT_LT(d.color, 6);
}

/// The same views in another order.
std::vector<View> shuffled(std::vector<View> views, std::uint64_t seed) {
  CounterRandom random(seed, 0);
  for (std::size_t i = views.size(); i > 1; --i)
    std::swap(views[i - 1], views[random.below(static_cast<std::uint32_t>(i))]);
  return views;
}

TEST(LdiPictures, AndFilesDependNeitherOnOrderNorOnThreads) {
  TemporaryFolder const folder;
  std::vector<View> views;
  for (int i = 0; i < 6; ++i) {
    Camera const camera = i % 2 == 0 ? square_view(24) : Camera::orthographic(24, 20, 0.1, 0.12, 12, 10);
    views.push_back(slanted(camera, toward(Vector3d(0.2 * i, 0.1, 1 + 0.5 * i), {0, 0.1, -1})));
    views.back().name = std::to_string(i);
  }
  // Equal names and poses, too.
  views.push_back(views[0]);
  views.back().gain = {1, 0.5, 2};
  views.push_back(views[0]);
  views.back().image = views[1].image;
  LdiOptions options;
  options.resolution = 16;
  auto const bytes = [&](std::vector<View> const& list, int threads) {
    Context context;
    context.threads = threads;
    LdiBuilder builder(options);
    // In one go, or one by one.
    if (threads == 1) {
      for (View const& view : list) builder.add({view}, context);
    } else {
      builder.add(list, context);
    }
    write_ldi(folder.path() / "tree.ldi", builder.build(Unit::m, context), builder, LdiKeep::sums);
    return read_file(folder.path() / "tree.ldi");
  };
  std::string const once = bytes(views, 2);
  for (std::uint64_t seed = 0; seed < 12; ++seed)
    EXPECT_EQ(bytes(shuffled(views, seed), seed % 2 == 0 ? 1 : 2), once) << "seed " << seed;

  LdiTree const tree = read_ldi(folder.path() / "tree.ldi");
  Frame const a = picture(tree, square_view(80), toward({0.4, 0, 1}, {0, 0, -1}), 1),
              b = picture(tree, square_view(80), toward({0.4, 0, 1}, {0, 0, -1}), 2);
  EXPECT_EQ(cv::norm(a.color, b.color, cv::NORM_INF), 0);
}

TEST(LdiPictures, OfADamagedFileLackItsDamagedCells) {
  TemporaryFolder const folder;
  auto const path = folder.path() / "tree.ldi";
  Eigen::Isometry3d const pose = toward({0.3, 0.2, 1}, {0, 0, -2});
  LdiOptions options;
  options.resolution = 16;
  LdiBuilder const builder = builder_of({slanted(square_view(64), pose)}, options);
  Context context;
  write_ldi(path, builder.build(Unit::m, context), builder, LdiKeep::tree_alone);
  std::string bytes = read_file(path);
  auto const whole = std::make_shared<LdiTree>(read_ldi(path));
  LdiRenderer before(whole, {});
  Camera const camera = square_view(200);
  Frame const all = before.render(camera, pose);
  EXPECT_TRUE(before.damaged().empty());
  bytes[bytes.size() - kLdiPadding - 32] ^= 1;
  write_file(path, bytes);
  LdiRenderer renderer(std::make_shared<LdiTree>(read_ldi(path)), {});
  // What does not show the last of its cells does not read it.
  renderer.render(square_view(4), pose);
  EXPECT_TRUE(renderer.damaged().empty());
  for (int turn = 0; turn < 2; ++turn) {
    Frame const frame = renderer.render(camera, pose);
    ASSERT_EQ(renderer.damaged().size(), 1U);
    auto const& [cell, why] = *renderer.damaged().begin();
    EXPECT_EQ(cell, static_cast<std::int32_t>(whole->cells.size()) - 1);
    EXPECT_NE(why.find("tree.ldi"), std::string::npos);
    EXPECT_NE(why.find("damaged"), std::string::npos);
    // Away from the cell nothing changes; where it is, coarser ones fill in.
    Eigen::AlignedBox3d box = whole->box(whole->cells.back());
    box.min() -= 0.1 * Vector3d::Ones();
    box.max() += 0.1 * Vector3d::Ones();
    std::size_t same = 0, other = 0;
    for (int y = 0; y < camera.height(); ++y)
      for (int x = 0; x < camera.width(); ++x) {
        if (all.color(y, x)[3] < 128) continue;
        bool const equal = frame.color(y, x) == all.color(y, x);
        bool const within = box.contains(pose * camera.unproject(x, y, double(all.depth(y, x))));
        EXPECT_TRUE(equal || within) << x << ' ' << y;
        (equal ? same : other) += 1;
      }
    EXPECT_GT(other, 0U);
    EXPECT_GT(same, 10 * other);
  }
  renderer.options.splats = LdiRenderOptions::Splats::squares;
  Frame const squares = renderer.render(camera, pose);
  EXPECT_EQ(renderer.damaged().size(), 1U);
  std::size_t drawn = 0;
  for (cv::Vec4b const& pixel : squares.color) drawn += pixel[3] > 0;
  EXPECT_GT(drawn, squares.color.total() / 2);
  renderer.render(square_view(4), pose);
  EXPECT_TRUE(renderer.damaged().empty());
}

TEST(LdiPictures, OfOneCameraHaveTheSameFiguresHoweverOftenTheyAreTaken) {
  // From nearer than the reference, with a hole that the cells above fill.
  Eigen::Isometry3d const pose = toward({0.3, 0.2, 1}, {0, 0, -2});
  View view = slanted(square_view(64), pose);
  cv::circle(view.image.depth, {30, 30}, 3, cv::Scalar(kMissing), -1);
  LdiOptions options;
  options.resolution = 16;
  LdiRenderer renderer(std::make_shared<LdiTree>(tree_of({view}, options)), {});
  Camera const camera = square_view(160);
  Frame const first = renderer.render(camera, pose);
  std::size_t const splats = renderer.splats(), filling = renderer.filling_splats(), gaps = renderer.gaps(),
                    uncovered = renderer.uncovered();
  EXPECT_GT(filling, 0U);
  EXPECT_GT(splats, filling);
  for (int i = 0; i < 3; ++i) {
    Frame const again = renderer.picture();
    EXPECT_EQ(renderer.splats(), splats);
    EXPECT_EQ(renderer.filling_splats(), filling);
    EXPECT_EQ(renderer.gaps(), gaps);
    EXPECT_EQ(renderer.uncovered(), uncovered);
    EXPECT_EQ(cv::norm(again.color, first.color, cv::NORM_INF), 0);
  }
  renderer.options.gaps = LdiRenderOptions::Gaps::background;
  renderer.picture();
  EXPECT_EQ(renderer.filling_splats(), 0U);
  EXPECT_EQ(renderer.splats(), splats - filling);
  renderer.options.gaps = LdiRenderOptions::Gaps::filled;
  renderer.render(camera, pose);
  EXPECT_EQ(renderer.splats(), splats);
}

TEST(LdiPictures, InStepsCountWhatIsUncoveredAtEachStep) {
  Eigen::Isometry3d const pose = toward({0.3, 0.2, 1}, {0, 0, -2});
  LdiOptions options;
  options.resolution = 8;
  LdiRenderer renderer(std::make_shared<LdiTree>(tree_of({slanted(square_view(128), pose)}, options)), {});
  renderer.begin(square_view(128), pose);
  int steps = 0;
  for (bool more = true; more; ++steps) {
    more = renderer.refine();
    Frame const frame = renderer.picture();
    std::size_t bare = 0;
    for (cv::Vec4b const& pixel : frame.color) bare += pixel[3] < 128;
    EXPECT_EQ(renderer.uncovered(), bare) << steps;
    EXPECT_LT(bare, frame.color.total() / 10) << steps;
  }
  EXPECT_GT(steps, 2);
}

bool equal(Frame const& a, Frame const& b) {
  return a.color.size() == b.color.size() && std::equal(a.color.begin(), a.color.end(), b.color.begin()) &&
         std::equal(a.depth.begin(), a.depth.end(), b.depth.begin(),
                    [](float x, float y) { return x == y || (std::isnan(x) && std::isnan(y)); });
}

TEST(LdiPictures, MayBeAskedForAndPaintedOnAtAnyTime) {
  Eigen::Isometry3d const pose = toward({0.3, 0.2, 1}, {0, 0, -2});
  LdiOptions options;
  options.resolution = 8;
  LdiRenderer renderer(std::make_shared<LdiTree>(tree_of({slanted(square_view(64), pose)}, options)), {});
  EXPECT_FALSE(renderer.refine());
  EXPECT_TRUE(renderer.picture().color.empty());
  Camera const camera = square_view(90);
  renderer.begin(camera, pose);
  EXPECT_EQ(cv::countNonZero(renderer.picture().depth > 0), 0);
  for (bool more = true; more;) {
    more = renderer.refine();
    Frame first = renderer.picture();
    Frame const copy{first.color.clone(), first.depth.clone()};
    first.color.setTo(cv::Scalar(255, 0, 255, 255));
    EXPECT_TRUE(equal(renderer.picture(), copy));
  }
  Frame const blended = renderer.picture();
  // What has been drawn stays, whatever the next picture is to be drawn with.
  renderer.options.splats = LdiRenderOptions::Splats::squares;
  EXPECT_FALSE(renderer.refine());
  EXPECT_TRUE(equal(renderer.picture(), blended));
  Frame const squares = renderer.render(camera, pose);
  EXPECT_FALSE(equal(squares, blended));
  EXPECT_TRUE(equal(renderer.picture(), squares));
  EXPECT_EQ(renderer.filling_splats(), 0U);
  renderer.options.splats = LdiRenderOptions::Splats::blended;
  EXPECT_TRUE(equal(renderer.picture(), squares));
  // From blended ones to squares on the way.
  renderer.begin(camera, pose);
  renderer.refine();
  ASSERT_TRUE(renderer.refine());
  renderer.picture();
  renderer.options.splats = LdiRenderOptions::Splats::squares;
  EXPECT_FALSE(renderer.refine());
  EXPECT_TRUE(equal(renderer.picture(), squares));
  EXPECT_EQ(renderer.filling_splats(), 0U);
}

TEST(LdiPictures, OfSquaresHaveTheDepthOfWhatTheyShow) {
  Camera const camera = square_view(64);
  Eigen::Isometry3d const pose = toward({0.3, 0.2, 1}, {0, 0, -2});
  View const view = slanted(camera, pose);
  LdiRenderOptions options;
  options.splats = LdiRenderOptions::Splats::squares;
  LdiRenderer renderer(std::make_shared<LdiTree>(tree_of({view})), options);
  Frame const frame = renderer.render(camera, pose);
  double behind = 0, drawn = 0;
  for (int y = 3; y < 61; ++y)
    for (int x = 3; x < 61; ++x) {
      if (frame.color(y, x)[3] == 0) continue;
      // A square's middle is at most a pixel away, along both axes, on a plane that rises by its pixels' size or less.
      double const off = double(frame.depth(y, x) - view.image.depth(y, x)),
                   pixel = camera.pixel_size(double(view.image.depth(y, x)));
      EXPECT_LT(std::abs(off), 2 * pixel) << x << ' ' << y;
      behind += off / pixel;
      ++drawn;
    }
  EXPECT_GT(drawn, 3000);
  EXPECT_NEAR(behind / drawn, 0, 0.1);
}

TEST(LdiPictures, AreEqualOnAnyThreadsAndInstructions) {
  struct AllTargets {
    ~AllTargets() { use_kernel_target(""); }
  } const all_targets;
  // Rough surfaces, so that pixels' splats reach by turns more and less than a pixel; in cells of which several bands
  // have a part.
  constexpr std::uint64_t kSeed = 3;
  std::vector<View> views;
  for (int i = 0; i < 3; ++i) {
    views.push_back(slanted(square_view(64), toward({0.3 + 0.2 * i, 0.2, 1}, {0, 0, -2})));
    CounterRandom random(kSeed, static_cast<std::uint64_t>(i));
    for (float& z : views.back().image.depth) z *= static_cast<float>(1 + 0.02 * random.uniform());
  }
  auto const tree = std::make_shared<LdiTree>(tree_of(views));
  Eigen::Isometry3d const pose = toward({0.3, 0.2, 1}, {0, 0, -2});
  for (Camera const& camera :
       {square_view(65), square_view(80), square_view(150), Camera::orthographic(126, 97, 0.02, 0.03, 63, 48)})
    for (auto const splats : {LdiRenderOptions::Splats::blended, LdiRenderOptions::Splats::squares}) {
      LdiRenderOptions options;
      options.splats = splats;
      Frame const expected = LdiRenderer(tree, options, 1).render(camera, pose);
      for (char const* const target : kernel_targets()) {
        use_kernel_target(target);
        for (int const threads : {1, 2, 3})
          EXPECT_TRUE(equal(LdiRenderer(tree, options, threads).render(camera, pose), expected))
              << target << ' ' << camera.width() << ' ' << threads;
      }
      use_kernel_target("");
    }
}

TEST(LdiPictures, FromWithinSurfacesHaveDepthsThatCanBe) {
  // Splats of steep surfaces beside the eye reach beyond their tangent planes' horizons.
  std::vector<View> const views = {slanted(square_view(64), toward({0.3, 0.2, 1}, {0, 0, -2})),
                                   plane_view("wall", square_view(64), toward({2, 0.5, 1}, {-1, 0, -1.5}),
                                              Vector3d(1, 0.2, 0.3).normalized(), -1.2, wavy_paint(1))};
  constexpr std::uint64_t kSeed = 7;
  for (int const resolution : {1, 5, 64}) {
    LdiOptions options;
    options.resolution = resolution;
    auto const tree = std::make_shared<LdiTree>(tree_of(views, options));
    double const near = nearest_drawn(*tree);
    auto const places = pixels_of(*tree);
    for (std::uint64_t i = 0; i < 30; ++i) {
      CounterRandom random(kSeed, i);
      auto const any = [&] { return 2 * random.uniform() - 1; };
      // In a pixel's middle, on a cell's corner or face, or beside.
      Vector3d eye = places[random.below(static_cast<std::uint32_t>(places.size()))].at;
      LdiCell const& cell = tree->cells[random.below(static_cast<std::uint32_t>(tree->cells.size()))];
      if (i % 5 == 0) eye = tree->box(cell).min();
      if (i % 5 == 1) eye = {eye.x(), eye.y(), tree->box(cell).min().z()};
      if (i % 5 == 2) eye += 0.05 * Vector3d(any(), any(), any());
      Eigen::Isometry3d const pose = toward(eye, Vector3d(any(), any(), any() - 1));
      Camera const camera = Camera::perspective(111, 65, 50, 60, 55, 32);
      for (auto const splats : {LdiRenderOptions::Splats::blended, LdiRenderOptions::Splats::squares}) {
        LdiRenderOptions how;
        how.splats = splats;
        how.stamp_px = i % 2 == 0 ? 1 : 16;
        Frame const frame = LdiRenderer(tree, how).render(camera, pose);
        for (int y = 0; y < frame.color.rows; ++y)
          for (int x = 0; x < frame.color.cols; ++x) {
            double const z = double(frame.depth(y, x));
            if (frame.color(y, x)[3] == 0) {
              EXPECT_TRUE(std::isnan(z));
            } else {
              // Of the scene, which is smaller than 20; over a splat depths are two thirds to twice its middle's.
              EXPECT_GE(z, 0.66 * near) << resolution << " seed " << i << ' ' << x << ' ' << y;
              EXPECT_LE(z, 40) << resolution << " seed " << i << ' ' << x << ' ' << y;
            }
          }
      }
    }
  }
}

TEST(LdiPictures, OfOrthographicCamerasDoNotDependOnHowFarAwayTheyAre) {
  // A wall that is seen from a grazing angle, before a plane.
  View const wall = plane_view("wall", square_view(96), toward({1.3, 0, 0}, {0, 0, -1}),
                               Vector3d(1, 0, 0.1).normalized(), 0, wavy_paint(0.3));
  LdiRenderer renderer(
      std::make_shared<LdiTree>(tree_of({slanted(square_view(96), toward({0.3, 0.2, 1}, {0, 0, -2})), wall})), {});
  Camera const camera = Camera::orthographic(200, 200, 0.015, 0.015, 100, 100);
  Eigen::Isometry3d const pose = toward({0.5, 0.1, 4}, {0.1, 0, -1});
  Frame const expected = renderer.render(camera, pose);
  EXPECT_GT(cv::countNonZero(expected.depth > 0), 20000);
  for (double const move : {-2.0, 3.0, 4.0, 4.5, 5.0, 8.0}) {
    Eigen::Isometry3d moved = pose;
    moved.translation() += move * pose.linear().col(2);
    Frame const frame = renderer.render(camera, moved);
    std::size_t other = 0;
    for (int y = 0; y < 200; ++y)
      for (int x = 0; x < 200; ++x) other += cv::norm(frame.color(y, x), expected.color(y, x), cv::NORM_INF) > 4;
    EXPECT_LE(other, 2U) << move;  // where rounding decides what is one surface
  }
}

}  // namespace
}  // namespace scanview::test
