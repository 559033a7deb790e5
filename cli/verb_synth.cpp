#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <cstdio>
#include <memory>

#include "acquire/scan_set_file.h"
#include "base/error.h"
#include "base/random.h"
#include "cli/report.h"
#include "cli/stages.h"
#include "mesh/triangle_mesh.h"
#include "synth/capture_files.h"
#include "synth/centered_model.h"
#include "synth/disturbed_pose.h"
#include "synth/scanner.h"

namespace scanview {
namespace fs = std::filesystem;
namespace {

struct SynthArguments {
  std::string model, pattern = "sweep", size = "640x480", noise, disturb;
  int views = 12;
  fs::path output;
  bool force = false;
  // range
  std::string layout = "sphere";
  SynthOptions range;
  // sweep, gray
  std::string beam, projector = "1024x768";
  std::vector<std::string> faults;
  bool no_stage = false;
  CaptureOptions capture;
};

/// Numbers between separators, as many as the format has; throws Error{usage} naming the option.
template <class... Numbers>
void scan(std::string const& option, std::string const& text, char const* format, char const* expected,
          Numbers*... numbers) {
  int end = 0;
  int const read = std::sscanf(text.c_str(), (std::string(format).append("%n")).c_str(), numbers..., &end);
  if (read != static_cast<int>(sizeof...(numbers)) || end != static_cast<int>(text.size()))
    throw Error(ErrorCode::usage, {}, fmt::format("{} {}: expected {}", option, text, expected));
}

TriangleMesh load_model(std::string const& model) {
  if (is_builtin_model(model)) return builtin_model(model);
  return read_triangle_mesh(model);
}

Disturbance disturbance(SynthArguments const& arguments) {
  Disturbance result;
  if (arguments.disturb.empty()) return result;
  double percent = 0;
  scan("--disturb", arguments.disturb, "%lf:%lf", "DEGREES:PERCENT", &result.turn_deg, &percent);
  result.share = percent / 100;
  result.validate();
  return result;
}

SynthOptions range_options(SynthArguments const& arguments) {
  SynthOptions options = arguments.range;
  options.views = arguments.views;
  scan("--size", arguments.size, "%dx%d", "WIDTHxHEIGHT", &options.width, &options.height);
  if (!arguments.noise.empty())
    scan("--noise", arguments.noise, "%lf", "a share of the radius", &options.noise.depth_sigma);
  options.layout = arguments.layout == "circle" ? SynthOptions::Layout::circle : SynthOptions::Layout::sphere;
  options.disturbance = disturbance(arguments);
  options.validate();
  return options;
}

void apply_fault(std::string const& text, CaptureFaults& faults) {
  auto const colon = text.find(':');
  std::string const kind = text.substr(0, colon), rest = colon == std::string::npos ? "" : text.substr(colon + 1);
  auto const number = [&](double& value) { scan("--fault", rest, "%lf", "KIND:NUMBER", &value); };
  if (kind == "drop" || kind == "repeat" || kind == "swap") {
    auto const side = rest.find(':');
    scan("--fault", rest.substr(0, side), "%d", "KIND:FRAME[:left|:right]",
         kind == "drop"     ? &faults.drop
         : kind == "repeat" ? &faults.repeat
                            : &faults.swap);
    std::string const name = side == std::string::npos ? "" : rest.substr(side + 1);
    if (name != "" && name != "left" && name != "right")
      throw Error(ErrorCode::usage, {}, fmt::format("--fault {}: '{}' is neither left nor right", text, name));
    if (name != "") faults.side = name == "left" ? CaptureFaults::Side::left : CaptureFaults::Side::right;
  } else if (kind == "flicker") {
    number(faults.flicker);
  } else if (kind == "jitter") {
    number(faults.jitter);
  } else if (kind == "moved") {
    number(faults.rig_moved_deg);
  } else {
    throw Error(ErrorCode::usage, {},
                fmt::format("--fault {}: expected drop, repeat, swap, flicker, jitter or moved", text));
  }
}

CaptureOptions capture_options(SynthArguments const& arguments) {
  CaptureOptions options = arguments.capture;
  options.views = arguments.views;
  scan("--size", arguments.size, "%dx%d", "WIDTHxHEIGHT", &options.width, &options.height);
  LightOptions& light = options.light;
  light.pattern = arguments.pattern == "gray" ? LightOptions::Pattern::gray : LightOptions::Pattern::sweep;
  scan("--projector", arguments.projector, "%dx%d", "WIDTHxHEIGHT", &light.projector_width, &light.projector_height);
  if (arguments.beam.ends_with("step"))
    scan("--beam", arguments.beam.substr(0, arguments.beam.size() - 4), "%lf", "MM or Nstep", &light.beam_steps);
  else if (!arguments.beam.empty())
    scan("--beam", arguments.beam, "%lf", "MM or Nstep", &light.beam_mm);
  if (arguments.noise == "none")
    options.sensor.full_scale_electrons = 0;
  else if (!arguments.noise.empty())
    scan("--noise", arguments.noise, "%lf:%lf", "ELECTRONS:READ or none", &options.sensor.full_scale_electrons,
         &options.sensor.read_electrons);
  options.scene.stage = !arguments.no_stage;
  for (auto const& fault : arguments.faults) apply_fault(fault, options.faults);
  options.validate();
  return options;
}

Json to_json(SynthOptions const& options) {
  return {{"pattern", "range"},
          {"views", options.views},
          {"layout", static_cast<int>(options.layout)},
          {"elevation_deg", options.elevation_deg},
          {"width", options.width},
          {"height", options.height},
          {"distance", options.distance},
          {"disturb_deg", options.disturbance.turn_deg},
          {"disturb_share", options.disturbance.share},
          {"depth_sigma", options.noise.depth_sigma},
          {"color_sigma", options.noise.color_sigma}};
}

/// truth/: the exact poses (a manifest of its own), the exact depths, and the model.
void write_truth(fs::path const& folder, SynthResult const& result, TriangleMesh const& model) {
  fs::create_directories(folder / "truth");
  ScanSet truth = result.set;
  for (std::size_t i = 0; i < truth.views.size(); ++i) {
    truth.views[i].object_from_camera = result.true_poses[i];
    write_depth_exr(folder / "truth" / (truth.views[i].name + ".exr"), result.true_depth[i]);
  }
  write_manifest(folder / "truth", truth);
  write_triangle_mesh(folder / "truth" / "model.ply", model);
}

Json to_json(CaptureOptions const& options) {
  LightOptions const& light = options.light;
  SceneOptions const& scene = options.scene;
  SensorOptions const& sensor = options.sensor;
  CaptureFaults const& faults = options.faults;
  bool const gray = light.pattern == LightOptions::Pattern::gray;
  return {{"pattern", gray ? "gray" : "sweep"},
          {"views", options.views},
          {"width", options.width},
          {"height", options.height},
          {"baseline_deg", options.baseline_deg},
          {"boards", options.boards},
          {"steps", light.steps},
          {"beam_mm", light.beam_mm},
          {"beam_steps", light.beam_steps},
          {"projector", {light.projector_width, light.projector_height}},
          {"rows", light.rows},
          {"blur", light.blur},
          {"ambient", scene.ambient},
          {"gloss", scene.gloss},
          {"gloss_exponent", scene.gloss_exponent},
          {"interreflection", scene.interreflection},
          {"stage", scene.stage},
          {"backdrop", scene.backdrop},
          {"full_scale_electrons", sensor.full_scale_electrons},
          {"read_electrons", sensor.read_electrons},
          {"bits", sensor.bits},
          {"gamma", sensor.gamma},
          {"exposure", sensor.exposure},
          {"fault_side", static_cast<int>(faults.side)},
          {"drop", faults.drop},
          {"repeat", faults.repeat},
          {"swap", faults.swap},
          {"flicker", faults.flicker},
          {"jitter", faults.jitter},
          {"rig_moved_deg", faults.rig_moved_deg}};
}

/// What has been made before by `synth` may be made anew; nothing else is replaced.
void require_own(fs::path const& folder) {
  if (!fs::exists(folder / "capture.json") || !fs::exists(folder / "synth.json")) require_replaceable(folder);
}

/// True where the folder already holds what is asked for; its figures are then reported.
bool is_done(SynthArguments const& arguments, StageRecord const& record, Session& session) {
  if (arguments.force || !is_up_to_date(arguments.output, record)) return false;
  session.report.update(read_stage_record(arguments.output, "synth").figures);
  return true;
}

StageRecord new_record(SynthArguments const& arguments, Json options, Context const& context) {
  StageRecord record{"synth", std::move(options), Json::object(), Json::object(), Json::object()};
  record.options["seed"] = context.seed;
  bool const is_file = fs::is_regular_file(arguments.model);
  record.inputs["model"] = is_file ? hash_file(arguments.model) : hash_bytes(arguments.model);
  return record;
}

void synth_range(SynthArguments const& arguments, Session& session) {
  Context& context = session.context;
  SynthOptions const options = range_options(arguments);
  StageRecord record = new_record(arguments, to_json(options), context);
  if (is_done(arguments, record, session)) return;
  TriangleMesh const model = load_model(arguments.model);
  NewFolder fresh(arguments.output);
  StageOutcome const outcome =
      run_stage(fresh.path(), std::move(record), StageMode::force, context, [&](StageRecord& out) {
        SynthResult const result = synthesize(model, options, context);
        write_scan_set(fresh.path(), result.set, context);
        write_truth(fresh.path(), result, model);
        out.outputs = image_hashes(fresh.path(), result.set);
        out.figures = {
            {"views", result.set.views.size()},
            {"unit", to_string(result.set.unit)},
            {"triangles", model.triangles.size()},
            {"radius", result.radius},
            {"truth", {{"poses", "truth/scanset.json"}, {"depth", "truth/*.exr"}, {"model", "truth/model.ply"}}},
            {"noise",
             {{"depth_sigma", options.noise.depth_sigma * result.radius}, {"color_sigma", options.noise.color_sigma}}}};
        ReportSection section = import_section(result.set);
        section.id = "synth";
        return section;
      });
  fresh.commit();
  write_report(arguments.output);
  session.report.update(outcome.figures);
}

Json capture_figures(CaptureRig const& rig, TriangleMesh const& model) {
  CaptureOptions const& options = rig.options();
  return {{"views", options.views},
          {"pattern", options.light.pattern == LightOptions::Pattern::gray ? "gray" : "sweep"},
          {"frames", rig.light().frames()},
          {"unit", "mm"},
          {"triangles", model.triangles.size()},
          {"baseline", rig.layout().rig.baseline()},
          {"distance", (rig.layout().room_from_left.translation() - rig.layout().target).norm()},
          {"beam_steps", rig.light().beam_steps()},
          {"truth",
           {{"poses", "truth/scanset.json"},
            {"depth", "truth/*.exr"},
            {"visible", "truth/visible_*.png"},
            {"model", "truth/model.ply"},
            {"rig", "truth/rig.yml"}}},
          {"noise",
           {{"full_scale_electrons", options.sensor.full_scale_electrons},
            {"read_electrons", options.sensor.read_electrons},
            {"bits", options.sensor.bits},
            {"exposure", rig.exposure()}}}};
}

/// stage/scanset.json: the poses as the stage's dials would tell them, which `register` starts from.
void write_stage_poses(fs::path const& folder, TriangleMesh const& model, Disturbance const& disturbance,
                       std::uint64_t seed) {
  constexpr std::uint64_t kStageItem = 0x7374616765;  // keys the stage's random numbers
  ScanSet set = read_manifest(folder / "truth");
  CenteredModel const object = centered(model);
  for (std::size_t v = 1; v < set.views.size(); ++v) {
    auto& pose = set.views[v].object_from_camera;
    pose = disturbed_pose(*pose, object, disturbance, CounterRandom(seed, kStageItem, v));
  }
  fs::create_directories(folder / "stage");
  write_manifest(folder / "stage", set);
}

void synth_capture(SynthArguments const& arguments, Session& session) {
  Context& context = session.context;
  CaptureOptions const options = capture_options(arguments);
  Disturbance const disturb = disturbance(arguments);
  StageRecord record = new_record(arguments, to_json(options), context);
  record.options["disturb_deg"] = disturb.turn_deg;
  record.options["disturb_share"] = disturb.share;
  if (is_done(arguments, record, session)) return;
  TriangleMesh const model = load_model(arguments.model);
  NewFolder fresh(arguments.output);
  CaptureRig const rig(model, options, context);
  write_capture(fresh.path(), model, rig, context);
  if (!arguments.disturb.empty()) write_stage_poses(fresh.path(), model, disturb, context.seed);
  for (char const* file : {"capture.json", "rig.yml", "truth/scanset.json"})
    record.outputs[file] = hash_file(fresh.path() / file);
  record.figures = capture_figures(rig, model);
  write_stage_record(fresh.path(), record);
  fresh.commit();
  session.report.update(record.figures);
}

void synth(SynthArguments const& arguments, Session& session) {
  require_own(arguments.output);
  if (arguments.pattern == "range")
    synth_range(arguments, session);
  else
    synth_capture(arguments, session);
}

void add_capture_options(CLI::App& verb, SynthArguments& arguments) {
  std::string const group = "sweep, gray";
  CaptureOptions& options = arguments.capture;
  auto const add = [&](char const* name, auto& value, char const* what) {
    verb.add_option(name, value, what)->group(group);
  };
  add("--steps", options.light.steps, "Positions of the light");
  add("--beam", arguments.beam,
      "Standard deviation of the beam: MM at the object, or Nstep (default 0.8/96 of the sweep)");
  add("--projector", arguments.projector, "WIDTHxHEIGHT of the projector (gray)");
  verb.add_flag("--rows", options.light.rows, "Gray code of the projector's rows as well")->group(group);
  add("--blur", options.light.blur, "Standard deviation of a projector pixel's blur, in its pixels");
  add("--ambient", options.scene.ambient, "Light that is always there, as a share of the beam's");
  add("--gloss", options.scene.gloss, "Share of light that a glossy lobe sends back");
  add("--gloss-exponent", options.scene.gloss_exponent, "Of the lobe: large is narrow");
  add("--interreflection", options.scene.interreflection, "1: light's first bounce between surfaces; 0: none");
  verb.add_flag("--no-stage", arguments.no_stage, "No turntable, no backdrop, no empty scene")->group(group);
  add("--backdrop", options.scene.backdrop, "Paint of turntable and backdrop, #rrggbb");
  add("--bits", options.sensor.bits, "8 or 16");
  add("--gamma", options.sensor.gamma, "Of the cameras' response; 1: linear");
  add("--saturate", options.sensor.exposure, "Exposure, 1: the brightest diffuse surface just stays below full scale");
  add("--baseline-deg", options.baseline_deg, "Angle between the cameras, as seen from the object");
  add("--boards", options.boards, "Pairs of pictures of a chessboard");
  add("--fault", arguments.faults,
      "drop:FRAME, repeat:FRAME, swap:FRAME (each with :left or :right for one camera only), flicker:SHARE, "
      "jitter:STEPS, moved:DEGREES");
}

void add_range_options(CLI::App& verb, SynthArguments& arguments) {
  auto const add = [&](char const* name, auto& value, char const* what) {
    return verb.add_option(name, value, what)->group("range");
  };
  add("--layout", arguments.layout, "sphere or circle (a turntable)")->check(CLI::IsMember({"sphere", "circle"}));
  add("--elevation", arguments.range.elevation_deg, "Of a circle, in degrees");
  add("--distance", arguments.range.distance, "Of the eye, in radii of the object");
  add("--color-noise", arguments.range.noise.color_sigma, "Standard deviation of an 8-bit channel");
}

}  // namespace

void add_synth(CLI::App& app, Session& session) {
  auto arguments = std::make_shared<SynthArguments>();
  CLI::App* verb = app.add_subcommand(
      "synth", "Captures a model: what two cameras see of a swept light, and the exact truth beside it");
  std::string names;
  for (auto const& name : builtin_model_names()) names += " " + name;
  verb->add_option("model", arguments->model,
                   "A PLY or OBJ file, or a built-in model:" + names + " (gallery:N and church:N have N polygons)")
      ->required();
  verb->add_option("-o,--output", arguments->output, "The capture (or scan set) to make")->required();
  verb->add_option("--pattern", arguments->pattern,
                   "sweep: a plane of light in steps; gray: a projector's Gray code; range: no capture, but a scan set "
                   "of finished range images")
      ->check(CLI::IsMember({"sweep", "gray", "range"}));
  verb->add_option("--views", arguments->views, "How many");
  verb->add_option("--size", arguments->size, "WIDTHxHEIGHT of a picture");
  verb->add_option("--noise", arguments->noise,
                   "sweep, gray: ELECTRONS:READ at full scale and of reading out (10000:10), or none; range: standard "
                   "deviation of a depth, as a share of the radius");
  verb->add_option("--disturb", arguments->disturb,
                   "DEGREES:PERCENT: stated poses are off by so much (percent of the size) but for the first view's; "
                   "sweep, gray: they go to stage/scanset.json");
  add_capture_options(*verb, *arguments);
  add_range_options(*verb, *arguments);
  verb->add_flag("--force", arguments->force, "Also where nothing changed");
  verb->callback([arguments, &session] {
    session.verb = "synth";
    session.work = [arguments, &session] { synth(*arguments, session); };
  });
}

}  // namespace scanview
