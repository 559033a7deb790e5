#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <chrono>
#include <memory>

#include "acquire/scan_set_file.h"
#include "base/error.h"
#include "base/median.h"
#include "cli/frame_cameras.h"
#include "cli/stages.h"
#include "viewer/blend/composite_renderer.h"
#include "viewer/blend/supersampling.h"
#include "viewer/view_based/view_based_renderer.h"

namespace scanview {
namespace fs = std::filesystem;
namespace {

/// Another set in the same scene.
struct Companion {
  std::shared_ptr<ViewLibrary> library;
  Eigen::Isometry3d scene_from_object;
};

struct RenderArguments {
  fs::path set, output;
  FrameCameras cameras;
  bool film = false;
  std::vector<std::string> with;
  std::string back_end = "cpu";
  int supersampling = 2;
  ViewBasedOptions options;
};

/// "SET", or "SET@FILE" with a JSON list of 16 numbers: scene_from_object, row by row, the scene being the first set's
/// object coordinates.
Companion read_companion(std::string const& text, Context& context) {
  auto const at = text.rfind('@');
  Companion companion{ViewLibrary::open(text.substr(0, at), context), Eigen::Isometry3d::Identity()};
  if (at != std::string::npos) {
    fs::path const file = text.substr(at + 1);
    companion.scene_from_object = pose_from_json(read_json(file), file, "scene_from_object");
  }
  return companion;
}

void render(RenderArguments const& arguments, Session& session) {
  Context& context = session.context;
  auto const library = ViewLibrary::open(arguments.set, context);
  auto const path = frame_cameras(arguments.cameras, library->set(), library->radius());
  auto const gl = arguments.back_end == "gl" ? make_offscreen_context() : nullptr;
  auto const make = [&](std::shared_ptr<ViewLibrary> const& of) {
    return gl ? make_gl_renderer(*gl, of, arguments.options)
              : make_cpu_renderer(of, arguments.options, context.threads);
  };
  auto first = make(library);
  ViewBasedRenderer const& timed = *first;
  std::vector<CompositeRenderer::Part> parts;
  parts.push_back({std::move(first), Eigen::Isometry3d::Identity()});
  std::vector<std::shared_ptr<ViewLibrary>> libraries{library};
  for (auto const& text : arguments.with) {
    Companion const companion = read_companion(text, context);
    libraries.push_back(companion.library);
    parts.push_back({make(companion.library), companion.scene_from_object});
  }
  CompositeRenderer scene(std::move(parts));
  SupersamplingRenderer smooth(scene, arguments.supersampling);
  constexpr int kFilmMilliseconds = 80;
  FrameFolder folder(arguments.output, arguments.film ? FrameFolder::Film::film : FrameFolder::Film::none,
                     kFilmMilliseconds);

  session.report["frames"] = Json::array();
  session.report["back_end"] = arguments.back_end;
  std::vector<double> times;
  for (std::size_t i = 0; i < path.size(); ++i) {
    context.check_cancelled();
    auto const start = std::chrono::steady_clock::now();
    Frame const frame = smooth.render(path[i].camera, path[i].object_from_camera);
    times.push_back(1e3 * std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count());
    std::string const file = folder.write(path[i].name, frame.color);
    write_depth_exr(arguments.output / (path[i].name + ".exr"), frame.depth);
    session.report["frames"].push_back({{"file", file}, {"milliseconds", times.back()}, {"stages", timed.stages()}});
    context.progress("render", i + 1, path.size());
  }
  folder.finish();
  for (auto const& one : libraries) {
    for (auto const& failure : one->failures()) context.warn(failure);
    if (!one->failures().empty()) session.exit_code = static_cast<int>(ErrorCode::partial);
  }
  session.report["fps_median"] = times.empty() ? 0 : 1e3 / median(times);
}

}  // namespace

void add_render(CLI::App& app, Session& session) {
  auto arguments = std::make_shared<RenderArguments>();
  CLI::App* verb =
      app.add_subcommand("render", "Pictures (PNG with alpha) and depths (EXR) from any side; needs no display");
  verb->add_option("set", arguments->set, "The scan set, meshed")->required();
  verb->add_option("-o,--output", arguments->output, "Folder of the pictures")->required();
  add_camera_options(verb, arguments->cameras);
  verb->add_option(
      "--with", arguments->with,
      "Another set in the same scene: SET, or SET@FILE with its place (a JSON list of 16 numbers, row by row, "
      "to the first set's object coordinates); may be repeated");
  verb->add_flag("--film", arguments->film, "Also all pictures as one animated PNG, film.png");
  verb->add_option("--back-end", arguments->back_end, "cpu, or gl (OpenGL 3.3 without a display)")
      ->check(CLI::IsMember({"cpu", "gl"}));
  verb->add_option("--supersampling", arguments->supersampling, "Samples a pixel of a border, each way")
      ->check(CLI::Range(1, 8));
  verb->add_option("--threshold", arguments->options.threshold, "Of soft z, in units (default: from the error budget)");
  verb->add_option("--fill-views", arguments->options.fill_views,
                   "Views beyond the three that fill holes (0: the paper's three)");
  verb->callback([arguments, &session] {
    session.verb = "render";
    session.work = [arguments, &session] { render(*arguments, session); };
  });
}

}  // namespace scanview
