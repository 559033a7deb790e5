#include "acquire/scan_set_file.h"

#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <opencv2/core.hpp>

#include "base/image_file.h"
#include "base/random.h"
#include "tests/expect_error.h"
#include "tests/temporary_folder.h"

namespace scanview {
namespace {

namespace fs = std::filesystem;

/// Random depths with holes: two perspective views and an orthographic one without a pose.
ScanSet sample_set() {
  ScanSet set;
  set.unit = Unit::mm;
  set.center = {1, 2.5, -3e-7};
  set.error_budget.sampling = {0.1, 0.2};
  Camera const cameras[] = {Camera::perspective(31, 17, 40, 41, 15, 8), Camera::perspective(20, 20, 30, 30, 9, 9),
                            Camera::orthographic(8, 9, 0.3, 0.7, 1, 2)};
  for (std::size_t v = 0; v < 3; ++v) {
    View view;
    view.name = std::string("00") + static_cast<char>('0' + v);
    view.image = empty_range_image(cameras[v]);
    for (int y = 0; y < view.image.depth.rows; ++y)
      for (int x = 0; x < view.image.depth.cols; ++x) {
        CounterRandom random(v, static_cast<std::uint64_t>(y * 100 + x));
        view.image.color(y, x) = cv::Vec3b::all(static_cast<std::uint8_t>(random.below(256)));
        if (random.uniform() < 0.3) {
          view.image.remove(x, y, PixelClass::background);
          continue;
        }
        view.image.depth(y, x) = static_cast<float>(1 + random.uniform());
        view.image.sigma(y, x) = static_cast<float>(1e-3 * (1 + random.uniform()));
        view.image.classes(y, x) = static_cast<std::uint8_t>(PixelClass::object);
      }
    if (v < 2) {
      view.object_from_camera =
          Eigen::Isometry3d(Eigen::AngleAxisd(0.3 + static_cast<double>(v), Eigen::Vector3d::UnitY()));
      view.object_from_camera->translation() << 0.1, 0.2, 1.0 / 3;
    }
    view.gain = {1, 1.1, 0.9};
    set.views.push_back(view);
  }
  return set;
}

bool same_bits(cv::Mat1f const& a, cv::Mat1f const& b) {
  if (a.size() != b.size()) return false;
  for (int y = 0; y < a.rows; ++y)
    for (int x = 0; x < a.cols; ++x)
      if (!(a(y, x) == b(y, x) || (std::isnan(a(y, x)) && std::isnan(b(y, x))))) return false;
  return true;
}

class ScanSetFile : public ::testing::Test {
 protected:
  void SetUp() override {
    set_ = sample_set();
    write_scan_set(folder_.path(), set_, context_);
  }
  /// Reading the set fails with this text after the manifest was changed.
  void expect_bad_manifest(std::function<void(Json&)> const& change, std::string const& text) {
    Json json = good_;
    change(json);
    write_file(folder_.path() / "scanset.json", json.dump());
    EXPECT_SCANVIEW_ERROR(read_manifest(folder_.path()), ErrorCode::bad_input, text);
  }
  TemporaryFolder folder_;
  Context context_;
  ScanSet set_;
  Json good_;
};

TEST_F(ScanSetFile, RoundTripsBitByBit) {
  ScanSet const back = read_scan_set(folder_.path(), context_);
  EXPECT_EQ(back.unit, set_.unit);
  EXPECT_EQ(back.center, set_.center);
  EXPECT_EQ(back.error_budget.sampling.p95, 0.2);
  EXPECT_TRUE(std::isnan(back.error_budget.registration.rms));
  ASSERT_EQ(back.views.size(), 3U);
  for (std::size_t v = 0; v < 3; ++v) {
    EXPECT_EQ(back.views[v].image.camera, set_.views[v].image.camera);
    EXPECT_EQ(back.views[v].object_from_camera.has_value(), v < 2);
    if (v < 2) {
      EXPECT_EQ(back.views[v].object_from_camera->matrix(), set_.views[v].object_from_camera->matrix());
    }
    EXPECT_EQ(back.views[v].gain, set_.views[v].gain);
    EXPECT_TRUE(same_bits(back.views[v].image.depth, set_.views[v].image.depth));
    EXPECT_TRUE(same_bits(back.views[v].image.sigma, set_.views[v].image.sigma));
    EXPECT_EQ(cv::norm(back.views[v].image.color, set_.views[v].image.color, cv::NORM_INF), 0);
    EXPECT_EQ(cv::norm(back.views[v].image.classes, set_.views[v].image.classes, cv::NORM_INF), 0);
  }
  EXPECT_FALSE(back.has_poses());
}

TEST_F(ScanSetFile, EqualSetsGiveEqualBytesForAnyNumberOfThreads) {
  TemporaryFolder const parent;
  auto files = image_files(set_);
  files.emplace_back("scanset.json");
  for (int threads : {1, 2}) {
    fs::path const other = parent.path() / std::to_string(threads);
    fs::create_directories(other);
    Context context;
    context.threads = threads;
    write_scan_set(other, read_scan_set(folder_.path(), context), context);
    for (auto const& file : files) EXPECT_EQ(read_file(other / file), read_file(folder_.path() / file)) << file;
  }
}

TEST_F(ScanSetFile, BadManifestsAreNamed) {
  good_ = read_json(folder_.path() / "scanset.json");
  expect_bad_manifest([](Json& j) { j["format"] = 2; }, "format 1");
  expect_bad_manifest([](Json& j) { j["unit"] = "inch"; }, "inch");
  expect_bad_manifest([](Json& j) { j["center"] = {1, 2}; }, "center");
  expect_bad_manifest([](Json& j) { j["views"] = Json::array(); }, "no views");
  expect_bad_manifest([](Json& j) { j["views"][1]["name"] = "000"; }, "twice");
  expect_bad_manifest([](Json& j) { j["views"][1]["name"] = "../../etc"; }, "view name");
  expect_bad_manifest([](Json& j) { j["views"][1].erase("camera"); }, "no camera");
  expect_bad_manifest([](Json& j) { j["views"][0]["object_from_camera"][0] = 5; }, "pose of view 000 is no rotation");
  expect_bad_manifest([](Json& j) { j["views"][0]["object_from_camera"][3] = nullptr; }, "16 numbers");
  expect_bad_manifest([](Json& j) { j["views"][0]["gain"] = {1, 0, 1}; }, "gain");
  expect_bad_manifest([](Json& j) { j["error_budget"]["sampling"]["rms"] = -1; }, "sampling.rms");
  write_file(folder_.path() / "scanset.json", "[1, 2");
  EXPECT_SCANVIEW_ERROR(read_manifest(folder_.path()), ErrorCode::bad_input, "JSON");
  fs::remove(folder_.path() / "scanset.json");
  EXPECT_SCANVIEW_ERROR(read_manifest(folder_.path()), ErrorCode::bad_input, "is not a scan set");
}

TEST_F(ScanSetFile, EveryTruncatedRangeFileIsRefused) {
  fs::path const path = folder_.path() / "views/000/range.exr";
  std::string const bytes = read_file(path);
  for (std::size_t n = 0; n < bytes.size(); n += std::max<std::size_t>(1, bytes.size() / 97)) {
    write_file(path, bytes.substr(0, n));
    EXPECT_SCANVIEW_ERROR(read_scan_set(folder_.path(), context_), ErrorCode::bad_input, "range.exr");
  }
}

TEST_F(ScanSetFile, DamagedRangeFilesNeverDoMoreThanThrow) {
  fs::path const path = folder_.path() / "views/000/range.exr";
  std::string const bytes = read_file(path);
  for (std::uint64_t trial = 0; trial < 500; ++trial) {
    std::string damaged = bytes;
    CounterRandom random(3, trial);
    // Most of the harm can be done in the header.
    for (int k = 0; k < 3; ++k) damaged[random.below(400)] = static_cast<char>(random.below(256));
    write_file(path, damaged);
    cv::Mat1f depth, sigma;
    try {
      read_range_exr(path, depth, sigma);
    } catch (Error const& error) {
      EXPECT_EQ(error.code(), ErrorCode::bad_input);
    }
  }
}

TEST_F(ScanSetFile, FilesOfAnotherSizeAreNamed) {
  write_file(folder_.path() / "views/001/color.png", encode_png(cv::Mat(3, 3, CV_8UC3, cv::Scalar::all(1))));
  EXPECT_SCANVIEW_ERROR(read_scan_set(folder_.path(), context_), ErrorCode::bad_input,
                        "color.png: is 3x3, but its camera is 20x20");
}

TEST_F(ScanSetFile, AMaskThatContradictsTheDepthsIsNamed) {
  write_file(folder_.path() / "views/001/mask.png", encode_png(cv::Mat(20, 20, CV_8UC1, cv::Scalar(255))));
  EXPECT_SCANVIEW_ERROR(read_scan_set(folder_.path(), context_), ErrorCode::bad_input, "mask.png");
}

TEST(ScanSet, RadiusAndCenterIgnoreFewOutliers) {
  ScanSet set = sample_set();
  set.center = median_center(set);
  double const radius = set.radius();
  set.views[0].image.depth(3, 3) = 1e6F;
  set.views[0].image.sigma(3, 3) = 1;
  set.views[0].image.classes(3, 3) = static_cast<std::uint8_t>(PixelClass::object);
  EXPECT_LT((median_center(set) - set.center).norm(), 0.01);
  EXPECT_NEAR(set.radius(), radius, 0.05 * radius);
}

TEST(ErrorBudget, ThresholdSumsWhatIsKnown) {
  ErrorBudget budget;
  EXPECT_EQ(budget.threshold(), 0);
  budget.sampling = {1, 2};
  budget.approximation = {0.5, 0.75};
  EXPECT_EQ(budget.threshold(), 2.75);
}

}  // namespace
}  // namespace scanview
