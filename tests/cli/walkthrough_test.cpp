#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>

#include "acquire/scan_set_file.h"
#include "base/image_file.h"
#include "tests/cli/command.h"
#include "viewer/walkthrough/walkthrough_file.h"

namespace scanview {
namespace {

namespace fs = std::filesystem;
using ::testing::HasSubstr;

class Walkthrough : public VerbTest {
 protected:
  /// Two nodes in one room of the gallery.
  Json build(std::string const& output, std::vector<std::string> const& more = {}) {
    write_json(in("nodes.json"), {{"nodes", {{{"position", {4.4, 1.6, 2.4}}}, {{"position", {6.4, 1.6, 2.4}}}}}});
    std::vector<std::string> arguments = {"walkthrough", "build",          "gallery:20000", "-o", in(output),
                                          "--nodes",     in("nodes.json"), "--size",        "64", "--triangles",
                                          "2000",        "--light",        "painted"};
    arguments.insert(arguments.end(), more.begin(), more.end());
    return run(arguments);
  }
  std::vector<std::string> render(std::string const& folder, std::string const& output,
                                  std::vector<std::string> const& more = {}) const {
    std::vector<std::string> arguments = {"walkthrough", "render", in(folder), "-o", in(output),
                                          "--frames",    "3",      "--size",   "48", "32"};
    arguments.insert(arguments.end(), more.begin(), more.end());
    return arguments;
  }
  /// Frames of a camera that moves along a checkered wall, as a scan set.
  void write_set(std::string const& name, int views) const {
    ScanSet set;
    set.unit = Unit::m;
    for (int v = 0; v < views; ++v) {
      View view;
      view.name = fmt::format("{:03}", v);
      view.object_from_camera = Eigen::Isometry3d::Identity();
      view.object_from_camera->translation() = Eigen::Vector3d(0.1 * v, 0, 0);
      view.image = empty_range_image(Camera::perspective(48, 40, 45, 45, 23.5, 19.5));
      view.image.color.create(40, 48);
      for (int y = 0; y < 40; ++y)
        for (int x = 0; x < 48; ++x) {
          Eigen::Vector3d const p = *view.object_from_camera * view.image.camera.unproject(x, y, 2);
          view.image.depth(y, x) = 2;
          view.image.sigma(y, x) = 1e-3F;
          view.image.classes(y, x) = uchar(PixelClass::object);
          uchar const shade = uchar(std::lround(128 + 60 * std::sin(3 * p.x()) * std::cos(2 * p.y())));
          view.image.color(y, x) = {shade, shade, uchar(255 - shade)};
        }
      set.views.push_back(std::move(view));
    }
    Context context;
    write_scan_set(in(name), set, context);
  }
};

TEST_F(Walkthrough, IsBuiltWalkedThroughAndReported) {
  Json const built = build("walk");
  ASSERT_EQ(built["nodes"].size(), 2U);
  std::size_t triangles = 0;
  for (Json const& node : built["nodes"]) {
    EXPECT_LE(node["triangles"], 2000);
    triangles += node["triangles"].get<std::size_t>();
  }
  EXPECT_EQ(built["triangles"], triangles);
  EXPECT_EQ(built["walking_radius"], 1.0);  // half of the distance between the two
  EXPECT_GT(built["build_seconds"], 0);
  WalkthroughManifest const manifest = read_walkthrough(in("walk"));
  EXPECT_EQ(manifest.nodes.size(), 2U);
  EXPECT_EQ(manifest.nodes[0].levels.size(), 2U);
  EXPECT_EQ(manifest.focal_length, 32);

  Json const rendered = run(render("walk", "pictures", {"--between", "0", "1", "--film"}));
  ASSERT_EQ(rendered["frames"].size(), 3U);
  for (Json const& frame : rendered["frames"]) {
    EXPECT_TRUE(fs::exists(in("pictures") + "/" + frame["file"].get<std::string>()));
    EXPECT_GT(frame["milliseconds"], 0);
    EXPECT_EQ(frame["nodes"], 2);
  }
  EXPECT_LT(rendered["uncovered"], 0.1);
  EXPECT_TRUE(fs::exists(in("pictures/film.png")));

  Json const report = run({"walkthrough", "report", in("walk"), "--scene", "gallery:20000", "--light", "painted", "-o",
                           in("page.html"), "--frames", "3", "--size", "48", "32", "--between", "0", "1"});
  EXPECT_TRUE(report.contains("uncovered"));
  for (char const* const policy : {"layering", "binary", "weighted", "positional"}) {
    SCOPED_TRACE(policy);
    ASSERT_TRUE(report["policies"].contains(policy));
    EXPECT_GT(report["policies"][policy]["milliseconds"], 0);
    // At a node the frame is what the node saw, so that it is no worse than 20 dB even in pictures as coarse as these.
    EXPECT_LT(report["policies"][policy]["errors"][0], 0.01);
  }
  EXPECT_THAT(read_file(in("page.html")), HasSubstr("<svg"));
}

TEST_F(Walkthrough, EqualNodesForAnyNumberOfThreads) {
  build("one", {"--threads", "1"});
  build("three", {"--threads", "3"});
  EXPECT_EQ(folder_hashes(in("one")), folder_hashes(in("three")));
}

TEST_F(Walkthrough, ANodeInsideAnObjectIsRefusedByItsPosition) {
  write_json(in("nodes.json"), Json::array({{4.4, 1.6, 4.4}, {0.2, 1.6, 4.0}}));  // the second in the outer wall
  auto const result = run_scanview({"walkthrough", "build", "gallery:20000", "-o", in("walk"), "--nodes",
                                    in("nodes.json"), "--size", "16", "--light", "painted"});
  EXPECT_EQ(result.exit_code, 3);
  EXPECT_THAT(result.errors, HasSubstr("0.2"));
  EXPECT_FALSE(fs::exists(in("walk")));
}

TEST_F(Walkthrough, AMissingNodeIsNamedAndTheOthersAreDrawn) {
  build("walk");
  fs::remove_all(in("walk/nodes/000"));
  auto const result = run_scanview(render("walk", "pictures"));
  EXPECT_EQ(result.exit_code, 6);
  EXPECT_THAT(result.errors, HasSubstr("node 000"));
  EXPECT_THAT(result.errors, HasSubstr("node.json"));
  std::size_t pictures = 0;
  for (auto const& entry : fs::directory_iterator(in("pictures"))) pictures += entry.path().extension() == ".png";
  EXPECT_EQ(pictures, 3U);
  // Nothing is left.
  fs::resize_file(in("walk/nodes/001/0/mesh.ply"), 100);
  fs::resize_file(in("walk/nodes/001/1/color_0.png"), 20);
  auto const nothing = run_scanview(render("walk", "nothing"));
  EXPECT_EQ(nothing.exit_code, 6);
  EXPECT_THAT(nothing.errors, HasSubstr("node 001"));
}

TEST_F(Walkthrough, FramesOfAScanSetAreNodesOfOneSide) {
  write_set("set", 6);
  Json const built = run({"walkthrough", "build", in("set"), "-o", in("walk"), "--hold-out", "every:2"});
  ASSERT_EQ(built["nodes"].size(), 3U);
  Json const report =
      run({"walkthrough", "report", in("walk"), "--scene", in("set"), "--hold-out", "every:2", "-o", in("page.html")});
  // A smooth wall seen from a tenth of a unit beside: all of it but the rim, to 8 bits and bilinear filtering.
  for (auto const& [name, policy] : report["policies"].items()) EXPECT_GT(policy["psnr"], 20) << name;
  EXPECT_LT(report["uncovered"], 0.05 + 2 * 0.1 * 45 / 2 / 48);  // a tenth of a unit at depth 2 is 2.25 of 48 columns
  auto const none = run_scanview({"walkthrough", "report", in("walk"), "--scene", in("set"), "-o", in("none.html")});
  EXPECT_NE(none.exit_code, 0);
  EXPECT_THAT(none.errors, HasSubstr("--hold-out"));
}

TEST_F(Walkthrough, PanoramasAreNodes) {
  fs::create_directories(in("panoramas"));
  cv::Mat3b color(32, 64);
  cv::Mat1w depth(32, 64, ushort(2000));
  for (int y = 0; y < 32; ++y)
    for (int x = 0; x < 64; ++x) color(y, x) = {uchar(4 * x), uchar(8 * y), 100};
  depth.rowRange(0, 6).setTo(65535);
  write_file(in("panoramas/a.png"), encode_png(color));
  write_file(in("panoramas/a_depth.png"), encode_png(depth));
  write_json(in("panoramas/panoramas.json"),
             {{"format", 1},
              {"unit", "m"},
              {"nodes", {{{"color", "a.png"}, {"depth", "a_depth.png"}, {"depth_unit", 0.001}, {"sky", {65535}}}}}});
  Json const built = run({"walkthrough", "build", in("panoramas"), "-o", in("walk"), "--size", "16"});
  ASSERT_EQ(built["nodes"].size(), 1U);
  Json const rendered = run(render("walk", "pictures"));
  EXPECT_EQ(rendered["uncovered"], 0);
}

TEST_F(Walkthrough, WhatItCannotUseIsRefusedByName) {
  auto const refused = [&](int code, char const* text, std::vector<std::string> const& arguments) {
    CommandResult const result = run_scanview(arguments);
    EXPECT_EQ(result.exit_code, code) << text << ": " << result.errors;
    EXPECT_THAT(result.errors, HasSubstr(text));
  };
  write_file(in("nodes.json"), "[[1, 2]]");
  refused(3, "nodes[0]", {"walkthrough", "build", "gallery:20000", "-o", in("w"), "--nodes", in("nodes.json")});
  write_file(in("nodes.json"), R"({"nodes": [{"place": [1, 2, 3]}]})");
  refused(3, "place", {"walkthrough", "build", "gallery:20000", "-o", in("w"), "--nodes", in("nodes.json")});
  refused(2, "parallax_px", {"walkthrough", "build", "gallery:20000", "-o", in("w"), "--parallax", "0"});
  refused(2, "gallery", {"walkthrough", "build", "gallery:3", "-o", in("w")});
  refused(2, "--size", {"walkthrough", "build", "gallery:20000", "-o", in("w"), "--size", "4"});
  refused(3, "missing.ply", {"walkthrough", "build", in("missing.ply"), "-o", in("w")});
  write_set("set", 2);
  refused(2, "every:1", {"walkthrough", "build", in("set"), "-o", in("w"), "--hold-out", "every:1"});
  EXPECT_FALSE(fs::exists(in("w")));
  refused(3, "walkthrough.json", render("set", "p"));
  run({"walkthrough", "build", in("set"), "-o", in("walk")});
  refused(2, "--between", render("walk", "p", {"--between", "0", "2"}));
  refused(2, "merged", render("walk", "p", {"--merged", "0"}));
  refused(2, "--policy", render("walk", "p", {"--policy", "best"}));
  fs::resize_file(in("walk/walkthrough.json"), 50);
  refused(3, "walkthrough.json", render("walk", "p"));
}

}  // namespace
}  // namespace scanview
