// What the command says, how it exits and what it leaves behind where its input or its surroundings are bad.
#include <fmt/format.h>
#include <gtest/gtest.h>
#include <sys/resource.h>

#include <csignal>
#include <limits>
#include <opencv2/core.hpp>

#include "base/files.h"
#include "base/image_file.h"
#include "tests/cli/command.h"
#include "tests/temporary_folder.h"

namespace scanview {
namespace {

namespace fs = std::filesystem;

/// Two small colour and depth frames of a slanted plane, described by an rgbd.json.
class BadInput : public ::testing::Test {
 protected:
  void SetUp() override {
    input_ = folder_.path() / "input";
    output_ = folder_.path() / "set";
    fs::create_directories(input_);
    for (int i = 0; i < 2; ++i) write_frame(i, 40, 30);
    manifest_ =
        Json::parse(R"({"color": "c{}.png", "depth": "d{}.png", "first": 0, "last": 1, "depth_unit": 0.001, "unit": "m",
      "missing": [0], "poses": "p{}.txt", "intrinsics": {"width": 40, "height": 30, "fx": 50, "fy": 50, "cx": 20, "cy": 15}})");
    for (int i = 0; i < 2; ++i) write_file(input_ / fmt::format("p{}.txt", i), "1 0 0 0\n0 1 0 0\n0 0 1 0\n0 0 0 1\n");
    write_manifest();
  }
  void write_frame(int i, int width, int height) {
    cv::Mat3b color(height, width);
    cv::Mat1w depth(height, width);
    for (int y = 0; y < height; ++y)
      for (int x = 0; x < width; ++x) {
        color(y, x) = cv::Vec3b(static_cast<std::uint8_t>(5 * x), static_cast<std::uint8_t>(7 * y), 90);
        depth(y, x) = static_cast<std::uint16_t>(1000 + 2 * x + y);
      }
    write_file(input_ / fmt::format("c{}.png", i), encode_png(color));
    write_file(input_ / fmt::format("d{}.png", i), encode_png(depth));
  }
  void write_manifest() { write_file(input_ / "rgbd.json", manifest_.dump()); }
  void truncate(std::string const& name) {
    std::string const bytes = read_file(input_ / name);
    write_file(input_ / name, bytes.substr(0, bytes.size() / 2));
  }
  /// The import fails with this code and one line that has the texts; nothing is left behind.
  void expect_refused(int code, std::vector<std::string> const& texts) {
    CommandResult const result = run_scanview({"import", "rgbd", input_.string(), "-o", output_.string()});
    EXPECT_EQ(result.exit_code, code) << result.errors;
    for (auto const& text : texts)
      EXPECT_NE(result.errors.find(text), std::string::npos) << text << " is not in: " << result.errors;
    EXPECT_FALSE(fs::exists(output_));
    EXPECT_FALSE(fs::exists(output_.string() + ".partial"));
    EXPECT_LT(result.peak_mb, 300);
  }
  /// One frame is bad: it is named, the other is imported, and the exit code says "part".
  void expect_one_view_fails(std::vector<std::string> const& texts) {
    CommandResult const result = run_scanview({"import", "rgbd", input_.string(), "-o", output_.string()});
    EXPECT_EQ(result.exit_code, 6) << result.errors;
    for (auto const& text : texts)
      EXPECT_NE(result.errors.find(text), std::string::npos) << text << " is not in: " << result.errors;
    EXPECT_TRUE(fs::exists(output_ / "scanset.json"));
  }
  TemporaryFolder folder_;
  fs::path input_, output_;
  Json manifest_;
};

TEST_F(BadInput, GoodInputIsTaken) {
  CommandResult const result = run_scanview(
      {"import", "rgbd", input_.string(), "-o", output_.string(), "--report", (folder_.path() / "r.json").string()});
  ASSERT_EQ(result.exit_code, 0) << result.errors;
  Json const report = read_json(folder_.path() / "r.json");
  EXPECT_EQ(report["views"], 2);
  EXPECT_EQ(report["unit"], "m");
  EXPECT_EQ(report["exit"], 0);
  for (char const* key : {"version", "seconds", "peak_mb", "warnings", "depths", "background_removed"})
    EXPECT_TRUE(report.contains(key)) << key;
}

TEST_F(BadInput, TruncatedPictureIsNamed) {
  truncate("c1.png");
  expect_one_view_fails({"c1.png", "truncated"});
}

TEST_F(BadInput, TruncatedPicturesInAllFramesAreRefused) {
  truncate("d0.png");
  truncate("d1.png");
  expect_refused(3, {"d0.png", "truncated"});
}

TEST_F(BadInput, ColourAndDepthOfDifferentSizes) {
  write_file(input_ / "d1.png", encode_png(cv::Mat1w(20, 20, std::uint16_t{1000})));
  expect_one_view_fails({"d1.png", "20x20"});
}

TEST_F(BadInput, MissingIntrinsics) {
  manifest_.erase("intrinsics");
  write_manifest();
  expect_refused(3, {"rgbd.json", "intrinsics"});
}

TEST_F(BadInput, UnknownKey) {
  manifest_["deph_unit"] = 1;
  write_manifest();
  expect_refused(3, {"rgbd.json", "deph_unit"});
}

TEST_F(BadInput, BrokenJson) {
  write_file(input_ / "rgbd.json", "{\"color\": ");
  expect_refused(3, {"rgbd.json", "JSON"});
}

TEST_F(BadInput, PoseThatIsNotFinite) {
  write_file(input_ / "p1.txt", "1 0 0 nan\n0 1 0 0\n0 0 1 0\n0 0 0 1\n");
  expect_one_view_fails({"p1.txt"});
}

TEST_F(BadInput, PoseThatIsNoRotation) {
  write_file(input_ / "p1.txt", "2 0 0 0\n0 1 0 0\n0 0 1 0\n0 0 0 1\n");
  expect_one_view_fails({"p1.txt", "rotation"});
}

TEST_F(BadInput, EmptyFolder) {
  fs::remove_all(input_);
  fs::create_directories(input_);
  expect_refused(3, {"input"});
  CommandResult const result = run_scanview({"run", input_.string(), "-o", output_.string()});
  EXPECT_EQ(result.exit_code, 3);
  EXPECT_FALSE(fs::exists(output_));
}

TEST_F(BadInput, FolderThatCannotBeWritten) {
  CommandResult const result = run_scanview({"import", "rgbd", input_.string(), "-o", "/proc/scanview/set"});
  EXPECT_EQ(result.exit_code, 5) << result.errors;
  EXPECT_NE(result.errors.find("/proc/scanview/set"), std::string::npos) << result.errors;
}

TEST_F(BadInput, FullDisk) {
  auto const limit = [] {
    std::signal(SIGXFSZ, SIG_IGN);
    rlimit const size{600, 600};
    ::setrlimit(RLIMIT_FSIZE, &size);
  };
  CommandResult const result =
      run_scanview({"import", "rgbd", input_.string(), "-o", output_.string(), "--quiet"}, limit);
  EXPECT_EQ(result.exit_code, 5) << result.errors;
  EXPECT_NE(result.errors.find("cannot write"), std::string::npos) << result.errors;
  EXPECT_FALSE(fs::exists(output_));
  EXPECT_FALSE(fs::exists(output_.string() + ".partial"));
}

TEST_F(BadInput, AFolderThatIsNoSetIsNotReplaced) {
  fs::create_directories(output_);
  write_file(output_ / "thesis.tex", "precious");
  CommandResult const result = run_scanview({"import", "rgbd", input_.string(), "-o", output_.string()});
  EXPECT_EQ(result.exit_code, 3);
  EXPECT_EQ(read_file(output_ / "thesis.tex"), "precious");
}

TEST_F(BadInput, APlyThatPromisesFourBillionVertices) {
  write_file(folder_.path() / "big.ply",
             "ply\nformat binary_little_endian 1.0\nelement vertex 4000000000\nproperty float x\nproperty float y\n"
             "property float z\nend_header\n0123456789ab");
  for (auto const& arguments :
       {std::vector<std::string>{"synth", (folder_.path() / "big.ply").string(), "-o", output_.string()},
        std::vector<std::string>{"info", (folder_.path() / "big.ply").string()}}) {
    CommandResult const result = run_scanview(arguments);
    EXPECT_EQ(result.exit_code, 3);
    EXPECT_NE(result.errors.find("big.ply: promises 4000000000 rows"), std::string::npos) << result.errors;
    EXPECT_LT(result.peak_mb, 300);
  }
  EXPECT_FALSE(fs::exists(output_));
}

TEST_F(BadInput, DamagedSetIsNamed) {
  ASSERT_EQ(run_scanview({"import", "rgbd", input_.string(), "-o", output_.string()}).exit_code, 0);
  fs::path const range =
      output_ / "views" / read_json(output_ / "scanset.json")["views"][0]["name"].get<std::string>() / "range.exr";
  std::string const bytes = read_file(range);
  write_file(range, bytes.substr(0, bytes.size() / 2));
  CommandResult const result = run_scanview({"mesh", output_.string()});
  EXPECT_EQ(result.exit_code, 3);
  EXPECT_NE(result.errors.find("range.exr"), std::string::npos) << result.errors;
}

TEST(Usage, MistakesExitWithTwo) {
  for (std::vector<std::string> const& arguments : {std::vector<std::string>{},
                                                    {"fly"},
                                                    {"import"},
                                                    {"render", "set", "-o", "x"},
                                                    {"import", "cuneiform", "/tmp", "-o", "/tmp/x"},
                                                    {"register", "set", "--init", "sideways"},
                                                    {"mesh", "set", "--tolerance", "3parsec"},
                                                    {"mesh", "set", "--placement", "dice"},
                                                    {"mesh", "set", "--levels", "0"},
                                                    {"run", "/tmp", "-o", "/tmp/x", "--set", "mesh.colour=1"}})
    EXPECT_EQ(run_scanview(arguments).exit_code, 2) << (arguments.empty() ? "" : arguments[0]);
  EXPECT_EQ(run_scanview({"--help"}).exit_code, 0);
  EXPECT_EQ(run_scanview({"run", "--help"}).exit_code, 0);
  EXPECT_EQ(run_scanview({"--version"}).exit_code, 0);
}

TEST(Usage, WhatDoesNotExistIsBadInput) {
  for (std::vector<std::string> const& arguments :
       {std::vector<std::string>{"info", "/nowhere"}, {"mesh", "/nowhere"}, {"run", "/nowhere", "-o", "/tmp/x"}}) {
    CommandResult const result = run_scanview(arguments);
    EXPECT_EQ(result.exit_code, 3) << arguments[0];
    EXPECT_NE(result.errors.find("/nowhere"), std::string::npos);
  }
}

}  // namespace
}  // namespace scanview
