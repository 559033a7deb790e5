#include <algorithm>
#include <cmath>

#include "acquire/scan_set_file.h"
#include "base/error.h"
#include "base/parallel.h"
#include "cli/stages.h"

namespace scanview {
namespace fs = std::filesystem;
namespace {

Json to_json(MeshOptions const& options) {
  return {{"tolerance_kind", static_cast<int>(options.tolerance_kind)},
          {"tolerance", options.tolerance},
          {"max_triangles", options.max_triangles},
          {"step_sigmas", options.step_sigmas},
          {"max_angle_deg", options.max_angle_deg},
          {"feather_px", options.feather_px}};
}

/// Over all views, each weighing as many depths as it has.
ErrorPart approximation_error(ScanSet const& set, std::vector<ViewMeshResult> const& results) {
  double squares = 0, p95 = 0, depths = 0;
  for (std::size_t i = 0; i < results.size(); ++i) {
    auto const count = static_cast<double>(set.views[i].image.count_depths());
    MeshFigures const& figures = results[i].figures;
    if (count == 0 || figures.triangles == 0) continue;
    squares += count * figures.rms * figures.rms;
    p95 += count * figures.p95;
    depths += count;
  }
  if (depths == 0) return {};
  return {std::sqrt(squares / depths), p95 / depths};
}

}  // namespace

StageOutcome mesh_stage(fs::path const& folder, MeshOptions const& options, StageMode mode, Context& context) {
  options.validate();
  ScanSet const manifest = read_manifest(folder);
  Json views = Json::array();
  for (auto const& view : manifest.views)
    views.push_back({view.image.camera.to_json(),
                     view.object_from_camera ? pose_to_json(*view.object_from_camera) : Json(nullptr)});
  StageRecord record{"mesh", to_json(options), image_hashes(folder, manifest), {}, {}};
  record.inputs["scanset.json#views"] = hash_bytes(views.dump());

  return run_stage(folder, std::move(record), mode, context, [&](StageRecord& out) {
    ScanSet set = read_scan_set(folder, context);
    std::vector<ViewMeshResult> results(set.views.size());
    for_each_index(
        context, results.size(),
        [&](std::size_t i) {
          results[i] = mesh_range_image(set.views[i].image, options, context);
          fs::path const to = folder / view_folder(set.views[i].name);
          write_view_mesh(to, results[i].view_mesh);
          write_file(to / "mesh.glb", encode_glb({&results[i].view_mesh}, set, {i}));
        },
        "mesh");
    set.error_budget.approximation = approximation_error(set, results);
    write_manifest(folder, set);
    out.figures["views"] = Json::array();
    double tolerance = 0;
    for (std::size_t i = 0; i < results.size(); ++i) {
      MeshFigures const& f = results[i].figures;
      out.figures["views"].push_back({{"name", set.views[i].name},
                                      {"triangles", f.triangles},
                                      {"rms", json_number(f.rms)},
                                      {"p95", json_number(f.p95)},
                                      {"max", json_number(f.max)},
                                      {"uncovered", json_number(f.uncovered)}});
      tolerance = std::max(tolerance, results[i].tolerance);
      for (char const* name : {"mesh.ply", "feather.png", "mesh.glb"}) {
        fs::path const file = view_folder(set.views[i].name) / name;
        out.outputs[file.generic_string()] = hash_file(folder / file);
      }
      if (f.triangles == 0) context.warn("view " + set.views[i].name + " has too few depths for a mesh");
    }
    out.figures["tolerance"] = tolerance;
    out.figures["tolerance_kind"] = options.tolerance_kind == MeshOptions::Tolerance::units ? "units" : "sigmas";
    return mesh_section(set, results);
  });
}

}  // namespace scanview
