#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <numbers>

#include "acquire/scan_set_file.h"
#include "tests/cli/command.h"

namespace scanview {
namespace {

namespace fs = std::filesystem;

class Synth : public VerbTest {
 protected:
  std::vector<std::string> tiny(std::string const& output, std::vector<std::string> const& more = {}) const {
    std::vector<std::string> arguments = {"synth",  in("model.obj"), "-o",      in(output), "--views",  "2",
                                          "--size", "48x36",         "--steps", "12",       "--boards", "1"};
    arguments.insert(arguments.end(), more.begin(), more.end());
    return arguments;
  }
  void SetUp() override {
    write_file(in("model.obj"), "v 0 0 0\nv 30 0 0\nv 0 40 0\nv 0 0 20\nf 1 3 2\nf 1 2 4\nf 1 4 3\nf 2 3 4\n");
  }
};

TEST_F(Synth, ACaptureIsTheSameForAnyNumberOfThreadsAndIsNotMadeTwice) {
  Json const report = run(tiny("one", {"--threads", "1"}));
  EXPECT_EQ(report["views"], 2);
  EXPECT_EQ(report["frames"], 12);
  EXPECT_EQ(report["truth"]["poses"], "truth/scanset.json");
  EXPECT_EQ(report["noise"]["full_scale_electrons"], 10000);
  run(tiny("two", {"--threads", "2"}));
  EXPECT_EQ(folder_hashes(in("one")), folder_hashes(in("two")));
  auto const before = fs::last_write_time(in("one") + "/capture.json");
  run(tiny("one"));
  EXPECT_EQ(fs::last_write_time(in("one") + "/capture.json"), before);
  run(tiny("one", {"--seed", "2"}));
  EXPECT_NE(folder_hashes(in("one")), folder_hashes(in("two")));
}

TEST_F(Synth, StatedPosesAreOffByWhatWasAskedForButTheFirst) {
  run(tiny("off", {"--disturb", "2:1"}));
  ScanSet const truth = read_manifest(in("off") + "/truth"), stated = read_manifest(in("off") + "/stage");
  Eigen::Isometry3d const first = truth.views[0].object_from_camera->inverse() * *stated.views[0].object_from_camera;
  Eigen::Isometry3d const second = truth.views[1].object_from_camera->inverse() * *stated.views[1].object_from_camera;
  // Numbers are written with all their digits; an angle's cosine keeps half of them.
  EXPECT_LT((first.matrix() - Eigen::Matrix4d::Identity()).norm(), 1e-9);
  EXPECT_NEAR(Eigen::AngleAxisd(second.linear()).angle() * 180 / std::numbers::pi, 2, 1e-6);
  run(tiny("exact"));
  EXPECT_FALSE(fs::exists(in("exact") + "/stage"));
}

TEST_F(Synth, GrayCodeHasItsOwnManifest) {
  run(tiny("gray", {"--pattern", "gray", "--projector", "40x30", "--rows", "--no-stage"}));
  Json const manifest = read_json(in("gray") + "/capture.json");
  EXPECT_EQ(manifest["bits"], 6);
  EXPECT_EQ(manifest["last"], 11);
  EXPECT_EQ(manifest["rows_first"], 12);
  EXPECT_TRUE(manifest["empty"].is_null());
  for (char const* file : {"0000.png", "0021.png", "white.png", "black.png"})
    EXPECT_TRUE(fs::exists(in("gray") + "/view_001/right/" + file)) << file;
  EXPECT_FALSE(fs::exists(in("gray") + "/empty"));
}

TEST_F(Synth, BadOptionsNameThemselvesAndNothingIsReplaced) {
  for (auto const& [option, value, says] : {std::tuple{"--fault", "melt:3", "expected drop"},
                                            {"--fault", "drop:x", "--fault"},
                                            {"--noise", "0.01", "ELECTRONS:READ"},
                                            {"--beam", "2steps", "Nstep"},
                                            {"--backdrop", "blue", "#rrggbb"},
                                            {"--bits", "12", "sensor.bits"}}) {
    CommandResult const result = run_scanview(tiny("bad", {option, value}));
    EXPECT_EQ(result.exit_code, 2) << option << ' ' << value;
    EXPECT_NE(result.errors.find(says), std::string::npos) << result.errors;
    EXPECT_FALSE(fs::exists(in("bad")));
  }
  fs::create_directories(in("mine"));
  write_file(in("mine") + "/letter.txt", "dear");
  EXPECT_EQ(run_scanview(tiny("mine")).exit_code, 3);
  EXPECT_TRUE(fs::exists(in("mine") + "/letter.txt"));
}

}  // namespace
}  // namespace scanview
