#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <chrono>
#include <iostream>
#include <map>
#include <memory>

#include "acquire/scan_set_file.h"
#include "base/error.h"
#include "base/median.h"
#include "cli/frame_cameras.h"
#include "cli/session.h"
#include "cli/walkthrough_build.h"
#include "cli/walkthrough_report.h"
#include "viewer/blend/supersampling.h"
#include "viewer/walkthrough/node_cache.h"
#include "viewer/walkthrough/walk_path.h"
#include "viewer/walkthrough/walkthrough_renderer.h"

namespace scanview {
namespace fs = std::filesystem;
namespace {

struct WalkthroughArguments {
  std::string scene;
  fs::path folder, output, path;
  NodeSourceOptions of_scene;
  WalkthroughBuildOptions build;
  WalkthroughOptions draw;
  double radius = 0;
  std::string gaps = "background";
  std::vector<int> size = {640, 480}, between;
  std::size_t frames = 250;
  int samples = 1, megabytes = 1024;
  double angle = 90, turn = 60;
  bool film = false;
};

void write_nodes(WalkthroughArguments const& arguments, Session& session) {
  Context& context = session.context;
  WalkthroughBuildOptions options = arguments.build;
  options.mesh.walking_radius = 1;
  options.mesh.validate();
  options.mesh.walking_radius = arguments.radius;
  auto const scene = open_node_source(arguments.scene, arguments.of_scene, Places::chosen, context);
  session.report = build_walkthrough(*scene, arguments.output, options, context);
  std::cout << fmt::format("{} nodes, {} triangles, walking radius {:.4g} {}; {:.2f} s a node after {:.2f} s capture\n",
                           session.report["nodes"].size(), session.report["triangles"].get<std::size_t>(),
                           session.report["walking_radius"].get<double>(), to_string(scene->unit()),
                           session.report["build_seconds"].get<double>(),
                           session.report["capture_seconds"].get<double>());
}

std::shared_ptr<NodeLibrary> open_nodes(WalkthroughArguments const& arguments) {
  NodeCacheOptions cache;
  cache.bytes = std::size_t(arguments.megabytes) << 20;
  cache.quality = arguments.draw.quality;
  return open_node_library(arguments.folder, cache);
}

std::vector<PathCamera> walk(WalkthroughArguments const& arguments, WalkthroughManifest const& manifest) {
  Camera const camera = walking_camera(arguments.size[0], arguments.size[1], arguments.angle);
  if (!arguments.path.empty()) return read_walk_path(arguments.path, arguments.size[0], arguments.size[1]);
  if (arguments.between.empty()) {
    std::vector<Eigen::Vector3d> positions;
    for (auto const& node : manifest.nodes) positions.push_back(node.position);
    return walk_through(tour(positions), manifest.up, arguments.frames, camera);
  }
  for (int const node : arguments.between)
    if (node < 0 || std::size_t(node) >= manifest.nodes.size())
      throw Error(ErrorCode::usage, {},
                  fmt::format("--between {}: there are nodes 0 to {}", node, manifest.nodes.size() - 1));
  Eigen::Vector3d const from = manifest.nodes[std::size_t(arguments.between[0])].position,
                        to = manifest.nodes[std::size_t(arguments.between[1])].position;
  Eigen::Vector3d heading = to - from - (to - from).dot(manifest.up) * manifest.up;
  if (!(heading.norm() > 0)) heading = manifest.up.unitOrthogonal();
  return straight_walk(from, to, heading.normalized(), manifest.up, arguments.turn, arguments.frames, camera);
}

void note_failures(NodeLibrary const& library, Session& session) {
  for (auto const& failure : library.failures()) session.context.warn(failure);
  if (!library.failures().empty()) session.exit_code = static_cast<int>(ErrorCode::partial);
}

void render_walk(WalkthroughArguments const& arguments, Session& session) {
  Context& context = session.context;
  auto const library = open_nodes(arguments);
  WalkthroughOptions options = arguments.draw;
  options.gaps = arguments.gaps == "interpolated" ? VisibilityGaps::interpolated : VisibilityGaps::background;
  WalkthroughRenderer renderer(library, options, context.threads);
  auto const path = walk(arguments, read_walkthrough(arguments.folder));
  constexpr int kFilmMilliseconds = 50;
  FrameFolder folder(arguments.output, arguments.film ? FrameFolder::Film::film : FrameFolder::Film::none,
                     kFilmMilliseconds);
  session.report["frames"] = Json::array();
  std::vector<double> times;
  double uncovered = 0;
  for (std::size_t i = 0; i < path.size(); ++i) {
    context.check_cancelled();
    Camera const& camera = path[i].camera;
    Camera const fine = camera.resized(arguments.samples * camera.width(), arguments.samples * camera.height());
    auto const start = std::chrono::steady_clock::now();
    Frame const drawn = renderer.render(fine, path[i].object_from_camera);
    times.push_back(std::chrono::duration<double, std::milli>(std::chrono::steady_clock::now() - start).count());
    double const share = double(renderer.uncovered()) / double(drawn.color.total());
    uncovered += share / double(path.size());
    std::string const file = folder.write(path[i].name, box_filtered(drawn, arguments.samples).color);
    session.report["frames"].push_back({{"file", file},
                                        {"milliseconds", times.back()},
                                        {"stages", renderer.stages()},
                                        {"nodes", renderer.used().size()},
                                        {"uncovered", share}});
    context.progress("render", i + 1, path.size());
  }
  folder.finish();
  note_failures(*library, session);
  session.report["uncovered"] = uncovered;
  session.report["fps_median"] = times.empty() ? 0 : 1e3 / median(times);
  std::cout << fmt::format("{} frames, {:.2f} ms each, {:.4f} % uncovered\n", path.size(), median(times),
                           100 * uncovered);
}

void write_walkthrough_page(WalkthroughArguments const& arguments, Session& session) {
  Context& context = session.context;
  auto const library = open_nodes(arguments);
  WalkthroughOptions options = arguments.draw;
  WalkthroughRenderer renderer(library, options, context.threads);
  auto const scene = open_node_source(arguments.scene, arguments.of_scene, Places::none, context);
  auto const references = scene->references(walk(arguments, read_walkthrough(arguments.folder)), context);
  WalkthroughReport const report = walkthrough_report(renderer, references, arguments.samples, context);
  write_file(arguments.output, html_page("Walkthrough of " + arguments.scene, "", {report.section}));
  session.report.update(report.figures);
  note_failures(*library, session);
  std::cout << report.text;
}

void add_scene_options(CLI::App* part, NodeSourceOptions& options) {
  part->add_option("--light", options.light, "Of a model: baked (shadows and diffuse light), painted (as it is)")
      ->check(CLI::IsMember({"baked", "painted"}));
  part->add_option("--winding", options.winding, "Of a model, which side is outside: automatic, keep, flip")
      ->check(CLI::IsMember({"automatic", "keep", "flip"}));
  part->add_option("--hold-out", options.hold_out, "Of a set: every:N, views that are no nodes");
}

void add_drawing_options(CLI::App* part, WalkthroughArguments& arguments) {
  part->add_option("walkthrough", arguments.folder, "The walkthrough's folder")->required();
  part->add_option("--merged", arguments.draw.merged, "Nodes that are merged, the nearest to the eye");
  part->add_option("--filling", arguments.draw.filling, "Further nodes that fill what these do not show");
  part->add_option("--depth-tolerance", arguments.draw.depth_tolerance,
                   "Samples of one surface differ by no more, as a share of their depth");
  part->add_option("--parallax-tolerance", arguments.draw.parallax_tolerance_px,
                   "and in pixels of parallax at the walking radius");
  part->add_option("--size", arguments.size, "Of a frame: width and height in pixels")->expected(2);
  part->add_option("--angle", arguments.angle, "Across a frame's width, degrees")->check(CLI::Range(1.0, 170.0));
  part->add_option("--samples", arguments.samples, "A pixel, each way")->check(CLI::Range(1, 8));
  part->add_option("--frames", arguments.frames, "Of the walk")->check(CLI::Range(1, 100000));
  part->add_option("--path", arguments.path, "Cameras of a path file, with straight ways between them");
  part->add_option("--between", arguments.between,
                   "Straight from one node to another (numbers), instead of through all")
      ->expected(2);
  part->add_option("--turn", arguments.turn, "On the way between two nodes, degrees");
  part->add_option("--memory", arguments.megabytes, "For nodes, megabytes")->check(CLI::Range(1, 1 << 20));
  static std::map<std::string, NodeQuality> const kQualities = {
      {"flat", NodeQuality::flat}, {"smooth", NodeQuality::smooth}, {"density", NodeQuality::density}};
  part->add_option("--quality", arguments.draw.quality, "Which sample is better: flat, smooth (the paper's), density")
      ->transform(CLI::CheckedTransformer(kQualities));
  static std::map<std::string, WalkthroughOptions::Silhouettes> const kSilhouettes = {
      {"fade", WalkthroughOptions::Silhouettes::fade}, {"keep", WalkthroughOptions::Silhouettes::keep}};
  part->add_option("--silhouettes", arguments.draw.silhouettes, "Whether samples near them count less: fade, keep")
      ->transform(CLI::CheckedTransformer(kSilhouettes));
}

void add_building_options(CLI::App* part, WalkthroughArguments& arguments) {
  NodeMeshOptions& mesh = arguments.build.mesh;
  part->add_option("-o,--output", arguments.output, "The walkthrough's folder")->required();
  part->add_option("--nodes", arguments.of_scene.nodes, "Of a model: auto, or a JSON file with positions");
  part->add_option("--size", arguments.of_scene.size, "Of a side of a node, pixels")->check(CLI::Range(8, 8192));
  part->add_option("--triangles", mesh.max_triangles, "A node at most; 0: as many as --parallax needs");
  part->add_option("--parallax", mesh.parallax_px, "No pixel is off by more within the walking radius");
  part->add_option("--radius", arguments.radius,
                   "Walking radius, units (default: half of the median distance of neighbouring nodes)");
  part->add_option("--levels", arguments.build.levels, "Of detail, for nodes far from the eye")
      ->check(CLI::Range(1, 8));
  part->add_option("--eye-height", arguments.of_scene.eye_height, "Above the floor, for --nodes auto");
  part->add_option("--walk", arguments.of_scene.walk, "Corners of the box where eyes are, for --nodes auto")
      ->expected(6);
  part->add_option("--gap", arguments.of_scene.greatest_gap, "Share of what an eye sees that may be missing, for auto");
  part->add_option("--clearance", arguments.of_scene.clearance, "Of eyes from surfaces, units, for auto");
  static std::map<std::string, NodeMeshOptions::Placement> const kPlacements = {
      {"insertion", NodeMeshOptions::Placement::insertion}, {"probing", NodeMeshOptions::Placement::probing}};
  part->add_option("--placement", mesh.placement, "Of vertices: insertion, probing (the paper's)")
      ->transform(CLI::CheckedTransformer(kPlacements));
  static std::map<std::string, NodeMeshOptions::Silhouettes> const kSteps = {
      {"constrained", NodeMeshOptions::Silhouettes::constrained},
      {"torn", NodeMeshOptions::Silhouettes::torn},
      {"skins", NodeMeshOptions::Silhouettes::skins}};
  part->add_option("--steps", mesh.silhouettes, "Depth steps: constrained, torn or skins (the paper's)")
      ->transform(CLI::CheckedTransformer(kSteps));
  static std::map<std::string, NodeMeshOptions::Fit> const kFits = {{"none", NodeMeshOptions::Fit::none},
                                                                    {"depths", NodeMeshOptions::Fit::depths},
                                                                    {"joint", NodeMeshOptions::Fit::joint}};
  part->add_option("--fit", mesh.fit, "After placing vertices: none, depths, joint")
      ->transform(CLI::CheckedTransformer(kFits));
}

}  // namespace

void add_walkthrough(CLI::App& app, Session& session) {
  auto arguments = std::make_shared<WalkthroughArguments>();
  CLI::App* verb = app.add_subcommand("walkthrough", "Walk through a scene of any complexity from a few nodes");
  verb->require_subcommand(1);
  auto const set_work = [&session, arguments](CLI::App* part, auto work) {
    part->callback([&session, arguments, work] {
      session.verb = "walkthrough";
      session.work = [&session, arguments, work] { work(*arguments, session); };
    });
  };
  char const* const kScene =
      "A model (PLY, OBJ, OFF, STL, glTF), \"gallery\", \"church\", a scan set, or a folder of panoramas";

  CLI::App* part = verb->add_subcommand("build", "Captures and simplifies the nodes of a scene");
  part->add_option("scene", arguments->scene, kScene)->required();
  add_scene_options(part, arguments->of_scene);
  add_building_options(part, *arguments);
  set_work(part, write_nodes);

  part = verb->add_subcommand("render", "Pictures of a walk");
  add_drawing_options(part, *arguments);
  part->add_option("-o,--output", arguments->output, "Folder of the pictures")->required();
  static std::map<std::string, MergePolicy> const kPolicies = {{"layering", MergePolicy::layering},
                                                               {"binary", MergePolicy::binary},
                                                               {"weighted", MergePolicy::weighted},
                                                               {"positional", MergePolicy::positional}};
  part->add_option("--policy", arguments->draw.policy, "layering, binary, weighted, positional")
      ->transform(CLI::CheckedTransformer(kPolicies));
  part->add_option("--gaps", arguments->gaps, "background (transparent), interpolated")
      ->check(CLI::IsMember({"background", "interpolated"}));
  part->add_flag("--film", arguments->film, "Also all pictures as one animated PNG, film.png");
  set_work(part, render_walk);

  part = verb->add_subcommand("report", "The paper's figures 23 and 24 for a scene, as a page");
  add_drawing_options(part, *arguments);
  part->add_option("--scene", arguments->scene, kScene)->required();
  add_scene_options(part, arguments->of_scene);
  part->add_option("-o,--output", arguments->output, "The page (HTML)")->required();
  set_work(part, write_walkthrough_page);
}

}  // namespace scanview
