#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <cstdio>
#include <memory>

#include "acquire/scan_set_file.h"
#include "base/error.h"
#include "cli/report.h"
#include "cli/stages.h"
#include "mesh/triangle_mesh.h"
#include "synth/scanner.h"

namespace scanview {
namespace fs = std::filesystem;
namespace {

struct Arguments {
  std::string model, size = "640x480", layout = "sphere", disturb;
  fs::path output;
  SynthOptions options;
  bool force = false;
};

TriangleMesh load_model(std::string const& model) {
  auto const names = builtin_model_names();
  if (std::find(names.begin(), names.end(), model) != names.end()) return builtin_model(model);
  return read_triangle_mesh(model);
}

SynthOptions resolve(Arguments const& arguments) {
  SynthOptions options = arguments.options;
  char end = 0;
  if (std::sscanf(arguments.size.c_str(), "%dx%d%c", &options.width, &options.height, &end) != 2)
    throw Error(ErrorCode::usage, {}, fmt::format("--size {}: expected WIDTHxHEIGHT", arguments.size));
  options.layout = arguments.layout == "circle" ? SynthOptions::Layout::circle : SynthOptions::Layout::sphere;
  if (!arguments.disturb.empty()) {
    double percent = 0;
    if (std::sscanf(arguments.disturb.c_str(), "%lf:%lf%c", &options.disturb_deg, &percent, &end) != 2)
      throw Error(ErrorCode::usage, {}, fmt::format("--disturb {}: expected DEGREES:PERCENT", arguments.disturb));
    options.disturb_share = percent / 100;
  }
  options.validate();
  return options;
}

Json to_json(SynthOptions const& options) {
  return {{"views", options.views},
          {"layout", static_cast<int>(options.layout)},
          {"elevation_deg", options.elevation_deg},
          {"width", options.width},
          {"height", options.height},
          {"distance", options.distance},
          {"disturb_deg", options.disturb_deg},
          {"disturb_share", options.disturb_share},
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

void synth(Arguments const& arguments, Session& session) {
  Context& context = session.context;
  require_replaceable(arguments.output);
  SynthOptions const options = resolve(arguments);
  StageRecord record{"synth", to_json(options), Json::object(), {}, {}};
  record.options["seed"] = context.seed;
  bool const is_file = fs::is_regular_file(arguments.model);
  record.inputs["model"] = is_file ? hash_file(arguments.model) : hash_bytes(arguments.model);
  if (!arguments.force && is_up_to_date(arguments.output, record)) {
    session.report.update(read_stage_record(arguments.output, "synth").figures);
    return;
  }
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

}  // namespace

void add_synth(CLI::App& app, Session& session) {
  auto arguments = std::make_shared<Arguments>();
  CLI::App* verb = app.add_subcommand("synth", "Scans a model: range images, colours, and the exact truth beside them");
  std::string names;
  for (auto const& name : builtin_model_names()) names += " " + name;
  verb->add_option("model", arguments->model, "A PLY or OBJ file, or a built-in object:" + names)->required();
  verb->add_option("-o,--output", arguments->output, "The scan set to make")->required();
  verb->add_option("--views", arguments->options.views, "How many");
  verb->add_option("--layout", arguments->layout, "sphere or circle (a turntable)")
      ->check(CLI::IsMember({"sphere", "circle"}));
  verb->add_option("--elevation", arguments->options.elevation_deg, "Of a circle, in degrees");
  verb->add_option("--size", arguments->size, "WIDTHxHEIGHT of a view");
  verb->add_option("--distance", arguments->options.distance, "Of the eye, in radii of the object");
  verb->add_option("--noise", arguments->options.noise.depth_sigma,
                   "Standard deviation of a depth, as a share of the radius");
  verb->add_option("--color-noise", arguments->options.noise.color_sigma, "Standard deviation of an 8-bit channel");
  verb->add_option("--disturb", arguments->disturb, "DEGREES:PERCENT: poses off by so much (percent of the size)");
  verb->add_flag("--force", arguments->force, "Also where nothing changed");
  verb->callback([arguments, &session] {
    session.verb = "synth";
    session.work = [arguments, &session] { synth(*arguments, session); };
  });
}

}  // namespace scanview
