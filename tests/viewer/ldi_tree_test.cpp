#include "viewer/layered/ldi_tree.h"

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <tuple>

#include "base/error.h"
#include "base/random.h"
#include "tests/expect_error.h"
#include "viewer/layered/stamp.h"
#include "viewer/ldi_scenes.h"

// What is splatted where, and what filtering makes of it.

namespace scanview::test {
namespace {

using Eigen::Vector3d;

/// An orthographic pixel of a size at a place in grid steps of level 0, from ldi_origin(); looks along an axis.
View pixel_at(Vector3d const& steps, double size, cv::Vec3b const& color = {100, 150, 200}, int axis = 0) {
  Eigen::Isometry3d pose = Eigen::Isometry3d::Identity();
  for (int k = 0; k < 3; ++k) pose.linear().col(k) = Vector3d::Unit((axis + 1 + k) % 3);
  // Exactly there: no rounding by the rotation.
  pose.translation() = ldi_origin() + steps;
  return pixel_view(Camera::orthographic(1, 1, size, size, 0, 0), pose, 0, color);
}

LdiOptions facing(int resolution, double coarseness = 1) {
  LdiOptions options;
  options.resolution = resolution;
  options.coarseness = coarseness;
  options.normals = LdiOptions::Normals::facing;
  return options;
}

struct PlacedSum {
  LdiCellKey key;
  int face, x, y;
  LdiSum sum;
};
std::vector<PlacedSum> sums_of(LdiBuilder const& builder) {
  std::vector<PlacedSum> all;
  int const n = builder.options().resolution;
  for (auto const& [key, sums] : builder.sums())
    for (int face = 0; face < LdiSums::kFaces; ++face)
      for (int y = 0; y < n; ++y)
        for (int x = 0; x < n; ++x)
          for (std::uint32_t k = sums->first(face, x, y); k != 0; k = (*sums)[k].next)
            all.push_back({key, face, x, y, (*sums)[k]});
  return all;
}
double total_weight(std::vector<PlacedSum> const& all) {
  double total = 0;
  for (PlacedSum const& one : all) total += one.sum.weight;
  return total;
}

TEST(LdiOptions, ValidateNamesTheField) {
  LdiOptions().validate();
  auto const expect_refused = [](auto LdiOptions::*field, std::initializer_list<double> values, char const* name) {
    for (double const value : values) {
      LdiOptions options;
      options.*field = static_cast<std::remove_reference_t<decltype(options.*field)>>(value);
      EXPECT_SCANVIEW_ERROR(options.validate(), ErrorCode::usage, name);
      EXPECT_SCANVIEW_ERROR(LdiBuilder{options}, ErrorCode::usage, name);
    }
  };
  double const nan = std::nan(""), infinity = std::numeric_limits<double>::infinity();
  expect_refused(&LdiOptions::resolution, {-1, 0, 257}, "resolution");
  expect_refused(&LdiOptions::coarseness, {nan, 0.2, 4.1, -1}, "coarseness");
  expect_refused(&LdiOptions::smallest_feature, {nan, -1, infinity}, "smallest_feature");
  expect_refused(&LdiOptions::merge_steps, {nan, -0.1, 1.1}, "merge_steps");
  expect_refused(&LdiOptions::depth_error, {nan, -1, infinity}, "depth_error");
  expect_refused(&LdiOptions::covered, {nan, -0.1, 1.1}, "covered");
}

TEST(LdiLattice, HeightIsThePapersBound) {
  // H = ceil(log2(L / (N d))).
  EXPECT_EQ(ldi_height_bound(16, 64, 0.25), 0);
  EXPECT_EQ(ldi_height_bound(16, 4, 0.25), 4);
  EXPECT_EQ(ldi_height_bound(17, 4, 0.25), 5);
  EXPECT_EQ(ldi_height_bound(1024, 1, 1), 10);
  EXPECT_EQ(ldi_height_bound(1000, 64, 0.01), 11);  // 1562.5
  EXPECT_EQ(ldi_height_bound(1, 64, 1), 0);
}

TEST(LdiLattice, TheSmallestFeatureBoundsTheTree) {
  std::vector<View> const views = {
      plane_view("a", square_view(100), toward({0, 0, 0.5}, {0.4, 0.3, -2}), Vector3d::UnitZ(), -0.7, wavy_paint(1))};
  double nearest = 0;
  cv::minMaxLoc(views[0].image.depth, &nearest, nullptr);
  for (double const d : {0.25, 0.3, 0.0625, 0.001, 0.0}) {
    LdiOptions options;
    options.resolution = 8;
    options.smallest_feature = d;
    LdiTree const tree = tree_of(views, options);
    int const finest = tree.cells.back().key.level, top = tree.cells.front().key.level;
    if (d >= 0.0625) {
      EXPECT_EQ(finest, static_cast<int>(std::floor(std::log2(d))));
      Eigen::AlignedBox3d box;
      for (PlacedPixel const& pixel : pixels_of(tree))
        if (pixel.level == finest) box.extend(pixel.at);
      // The root, above `top`, is not the scene's box: by less than two levels larger.
      EXPECT_LE(top + 1 - finest, ldi_height_bound(box.sizes().maxCoeff(), options.resolution, d) + 2);
    } else {
      EXPECT_EQ(finest, static_cast<int>(std::floor(std::log2(nearest / 50))));  // as fine as the images
    }
  }
}

TEST(Stamps, AreWhereAndAsLargeAsEquations1And2Say) {
  Camera const camera = Camera::perspective(9, 7, 20, 25, 3.5, 2.5);
  Eigen::Isometry3d const pose = toward({1, 2, 3}, {1.5, 1, -2});
  Vector3d const normal = Vector3d(0.2, 0.3, 1).normalized();
  View const view = plane_view("a", camera, pose, normal, -1, plain_paint({10, 20, 30}));
  StampReader const reader(view, {});
  for (int y = 0; y < 7; ++y) {
    std::vector<Stamp> stamps;
    reader.read_row(y, stamps);
    ASSERT_EQ(stamps.size(), 9U);
    for (int x = 0; x < 9; ++x) {
      Stamp const& stamp = stamps[static_cast<std::size_t>(x)];
      double const z = double(view.image.depth(y, x));
      EXPECT_NEAR(normal.dot(stamp.center), -1, 1e-6);
      EXPECT_LT((pose.inverse() * stamp.center - Vector3d((x - 3.5) / 20 * z, (y - 2.5) / 25 * z, z)).norm(), 1e-9);
      // Longer along the tilt: by 1 / cos of the angle between normal and ray.
      double const cosine = normal.dot((pose.translation() - stamp.center).normalized());
      EXPECT_NEAR(double(stamp.size), z / std::sqrt(20.0 * 25.0) / cosine, 1e-5);
      EXPECT_LT((stamp.normal.cast<double>() - normal).norm(), 1e-3);
      // To the next pixel on the plane.
      if (x + 1 < 9) {
        Vector3d const next = stamps[static_cast<std::size_t>(x) + 1].center - stamp.center;
        EXPECT_LT((stamp.along_u.cast<double>() - next).norm(), 0.05 * next.norm());
      }
    }
  }
}

TEST(LdiBuilder, WeightsAreThoseOfEquation3aWhereStampsAreLarger) {
  // Facing: the plane is across x, grids along y and z; grid points are half a step from the cells' corners.
  LdiBuilder const builder = builder_of({pixel_at({10.3, 20.6, 5.5}, 1.5)}, facing(64));
  std::map<std::pair<int, int>, double> expected;
  double const along_x[3] = {1 - 1.1 / 1.5, 1 - 0.1 / 1.5, 1 - 0.9 / 1.5}, along_y[3] = {1 / 3.0, 1, 1 / 3.0};
  for (int j = 0; j < 3; ++j)
    for (int i = 0; i < 3; ++i) expected[{19 + i, 4 + j}] = 256 * along_x[i] * along_y[j];
  auto const all = sums_of(builder);
  EXPECT_EQ(all.size(), expected.size());
  for (PlacedSum const& one : all) {
    EXPECT_EQ(one.key, LdiCellKey{});
    EXPECT_EQ(one.face, 0);
    EXPECT_NEAR(one.sum.weight, (expected[{one.x, one.y}]), 0.51);
    EXPECT_EQ(one.sum.bin, 10U);
    EXPECT_EQ(one.sum.depth, one.sum.weight * 76);  // 0.3 · 256
    EXPECT_EQ(one.sum.slope_x, one.sum.weight * 128);
    double const red = kLinearOne * std::pow((200 / 255.0 + 0.055) / 1.055, 2.4);
    EXPECT_NEAR(double(one.sum.red), one.sum.weight * red, 0.51 * one.sum.weight);
  }
}

TEST(LdiBuilder, WeightsAreThoseOfEquation3bWhereStampsAreSmaller) {
  // coarseness 2: a stamp of 3/4 on a grid of step 1.
  LdiBuilder const builder = builder_of({pixel_at({10.3, 20.6, 5.5}, 0.75)}, facing(64, 2));
  auto const all = sums_of(builder);
  ASSERT_EQ(all.size(), 2U);  // of four grid points two have no weight
  for (PlacedSum const& one : all) {
    EXPECT_EQ(one.key.level, 0);
    EXPECT_EQ(one.y, 5);
    EXPECT_NEAR(one.sum.weight, 256 * (one.x == 20 ? 0.9 : 0.1) * 0.75 * 0.75, 0.51);
  }
}

TEST(LdiBuilder, APixelLandsOnceWhereverItIs) {
  // Cells of 4 steps. On faces, edges and corners, and closer to them than a float can tell.
  std::vector<Vector3d> places = {{4, 4, 4}, {0, 0, 0}, {-4, 8, 4}, {4, 4.5, 2.5}, {2.5, 4, 4.5}, {8, 4, 0.5}};
  for (double const off : {1e-16, 1e-12, 1e-9, 1e-8, 1e-7, 1e-6})
    for (double const sign : {-1.0, 1.0}) places.push_back(Vector3d::Constant(4 + sign * off));
  constexpr std::uint64_t kSeed = 5;
  for (std::uint64_t i = 0; i < 200; ++i) {
    CounterRandom random(kSeed, i);
    places.emplace_back(random.uniform() * 20 - 10, random.uniform() * 20 - 10, random.uniform() * 20 - 10);
  }
  for (int const resolution : {1, 4, 64})
    for (LdiOptions::Normals const normals : {LdiOptions::Normals::facing, LdiOptions::Normals::measured})
      for (Vector3d const& at : places)
        for (int axis = 0; axis < 3; ++axis) {
          LdiOptions options = facing(resolution);
          options.normals = normals;
          auto const all = sums_of(builder_of({pixel_at(at, 1, {100, 150, 200}, axis)}, options));
          // S = P: bilinear weights of four grid points add up to 1, each rounded.
          EXPECT_NEAR(total_weight(all), 256, 2) << at.transpose() << " resolution " << resolution << " axis " << axis;
          EXPECT_LE(all.size(), 4U);
        }
}

TEST(LdiBuilder, ObliqueStampsLandOnceOnEveryGridPoint) {
  // Neighbouring pixels' weights add up to 1 inside of a plane, also where it passes from cell to cell.
  Vector3d const normal = Vector3d(0.5, 0.6, 0.9).normalized();
  for (int const resolution : {1, 4, 32}) {
    LdiOptions options;
    options.resolution = resolution;
    Camera const camera = Camera::orthographic(40, 40, 1.2, 1.2, 20, 20);
    LdiBuilder const builder = builder_of(
        {plane_view("a", camera, toward({30, 20, 50}, {0, 0, 0}), normal, 0, plain_paint({9, 9, 9}))}, options);
    for (auto const& [key, sums] : builder.sums()) EXPECT_GT(sums->count(), 0U);
    std::map<std::tuple<std::int64_t, std::int64_t>, double> weights;
    for (PlacedSum const& one : sums_of(builder)) {
      EXPECT_EQ(one.face, 5);
      weights[{one.key.index[0] * resolution + one.x, one.key.index[1] * resolution + one.y}] += one.sum.weight;
    }
    int full = 0;
    for (auto const& [at, weight] : weights) {
      auto const [x, y] = at;
      if (std::abs(double(x)) > 10 || std::abs(double(y)) > 10) continue;
      EXPECT_NEAR(weight, 256, 4) << x << ' ' << y << " resolution " << resolution;
      ++full;
    }
    EXPECT_EQ(full, 21 * 21) << resolution;
  }
}

TEST(LdiBuilder, DepthsThatAreNoneAreSkipped) {
  float const infinity = std::numeric_limits<float>::infinity();
  View view =
      plane_view("a", square_view(16), toward({0, 0, 1}, {0.01, 0, -1}), Vector3d::UnitZ(), -1, plain_paint({1, 2, 3}));
  float const bad[] = {0, -1, infinity, -infinity, kMissing, 1e-42F};
  for (int i = 0; i < 6; ++i) view.image.depth(2 + 2 * i, 2 + 2 * i) = bad[i];
  LdiBuilder const builder = builder_of({view});
  Context context;
  LdiTree const tree = builder.build(Unit::m, context);
  EXPECT_EQ(tree.input_pixels, 250U);
  for (PlacedPixel const& pixel : pixels_of(tree)) {
    EXPECT_TRUE(pixel.at.allFinite());
    EXPECT_NEAR(pixel.at.z(), -1, 0.05);
  }
  view.image.depth.setTo(kMissing);
  EXPECT_SCANVIEW_ERROR(tree_of({view}), ErrorCode::bad_input, "no pixel");
}

TEST(LdiBuilder, WhatIsTooFarToBePlacedIsRefused) {
  View const view = pixel_at({1e20, 0, 0}, 1);
  EXPECT_SCANVIEW_ERROR(builder_of({view}), ErrorCode::bad_input, "far");
  builder_of({pixel_at({1e12, -1e12, 0}, 1)});
}

TEST(LdiBuilder, BinsThatCellsEndWithinHaveTheirOwnDepths) {
  // Cells of 5 or 7 steps end within bins of 2 and 4.
  for (int const resolution : {5, 7, 64})
    for (double const depth_error : {0.0, 2.0, 4.0, 100.0}) {
      LdiOptions options = facing(resolution);
      options.depth_error = depth_error;
      double const steps = 1 << options.bin_shift(0);
      EXPECT_LE(steps, std::max(1.0, depth_error));
      EXPECT_LE(steps, resolution);
      for (double depth = -8.7; depth < 8; ++depth)
        for (PlacedPixel const& pixel : pixels_of(tree_of({pixel_at({depth, 0.2, 0.3}, 1)}, options)))
          if (pixel.level == 0) {
            EXPECT_NEAR(pixel.at.x() - ldi_origin().x(), depth, steps / 256 + resolution / 65536.0) << resolution;
          }
    }
}

TEST(LdiBuilder, StampsMayBeAsSmallOrLargeAsAFloatCanBe) {
  for (double const size : {1e-44, 1e-39, 1e-30, 1e30, 3e38})
    for (double const coarseness : {0.25, 1.0, 4.0}) {
      LdiTree const tree = tree_of({pixel_at({0, 0, 0}, size)}, facing(64, coarseness));
      EXPECT_GT(tree.pixel_count(), 0U) << size;
      for (PlacedPixel const& pixel : pixels_of(tree)) EXPECT_TRUE(pixel.at.allFinite()) << size;
    }
}

TEST(LdiBuilder, WhatIsTooSmallForTheGridIsRefused) {
  LdiOptions options = facing(64);
  options.smallest_feature = 64;
  EXPECT_SCANVIEW_ERROR(tree_of({pixel_at({1, 2, 3}, 0.1)}, options), ErrorCode::bad_input, "smallest feature");
}

/// Pixels of a face at the level that a step of 1 has, by grid point.
std::map<std::tuple<double, double>, std::vector<PlacedPixel>> columns(LdiTree const& tree, int face) {
  std::map<std::tuple<double, double>, std::vector<PlacedPixel>> result;
  int const axis = face / 2;
  for (PlacedPixel const& pixel : pixels_of(tree))
    if (pixel.face == face && pixel.level == 0)
      result[{pixel.at[(axis + 1) % 3], pixel.at[(axis + 2) % 3]}].push_back(pixel);
  return result;
}

TEST(LdiTree, SurfacesThatAreCloserThanTheThresholdAreOne) {
  Camera const camera = Camera::orthographic(16, 16, 1, 1, 8, 8);
  Eigen::Isometry3d const from_above = toward({0.4, 0.3, 50}, {0.4, 0.3, 0}), from_below = [&] {
    return toward({0.4, 0.3, -50}, {0.4, 0.3, 0});
  }();
  Vector3d const up = Vector3d::UnitZ();
  double const z = ldi_origin().z() + 20.6;
  auto const above = [&](double height, cv::Vec3b const& color) {
    return plane_view("above", camera, from_above, up, height, plain_paint(color));
  };
  auto const most_layers = [](auto const& all) {
    std::size_t most = 0;
    for (auto const& [at, list] : all) most = std::max(most, list.size());
    return most;
  };
  cv::Vec3b const black(0, 0, 0), white(255, 255, 255);
  for (double const gap : {0.0, 0.3, 0.8}) {
    // 20.6 and 21.4 are in different depth bins.
    auto const all = columns(tree_of({above(z, black), above(z + gap, white)}), 5);
    EXPECT_EQ(most_layers(all), 1U) << gap;
    ASSERT_FALSE(all.empty());
    for (auto const& [at, list] : all) {
      EXPECT_NEAR(list[0].linear[1], 0.5, 0.01);
      EXPECT_NEAR(list[0].at.z(), z + gap / 2, 0.01);
    }
  }
  EXPECT_EQ(most_layers(columns(tree_of({above(z, black), above(z + 1.1, white)}), 5)), 2U);
  // A wall thinner than that has two sides, which do not mix.
  View const below = plane_view("below", camera, from_below, -up, -z, plain_paint(black));
  LdiTree const wall = tree_of({above(z + 0.1, white), below});
  for (int const face : {4, 5}) {
    auto const all = columns(wall, face);
    EXPECT_GT(all.size(), 200U);
    for (auto const& [at, list] : all) {
      ASSERT_EQ(list.size(), 1U);
      EXPECT_EQ(list[0].linear[0], face == 4 ? 0 : 1);
    }
  }
}

TEST(LdiTree, AThousandImagesOfAWallTakeNoMoreThanTen) {
  std::vector<View> views;
  for (int i = 0; i < 1000; ++i) {
    // Ten places, again and again.
    int const k = i % 10;
    views.push_back(plane_view(fmt::format("{:04}", i), square_view(8),
                               toward(Vector3d(0.01 * k, 0.02 * k, 2), {0.1, 0.1, -2}), Vector3d::UnitZ(), -0.9,
                               wavy_paint(1)));
  }
  auto const count = [](LdiBuilder const& builder) {
    std::size_t sum = 0;
    for (auto const& [key, sums] : builder.sums()) sum += sums->count();
    return sum;
  };
  Context context;
  LdiBuilder const few = builder_of({views.begin(), views.begin() + 10}), many = builder_of(views);
  EXPECT_EQ(count(many), count(few));
  LdiTree const few_tree = few.build(Unit::m, context), many_tree = many.build(Unit::m, context);
  EXPECT_EQ(many_tree.input_pixels, 64000U);
  EXPECT_EQ(many_tree.cells.size(), few_tree.cells.size());
  // But for the rim, of which ten images show too little.
  EXPECT_LT(double(many_tree.bytes()), 1.1 * double(few_tree.bytes()));
}

TEST(LdiTree, APlaneKeepsItsColourCoverAndDepthAtEveryLevel) {
  Vector3d const normal = Vector3d(0.5, 0.6, 0.9).normalized();
  double const offset = 0.4;
  LdiOptions options;
  options.resolution = 32;
  LdiTree const tree = tree_of({plane_view("a", Camera::orthographic(160, 160, 0.05, 0.05, 79.5, 79.5),
                                           toward({1, 2, 6}, {0, 0, 0.3}), normal, offset, plain_paint({40, 90, 250}))},
                               options);
  int const finest = tree.cells.back().key.level, top = tree.cells.front().key.level;
  EXPECT_GE(top - finest, 2);
  // Per level: the bin's 256 parts, read at their middle; the cell's 65536 parts, rounded down. Halved from level to
  // level, so twice that in all; floats: a tenth.
  double const quantum = 1.1 * 2 * (1 / 512.0 + options.resolution / 65536.0);
  // Slopes of 1/127, rounded, over up to 3/4 of a step along both axes; at rims nothing cancels them.
  double const rim = quantum + 2 * 2 * 0.75 / 254;
  std::map<std::tuple<int, double, double>, double> covers;
  auto const linear = [](int srgb) { return std::pow((srgb / 255.0 + 0.055) / 1.055, 2.4); };
  for (PlacedPixel const& pixel : pixels_of(tree)) {
    EXPECT_EQ(pixel.face, 5);
    EXPECT_EQ(pixel.kind == LdiKind::filtered, pixel.level != finest);
    double const error = (normal.dot(pixel.at) - offset) / normal.z() / ldi_step(pixel.level);
    bool const full = pixel.alpha == 1;
    EXPECT_LE(std::abs(error), full ? quantum : rim) << pixel.level << ' ' << pixel.at.transpose();
    // Square roots in 8 bits, rounded once: of 1/255.
    EXPECT_NEAR(std::sqrt(pixel.linear[0]), std::sqrt(linear(250)), 0.51 / 255);
    EXPECT_NEAR(std::sqrt(pixel.linear[1]), std::sqrt(linear(90)), 0.51 / 255);
    EXPECT_NEAR(std::sqrt(pixel.linear[2]), std::sqrt(linear(40)), 0.51 / 255);
    // Inside, everything is covered: farther from the plane's rim than kernels reach.
    Vector3d const middle(0, 0, 0.3);
    double const half = 2.5 - 4 * ldi_step(pixel.level);
    if ((pixel.at - middle).norm() < half) covers[{pixel.level, pixel.at.x(), pixel.at.y()}] += pixel.alpha;
  }
  // Of both cells where one grid point's depths lie on their border.
  std::map<int, int> counts;
  for (auto const& [place, cover] : covers) {
    EXPECT_NEAR(cover, 1, 0.02) << std::get<0>(place);
    ++counts[std::get<0>(place)];
  }
  for (int level = finest; level < top; ++level) EXPECT_GT(counts[level], 20) << level;
}

TEST(LdiTree, RimsCountOnlyWhereNothingElseShowsAPlace) {
  // A hole in a white plane, whose rim is black as if mixed with what is behind; another image shows all of it.
  Camera const camera = Camera::orthographic(24, 24, 1, 1, 11.5, 11.5);
  auto const seen = [&](Vector3d const& at) {
    return plane_view("a", camera, toward(at + Vector3d(0, 0, 50), at), Vector3d::UnitZ(), 0.3,
                      plain_paint({255, 255, 255}));
  };
  View torn = seen({0.4, 0.3, 0});
  for (int y = 8; y < 14; ++y)
    for (int x = 8; x < 14; ++x) {
      torn.image.color(y, x) = {0, 0, 0};
      if (x > 8 && x < 13 && y > 8 && y < 13) torn.image.depth(y, x) = kMissing;
    }
  std::vector<Stamp> stamps;
  StampReader(torn, {}).read_row(8, stamps);
  for (std::size_t x = 0; x < stamps.size(); ++x) EXPECT_EQ(stamps[x].rim, x >= 8 && x < 14) << x;
  auto const dark = [](LdiTree const& tree) {
    std::size_t count = 0;
    for (PlacedPixel const& pixel : pixels_of(tree)) count += pixel.level == 0 && pixel.linear[0] < 0.9;
    return count;
  };
  EXPECT_GE(dark(tree_of({torn})), 20U);
  EXPECT_EQ(dark(tree_of({torn, seen({0.1, 0.7, 0})})), 0U);
  // Also where what shows it is twice as coarse, or twice as fine.
  for (double const spacing : {0.5, 2.0}) {
    Camera const other = Camera::orthographic(48, 48, spacing, spacing, 23.5, 23.5);
    View const view = plane_view("b", other, toward({0.2, 0.1, 50}, {0.2, 0.1, 0}), Vector3d::UnitZ(), 0.3,
                                 plain_paint({255, 255, 255}));
    EXPECT_EQ(dark(tree_of({torn, view})), 0U) << spacing;
  }
}

TEST(LdiTree, PixelsOfImagesArePatchesWhereFinerOnesCoverAPart) {
  // A fine image within a coarse one, from -4 to 4; filters and stamps reach less than two coarse steps.
  auto const seen = [](int size, double spacing) {
    double const middle = (size - 1) / 2.0;
    return plane_view("a", Camera::orthographic(size, size, spacing, spacing, middle, middle),
                      toward({0, 0, 50}, {0, 0, 0}), Vector3d::UnitZ(), 0.3, plain_paint({50, 90, 130}));
  };
  for (double const covered : {0.0, 0.5, 0.9}) {
    LdiOptions options;
    options.covered = covered;
    std::map<LdiKind, std::size_t> counts;
    std::map<std::pair<double, double>, std::vector<LdiKind>> places;
    for (PlacedPixel const& pixel : pixels_of(tree_of({seen(20, 1), seen(16, 0.5)}, options))) {
      if (pixel.level != 0) continue;
      ++counts[pixel.kind];
      places[{pixel.at.x(), pixel.at.y()}].push_back(pixel.kind);
      double const off = pixel.at.head<2>().cwiseAbs().maxCoeff() - 4;
      if (off < -2) {
        EXPECT_EQ(pixel.kind, LdiKind::filtered) << off;
      }
      if (off > 2) {
        EXPECT_EQ(pixel.kind, LdiKind::unfiltered) << off;
      }
    }
    EXPECT_GT(counts[LdiKind::filtered], 25U);
    EXPECT_GT(counts[LdiKind::unfiltered], 200U);
    // The paper's rule has none; patches have what they fill beside them.
    EXPECT_EQ(counts[LdiKind::patch] > 0, covered > 0) << covered;
    for (auto const& [at, kinds] : places)
      if (std::count(kinds.begin(), kinds.end(), LdiKind::patch) > 0) {
        EXPECT_LE(kinds.size(), 2U);
        EXPECT_EQ(std::count(kinds.begin(), kinds.end(), LdiKind::unfiltered), 0);
      }
  }
}

}  // namespace
}  // namespace scanview::test
