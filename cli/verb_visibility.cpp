#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <cmath>
#include <iostream>
#include <limits>
#include <memory>
#include <numbers>

#include "base/animated_png.h"
#include "base/error.h"
#include "base/files.h"
#include "base/image_file.h"
#include "cli/session.h"
#include "cli/visibility_report.h"
#include "mesh/patch_glb.h"
#include "viewer/select/camera_path.h"
#include "viewer/visibility/visibility_check.h"
#include "viewer/visibility/visibility_file.h"

namespace scanview {
namespace fs = std::filesystem;
namespace {

struct VisibilityArguments {
  fs::path model, output, cameras, path, glb, visibility;
  std::string method = "patch", cut = "adaptive", winding = "automatic", up = "y";
  std::vector<std::string> shells;
  std::vector<int> grid;
  std::size_t stretch = 10;
  bool pictures_only = false, check = false, frozen = false, film = false, no_facing = false, thorough = false;
  int frames = 36, size = 800;
  double distance = 3;
  VisibilityOptions options;
};

PolygonModel read_model(VisibilityArguments const& arguments, Context& context) {
  Winding const winding = arguments.winding == "keep"   ? Winding::keep
                          : arguments.winding == "flip" ? Winding::flip
                                                        : Winding::automatic;
  PolygonModel model = read_polygon_model(arguments.model, winding);
  for (auto const& note : model.notes) context.log(note);
  return model;
}

VisibilityOptions build_options(VisibilityArguments const& arguments) {
  VisibilityOptions options = arguments.options;
  options.method = arguments.method == "id" ? VisibilityMethod::id : VisibilityMethod::patch;
  options.cut = arguments.cut == "even" ? PatchCut::even : PatchCut::adaptive;
  if (arguments.pictures_only) options.seen = Seen::in_picture;
  if (!arguments.shells.empty()) options.shells.clear();
  for (auto const& text : arguments.shells) {
    char* end = nullptr;
    double const value = std::strtod(text.c_str(), &end);  // takes inf
    if (end == text.c_str() || *end != '\0' || std::isnan(value))
      throw Error(ErrorCode::usage, {}, fmt::format("--shells {}: expected distances in radii, or inf", text));
    options.shells.push_back(value);
  }
  return options;
}

/// The ball that camera files without cameras of their own are framed for.
std::vector<SampleCamera> read_sample_cameras(fs::path const& file, PolygonModel const& model, int resolution) {
  VisibilityField const ball = field_ball(model);
  ScanSet set;
  set.center = ball.center;
  OrbitFrame frame{Eigen::Vector3d::UnitZ(), Eigen::Vector3d::UnitX(), 3 * ball.radius, ball.radius};
  std::vector<SampleCamera> cameras;
  for (PathCamera const& one : read_camera_path(file, set, frame, resolution, resolution))
    cameras.push_back({one.camera, one.object_from_camera});
  return cameras;
}

void build_file(VisibilityArguments const& arguments, Session& session) {
  Context& context = session.context;
  VisibilityOptions options = build_options(arguments);
  PolygonModel const model = read_model(arguments, context);
  if (!arguments.cameras.empty()) options.cameras = read_sample_cameras(arguments.cameras, model, options.resolution);
  options.validate();
  VisibilityTimes times;
  VisibilityField field;
  if (!arguments.path.empty()) {
    field = build_path_visibility(model, read_sample_cameras(arguments.path, model, options.resolution),
                                  arguments.stretch, options, context, &times);
  } else if (!arguments.grid.empty()) {
    VisibilityField const ball = field_ball(model);
    Eigen::AlignedBox3d box;
    for (auto const& vertex : model.mesh.vertices) box.extend(vertex.cast<double>());
    field = build_grid_visibility(model, box, {arguments.grid[0], arguments.grid[1], arguments.grid[2]}, options,
                                  context, &times);
  } else {
    field = build_visibility(model, options, context, &times);
  }
  std::string const bytes = format_visibility(field, model.mesh);
  write_file(arguments.output, bytes);
  TriangleMesh const drawn = drawn_mesh(model.mesh, field.patches);
  if (!arguments.glb.empty()) write_file(arguments.glb, encode_patch_glb(drawn, field.patches.begins));
  double const bits = 8.0 * static_cast<double>(bytes.size()) / static_cast<double>(model.polygon_count());
  session.report["polygons"] = model.polygon_count();
  session.report["patches"] = field.patches.count();
  session.report["rows"] = field.rows.rows();
  session.report["pictures"] = times.pictures;
  session.report["patch_seconds"] = times.patches;
  session.report["sampling_seconds"] = times.sampling;
  session.report["bytes"] = bytes.size();
  session.report["bits_a_polygon"] = bits;
  std::cout << fmt::format("{} polygons, {} patches, {} pictures in {:.1f} s; {:.1f} bits a polygon\n",
                           model.polygon_count(), field.patches.count(), times.pictures, times.patches + times.sampling,
                           bits);
}

void render_orbit(VisibilityArguments const& arguments, Session& session) {
  Context& context = session.context;
  PolygonModel const model = read_model(arguments, context);
  VisibilityField const field = read_visibility(arguments.visibility, model);
  TriangleMesh const drawn = drawn_mesh(model.mesh, field.patches);
  VisibilitySelector selector(field, drawn, !arguments.no_facing);
  std::error_code error;
  fs::create_directories(arguments.output, error);
  if (error) throw Error(ErrorCode::io, arguments.output, "cannot create: " + error.message());
  session.report["frames"] = Json::array();
  int const axis = arguments.up[0] - 'x';
  Eigen::Vector3d const up = Eigen::Vector3d::Unit(axis), ahead = Eigen::Vector3d::Unit((axis + 1) % 3);
  std::size_t wrong = 0, pixels = 0;
  std::vector<IndexRange> ranges;
  std::vector<std::string> film;
  for (int i = 0; i < arguments.frames; ++i) {
    context.check_cancelled();
    double const angle = 2 * std::numbers::pi * i / arguments.frames;
    Eigen::Vector3d const direction = std::cos(angle) * ahead + std::sin(angle) * up.cross(ahead) + 0.3 * up;
    SampleCamera camera = ball_camera(field.center, field.radius, direction, arguments.distance, arguments.size);
    camera.object_from_camera = look_at(camera.object_from_camera.translation(), field.center, up);
    if (!arguments.frozen || i == 0) {
      auto const selected = selector.select(camera.object_from_camera.translation());
      ranges.assign(selected.begin(), selected.end());
    }
    cv::Mat3b picture;
    std::size_t missed = 0;
    if (arguments.check) {
      MissedPixels const checked = missed_pixels(drawn, ranges, camera);
      picture = checked.picture;
      missed = checked.count;
    } else {
      picture = selection_picture(drawn, ranges, camera);
    }
    wrong += missed;
    pixels += picture.total();
    std::string const name = fmt::format("{:03}.png", i), png = encode_png(picture);
    write_file(arguments.output / name, png);
    if (arguments.film) film.push_back(png);
    Json frame{{"file", name}, {"triangles", selector.triangles()}, {"ranges", ranges.size()}};
    if (arguments.check) frame["wrong_pixels"] = missed;
    session.report["frames"].push_back(frame);
    context.progress("render", static_cast<std::size_t>(i) + 1, static_cast<std::size_t>(arguments.frames));
  }
  constexpr int kFilmMilliseconds = 80;
  if (arguments.film) write_file(arguments.output / "film.png", animated_png(film, kFilmMilliseconds));
  if (arguments.check) {
    session.report["wrong_pixels"] = wrong;
    std::cout << fmt::format("{} wrong pixels of {}\n", wrong, pixels);
  }
}

void write_visibility_page(VisibilityArguments const& arguments, Session& session) {
  Context& context = session.context;
  PolygonModel const model = read_model(arguments, context);
  VisibilityReport const result = visibility_report(model, arguments.model.filename().string(),
                                                    build_options(arguments), arguments.thorough, context);
  write_file(arguments.output, html_page("Visibility of " + arguments.model.filename().string(), "", {result.section}));
  session.report.update(result.figures);
  std::cout << result.text;
}

CLI::App* add_model_verb(CLI::App* verb, char const* name, char const* what,
                         std::shared_ptr<VisibilityArguments> const& arguments) {
  CLI::App* part = verb->add_subcommand(name, what);
  part->add_option("model", arguments->model,
                   "PLY, OBJ, OFF, STL, glTF, MNI polygons, FreeSurfer surface; also gzipped")
      ->required();
  part->add_option("--winding", arguments->winding, "Which side is outside: automatic, keep, flip")
      ->check(CLI::IsMember({"automatic", "keep", "flip"}));
  return part;
}

void add_sampling_options(CLI::App* part, VisibilityArguments& arguments) {
  part->add_option("--method", arguments.method, "patch: a bit a patch; id: a bit a polygon")
      ->check(CLI::IsMember({"id", "patch"}));
  part->add_option("--samples", arguments.options.samples, "Directions: 6, 18, 66, 258, 1026, 4098");
  part->add_option("--patches", arguments.options.patches, "How many (0: one for every 64 polygons)");
  part->add_option("--cut", arguments.cut,
                   "adaptive: patches where visibility changes; even: smallest first, as in the paper")
      ->check(CLI::IsMember({"even", "adaptive"}));
  part->add_option("--shells", arguments.shells, "Distances of the samples in radii, ascending; inf: orthographic");
  part->add_option("--resolution", arguments.options.resolution, "Of a sample's picture, in pixels");
  part->add_option("--widening", arguments.options.widening,
                   "How far eyes may be off a sample, as a share of half the way to the next");
  part->add_flag("--pictures-only", arguments.pictures_only, "Only what a pixel shows, as in the papers");
  part->add_option("--fill", arguments.options.fill,
                   "Rings of neighbours that face the camera and count as seen; -1: as long as there are any");
}

}  // namespace

void add_visibility(CLI::App& app, Session& session) {
  auto arguments = std::make_shared<VisibilityArguments>();
  CLI::App* verb = app.add_subcommand("visibility", "What of a polygon model can be seen from where, precomputed");
  verb->require_subcommand(1);
  auto const set_work = [&session, arguments](CLI::App* part, auto work) {
    part->callback([&session, arguments, work] {
      session.verb = "visibility";
      session.work = [&session, arguments, work] { work(*arguments, session); };
    });
  };

  CLI::App* part = add_model_verb(verb, "build", "Samples a model and writes a .vis file", arguments);
  part->add_option("-o,--output", arguments->output, "The .vis file")->required();
  add_sampling_options(part, *arguments);
  part->add_flag("--conservative", arguments->options.conservative,
                 "Leave out only what is proven hidden from all eyes between samples");
  part->add_option("--cameras", arguments->cameras, "Sample from the cameras of a path file instead");
  part->add_option("--path", arguments->path, "For a recorded path: a bitfield for each stretch of it");
  part->add_option("--stretch", arguments->stretch, "Frames of a stretch");
  part->add_option("--grid", arguments->grid, "For eyes inside the model: cells along x, y and z")->expected(3);
  part->add_option("--glb", arguments->glb, "Also a glTF file whose primitives are the patches");
  set_work(part, build_file);

  part = add_model_verb(verb, "render", "Pictures of an orbit, of what is selected alone", arguments);
  part->add_option("visibility", arguments->visibility, "The .vis file")->required();
  part->add_option("-o,--output", arguments->output, "Folder of the pictures")->required();
  part->add_option("--frames", arguments->frames, "Of a full turn")->check(CLI::Range(1, 100000));
  part->add_option("--size", arguments->size, "Of a picture, in pixels")->check(CLI::Range(16, 16384));
  part->add_option("--distance", arguments->distance, "Of the eye, in radii")->check(CLI::Range(1.01, 1e6));
  part->add_option("--up", arguments->up, "The model's axis that points up: x, y, z")
      ->check(CLI::IsMember({"x", "y", "z"}));
  part->add_flag("--check", arguments->check, "Draw the whole model, and in red the pixels that would be missed");
  part->add_flag("--frozen", arguments->frozen, "Keep what the first eye selected while the model turns");
  part->add_flag("--no-facing", arguments->no_facing, "Whole patches, also triangles that turn away");
  part->add_flag("--film", arguments->film, "Also all pictures as one animated PNG, film.png");
  set_work(part, render_orbit);

  part = add_model_verb(verb, "report", "The papers' tables and curves for a model, as a page", arguments);
  part->add_option("-o,--output", arguments->output, "The page (HTML)")->required();
  add_sampling_options(part, *arguments);
  part->add_flag("--thorough", arguments->thorough, "Also 4098 samples, and 200 eyes instead of 40");
  set_work(part, write_visibility_page);
}

}  // namespace scanview
