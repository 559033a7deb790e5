// From a synthetic scan to pictures: what the stages must reach together, and the sets that are hard.
#include <gtest/gtest.h>

#include <sstream>

#include "acquire/scan_set_file.h"
#include "base/files.h"
#include "base/image_file.h"
#include "tests/cli/command.h"
#include "tests/temporary_folder.h"

namespace scanview {
namespace {

namespace fs = std::filesystem;

class Pipeline : public VerbTest {};

TEST_F(Pipeline, ASyntheticScanComesBack) {
  run({"synth", "statuette", "--pattern", "range", "-o", in("scan"), "--views", "24", "--noise", "0.001",
       "--color-noise", "1", "--disturb", "3:2"});
  Json const all = run({"run", in("scan"), "-o", in("set"), "--hold-out", "every:2"});
  for (char const* verb : {"import", "register", "mesh", "render", "evaluate"})
    EXPECT_TRUE(all["stages"].contains(verb)) << verb;

  Json const registered = run({"register", in("set"), "--reference", in("scan/truth/scanset.json")});
  Context context;
  double const size = 2 * read_scan_set(in("set"), context).radius();
  for (auto const& pair : registered["pairs"])
    EXPECT_LE(pair["median_distance"].get<double>(), registered["worst_pair"]["median_distance"].get<double>());
  EXPECT_GT(registered["poses"]["000"]["seen_by"].get<double>(), 0.5);
  EXPECT_GT(registered["error"]["p95"].get<double>(), registered["error"]["rms"].get<double>());
  EXPECT_LE(registered["reference"]["median_deg"].get<double>(), 0.05);
  EXPECT_LE(registered["reference"]["median_length"].get<double>(), 1e-3 * size);

  Json const evaluated = all["stages"]["evaluate"]["renderers"];
  EXPECT_GE(evaluated["view_based"]["psnr_common"].get<double>(), 28);
  EXPECT_GE(evaluated["source_views"]["psnr_common_min"].get<double>(), 35);

  std::string const report = read_file(in("set/report.html"));
  for (char const* part :
       {"id=\"import\"", "id=\"register\"", "id=\"mesh\"", "id=\"render\"", "id=\"evaluate\"", "data:image/"})
    EXPECT_NE(report.find(part), std::string::npos) << part;
  EXPECT_EQ(report.find("src=\"http"), std::string::npos);
}

TEST_F(Pipeline, PicturesHaveAlphaAndDepth) {
  run({"synth", "statuette", "--pattern", "range", "-o", in("set"), "--views", "6", "--size", "160x120"});
  run({"mesh", in("set")});
  Json const report = run({"render", in("set"), "--orbit", "3", "--size", "90x70", "-o", in("orbit")});
  ASSERT_EQ(report["frames"].size(), 3U);
  cv::Mat const picture = read_image(in("orbit/" + report["frames"][1]["file"].get<std::string>()));
  EXPECT_EQ(picture.size(), cv::Size(90, 70));
  EXPECT_EQ(picture.channels(), 4);
  cv::Mat4b const pixels = picture;
  EXPECT_EQ(pixels(0, 0)[3], 0);
  EXPECT_EQ(pixels(35, 45)[3], 255);
  cv::Mat1f const depth = read_depth_exr(in("orbit/001.exr"));
  EXPECT_TRUE(std::isnan(depth(0, 0)));
  EXPECT_GT(depth(35, 45), 0);
  run({"render", in("set"), "--like", "002", "-o", in("like")});
  run({"render", in("set"), "--halfway", "-o", in("halfway")});
}

TEST_F(Pipeline, FewViewsAndCirclesGiveDefinedPictures) {
  struct Case {
    char const* views;
    char const* layout;
  };
  for (Case const& one : {Case{"1", "sphere"}, Case{"2", "sphere"}, Case{"3", "circle"}, Case{"8", "circle"}}) {
    std::string const set = in(std::string(one.layout) + one.views);
    run({"synth", "statuette", "--pattern", "range", "-o", set, "--views", one.views, "--layout", one.layout, "--size",
         "120x90"});
    // Two opposite views share no surface: exit code 6 says so, and their pictures are there all the same.
    CommandResult const result = run_scanview({"run", set, "--quiet"});
    EXPECT_TRUE(result.exit_code == 0 || result.exit_code == 6) << result.errors;
    EXPECT_TRUE(fs::exists(fs::path(set) / "evaluate.json")) << one.views << " on a " << one.layout;
    run({"render", set, "--orbit", "4", "--size", "80x60", "-o", set + "_orbit"});
  }
}

TEST_F(Pipeline, ExportsComeBack) {
  run({"synth", "statuette", "--pattern", "range", "-o", in("set"), "--views", "3", "--size", "160x120"});
  run({"mesh", in("set")});
  for (char const* kind : {"colmap", "nerfstudio"}) {
    run({"export", in("set"), "--to", kind, "-o", in(kind)});
    Json const report = run({"import", kind, in(kind), "-o", in(std::string(kind) + "_set")});
    EXPECT_EQ(report["views"], 3);
  }
  run({"export", in("set"), "--to", "ply", "-o", in("points.ply")});
  run({"export", in("set"), "--to", "glb", "-o", in("views.glb")});
  EXPECT_EQ(run({"info", in("views.glb")})["kind"], "binary glTF");
  EXPECT_EQ(run({"info", in("points.ply")})["kind"], "PLY");
  for (char const* name :
       {"set", "set/scanset.json", "set/mesh.json", "set/views/000/range.exr", "set/views/000/color.png",
        "set/views/000/mesh.ply", "set/views/000/mesh.glb", "nerfstudio/transforms.json", "colmap"})
    EXPECT_TRUE(run({"info", in(name)}).contains("kind")) << name;
}

TEST_F(Pipeline, MeshesByTheirOptions) {
  run({"synth", "statuette", "--pattern", "range", "-o", in("set"), "--views", "2", "--size", "160x120", "--noise",
       "0.001"});
  Json const automatic = run({"mesh", in("set"), "--levels", "3"});
  Json const& view = automatic["views"][0];
  ASSERT_EQ(view["levels"].size(), 2u);
  EXPECT_LT(view["levels"][0]["triangles"], view["triangles"]);
  EXPECT_LE(view["levels"][1]["triangles"], view["levels"][0]["triangles"]);
  EXPECT_EQ(view["levels"][1]["tolerance"], 4 * automatic["tolerance"].get<double>());
  for (char const* key : {"rms", "p95", "max", "uncovered"}) EXPECT_TRUE(view[key].is_number()) << key;
  EXPECT_TRUE(fs::exists(in("set/views/000/mesh.2.ply")));
  EXPECT_GT(read_json(in("set/scanset.json"))["error_budget"]["approximation"]["rms"].get<double>(), 0);

  Json const few = run({"mesh", in("set"), "--triangles", "600", "--placement", "probing", "--fit", "depths"});
  EXPECT_LE(few["views"][1]["triangles"], 600);
  EXPECT_FALSE(fs::exists(in("set/views/000/mesh.1.ply"))) << "levels of an earlier run";

  write_file(in("marks.json"), R"({"001": {"remove": [[[-1, -1], [200, -1], [200, 60], [-1, 60]]]}})");
  Json const marked = run({"mesh", in("set"), "--marks", in("marks.json")});
  EXPECT_EQ(marked["views"][0]["triangles"], view["triangles"]);
  EXPECT_LT(marked["views"][1]["triangles"], 0.8 * automatic["views"][1]["triangles"].get<double>());
  write_file(in("marks.json"), R"({"007": {}})");
  CommandResult const unknown = run_scanview({"mesh", in("set"), "--marks", in("marks.json")});
  EXPECT_EQ(unknown.exit_code, 3);
  EXPECT_NE(unknown.errors.find("007"), std::string::npos);

  run({"export", in("set"), "--to", "obj", "-o", in("obj")});
  for (char const* name : {"000.obj", "000.mtl", "000.jpg", "001.obj"})
    EXPECT_TRUE(fs::exists(fs::path(in("obj")) / name)) << name;
}

TEST_F(Pipeline, PosesComeBack) {
  run({"synth", "statuette", "--pattern", "range", "-o", in("set"), "--views", "12", "--size", "120x90"});
  run({"mesh", in("set")});
  for (char const* kind : {"conf", "aln", "tum", "redwood"}) {
    std::string const poses = in(std::string("poses.") + kind);
    run({"export", in("set"), "--to", kind, "-o", poses});
    Json const reference = run({"register", in("set"), "--init", poses, "--no-refine", "--reference",
                                in("set/truth/scanset.json")})["reference"];
    EXPECT_LE(reference["pose_max_deg"].get<double>(), 1e-5) << kind;
    EXPECT_LE(reference["pose_max_length"].get<double>(), 1e-9) << kind;
  }
  // What the alignment names is there: MeshLab opens it.
  std::istringstream aln(read_file(in("poses.aln")));
  std::string count, mesh;
  std::getline(aln, count);
  std::getline(aln, mesh);
  EXPECT_TRUE(fs::exists(in(mesh))) << mesh;
  for (char const* kind : {"colmap", "nerfstudio"}) run({"export", in("set"), "--to", kind, "-o", in(kind)});
  for (char const* file : {"colmap", "nerfstudio", "nerfstudio/transforms.json", "colmap/sparse/images.txt"}) {
    Json const report = run({"register", in("set"), "--no-refine", "--reference", in(file)});
    EXPECT_LE(report["reference"]["max_deg"].get<double>(), 1e-5) << file;
  }
}

}  // namespace
}  // namespace scanview
