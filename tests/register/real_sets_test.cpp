#include <gtest/gtest.h>

#include <filesystem>

#include "acquire/import.h"
#include "range_scene.h"
#include "register/alignment.h"

namespace scanview {
namespace {

std::filesystem::path data(std::string const& name) {
  return std::filesystem::path(SCANVIEW_SOURCE_DIR) / "../shared/data" / name;
}

double median_of_pairs(Alignment const& alignment) {
  std::vector<double> values;
  for (PairFigures const& pair : alignment.pairs) values.push_back(pair.median_distance);
  std::sort(values.begin(), values.end());
  return values.empty() ? 0 : values[values.size() / 2];
}

TEST(RealSets, BearLeavesTheDotsByWhatTheDotsAreWrongBy) {
  if (!std::filesystem::exists(data("bear_rgbd"))) GTEST_SKIP() << "bear_rgbd is not here";
  Context context;
  ScanSet const set = import_rgbd(data("bear_rgbd"), {}, context).set;
  Alignment const got = align(set, {}, context);
  EXPECT_EQ(got.parts.size(), 1u);
  EXPECT_LE(median_of_pairs(got), 0.0007);
  PoseComparison const moved = compare_poses_absolute(set, got.object_from_camera, scene::poses_of(set));
  EXPECT_LE(moved.max_deg, 1.5);
  EXPECT_LE(moved.max_length, 0.002);
}

}  // namespace
}  // namespace scanview
