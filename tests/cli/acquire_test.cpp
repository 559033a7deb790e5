// A capture becomes a scan set: what is reported, what is resumed, what is refused.
#include <fmt/format.h>
#include <gtest/gtest.h>
#include <sys/resource.h>

#include <cmath>
#include <csignal>
#include <numbers>
#include <opencv2/imgproc.hpp>

#include "acquire/scan_set_file.h"
#include "base/image_file.h"
#include "tests/cli/command.h"

namespace scanview {
namespace {

namespace fs = std::filesystem;

/// A ball of 30 mm with three bulges around its axis, as OBJ: cheap to scan, and no two sides of a view alike.
std::string blob() {
  constexpr int kAround = 24, kDown = 12;
  std::string obj;
  for (int j = 0; j <= kDown; ++j)
    for (int i = 0; i < kAround; ++i) {
      double const theta = std::numbers::pi * j / kDown, phi = 2 * std::numbers::pi * i / kAround;
      double const r = 30 + 4 * std::sin(3 * phi) * std::sin(theta);
      obj += fmt::format("v {} {} {}\n", r * std::sin(theta) * std::cos(phi), r * std::sin(theta) * std::sin(phi),
                         r * std::cos(theta));
    }
  for (int j = 0; j < kDown; ++j)
    for (int i = 0; i < kAround; ++i) {
      int const a = j * kAround + i + 1, b = j * kAround + (i + 1) % kAround + 1;
      if (j > 0) obj += fmt::format("f {} {} {}\n", a, a + kAround, b);
      if (j < kDown - 1) obj += fmt::format("f {} {} {}\n", b, a + kAround, b + kAround);
    }
  return obj;
}

class Acquire : public VerbTest {
 protected:
  static void SetUpTestSuite() {
    captures_ = new TemporaryFolder;
    write_file(captures_->path() / "blob.obj", blob());
    CommandResult const synth =
        run_scanview({"synth", (captures_->path() / "blob.obj").string(), "-o", capture().string(), "--views", "2",
                      "--size", "160x120", "--steps", "48", "--beam", "0.8step", "--boards", "0", "--quiet"});
    ASSERT_EQ(synth.exit_code, 0) << synth.errors;
  }
  static void TearDownTestSuite() {
    delete captures_;
    captures_ = nullptr;
  }
  static fs::path capture() { return captures_->path() / "capture"; }

  /// A capture of the test's own, to be damaged.
  fs::path copy() const {
    fs::copy(capture(), in("copy"), fs::copy_options::recursive);
    return in("copy");
  }
  /// `acquire` must fail with this code and words, and leave nothing.
  void expect_refused(fs::path const& input, int code, std::string const& words,
                      std::function<void()> const& limit = {}) const {
    CommandResult const result = run_scanview({"acquire", input.string(), "-o", in("set"), "--quiet"}, limit);
    EXPECT_EQ(result.exit_code, code) << result.errors;
    EXPECT_NE(result.errors.find(words), std::string::npos) << result.errors;
    EXPECT_FALSE(fs::exists(in("set")));
    EXPECT_FALSE(fs::exists(in("set") + ".partial"));
  }

 private:
  inline static TemporaryFolder* captures_ = nullptr;
};

TEST_F(Acquire, TheReportNamesEveryViewAndWhyPixelsAreMissing) {
  Json const report = run({"acquire", capture().string(), "-o", in("set"), "--measure-reading"});
  EXPECT_EQ(report["unit"], "mm");
  EXPECT_EQ(report["pattern"], "sweep");
  EXPECT_GT(report["baseline"], 0);
  for (char const* seconds : {"decode_seconds", "write_seconds", "read_seconds", "hash_seconds"})
    EXPECT_GT(report[seconds], 0) << seconds;
  ASSERT_EQ(report["views"].size(), 2U);
  Context context;
  ScanSet const set = read_scan_set(in("set"), context);
  std::size_t depths = 0;
  for (std::size_t v = 0; v < 2; ++v) {
    Json const& view = report["views"][v];
    RangeImage const& image = set.views[v].image;
    EXPECT_EQ(view["name"], set.views[v].name);
    EXPECT_EQ(view["depths"], image.count_depths());
    EXPECT_GE(view["decodable"], view["depths"]);
    EXPECT_GT(view["sigma_median"], 0);
    // Every pixel has a depth or a reason.
    std::size_t pixels = view["depths"];
    for (char const* reason : {"no_light", "saturated", "several_peaks", "no_partner", "inconsistent", "background"})
      EXPECT_TRUE(view["why_missing"].contains(reason)) << reason;
    for (auto const& [reason, count] : view["why_missing"].items()) pixels += count.get<std::size_t>();
    EXPECT_EQ(pixels, image.classes.total());
    EXPECT_FALSE(set.views[v].object_from_camera);
    depths += image.count_depths();
  }
  EXPECT_GT(depths, 500U);
  EXPECT_EQ(report["depths"], depths);
  EXPECT_GT(set.error_budget.sampling.rms, 0);
  EXPECT_GE(set.error_budget.sampling.p95, set.error_budget.sampling.rms / 2);
  EXPECT_TRUE(fs::exists(in("set") + "/report.html"));
}

TEST_F(Acquire, ThreadsDoNotChangeAByteAndNothingIsDoneTwice) {
  for (char const* threads : {"1", "2"}) run({"acquire", capture().string(), "-o", in(threads), "--threads", threads});
  EXPECT_EQ(folder_hashes(in("1")), folder_hashes(in("2")));
  auto const made = fs::last_write_time(in("1") + "/acquire.json");
  Json const again = run({"acquire", capture().string(), "-o", in("1")});
  EXPECT_EQ(fs::last_write_time(in("1") + "/acquire.json"), made);
  EXPECT_TRUE(again["decode_seconds"].is_null());
  EXPECT_EQ(again["views"].size(), 2U);
  // Another option, or the same rig from elsewhere with other contents, is other work.
  std::string rig = read_file(capture() / "rig.yml");
  write_file(in("rig.yml"), rig + "# the same numbers\n");
  run({"acquire", capture().string(), "-o", in("1"), "--rig", in("rig.yml")});
  EXPECT_NE(fs::last_write_time(in("1") + "/acquire.json"), made);
  EXPECT_EQ(read_file(in("1") + "/views/000/range.exr"), read_file(in("2") + "/views/000/range.exr"));
}

TEST_F(Acquire, ADamagedMissingOrResizedPictureIsNamedAndNothingIsLeft) {
  fs::path const broken = copy(), frame = broken / "view_001/right/0017.png";
  std::string const bytes = read_file(frame);
  write_file(frame, bytes.substr(0, bytes.size() / 2));
  expect_refused(broken, 3, "view_001/right/0017.png: is truncated");
  write_file(frame, "");
  expect_refused(broken, 3, "view_001/right/0017.png: is empty");
  write_file(frame, encode_png(cv::Mat1b(60, 80, std::uint8_t{9})));
  expect_refused(broken, 3, "view_001/right/0017.png: is 80×60, but the camera was calibrated at 160×120");
  fs::remove_all(broken / "view_001/right");
  expect_refused(broken, 3, "view_001/right/00");
  fs::remove(broken / "capture.json");
  expect_refused(broken, 3, "capture.json");
}

TEST_F(Acquire, AFullDiskLeavesNothing) {
  expect_refused(capture(), 5, "cannot write", [] {
    std::signal(SIGXFSZ, SIG_IGN);
    rlimit const size{2000, 2000};
    ::setrlimit(RLIMIT_FSIZE, &size);
  });
}

TEST_F(Acquire, DeepAndColourFramesMeanTheSame) {
  fs::path const deep = copy();
  run({"acquire", capture().string(), "-o", in("plain")});
  // Left frames in 16 bits, right frames in colour: each decoder sees the same light.
  for (auto const& entry : fs::recursive_directory_iterator(deep)) {
    if (!entry.is_regular_file() || entry.path().extension() != ".png") continue;
    std::string const side = entry.path().parent_path().filename().string();
    cv::Mat frame;
    if (side == "left")
      read_gray(entry.path()).convertTo(frame, CV_16U, 257);
    else if (side == "right")
      cv::cvtColor(read_gray(entry.path()), frame, cv::COLOR_GRAY2BGR);
    else
      continue;
    write_file(entry.path(), encode_png(frame));
  }
  run({"acquire", deep.string(), "-o", in("deep")});
  Context context;
  ScanSet const plain = read_scan_set(in("plain"), context), other = read_scan_set(in("deep"), context);
  std::size_t both = 0, either = 0, off = 0;
  for (std::size_t v = 0; v < plain.views.size(); ++v) {
    RangeImage const &a = plain.views[v].image, &b = other.views[v].image;
    for (int y = 0; y < a.depth.rows; ++y)
      for (int x = 0; x < a.depth.cols; ++x) {
        if (a.has_depth(x, y) || b.has_depth(x, y)) ++either;
        if (!a.has_depth(x, y) || !b.has_depth(x, y)) continue;
        ++both;
        // The same values, weighted by noise models that differ by the rounding to 8 bits only.
        if (std::abs(a.depth(y, x) - b.depth(y, x)) > a.sigma(y, x)) ++off;
      }
  }
  EXPECT_GT(both, 500U);
  EXPECT_GE(static_cast<double>(both), 0.98 * static_cast<double>(either));
  EXPECT_LE(static_cast<double>(off), 0.01 * static_cast<double>(both));
}

TEST_F(Acquire, BadOptionsNameThemselves) {
  for (auto const& [option, value] : {std::pair{"--decoder", "magic"},
                                      {"--set", "acquire.speed=3"},
                                      {"--set", "mesh.tolerance=3"},
                                      {"--min-depth", "-1"}}) {
    CommandResult const result = run_scanview({"acquire", capture().string(), "-o", in("set"), option, value});
    EXPECT_EQ(result.exit_code, 2) << option << ' ' << value << ": " << result.errors;
    EXPECT_FALSE(fs::exists(in("set")));
  }
}

TEST_F(Acquire, RunBeginsWithACapture) {
  CommandResult const dry = run_scanview({"run", capture().string(), "-o", in("set"), "--dry-run"});
  EXPECT_NE(dry.output.find("acquire    would run"), std::string::npos) << dry.output;
  Json const report = run({"run", capture().string(), "-o", in("set"), "--to", "acquire", "--decoder", "stripe"});
  EXPECT_EQ(report["stages"]["acquire"]["views"].size(), 2U);
  EXPECT_EQ(read_json(in("set") + "/acquire.json")["options"]["decoder"], "stripe");
  EXPECT_NE(read_file(in("set") + "/report.html").find("several peaks"), std::string::npos);
  CommandResult const info = run_scanview({"info", capture().string()});
  EXPECT_NE(info.output.find("kind: capture"), std::string::npos) << info.output << info.errors;
}

}  // namespace
}  // namespace scanview
