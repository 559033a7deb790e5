#include "viewer/layered/ldi_renderer.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <map>
#include <memory>
#include <opencv2/core.hpp>
#include <set>

#include "base/random.h"
#include "base/srgb.h"
#include "viewer/ldi_scenes.h"

// Which cells are drawn; pictures in steps; gaps; and what is seen from near and from far.

namespace scanview::test {
namespace {

using Eigen::Vector3d;
using Splats = LdiRenderOptions::Splats;
using Gaps = LdiRenderOptions::Gaps;

std::shared_ptr<LdiTree const> shared_tree(std::vector<View> const& views, int resolution) {
  LdiOptions options;
  options.resolution = resolution;
  return std::make_shared<LdiTree>(tree_of(views, options));
}
/// A room's corner in many cells of several levels.
std::shared_ptr<LdiTree const> corner_tree(int size = 96) {
  return shared_tree({corner_view("a", size, {2, 2, 2}), corner_view("b", size, {0.5, 1.5, -0.8})}, 8);
}

/// A camera somewhere in the room and around, every other one orthographic.
struct Look {
  Camera camera;
  Eigen::Isometry3d pose;
};
Look random_look(std::uint64_t seed) {
  CounterRandom random(seed, 0);
  auto const within = [&](double low, double high) { return low + (high - low) * random.uniform(); };
  Vector3d const eye(within(-2.5, 5), within(-2, 5), within(-2.5, 5)), at(within(-3, 3), within(-3, 3), within(-3, 3));
  double const f = std::exp2(within(3, 8));
  int const width = 20 + static_cast<int>(random.below(100)), height = 20 + static_cast<int>(random.below(100));
  double const cx = width * within(0.2, 0.8), cy = height * within(0.2, 0.8), aspect = within(0.7, 1.4);
  Camera const camera = seed % 2 == 0 ? Camera::perspective(width, height, f, f * aspect, cx, cy)
                                      : Camera::orthographic(width, height, 4 / f, 4 / f * aspect, cx, cy);
  return {camera, toward(eye, at)};
}

/// Corners of a cell's box that is so much larger to all sides, in camera coordinates.
std::array<Vector3d, 8> corners_of(LdiTree const& tree, LdiCell const& cell, double larger, Look const& look) {
  Eigen::AlignedBox3d const box = tree.box(cell);
  std::array<Vector3d, 8> corners;
  for (std::size_t i = 0; i < 8; ++i) {
    Vector3d at;
    for (int k = 0; k < 3; ++k) at[k] = i >> k & 1 ? box.max()[k] + larger : box.min()[k] - larger;
    corners[i] = look.pose.inverse() * at;
  }
  return corners;
}

/// The greatest that a grid step is at a corner: infinite where one is behind what is drawn.
double greatest_stamp(LdiTree const& tree, LdiCell const& cell, double larger, Look const& look) {
  double const focal = std::sqrt(look.camera.fx() * look.camera.fy()), step = ldi_step(cell.key.level);
  if (!look.camera.is_perspective()) return step * focal;
  double greatest = 0;
  for (Vector3d const& corner : corners_of(tree, cell, larger, look))
    greatest = std::max(greatest, corner.z() > nearest_drawn(tree) ? step * focal / corner.z()
                                                                   : std::numeric_limits<double>::infinity());
  return greatest;
}

/// Whether a cell with two steps around it is beyond one side of the picture by more than two pixels, or nearer than
/// anything is drawn: tangent planes reach a step, kernels a pixel.
bool is_outside(LdiTree const& tree, LdiCell const& cell, Look const& look) {
  Camera const& c = look.camera;
  int beyond[5] = {};
  for (Vector3d const& p : corners_of(tree, cell, 2 * ldi_step(cell.key.level), look)) {
    double const z = c.is_perspective() ? p.z() : 1;
    beyond[0] += c.fx() * p.x() + (c.cx() + 2.5) * z < 0;
    beyond[1] += c.fx() * p.x() + (c.cx() - c.width() - 1.5) * z > 0;
    beyond[2] += c.fy() * p.y() + (c.cy() + 2.5) * z < 0;
    beyond[3] += c.fy() * p.y() + (c.cy() - c.height() - 1.5) * z > 0;
    beyond[4] += c.is_perspective() && p.z() < nearest_drawn(tree);
  }
  return std::any_of(beyond, beyond + 5, [](int count) { return count == 8; });
}

/// Whether the camera sees one of 5 x 5 x 5 places of a cell.
bool is_seen(LdiTree const& tree, LdiCell const& cell, Look const& look) {
  auto const corners = corners_of(tree, cell, 0, look);
  for (int i = 0; i < 125; ++i) {
    double const a = i % 5 / 4.0, b = i / 5 % 5 / 4.0, c = i / 25 / 4.0;
    Vector3d const p =
        corners[0] + a * (corners[1] - corners[0]) + b * (corners[2] - corners[0]) + c * (corners[4] - corners[0]);
    if (look.camera.is_perspective() && p.z() <= nearest_drawn(tree)) continue;
    if (look.camera.contains(look.camera.project(p))) return true;
  }
  return false;
}

using ByCell = std::map<std::int32_t, TraversedCell>;
ByCell by_cell(std::vector<TraversedCell> const& cells) {
  ByCell all;
  for (TraversedCell const& at : cells) EXPECT_TRUE(all.emplace(at.cell, at).second) << "twice: " << at.cell;
  return all;
}
std::vector<std::int32_t> children_of(LdiCell const& cell) {
  std::vector<std::int32_t> children;
  std::copy_if(cell.children.begin(), cell.children.end(), std::back_inserter(children),
               [](std::int32_t child) { return child >= 0; });
  return children;
}

/// Checks cells and what is below them; returns how many are to be drawn.
std::size_t check_cells(LdiTree const& tree, std::vector<std::int32_t> const& numbers, ByCell const& drawn,
                        Look const& look, double stamp_px) {
  std::size_t count = 0;
  for (std::int32_t const number : numbers) {
    LdiCell const& cell = tree.cells[static_cast<std::size_t>(number)];
    auto const it = drawn.find(number);
    if (it == drawn.end()) {
      EXPECT_FALSE(is_seen(tree, cell, look)) << number;
      continue;
    }
    EXPECT_FALSE(is_outside(tree, cell, look)) << number;
    ++count;
    bool const within = look.camera.is_perspective() && tree.box(cell).contains(look.pose.translation());
    // Floats: a part in 1e5.
    if (it->second.descended) {
      EXPECT_TRUE(cell.has_children());
      EXPECT_GT(greatest_stamp(tree, cell, ldi_step(cell.key.level), look) * (1 + 1e-5), stamp_px) << number;
      count += check_cells(tree, children_of(cell), drawn, look, stamp_px);
    } else if (cell.has_children()) {
      EXPECT_LE(greatest_stamp(tree, cell, 0, look), stamp_px * (1 + 1e-5)) << number;
      EXPECT_FALSE(within) << number;
    }
    EXPECT_FALSE(it->second.postponed);
    double const z = (look.pose.inverse() * tree.box(cell).center()).z();
    EXPECT_NEAR(it->second.distance, z, 1e-5 * (1 + std::abs(z)));
  }
  return count;
}

TEST(LdiTraversal, GoesAsFarDownAsTheScreenNeedsAndNoFarther) {
  auto const tree = corner_tree();
  for (std::uint64_t seed = 0; seed < 80; ++seed) {
    SCOPED_TRACE(testing::Message() << "seed " << seed);
    Look const look = random_look(seed);
    TraversalOptions how;
    how.stamp_px = std::exp2(double(seed % 5) - 1);
    auto const cells = traverse(*tree, look.camera, look.pose, how);
    EXPECT_EQ(check_cells(*tree, tree->roots, by_cell(cells), look, how.stamp_px), cells.size());
    EXPECT_TRUE(std::is_sorted(cells.begin(), cells.end(),
                               [](auto const& a, auto const& b) { return a.distance < b.distance; }));
  }
}

TEST(LdiTraversal, ACellAroundTheEyeOrWhoseFaceItIsOnIsDescended) {
  auto const tree = corner_tree();
  std::size_t count = 0;
  for (LdiCell const& cell : tree->cells) {
    if (!cell.has_children()) continue;
    Eigen::AlignedBox3d const box = tree->box(cell);
    TraversalOptions how;
    how.stamp_px = 64;
    // However little a step is on the screen.
    Camera const camera = Camera::perspective(8, 8, 1, 1, 3.5, 3.5);
    Vector3d const middle = box.center();
    Vector3d const on_face(box.min().x(), middle.y(), middle.z());
    std::int32_t const number = static_cast<std::int32_t>(&cell - tree->cells.data());
    for (auto const& [eye, target] : {std::pair(middle, Vector3d(-2, -1.5, -2)), std::pair(on_face, middle)}) {
      ByCell const drawn = by_cell(traverse(*tree, camera, toward(eye, target), how));
      ASSERT_TRUE(drawn.contains(number));
      EXPECT_TRUE(drawn.at(number).descended);
    }
    ++count;
  }
  EXPECT_GT(count, 20U);
}

TEST(LdiTraversal, FromFarOutsideOnlyTheRootsAreDrawn) {
  auto const tree = corner_tree();
  Vector3d const center = tree->center;
  auto const cells = traverse(*tree, Camera::perspective(64, 64, 32, 32, 31.5, 31.5),
                              toward(center + Vector3d(1e6, 2e6, 3e6), center), {});
  EXPECT_EQ(cells.size(), tree->roots.size());
  for (TraversedCell const& at : cells) EXPECT_FALSE(at.descended);
}

TEST(LdiTraversal, WhatIsPostponedAndWhatIsBelowAreTheWhole) {
  auto const tree = corner_tree();
  for (std::uint64_t seed = 100; seed < 140; ++seed) {
    SCOPED_TRACE(testing::Message() << "seed " << seed);
    Look const look = random_look(seed);
    TraversalOptions how;
    ByCell const whole = by_cell(traverse(*tree, look.camera, look.pose, how));
    how.until_px = 4;
    std::vector<TraversedCell> all, cells = traverse(*tree, look.camera, look.pose, how);
    while (!cells.empty()) {
      std::vector<TraversedCell> postponed;
      for (TraversedCell& at : cells) {
        if (!at.postponed) continue;
        EXPECT_FALSE(at.descended);
        EXPECT_GT(at.stamp_px, how.stamp_px);
        EXPECT_LE(at.stamp_px, how.until_px);
        postponed.push_back(at);
        at.descended = true;
      }
      all.insert(all.end(), cells.begin(), cells.end());
      how.until_px /= 2;
      cells = traverse_below(*tree, postponed, look.camera, look.pose, how);
    }
    ByCell const steps = by_cell(all);
    ASSERT_EQ(steps.size(), whole.size());
    for (auto const& [cell, at] : whole) {
      ASSERT_TRUE(steps.contains(cell));
      EXPECT_EQ(steps.at(cell).descended, at.descended);
    }
  }
}

bool same(Frame const& a, Frame const& b) {
  return cv::norm(a.color, b.color, cv::NORM_INF) == 0 &&
         cv::countNonZero(a.depth != b.depth) == cv::countNonZero(a.depth != a.depth);
}
std::set<std::int32_t> leaves(std::vector<TraversedCell> const& cells) {
  std::set<std::int32_t> all;
  for (TraversedCell const& at : cells)
    if (!at.descended) all.insert(at.cell);
  return all;
}

TEST(LdiSteps, GrowFinerUntilTheyAreTheWholePicture) {
  auto const tree = corner_tree(192);
  std::map<LdiCellKey, std::int32_t> numbers;
  for (std::size_t i = 0; i < tree->cells.size(); ++i) numbers[tree->cells[i].key] = static_cast<std::int32_t>(i);
  int const top = tree->cells.front().key.level;
  Camera const camera = square_view(160);
  Eigen::Isometry3d const pose = toward({1.2, 1.4, 1.1}, {-2, -1.5, -2});
  for (double const stamp_px : {1.0, 1.4, 3.0, 8.0}) {
    SCOPED_TRACE(stamp_px);
    LdiRenderOptions options;
    options.stamp_px = stamp_px;
    LdiRenderer renderer(tree, options), at_once(tree, options);
    renderer.begin(camera, pose);
    EXPECT_FALSE(renderer.is_complete());
    std::set<std::int32_t> before;
    Frame frame;
    int steps = 0;
    for (bool more = true; more; ++steps) {
      ASSERT_LT(steps, 8);
      more = renderer.refine();
      EXPECT_EQ(more, !renderer.is_complete());
      frame = renderer.picture();
      std::size_t bare = 0;
      for (cv::Vec4b const& pixel : frame.color) bare += pixel[3] == 0;
      // Squares leave some open between them; the room is closed.
      EXPECT_LT(bare, frame.color.total() / 20) << steps;
      std::set<std::int32_t> const now = leaves(renderer.traversed());
      if (steps > 0)
        for (std::int32_t const number : now) {
          LdiCellKey key = tree->cells[static_cast<std::size_t>(number)].key;
          auto const drawn_before = [&] {
            auto const it = numbers.find(key);
            return it != numbers.end() && before.contains(it->second);
          };
          while (key.level < top && !drawn_before()) key = key.parent();
          EXPECT_TRUE(drawn_before()) << number << " step " << steps;
        }
      before = now;
    }
    // Squares, blended splats of the same cells, and of half of 4 pixels until steps are small enough.
    EXPECT_LE(steps, 2 + std::max(0.0, std::ceil(std::log2(LdiRenderer::kFirstPx / stamp_px))));
    EXPECT_FALSE(renderer.refine());
    EXPECT_TRUE(renderer.is_complete());
    EXPECT_TRUE(same(renderer.picture(), frame));
    Frame const whole = at_once.render(camera, pose);
    EXPECT_TRUE(at_once.is_complete());
    EXPECT_FALSE(at_once.refine());
    EXPECT_EQ(before, leaves(at_once.traversed()));
    // The same splats, in another order: sums of floats, and which samples of a layer came first to say how far it is.
    EXPECT_GT(cv::PSNR(frame.color, whole.color), 40);
  }
}

TEST(LdiSteps, WithinNoTimeTheFirstAndWithinAllTheLast) {
  auto const tree = corner_tree();
  Camera const camera = square_view(100);
  Eigen::Isometry3d const pose = toward({1.2, 1.4, 1.1}, {-2, -1.5, -2});
  for (Splats const splats : {Splats::blended, Splats::squares}) {
    LdiRenderOptions options;
    options.splats = splats;
    LdiRenderer renderer(tree, options), steps(tree, options);
    steps.begin(camera, pose);
    EXPECT_TRUE(steps.refine());
    Frame const first = steps.picture();
    while (steps.refine()) {
    }
    Frame const last = steps.picture();
    EXPECT_FALSE(same(first, last));
    // Whatever was drawn before.
    for (int turn = 0; turn < 3; ++turn) {
      EXPECT_TRUE(same(renderer.render_within(0, camera, pose), first));
      EXPECT_FALSE(renderer.is_complete());
      EXPECT_TRUE(same(renderer.render_within(1e9, camera, pose), last));
      EXPECT_TRUE(renderer.is_complete());
    }
  }
}

/// A wall of which no image has depths within a hole of 6 x 6 pixels, left of x = 0 blue and right of it yellow.
constexpr int kWall = 96;
constexpr double kPixel = 1.02 / 16;
cv::Vec3b const kBlue(220, 60, 20), kYellow(10, 210, 230);
View wall_view(bool hole) {
  Vector3d const middle(0, 0.1, 0.3);
  View view = panel_view(Vector3d::UnitZ(), middle, kWall / 2 * kPixel, kPixel,
                         [](Vector3d const& p) { return p.x() < 0 ? kBlue : kYellow; });
  if (hole) view.image.depth(cv::Rect(kWall / 2 - 3, kWall / 2 - 3, 6, 6)).setTo(kMissing);
  return view;
}
LdiRenderOptions with(Gaps gaps, double covered = 0.5) {
  LdiRenderOptions options;
  options.gaps = gaps;
  options.covered = covered;
  return options;
}

TEST(LdiGaps, AHoleIsFilledFromAround) {
  View const view = wall_view(true);
  auto const tree = shared_tree({view, view}, 8);
  Camera const& camera = view.image.camera;
  Frame const open = LdiRenderer(tree, with(Gaps::background)).render(camera, *view.object_from_camera),
              closed = LdiRenderer(tree, with(Gaps::filled)).render(camera, *view.object_from_camera);
  // Stamps reach half a pixel beyond the hole's border, and kernels four fifths of one.
  int const first = kWall / 2 - 2, last = kWall / 2 + 1;
  for (int y = first; y <= last; ++y)
    for (int x = first; x <= last; ++x) EXPECT_EQ(open.color(y, x)[3], 0) << x << ' ' << y;
  // The levels whose steps are wider than the hole reach all of it.
  double const within = tree->options.merge_distance(tree->cells.back().key.level + 3);
  for (int y = kWall / 2 - 4; y < kWall / 2 + 4; ++y)
    for (int x = kWall / 2 - 4; x < kWall / 2 + 4; ++x) {
      cv::Vec4b const& pixel = closed.color(y, x);
      EXPECT_EQ(pixel[3], 255) << x << ' ' << y;
      EXPECT_NEAR(closed.depth(y, x), 50, within) << x << ' ' << y;
      for (int c = 0; c < 3; ++c) {
        double const a = kept(kBlue[c]), b = kept(kYellow[c]);
        // Rounded once from roots, once from light.
        EXPECT_GE(pixel[c], std::min(a, b) - 1) << x << ' ' << y;
        EXPECT_LE(pixel[c], std::max(a, b) + 1) << x << ' ' << y;
      }
    }
}

TEST(LdiGaps, UncoveredCountsThePixelsThatAre) {
  View const view = wall_view(true);
  auto const tree = shared_tree({view}, 8);
  // Also from where the wall is a part of the picture.
  Camera const wide = Camera::orthographic(kWall, kWall, 1.9 * kPixel, 1.9 * kPixel, 40, 50);
  for (Camera const& camera : {view.image.camera, wide})
    for (double const covered : {0.1, 0.25, 0.5, 0.8, 1.0})
      for (Gaps const gaps : {Gaps::background, Gaps::filled}) {
        LdiRenderer renderer(tree, with(gaps, covered));
        Frame const frame = renderer.render(camera, *view.object_from_camera);
        std::size_t count = 0;
        for (cv::Vec4b const& pixel : frame.color) count += pixel[3] < 255 * covered;
        EXPECT_EQ(renderer.uncovered(), count) << covered << (gaps == Gaps::filled ? " filled" : "");
        EXPECT_GE(renderer.gaps(), count);
      }
}

TEST(LdiGaps, AnOutlineHasNoHalo) {
  View const view = wall_view(false);
  for (int const resolution : {8, 64}) {
    auto const tree = shared_tree({view}, resolution);
    // As large as the reference, and up to half and twice as large.
    for (double const zoom : {0.5, 0.8, 1.0, 2.0}) {
      int const size = static_cast<int>(2 * zoom * kWall);
      double const spacing = kPixel / zoom, center = (size - 1) / 2.0;
      Camera const camera = Camera::orthographic(size, size, spacing, spacing, center, center);
      Frame const frame = LdiRenderer(tree, with(Gaps::filled)).render(camera, *view.object_from_camera);
      // Two pixels and a step of what is drawn: of a pixel, or of the image's where it is larger.
      double const most = kWall / 2 * zoom + 2 + std::max(1.0, zoom);
      int halo = 0;
      double farthest = 0;
      for (int y = 0; y < size; ++y)
        for (int x = 0; x < size; ++x) {
          if (frame.color(y, x)[3] == 0) continue;
          double const off = std::max(std::abs(x - center), std::abs(y - center));
          halo += off > most;
          farthest = std::max(farthest, off);
        }
      EXPECT_EQ(halo, 0) << "resolution " << resolution << " zoom " << zoom << " farthest " << farthest << " of "
                         << most;
    }
  }
}

TEST(LdiSamplingRate, IsThatOfTheImageFromNearAndOfThePictureFromAfar) {
  // A board of squares of 8 pixels of the near image; the far one, from 8 times as far, shows their average.
  constexpr int kSize = 512, kSquare = 8;
  constexpr double kFocal = kSize;
  auto const camera = [&](int size, double f) {
    return Camera::perspective(size, size, f, f, (size - 1) / 2.0, (size - 1) / 2.0);
  };
  double const side = kSquare / kFocal;  // at a distance of 1
  double const low = -kSize / 2 / kFocal;
  auto const board = [=](Vector3d const& p) {
    int const i = static_cast<int>(std::floor((p.x() - low) / side)),
              j = static_cast<int>(std::floor((p.y() - low) / side));
    return (i + j) % 2 == 0 ? cv::Vec3b(255, 255, 255) : cv::Vec3b(0, 0, 0);
  };
  Vector3d const up = Vector3d::UnitZ();
  auto const from = [](double distance) { return toward({0, 0, distance}, {0, 0, 0}); };
  View const near = plane_view("near", camera(kSize, kFocal), from(1), up, 0, board),
             far = plane_view("far", camera(kSize / 8, kFocal), from(8), up, 0, plain_paint({188, 188, 188}));
  constexpr int kResolution = 8;
  auto const tree = shared_tree({near, far}, kResolution);

  LdiRenderer renderer(tree, {});
  Frame const close = renderer.render(near.image.camera, *near.object_from_camera);
  // In the middle of a square nothing of another one is within stamps (a pixel) and kernels (four fifths).
  for (int y = kSquare / 2; y < kSize; y += kSquare)
    for (int x = kSquare / 2; x < kSize; x += kSquare)
      for (int c = 0; c < 3; ++c) EXPECT_EQ(close.color(y, x)[c], near.image.color(y, x)[c]) << x << ' ' << y;

  constexpr int kDistance = 16, kShown = kSize / kDistance;
  Camera const small = camera(2 * kShown, kFocal);
  Frame const frame = renderer.render(small, from(kDistance));
  EXPECT_EQ(renderer.gaps() - renderer.uncovered(), 0U);
  // Steps are more than half a pixel at the nearest corner of a cell's box, a cell's side and a step nearer than the
  // board: so many to a pixel, and one around the whole. What lies in two bands of rows counts in both: of two bands
  // all could.
  double const step = kDistance / kFocal, nearest = kDistance - (kResolution + 1) * step;
  double const per_pixel = 2 * kDistance / nearest;
  EXPECT_LE(double(renderer.splats()), 2 * std::pow(per_pixel * (kShown + 2), 2));
  EXPECT_GT(renderer.splats(), 0U);
  // Half of the light, but for roots of 8 bits, rounded at each of six levels: 1/510 off a root of 0.7; and sRGB of
  // 8 bits, half a value of 1.6/255.
  double const allowed = 6 * 2 * 0.71 / 510 + 0.8 / 255;
  double sum = 0;
  int count = 0;
  auto const& linear = linear_from_srgb8();
  for (int y = kShown / 2 + 3; y < 3 * kShown / 2 - 3; ++y)
    for (int x = kShown / 2 + 3; x < 3 * kShown / 2 - 3; ++x, ++count) sum += linear[frame.color(y, x)[1]];
  EXPECT_NEAR(sum / count, 0.5, allowed);
}

}  // namespace
}  // namespace scanview::test
