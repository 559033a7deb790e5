#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>

#include "acquire/scan_set_file.h"
#include "base/image_file.h"
#include "tests/cli/command.h"
#include "viewer/layered/ldi_file.h"

namespace scanview {
namespace {

namespace fs = std::filesystem;
using ::testing::HasSubstr;

class Ldi : public VerbTest {
 protected:
  /// Frames of a camera that moves along a painted wall with a board before it, as a scan set.
  void write_set(std::string const& name, std::vector<int> const& places, bool with_poses = true) const {
    ScanSet set;
    set.unit = Unit::m;
    for (int const place : places) {
      View view;
      view.name = fmt::format("{:03}", place);
      Eigen::Isometry3d pose = Eigen::Isometry3d::Identity();
      pose.translation() = Eigen::Vector3d(0.1 * place, 0, 0);
      view.image = empty_range_image(Camera::perspective(48, 40, 45, 45, 23.5, 19.5));
      view.image.color.create(40, 48);
      for (int y = 0; y < 40; ++y)
        for (int x = 0; x < 48; ++x) {
          Eigen::Vector3d const near = pose * view.image.camera.unproject(x, y, 1.4);
          bool const is_board = std::abs(near.x() - 0.2) < 0.15 && std::abs(near.y()) < 0.2;
          double const depth = is_board ? 1.4 : 2;
          Eigen::Vector3d const p = pose * view.image.camera.unproject(x, y, depth);
          view.image.depth(y, x) = float(depth);
          view.image.sigma(y, x) = 1e-3F;
          view.image.classes(y, x) = uchar(PixelClass::object);
          uchar const shade = uchar(std::lround(128 + 60 * std::sin(3 * p.x()) * std::cos(2 * p.y())));
          view.image.color(y, x) = {shade, is_board ? uchar(30) : shade, uchar(255 - shade)};
        }
      if (with_poses) view.object_from_camera = pose;
      set.views.push_back(std::move(view));
    }
    set.center = Eigen::Vector3d(0.2, 0, 2);
    Context context;
    fs::create_directories(in(name));
    write_scan_set(in(name), set, context);
  }
  Json build(std::string const& set, std::string const& tree, std::vector<std::string> const& more = {}) {
    std::vector<std::string> arguments = {"ldi", "build", in(set), "-o", in(tree), "--resolution", "16"};
    arguments.insert(arguments.end(), more.begin(), more.end());
    return run(arguments);
  }
  /// Where the cells' content begins in a file.
  static std::size_t content_of(std::string const& bytes, LdiTree const& tree) {
    return bytes.find(std::string_view(reinterpret_cast<char const*>(tree.content.data()), tree.content.size()));
  }
  void refused(int code, std::vector<std::string> const& texts, std::vector<std::string> const& arguments) const {
    CommandResult const result = run_scanview(arguments);
    EXPECT_EQ(result.exit_code, code) << result.errors;
    for (auto const& text : texts) EXPECT_THAT(result.errors, HasSubstr(text));
  }
};

TEST_F(Ldi, IsBuiltToldOfAndRendered) {
  write_set("set", {0, 1, 2, 3, 4, 5});
  Json const built = build("set", "tree.ldi");
  EXPECT_EQ(built["images"], 6);
  EXPECT_EQ(built["input_bytes"], 6 * 48 * 40 * 7);
  EXPECT_GT(built["cells"], 1);
  EXPECT_GT(built["levels"], 1);
  EXPECT_GT(built["sums"], 48 * 40);
  EXPECT_GT(built["build_seconds"], 0);
  LdiTree const tree = read_ldi(in("tree.ldi"));
  EXPECT_EQ(tree.cells.size(), built["cells"]);
  EXPECT_EQ(tree.pixel_count(), built["pixels"]);
  EXPECT_EQ(tree.bytes(), built["bytes"]);
  EXPECT_EQ(built["file_bytes"], fs::file_size(in("tree.ldi")));
  // The images see the same surface: much less than all of their pixels, once and in all coarser levels.
  EXPECT_LT(built["pixels"], 6 * 48 * 40);

  Json const info = run({"info", in("tree.ldi")});
  EXPECT_EQ(info["kind"], "LDI tree");
  EXPECT_EQ(info["unit"], "m");
  EXPECT_EQ(info["resolution"], 16);
  EXPECT_EQ(info["cells"], built["cells"]);
  EXPECT_EQ(info["views"].size(), 6U);
  EXPECT_EQ(info["levels"].size(), built["levels"]);

  Json const rendered = run({"ldi", "render", in("tree.ldi"), "--like", "002", "--size", "48x40", "-o", in("like")});
  ASSERT_EQ(rendered["frames"].size(), 1U);
  Json const& frame = rendered["frames"][0];
  EXPECT_EQ(frame["file"], "002.png");
  EXPECT_EQ(frame["complete"], true);
  for (char const* const key : {"milliseconds", "cells_traversed", "splats"}) EXPECT_GT(frame[key], 0) << key;
  EXPECT_LT(frame["uncovered"], 0.01);
  EXPECT_GT(rendered["fps_median"], 0);
  // From where an image was taken, it comes back.
  cv::Mat const picture = read_image(in("like/002.png"));
  ASSERT_EQ(picture.type(), CV_8UC4);
  Context context;
  cv::Mat3b const wanted = read_scan_set(in("set"), context).views[2].image.color;
  double sum = 0;
  for (int y = 0; y < 40; ++y)
    for (int x = 0; x < 48; ++x)
      for (int c = 0; c < 3; ++c)
        sum += std::pow((picture.at<cv::Vec4b>(y, x)[c] - double(wanted(y, x)[c])) / 255, 2) / (40 * 48 * 3);
  EXPECT_GT(-10 * std::log10(sum), 25);
}

TEST_F(Ldi, RendersFromEverywhereInTimeAndInSteps) {
  write_set("set", {0, 2, 4});
  build("set", "tree.ldi", {"--no-sums"});
  auto const render = [&](std::string const& output, std::vector<std::string> const& more) {
    std::vector<std::string> arguments = {"ldi", "render", in("tree.ldi"), "-o", in(output), "--size", "48x40"};
    arguments.insert(arguments.end(), more.begin(), more.end());
    return run(arguments);
  };
  EXPECT_EQ(render("orbit", {"--orbit", "3", "--film"})["frames"].size(), 3U);
  EXPECT_TRUE(fs::exists(in("orbit/film.png")));
  EXPECT_EQ(render("halfway", {"--halfway", "--samples", "2"})["frames"].size(), 2U);
  EXPECT_EQ(read_image(in("halfway/000-002.png")).size(), cv::Size(48, 40));
  Json const pose = {1, 0, 0, 0.1, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1};
  Json const camera = Camera::perspective(48, 40, 45, 45, 23.5, 19.5).to_json();
  write_json(in("path.json"),
             {{"format", 1}, {"keyframes", Json::array({{{"camera", camera}, {"object_from_camera", pose}}})}});
  Json const open = render("open", {"--path", in("path.json"), "--gaps", "background"})["frames"][0];
  Json const filled = render("filled", {"--path", in("path.json")})["frames"][0];
  EXPECT_GE(open["uncovered"], filled["uncovered"]);
  EXPECT_GT(open["splats"], render("coarse", {"--path", in("path.json"), "--stamp", "4"})["frames"][0]["splats"]);
  Json const quick = render("quick", {"--path", in("path.json"), "--milliseconds", "0.0001"})["frames"][0];
  EXPECT_EQ(quick["complete"], false);
  EXPECT_LT(quick["cells_traversed"], open["cells_traversed"]);
}

TEST_F(Ldi, ImagesCanBeAddedLaterInAnyOrderAndOnce) {
  write_set("all", {0, 1, 2, 3});
  write_set("even", {2, 0});
  write_set("odd", {1, 3});
  build("all", "all.ldi");
  build("even", "tree.ldi");
  refused(3, {"view 000", "already"},
          {"ldi", "add", in("tree.ldi"), in("all"), "-o", in("twice.ldi"), "--images", "4"});
  EXPECT_FALSE(fs::exists(in("twice.ldi")));
  Json const added = run({"ldi", "add", in("tree.ldi"), in("odd"), "-o", in("new.ldi")});
  EXPECT_EQ(added["images"], 4);
  EXPECT_EQ(hash_file(in("new.ldi")), hash_file(in("all.ldi")));
  EXPECT_NE(hash_file(in("tree.ldi")), hash_file(in("all.ldi")));
  run({"ldi", "add", in("tree.ldi"), in("odd")});
  EXPECT_EQ(hash_file(in("tree.ldi")), hash_file(in("all.ldi")));
  build("even", "alone.ldi", {"--no-sums"});
  EXPECT_LT(fs::file_size(in("alone.ldi")), fs::file_size(in("all.ldi")));
  refused(3, {"alone.ldi", "sums"}, {"ldi", "add", in("alone.ldi"), in("odd")});
}

TEST_F(Ldi, EqualBytesForAnyNumberOfThreads) {
  write_set("set", {0, 1, 2});
  build("set", "one.ldi", {"--threads", "1"});
  build("set", "three.ldi", {"--threads", "3"});
  EXPECT_EQ(hash_file(in("one.ldi")), hash_file(in("three.ldi")));
}

TEST_F(Ldi, OptionsChangeTheTree) {
  write_set("set", {0, 1, 2, 3});
  Json const usual = build("set", "usual.ldi");
  EXPECT_EQ(build("set", "two.ldi", {"--images", "2"})["images"], 2);
  EXPECT_EQ(build("set", "held.ldi", {"--hold-out", "every:2"})["images"], 2);
  EXPECT_LT(build("set", "coarse.ldi", {"--coarseness", "2"})["pixels"], usual["pixels"]);
  EXPECT_LT(build("set", "blunt.ldi", {"--smallest-feature", "0.2"})["levels"], usual["levels"]);
  build("set", "paper.ldi", {"--normals", "facing", "--covered", "0", "--merge", "0.5"});
  LdiTree const paper = read_ldi(in("paper.ldi"));
  EXPECT_EQ(paper.options.normals, LdiOptions::Normals::facing);
  EXPECT_EQ(paper.options.covered, 0);
  EXPECT_EQ(paper.options.merge_steps, 0.5);
}

TEST_F(Ldi, AReportHasTheChartsAndFiguresOfThePaper) {
  write_set("set", {0, 1, 2, 3, 4, 5, 6, 7});
  Json const report = run({"ldi", "report", in("set"), "-o", in("page.html"), "--hold-out", "every:4", "--images",
                           "4,2", "--frames", "3", "--size", "24x20", "--resolution", "16"});
  ASSERT_EQ(report["images"].size(), 2U);
  for (Json const& one : report["images"]) {
    for (char const* const key :
         {"cells", "bytes", "input_bytes", "cells_traversed", "splats", "milliseconds", "build_seconds"})
      EXPECT_GT(one[key], 0) << key;
    EXPECT_GT(one["psnr"], 20);
    EXPECT_LT(one["uncovered"], 0.1);
    EXPECT_LE(one["uncovered"], one["gaps_left"]["uncovered"]);
    EXPECT_GT(one["warping"]["psnr_common"], 20);
    EXPECT_GT(one["warping"]["milliseconds"], 0);
    EXPECT_EQ(one["frames"]["cells_traversed"].size(), 3U);
  }
  EXPECT_EQ(report["images"][0]["images"], 2);
  EXPECT_GT(report["images"][1]["bytes"], report["images"][0]["bytes"]);
  std::string const page = read_file(in("page.html"));
  for (char const* const text : {"chart 1", "chart 2", "chart 3", "figure 7", "figures 8 to 11", "gaps filled"})
    EXPECT_THAT(page, HasSubstr(text));
  // Nothing held out: figures without comparison.
  Json const alone =
      run({"ldi", "report", in("set"), "-o", in("alone.html"), "--images", "2", "--frames", "2", "--size", "24x20"});
  EXPECT_TRUE(alone["images"][0]["psnr"].is_null());
  EXPECT_GE(alone["images"][0]["uncovered"], 0);
}

TEST_F(Ldi, TheChurchIsTracedAndPanoramasAndModelsAreTaken) {
  Json const church = run(
      {"ldi", "build", "church:150000", "-o", in("church.ldi"), "--images", "1", "--light", "painted", "--no-sums"});
  EXPECT_EQ(church["images"], 1);
  EXPECT_EQ(church["input_bytes"], 512 * 512 * 7);
  // Its path is traced too: frames are compared with what they should look like.
  Json const report = run({"ldi", "report", "church:150000", "-o", in("church.html"), "--images", "2", "--light",
                           "painted", "--frames", "2", "--size", "64x64"});
  EXPECT_GT(report["images"][0]["psnr"], 12);
  EXPECT_GT(report["images"][0]["psnr_common"], 15);
  EXPECT_THAT(read_file(in("church.html")), HasSubstr("ray traced"));
  write_json(in("nodes.json"), {{"nodes", {{{"position", {4.4, 1.6, 2.4}}}}}});
  Json const room = run({"ldi", "build", "gallery:20000", "-o", in("room.ldi"), "--light", "painted", "--nodes",
                         in("nodes.json"), "--node-size", "32"});
  EXPECT_EQ(room["images"], 6);
  EXPECT_EQ(read_ldi(in("room.ldi")).views[0].name, "000_nx");
}

TEST_F(Ldi, WhatItCannotUseIsRefusedByName) {
  write_set("set", {0, 1});
  write_set("loose", {0, 1}, false);
  refused(3, {"register"}, {"ldi", "build", in("loose"), "-o", in("t.ldi")});
  refused(3, {"nowhere"}, {"ldi", "build", in("nowhere"), "-o", in("t.ldi")});
  refused(2, {"--images 3", "2"}, {"ldi", "build", in("set"), "-o", in("t.ldi"), "--images", "3"});
  refused(2, {"resolution"}, {"ldi", "build", in("set"), "-o", in("t.ldi"), "--resolution", "300"});
  refused(2, {"--normals"}, {"ldi", "build", in("set"), "-o", in("t.ldi"), "--normals", "guessed"});
  refused(2, {"every:1"}, {"ldi", "build", in("set"), "-o", in("t.ldi"), "--hold-out", "every:1"});
  refused(2, {"church:many"}, {"ldi", "build", "church:many", "-o", in("t.ldi")});
  refused(2, {"--hold-out"}, {"ldi", "build", "church", "-o", in("t.ldi"), "--hold-out", "every:2"});
  EXPECT_FALSE(fs::exists(in("t.ldi")));
  refused(2, {"--images"}, {"ldi", "report", in("set"), "-o", in("page.html"), "--images", "2,40"});
  write_json(in("nodes.json"), {{"nodes", {{{"position", {4.4, 1.6, 2.4}}}}}});
  refused(2, {"church"},
          {"ldi", "report", "gallery:20000", "-o", in("page.html"), "--light", "painted", "--nodes", in("nodes.json")});
  refused(2, {}, {"ldi"});

  build("set", "tree.ldi");
  auto const render = [&](std::string const& tree, std::vector<std::string> const& more) {
    std::vector<std::string> arguments = {"ldi", "render", in(tree), "-o", in("pictures")};
    arguments.insert(arguments.end(), more.begin(), more.end());
    return arguments;
  };
  refused(3, {"missing.ldi"}, render("missing.ldi", {"--orbit", "1"}));
  refused(2, {"'007'"}, render("tree.ldi", {"--like", "007"}));
  refused(2, {"--size"}, render("tree.ldi", {"--orbit", "1", "--size", "0x4"}));
  refused(2, {"stamp_px"}, render("tree.ldi", {"--orbit", "1", "--stamp", "0"}));
  refused(2, {}, render("tree.ldi", {}));
  refused(2, {}, render("tree.ldi", {"--orbit", "1", "--halfway"}));
  EXPECT_FALSE(fs::exists(in("pictures")));
  std::string const bytes = read_file(in("tree.ldi"));
  for (double const share : {0.01, 0.3, 0.999}) {
    write_file(in("cut.ldi"), bytes.substr(0, std::size_t(share * double(bytes.size()))));
    refused(3, {"cut.ldi"}, render("cut.ldi", {"--orbit", "1"}));
  }
  // Of a damaged cell frames lack that cell alone: a warning, and not whole.
  {
    LdiTree const tree = read_ldi(in("tree.ldi"));
    std::string damaged = bytes;
    damaged[content_of(bytes, tree) + tree.cells.back().offset] ^= 1;
    write_file(in("damaged.ldi"), damaged);
  }
  CommandResult const part = run_scanview(render("damaged.ldi", {"--like", "000", "--report", in("part.json")}));
  EXPECT_EQ(part.exit_code, 3);
  EXPECT_THAT(part.errors, HasSubstr("damaged.ldi"));
  EXPECT_THAT(part.errors, HasSubstr("1 of "));
  EXPECT_TRUE(fs::exists(in("pictures/000.png")));
  Json const of_part = Json::parse(read_file(in("part.json")));
  EXPECT_EQ(of_part["warnings"].size(), 1U);
  EXPECT_EQ(of_part["frames"][0]["damaged_cells"], 1);
  refused(3, {"cut.ldi"}, {"info", in("cut.ldi")});
  refused(3, {"cut.ldi"}, {"ldi", "add", in("cut.ldi"), in("set")});
  write_file(in("other.ldi"), "ply\nformat ascii 1.0\n");
  refused(3, {"other.ldi"}, render("other.ldi", {"--orbit", "1"}));
}

}  // namespace
}  // namespace scanview
