#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <chrono>
#include <iostream>
#include <map>
#include <memory>
#include <tuple>

#include "base/error.h"
#include "base/median.h"
#include "cli/frame_cameras.h"
#include "cli/ldi_figures.h"
#include "cli/ldi_report.h"
#include "cli/ldi_source.h"
#include "cli/session.h"
#include "viewer/blend/supersampling.h"
#include "viewer/layered/ldi_file.h"

namespace scanview {
namespace fs = std::filesystem;
namespace {

struct LdiArguments {
  std::string scene;
  NodeSourceOptions of_scene;
  int images = 0;  ///< 0: as many as are usual
  fs::path tree, output;
  bool no_sums = false;
  LdiReportOptions options;
  FrameCameras cameras;
  std::string size;  ///< of the report's frames
  int samples = 1;
  double milliseconds = 0;  ///< 0: complete pictures
  bool film = false;
};

std::vector<View> reference_views(LdiSource& source, int images, Context& context) {
  if (images > source.count())
    throw Error(ErrorCode::usage, {}, fmt::format("--images {}: there are {}", images, source.count()));
  return source.views(images > 0 ? images : source.usual_count(), context);
}

/// Writes a tree and tells of it.
void keep_tree(LdiTree const& tree, LdiBuilder const& builder, fs::path const& path, LdiKeep keep, double seconds,
               Session& session) {
  write_ldi(path, tree, builder, keep);
  session.report = ldi_size(tree);
  session.report["build_seconds"] = seconds;
  std::size_t sums = 0;
  if (keep == LdiKeep::sums)
    for (auto const& [key, cell] : builder.sums()) sums += cell->count();
  session.report["sums"] = sums;
  session.report["file_bytes"] = fs::file_size(path);
  session.report["images"] = tree.views.size();
  std::cout << fmt::format("{} images, {} cells on {} levels, {} pixels, {:.1f} MB ({:.2f} of the images'); {:.2f} s\n",
                           tree.views.size(), tree.cells.size(), session.report["levels"].get<std::size_t>(),
                           tree.pixel_count(), double(tree.bytes()) / 1e6,
                           double(tree.bytes()) / double(tree.input_bytes), seconds);
}

void build_tree(LdiArguments const& arguments, Session& session) {
  Context& context = session.context;
  arguments.options.build.validate();
  auto const source = open_ldi_source(arguments.scene, arguments.of_scene, context);
  LdiOptions options = arguments.options.build;
  options.depth_error = source->depth_error();
  BuiltLdi const built =
      build_ldi(reference_views(*source, arguments.images, context), source->unit(), options, context);
  keep_tree(*built.tree, built.builder, arguments.output, arguments.no_sums ? LdiKeep::tree_alone : LdiKeep::sums,
            built.seconds, session);
}

void add_to_tree(LdiArguments const& arguments, Session& session) {
  Context& context = session.context;
  LdiTree const before = read_ldi(arguments.tree);
  LdiBuilder builder = read_ldi_builder(arguments.tree);
  auto const source = open_ldi_source(arguments.scene, arguments.of_scene, context);
  if (source->unit() != before.unit)
    throw Error(ErrorCode::bad_input, arguments.scene,
                fmt::format("its unit is {}, the tree's {}", to_string(source->unit()), to_string(before.unit)));
  auto const views = reference_views(*source, arguments.images, context);
  for (View const& view : views)
    for (View const& there : before.views)
      if (view.name == there.name && view.object_from_camera &&
          view.object_from_camera->matrix() == there.object_from_camera->matrix())
        throw Error(ErrorCode::bad_input, arguments.scene,
                    fmt::format("view {} is in the tree already: nothing was added", view.name));
  auto const start = std::chrono::steady_clock::now();
  builder.add(views, context);
  LdiTree const tree = builder.build(before.unit, context);
  double const seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
  keep_tree(tree, builder, arguments.output.empty() ? arguments.tree : arguments.output, LdiKeep::sums, seconds,
            session);
}

void draw_tree(LdiArguments const& arguments, Session& session) {
  Context& context = session.context;
  arguments.options.draw.validate();
  auto const tree = std::make_shared<LdiTree const>(read_ldi(arguments.tree));
  ScanSet set;
  set.unit = tree->unit;
  set.center = tree->center;
  set.views = tree->views;
  auto const path = frame_cameras(arguments.cameras, set, tree->radius);
  constexpr int kFilmMilliseconds = 80;
  FrameFolder folder(arguments.output, arguments.film ? FrameFolder::Film::film : FrameFolder::Film::none,
                     kFilmMilliseconds);
  LdiRenderer renderer(tree, arguments.options.draw, context.threads);
  std::vector<double> times;
  std::map<std::int32_t, std::string> damaged;
  session.report["frames"] = Json::array();
  for (PathCamera const& from : path) {
    context.check_cancelled();
    Camera const fine =
        from.camera.resized(arguments.samples * from.camera.width(), arguments.samples * from.camera.height());
    auto const start = std::chrono::steady_clock::now();
    Frame const drawn = arguments.milliseconds > 0
                            ? renderer.render_within(arguments.milliseconds, fine, from.object_from_camera)
                            : renderer.render(fine, from.object_from_camera);
    times.push_back(std::chrono::duration<double, std::milli>(std::chrono::steady_clock::now() - start).count());
    session.report["frames"].push_back({{"file", folder.write(from.name, box_filtered(drawn, arguments.samples).color)},
                                        {"milliseconds", times.back()},
                                        {"stages", renderer.stages()},
                                        {"cells_traversed", renderer.traversed().size()},
                                        {"splats", renderer.splats()},
                                        {"damaged_cells", renderer.damaged().size()},
                                        {"uncovered", double(renderer.uncovered()) / double(drawn.color.total())},
                                        {"complete", renderer.is_complete()}});
    damaged.insert(renderer.damaged().begin(), renderer.damaged().end());
    context.progress("render", times.size(), path.size());
  }
  folder.finish();
  if (!damaged.empty()) {
    context.warn(fmt::format("{}; {} of {} cells are left out of the frames", damaged.begin()->second, damaged.size(),
                             tree->cells.size()));
    session.exit_code = static_cast<int>(ErrorCode::bad_input);
  }
  session.report["fps_median"] = times.empty() ? 0 : 1e3 / median(times);
  std::cout << fmt::format("{} frames, {:.2f} ms each\n", path.size(), times.empty() ? 0 : median(times));
}

void write_ldi_page(LdiArguments const& arguments, Session& session) {
  Context& context = session.context;
  LdiReportOptions options = arguments.options;
  options.build.validate();
  options.draw.validate();
  if (!arguments.size.empty()) std::tie(options.width, options.height) = parse_picture_size(arguments.size);
  auto const source = open_ldi_source(arguments.scene, arguments.of_scene, context);
  options.build.depth_error = source->depth_error();
  LdiReport const report = ldi_report(*source, options, context);
  write_file(arguments.output, html_page("LDI trees of " + arguments.scene, "", {report.section}));
  session.report.update(report.figures);
  std::cout << report.text;
}

void add_source_options(CLI::App* part, LdiArguments& arguments) {
  part->add_option("set", arguments.scene,
                   "A registered scan set, \"church\" (ray traced), a model, or a folder of panoramas (of both, each "
                   "side of each node is an image)")
      ->required();
  part->add_option("--hold-out", arguments.of_scene.hold_out, "Of a set: every:N, views that are left out");
  part->add_option("--light", arguments.of_scene.light,
                   "Of a model and the church: baked (shadows and diffuse light), painted (as it is)")
      ->check(CLI::IsMember({"baked", "painted"}));
  part->add_option("--nodes", arguments.of_scene.nodes, "Of a model: auto, or a JSON file with positions");
  part->add_option("--node-size", arguments.of_scene.size, "Of a side of a node, pixels")->check(CLI::Range(8, 8192));
}

void add_number_of_images(CLI::App* part, LdiArguments& arguments) {
  part->add_option("--images", arguments.images,
                   "So many: of the church the first (1 to 36; default 12), of a set evenly spread ones (default all)")
      ->check(CLI::Range(1, 1'000'000));
}

void add_tree_options(CLI::App* part, LdiOptions& options) {
  part->add_option("--resolution", options.resolution, "Grid points a side of a cell's LDI, 1 to 256");
  part->add_option("--coarseness", options.coarseness,
                   "Grid steps in pixels of the images: 1 loses nothing, 0.25 to 4");
  part->add_option("--smallest-feature", options.smallest_feature,
                   "Grids are no finer than this, units (default: as fine as the images)");
  static std::map<std::string, LdiOptions::Normals> const kNormals = {{"measured", LdiOptions::Normals::measured},
                                                                      {"facing", LdiOptions::Normals::facing}};
  part->add_option("--normals", options.normals, "Of surfaces: measured, or all facing the camera (the paper's)")
      ->transform(CLI::CheckedTransformer(kNormals));
  part->add_option(
      "--covered", options.covered,
      "Where finer cells cover less of a pixel, its own images fill what these leave open: 0 (the paper's) to 1");
  part->add_option("--merge", options.merge_steps, "Depths of one surface differ by less, in grid steps: 0 to 1");
}

void add_splat_options(CLI::App* part, LdiRenderOptions& options) {
  part->add_option("--stamp", options.stamp_px, "Grid steps are at most so large on the screen, pixels");
  static std::map<std::string, LdiRenderOptions::Gaps> const kGaps = {
      {"filled", LdiRenderOptions::Gaps::filled}, {"background", LdiRenderOptions::Gaps::background}};
  part->add_option("--gaps", options.gaps, "filled (from coarser cells), background (transparent)")
      ->transform(CLI::CheckedTransformer(kGaps));
  static std::map<std::string, LdiRenderOptions::Splats> const kSplats = {
      {"blended", LdiRenderOptions::Splats::blended}, {"squares", LdiRenderOptions::Splats::squares}};
  part->add_option("--splats", options.splats, "blended, or squares: the nearest wins, faster and rougher")
      ->transform(CLI::CheckedTransformer(kSplats));
}

}  // namespace

void add_ldi(CLI::App& app, Session& session) {
  auto arguments = std::make_shared<LdiArguments>();
  CLI::App* verb = app.add_subcommand("ldi", "Many images with depth as one tree of layered depth images");
  verb->require_subcommand(1);
  auto const set_work = [&session, arguments](CLI::App* part, auto work) {
    part->callback([&session, arguments, work] {
      session.verb = "ldi";
      session.work = [&session, arguments, work] { work(*arguments, session); };
    });
  };

  CLI::App* part = verb->add_subcommand("build", "Makes a tree of a set's images");
  add_source_options(part, *arguments);
  add_number_of_images(part, *arguments);
  part->add_option("-o,--output", arguments->output, "The tree (.ldi)")->required();
  add_tree_options(part, arguments->options.build);
  part->add_flag("--no-sums", arguments->no_sums, "A smaller file, to which nothing can be added");
  set_work(part, build_tree);

  part = verb->add_subcommand("add", "Adds more images: the tree is the one of all of them at once");
  part->add_option("tree", arguments->tree, "The tree (.ldi)")->required();
  add_source_options(part, *arguments);
  add_number_of_images(part, *arguments);
  part->add_option("-o,--output", arguments->output, "The new tree (default: in place of the old one)");
  set_work(part, add_to_tree);

  part = verb->add_subcommand("render", "Pictures (PNG with alpha) from anywhere");
  part->add_option("tree", arguments->tree, "The tree (.ldi)")->required();
  part->add_option("-o,--output", arguments->output, "Folder of the pictures")->required();
  add_camera_options(part, arguments->cameras);
  add_splat_options(part, arguments->options.draw);
  part->add_option("--samples", arguments->samples, "A pixel, each way")->check(CLI::Range(1, 8));
  part->add_option("--milliseconds", arguments->milliseconds,
                   "A picture may take: coarse ones are refined as long as there is time")
      ->check(CLI::PositiveNumber);
  part->add_flag("--film", arguments->film, "Also all pictures as one animated PNG, film.png");
  set_work(part, draw_tree);

  part = verb->add_subcommand("report", "The paper's charts 1 to 3 and figures 7 to 11, as a page");
  add_source_options(part, *arguments);
  part->add_option("-o,--output", arguments->output, "The page (HTML)")->required();
  part->add_option("--images", arguments->options.images, "Numbers of images (default: 2,4,8,12,24,36 where there are)")
      ->delimiter(',');
  part->add_option("--frames", arguments->options.frames, "Of the path")->check(CLI::Range(2, 100000));
  part->add_option("--size", arguments->size, "Of a frame, WIDTHxHEIGHT (default: the images')");
  add_tree_options(part, arguments->options.build);
  add_splat_options(part, arguments->options.draw);
  set_work(part, write_ldi_page);
}

}  // namespace scanview
