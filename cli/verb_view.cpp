#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <iostream>
#include <memory>
#include <numbers>

#include "acquire/scan_set_file.h"
#include "base/error.h"
#include "cli/stages.h"
#include "viewer/window/view_window.h"

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

void view(fs::path const& folder, WindowOptions options, Session& session) {
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
  if (result.times) {
    session.report["frame_milliseconds"] = result.times->frame_milliseconds;
    session.report["panel_milliseconds"] = result.times->panel_milliseconds;
    session.report["fps_median"] = result.times->frames_per_second;
    std::cout << fmt::format(
        "frame {:.2f} ms, panel {:.2f} ms, {:.1f} frames/s (medians of {} frames, picture {} x {})\n",
        result.times->frame_milliseconds, result.times->panel_milliseconds, result.times->frames_per_second,
        options.frames, result.times->width, result.times->height);
  }
  if (!result.failures.empty()) session.exit_code = static_cast<int>(ErrorCode::partial);
}

}  // namespace

void add_view(CLI::App& app, Session& session) {
  struct Arguments {
    fs::path set;
    WindowOptions options;
    std::string back_end = "auto";
  };
  auto arguments = std::make_shared<Arguments>();
  CLI::App* verb = app.add_subcommand("view", "A window to turn the object in");
  verb->add_option("set", arguments->set, "The scan set, meshed")->required();
  verb->add_option("--width", arguments->options.width, "Of the window, in pixels");
  verb->add_option("--height", arguments->options.height, "Of the window, in pixels");
  verb->add_option("--pictures", arguments->options.pictures, "Folder where P saves pictures and K a camera path");
  verb->add_option("--back-end", arguments->back_end, "What draws: cpu, gl, or auto (OpenGL on a graphics card)")
      ->check(CLI::IsMember({"auto", "cpu", "gl"}));
  verb->add_option("--frames", arguments->options.frames,
                   "Draw a full turn of so many frames as fast as it goes, print their times, and quit")
      ->check(CLI::Range(1, 100000));
  verb->footer(window_help());
  verb->callback([arguments, &session] {
    session.verb = "view";
    if (arguments->back_end != "auto")
      arguments->options.back_end = arguments->back_end == "cpu" ? BackEnd::cpu : BackEnd::gl;
    session.work = [arguments, &session] { view(arguments->set, arguments->options, session); };
  });
}

}  // namespace scanview
