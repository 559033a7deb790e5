#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <iostream>
#include <map>
#include <memory>
#include <numbers>
#include <optional>
#include <utility>
#include <vector>

#include "acquire/scan_set_file.h"
#include "base/error.h"
#include "cli/stages.h"
#include "viewer/layered/ldi_file.h"
#include "viewer/visibility/visibility_file.h"
#include "viewer/walkthrough/walkthrough_file.h"
#include "viewer/window/commands.h"
#include "viewer/window/model_window.h"
#include "viewer/window/tree_window.h"
#include "viewer/window/view_window.h"
#include "viewer/window/walk_window.h"

namespace scanview {
namespace fs = std::filesystem;
namespace {

/// A set that is not registered, its views side by side as if on a turntable: enough to mark points in.
std::shared_ptr<ViewLibrary> open_unregistered(fs::path const& folder, Context& context) {
  ScanSet set = read_scan_set(folder, context);
  set.center.setZero();
  for (std::size_t i = 0; i < set.views.size(); ++i) {
    ScanSet alone;
    alone.views = {set.views[i]};
    alone.views[0].object_from_camera = Eigen::Isometry3d::Identity();
    double const angle = 2 * std::numbers::pi * static_cast<double>(i) / static_cast<double>(set.views.size());
    set.views[i].object_from_camera = Eigen::Isometry3d(Eigen::AngleAxisd(angle, Eigen::Vector3d::UnitY()) *
                                                        Eigen::Translation3d(-median_center(alone)));
  }
  return std::make_shared<ViewLibrary>(set, read_view_meshes(folder, set, context));
}

void report_times(FrameTimes const& times, int frames, Session& session) {
  session.report["frame_milliseconds"] = times.frame_milliseconds;
  session.report["panel_milliseconds"] = times.panel_milliseconds;
  session.report["fps_median"] = times.frames_per_second;
  std::cout << fmt::format(
      "frame {:.2f} ms, panel {:.2f} ms, {:.1f} frames/s (medians of {} frames, picture {} x {})\n",
      times.frame_milliseconds, times.panel_milliseconds, times.frames_per_second, frames, times.width, times.height);
}

void view_set(fs::path const& folder, WindowOptions options, Session& session) {
  Context& context = session.context;
  options.validate();
  options.title = "scanview " + folder.string();
  std::shared_ptr<ViewLibrary> library;
  if (read_manifest(folder).has_poses()) {
    library = ViewLibrary::open(folder, context);
  } else {
    library = open_unregistered(folder, context);
    context.warn("the set is not registered: mark points of it, then register it with them");
    if (options.frames == 0) options.mode = WindowMode::mark;
  }
  WindowResult const result = view_window(library, folder, options, context);
  if (result.times) report_times(*result.times, options.frames, session);
  if (!result.failures.empty()) session.exit_code = static_cast<int>(ErrorCode::partial);
}

void view_model_file(fs::path const& path, fs::path const& visibility, ModelWindowOptions options, Session& session) {
  Context& context = session.context;
  options.validate();
  options.title = "scanview " + path.string();
  PolygonModel model = read_polygon_model(path);
  for (auto const& note : model.notes) context.log(note);
  std::optional<VisibilityField> field;
  if (!visibility.empty()) field = read_visibility(visibility, model);
  bool const is_culled = field.has_value();
  ModelWindowResult const result = view_model(std::move(model), std::move(field), options, context);
  if (!result.times) return;
  report_times(*result.times, options.frames, session);
  if (!is_culled) return;
  session.report["culling_rate"] = result.culling_rate;
  session.report["select_microseconds"] = result.select_microseconds;
  std::cout << fmt::format("culling rate {:.1f} %, chosen in {:.1f} us\n", 100 * result.culling_rate,
                           result.select_microseconds);
}

void view_walkthrough_folder(fs::path const& folder, WalkWindowOptions options, Session& session) {
  options.title = "scanview " + folder.string();
  WalkWindowResult const result = view_walkthrough(folder, options, session.context);
  if (!result.failures.empty()) session.exit_code = static_cast<int>(ErrorCode::partial);
  if (!result.times) return;
  report_times(*result.times, options.frames, session);
  session.report["uncovered"] = result.uncovered;
  session.report["triangles"] = result.triangles;
  std::cout << fmt::format("uncovered {:.3f} %, {:.0f} triangles a frame\n", 100 * result.uncovered, result.triangles);
}

void view_tree_file(fs::path const& path, TreeWindowOptions options, Session& session) {
  options.validate();
  options.title = "scanview " + path.string();
  auto const tree = std::make_shared<LdiTree const>(read_ldi(path));
  TreeWindowResult const result = view_ldi_tree(tree, options, session.context);
  if (!result.failures.empty()) session.exit_code = static_cast<int>(ErrorCode::bad_input);
  if (!result.times) return;
  report_times(*result.times, options.frames, session);
  session.report["cells_traversed"] = result.cells;
  session.report["splats"] = result.splats;
  session.report["uncovered"] = result.uncovered;
  std::cout << fmt::format("{:.0f} cells, {:.2f} million splats a frame, uncovered {:.3f} %\n", result.cells,
                           1e-6 * result.splats, 100 * result.uncovered);
}

/// What `view` was given, which some options are for.
enum class Viewed { set, model, walkthrough, tree };

Viewed kind_of(fs::path const& path) {
  if (fs::is_regular_file(path)) return is_ldi(path) ? Viewed::tree : Viewed::model;
  return is_walkthrough(path) ? Viewed::walkthrough : Viewed::set;
}

void refuse_given(std::vector<CLI::Option*> const& options, char const* why) {
  for (CLI::Option const* const option : options)
    if (option->count() > 0) throw Error(ErrorCode::usage, {}, option->get_name() + why);
}

}  // namespace

void add_view(CLI::App& app, Session& session) {
  struct Arguments {
    fs::path path, visibility, cameras;
    WindowOptions options;
    TreeWindowOptions of_tree;
    std::string back_end = "auto", up = "y", policy = to_string(WalkthroughOptions().policy);
  };
  static std::map<std::string, UpAxis> const kAxes = {{"x", UpAxis::x},        {"y", UpAxis::y},
                                                      {"z", UpAxis::z},        {"-x", UpAxis::minus_x},
                                                      {"-y", UpAxis::minus_y}, {"-z", UpAxis::minus_z}};
  static auto const kPolicies = [] {
    std::map<std::string, MergePolicy> policies;
    for (MergePolicy const policy : kMergePolicies) policies[to_string(policy)] = policy;
    return policies;
  }();
  auto arguments = std::make_shared<Arguments>();
  CLI::App* verb = app.add_subcommand("view", "A window to turn the object in, or to walk through a scene");
  verb->add_option(
          "path", arguments->path,
          "The scan set, meshed; or a file with a polygon model; or the folder of a walkthrough; or an LDI tree")
      ->required();
  verb->add_option("--width", arguments->options.width, "Of the window, in pixels");
  verb->add_option("--height", arguments->options.height, "Of the window, in pixels");
  verb->add_option("--pictures", arguments->options.pictures, "Folder where P saves pictures and K a camera path");
  verb->add_option("--back-end", arguments->back_end, "What draws: cpu, gl, or auto (OpenGL on a graphics card)")
      ->check(CLI::IsMember({"auto", "cpu", "gl"}));
  verb->add_option("--frames", arguments->options.frames,
                   "Draw a full turn of so many frames as fast as it goes, print their times, and quit")
      ->check(CLI::Range(1, 100000));
  std::string const group = "Of a model";
  std::vector<CLI::Option*> const of_models = {
      verb->add_option("--visibility", arguments->visibility, "What can be seen from where (visibility build)"),
      verb->add_option("--cameras", arguments->cameras, "Where C adds cameras, for visibility build --cameras"),
      verb->add_option("--up", arguments->up, "The axis that is up: x, y, z, -x, -y or -z")
          ->check(CLI::IsMember(kAxes))};
  for (CLI::Option* const option : of_models) option->group(group);
  std::vector<CLI::Option*> const of_walkthroughs = {
      verb->add_option("--policy", arguments->policy,
                       "How nodes are merged at first: layering, binary, weighted or positional")
          ->check(CLI::IsMember(kPolicies))};
  for (CLI::Option* const option : of_walkthroughs) option->group("Of a walkthrough");
  std::vector<CLI::Option*> const of_trees = {
      verb->add_option("--stamp", arguments->of_tree.rendering.stamp_px,
                       "How many pixels a sample may be wide at first, 0.25 to 64"),
      verb->add_option("--milliseconds", arguments->of_tree.milliseconds,
                       "For which a frame is refined while the eye moves; 0: always to the end")};
  for (CLI::Option* const option : of_trees) option->group("Of an LDI tree");
  verb->footer("A set:\n" + window_help() + "\n\nA model:\n" + model_window_help() + "\n\nA walkthrough:\n" +
               walk_window_help() + "\n\nAn LDI tree:\n" + tree_window_help());
  verb->callback([arguments, of_models, of_walkthroughs, of_trees, &session] {
    session.verb = "view";
    session.work = [arguments, of_models, of_walkthroughs, of_trees, &session] {
      WindowOptions& options = arguments->options;
      Viewed const viewed = kind_of(arguments->path);
      if (viewed != Viewed::model) refuse_given(of_models, " is for a polygon model");
      if (viewed != Viewed::walkthrough) refuse_given(of_walkthroughs, " is for a walkthrough");
      if (viewed != Viewed::tree) refuse_given(of_trees, " is for an LDI tree");
      if (viewed == Viewed::set) {
        if (arguments->back_end != "auto") options.back_end = arguments->back_end == "cpu" ? BackEnd::cpu : BackEnd::gl;
        view_set(arguments->path, options, session);
        return;
      }
      if (arguments->back_end == "gl")
        throw Error(ErrorCode::usage, {}, "--back-end: models, walkthroughs and LDI trees are drawn by the processor");
      if (viewed == Viewed::walkthrough) {
        WalkWindowOptions of_walkthrough;
        static_cast<BasicWindowOptions&>(of_walkthrough) = options;
        of_walkthrough.rendering.policy = kPolicies.at(arguments->policy);
        view_walkthrough_folder(arguments->path, of_walkthrough, session);
        return;
      }
      if (viewed == Viewed::tree) {
        static_cast<BasicWindowOptions&>(arguments->of_tree) = options;
        view_tree_file(arguments->path, arguments->of_tree, session);
        return;
      }
      ModelWindowOptions of_model;
      static_cast<BasicWindowOptions&>(of_model) = options;
      of_model.up = kAxes.at(arguments->up);
      of_model.cameras = arguments->cameras;
      view_model_file(arguments->path, arguments->visibility, of_model, session);
    };
  });
}

}  // namespace scanview
