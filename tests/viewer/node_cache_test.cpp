#include "viewer/walkthrough/node_cache.h"

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <atomic>
#include <chrono>
#include <set>
#include <thread>

#include "base/error.h"
#include "mesh/node_mesh_file.h"
#include "tests/expect_error.h"
#include "tests/temporary_folder.h"
#include "viewer/rooms.h"
#include "viewer/walkthrough/walkthrough_file.h"

namespace scanview::test {
namespace {

namespace fs = std::filesystem;
using Eigen::Vector3d;
using ::testing::AllOf;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using Wait = NodeLibrary::Wait;

constexpr double kRadius = 0.5;

/// Nodes in a row along a room, at x = 0, 1, 2 ..., of two levels of detail.
class NodeCache : public ::testing::Test {
 protected:
  static constexpr std::size_t kCount = 8;

  void SetUp() override {
    Surface const scene = inside_of(box_walls({-2, -1, -1}, {10, 1, 1}), by_direction(4));
    WalkthroughManifest manifest;
    manifest.walking_radius = kRadius;
    manifest.focal_length = 8;
    for (std::size_t i = 0; i < kCount; ++i) {
      Vector3d const at(double(i), 0, 0);
      std::string const name = fmt::format("{:03}", i);
      for (int level = 0; level < 2; ++level) {
        NodeMeshOptions options;
        options.walking_radius = kRadius;
        write_node_mesh(level_folder(i, level), mesh_of(capture_cube(scene, at, level == 0 ? 16 : 8), options));
      }
      manifest.nodes.push_back({name, at, 100, 0.25, {name + "_0", name + "_1"}});
    }
    write_walkthrough(folder(), manifest);
  }
  fs::path const& folder() const { return folder_.path(); }
  fs::path level_folder(std::size_t node, int level) const { return folder() / fmt::format("{:03}_{}", node, level); }
  void damage(std::size_t node, int level) const { fs::resize_file(level_folder(node, level) / "mesh.ply", 300); }
  std::size_t bytes_of_node() const { return open_node_library(folder())->get(0, 0, Wait::yes)->bytes(); }

 private:
  TemporaryFolder folder_;
};

/// Whether it comes true within half a minute.
template <typename Condition>
bool eventually(Condition const& holds) {
  auto const end = std::chrono::steady_clock::now() + std::chrono::seconds(30);
  while (std::chrono::steady_clock::now() < end) {
    if (holds()) return true;
    std::this_thread::sleep_for(std::chrono::milliseconds(2));
  }
  return holds();
}

TEST_F(NodeCache, HoldsNoMoreThanItsBudget) {
  NodeCacheOptions options;
  options.ahead = 0;
  options.bytes = 3 * bytes_of_node() + bytes_of_node() / 2;
  auto const library = open_node_library(folder(), options);
  std::vector<std::weak_ptr<RasterNode const>> held;
  for (std::size_t i = 0; i < 3 * kCount; ++i) {
    held.push_back(library->get(i * 5 % kCount, 0, Wait::yes));
    std::size_t bytes = 0;
    std::set<RasterNode const*> counted;
    for (auto const& weak : held)
      if (auto const node = weak.lock(); node && counted.insert(node.get()).second) bytes += node->bytes();
    EXPECT_LE(bytes, options.bytes);
    if (i >= 3) {
      EXPECT_GE(counted.size(), 3U);
    }
  }
}

TEST_F(NodeCache, ASceneLargerThanItsBudgetIsWalkedThroughPatiently) {
  // One byte: never more than the node that was asked for last. Read-ahead pushes nodes out that are waited for.
  NodeCacheOptions options;
  options.bytes = 1;
  options.ahead = 6;
  auto const library = open_node_library(folder(), options);
  WalkthroughRenderer renderer(library, {});
  for (int i = 0; i <= 60; ++i) {
    Frame const frame = renderer.render(square_camera(16, 8), look_at({0.12 * i, 0, 0}, {20, 0, 0}));
    EXPECT_TRUE(renderer.complete());
    EXPECT_EQ(gaps(frame), 0U) << i;
    EXPECT_EQ(renderer.used().size(), 3U);
  }
  EXPECT_TRUE(library->failures().empty());
}

TEST_F(NodeCache, AnImpatientRendererAnswersAtOnceAndCatchesUp) {
  auto const library = open_node_library(folder());
  WalkthroughRenderer renderer(library, {});
  renderer.set_patience(WalkthroughRenderer::Patience::answers);
  Eigen::Isometry3d const pose = look_at({3.2, 0, 0}, {20, 0, 0});
  EXPECT_TRUE(eventually([&] {
    Frame const frame = renderer.render(square_camera(16, 8), pose);
    return renderer.complete() && gaps(frame) == 0;
  }));
  WalkthroughRenderer patient(open_node_library(folder()), {});
  EXPECT_EQ(cv::norm(renderer.render(square_camera(16, 8), pose).color,
                     patient.render(square_camera(16, 8), pose).color, cv::NORM_INF),
            0);
}

TEST_F(NodeCache, ReadsAheadWhatIsNearest) {
  // They are read in the order of their distance, so once the third has failed the two before it are there.
  for (int level = 0; level < 2; ++level) damage(6, level);
  NodeCacheOptions options;
  options.ahead = 3;
  auto const library = open_node_library(folder(), options);
  library->follow({4.9, 0, 0});  // 5, 4, 6
  ASSERT_TRUE(eventually([&] { return !library->failures().empty(); }));
  EXPECT_NE(library->get(5, 0, Wait::no), nullptr);
  EXPECT_NE(library->get(4, 0, Wait::no), nullptr);
}

TEST_F(NodeCache, ReadsAheadWhereTheEyeIsGoing) {
  // An eye at 3.4 stands nearest to 3; in a second, at the speed at which it came from 3, it is beyond 4.
  for (std::size_t node = 0; node < kCount; ++node)
    for (int level = 0; level < 2; ++level) damage(node, level);
  NodeCacheOptions options;
  options.ahead = 1;
  auto const library = open_node_library(folder(), options);
  auto const has_failed = [&](int node) {
    auto const lines = library->failures();
    return std::any_of(lines.begin(), lines.end(),
                       [&](std::string const& line) { return line.starts_with(fmt::format("node {:03}", node)); });
  };
  // Half a second between the two on a busy machine would be a rest: then they come again.
  EXPECT_TRUE(eventually([&] {
    library->follow({3, 0, 0});
    library->follow({3.4, 0, 0});
    return has_failed(7) || has_failed(6) || has_failed(5) || has_failed(4);
  }));
}

TEST_F(NodeCache, ADamagedNodeIsNamedAndTheOthersAreDrawn) {
  for (int level = 0; level < 2; ++level) damage(3, level);
  fs::remove_all(level_folder(5, 0));
  auto const library = open_node_library(folder());
  WalkthroughRenderer renderer(library, {});
  Frame const frame = renderer.render(square_camera(16, 8), look_at({3, 0, 0}, {20, 0, 0}));
  EXPECT_EQ(gaps(frame), 0U);
  for (UsedNode const& used : renderer.used()) EXPECT_NE(used.node, 3U);
  EXPECT_EQ(library->get(3, 0, Wait::yes), nullptr);
  // Of 5 the coarser level is left.
  auto const coarse = library->get(5, 0, Wait::yes);
  ASSERT_NE(coarse, nullptr);
  EXPECT_LT(coarse->bytes(), library->get(4, 0, Wait::yes)->bytes());
  EXPECT_THAT(library->failures(), ElementsAre(AllOf(HasSubstr("node 003"), HasSubstr("003_0/mesh.ply")),
                                               AllOf(HasSubstr("node 003"), HasSubstr("003_1/mesh.ply")),
                                               AllOf(HasSubstr("node 005"), HasSubstr("005_0"))));
}

TEST_F(NodeCache, FarNodesComeInLessDetail) {
  NodeCacheOptions options;
  options.full_detail = 4;
  auto const library = open_node_library(folder(), options);
  std::size_t const full = library->get(1, 0, Wait::yes)->bytes();
  EXPECT_EQ(library->get(1, 4 * kRadius * 0.99, Wait::yes)->bytes(), full);
  EXPECT_LT(library->get(1, 4 * kRadius * 1.01, Wait::yes)->bytes(), full);
  EXPECT_LT(library->get(1, 1e9, Wait::yes)->bytes(), full);
}

TEST_F(NodeCache, MayBeAskedBySeveralThreads) {
  NodeCacheOptions options;
  options.bytes = 1;
  auto const library = open_node_library(folder(), options);
  std::vector<std::thread> threads;
  std::atomic<int> missing = 0;
  for (std::uint64_t t = 0; t < 3; ++t)
    threads.emplace_back([&, t] {
      CounterRandom random(40, t);
      for (int i = 0; i < 100; ++i) {
        std::size_t const node = random.below(kCount);
        if (i % 10 == 0) library->follow({double(node), 0, 0});
        if (!library->get(node, 3 * random.uniform(), Wait::yes)) ++missing;
      }
    });
  for (auto& thread : threads) thread.join();
  EXPECT_EQ(missing, 0);
}

TEST_F(NodeCache, ADamagedManifestAndBadOptionsAreRefused) {
  NodeCacheOptions options;
  options.ahead = -1;
  EXPECT_SCANVIEW_ERROR(open_node_library(folder(), options), ErrorCode::usage, "ahead");
  options = {};
  options.full_detail = 0;
  EXPECT_SCANVIEW_ERROR(open_node_library(folder(), options), ErrorCode::usage, "full_detail");
  options = {};
  options.seconds_ahead = NAN;
  EXPECT_SCANVIEW_ERROR(open_node_library(folder(), options), ErrorCode::usage, "seconds_ahead");
  fs::resize_file(folder() / "walkthrough.json", 40);
  EXPECT_SCANVIEW_ERROR(open_node_library(folder()), ErrorCode::bad_input, "walkthrough.json");
}

}  // namespace
}  // namespace scanview::test
