#include <algorithm>
#include <cmath>
#include <map>
#include <string>

#include "acquire/scan_set_file.h"
#include "base/error.h"
#include "base/parallel.h"
#include "cli/stages.h"
#include "mesh/mesh_marks.h"
#include "mesh/triangle_mesh.h"

namespace scanview {
namespace fs = std::filesystem;
namespace {

Json to_json(MeshOptions const& options) {
  return {{"tolerance_kind", static_cast<int>(options.tolerance_kind)},
          {"tolerance", options.tolerance},
          {"max_triangles", options.max_triangles},
          {"step_sigmas", options.step_sigmas},
          {"max_angle_deg", options.max_angle_deg},
          {"feather_px", options.feather_px},
          {"fill_pixels", options.fill_pixels},
          {"min_patch_pixels", options.min_patch_pixels},
          {"placement", static_cast<int>(options.placement)},
          {"fit", static_cast<int>(options.fit)}};
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

/// The options of a coarser level: twice the tolerance a level, half of the triangles.
MeshOptions coarser(MeshOptions options, double tolerance, int level) {
  if (options.tolerance_kind == MeshOptions::Tolerance::automatic)
    options.tolerance_kind = MeshOptions::Tolerance::sigmas;
  options.tolerance = tolerance * std::exp2(level);
  if (options.max_triangles > 0) options.max_triangles = std::max(1, options.max_triangles >> level);
  return options;
}

Json to_json(MeshFigures const& figures) {
  return {{"triangles", figures.triangles},
          {"rms", json_number(figures.rms)},
          {"p95", json_number(figures.p95)},
          {"max", json_number(figures.max)},
          {"uncovered", json_number(figures.uncovered)}};
}

std::string level_file(int level) { return "mesh." + std::to_string(level) + ".ply"; }

/// Levels of an earlier run that had more.
void remove_levels_from(fs::path const& folder, int level) {
  while (fs::remove(folder / level_file(level))) ++level;
}

std::map<std::string, MeshMarks> read_marks(fs::path const& path, ScanSet const& set) {
  if (path.empty()) return {};
  auto marks = mesh_marks_from_json(read_json(path), path);
  for (auto const& [name, view_marks] : marks)
    if (std::none_of(set.views.begin(), set.views.end(), [&](View const& view) { return view.name == name; }))
      throw Error(ErrorCode::bad_input, path, "marks of view " + name + ", which the set does not have");
  return marks;
}

}  // namespace

StageOutcome mesh_stage(fs::path const& folder, MeshRequest const& request, StageMode mode, Context& context) {
  MeshOptions const& options = request.options;
  options.validate();
  ScanSet const manifest = read_manifest(folder);
  auto const marks = read_marks(request.marks, manifest);
  Json views = Json::array();
  for (auto const& view : manifest.views)
    views.push_back({view.image.camera.to_json(),
                     view.object_from_camera ? pose_to_json(*view.object_from_camera) : Json(nullptr)});
  StageRecord record{"mesh", to_json(options), image_hashes(folder, manifest), {}, {}};
  record.options["levels"] = request.levels;
  record.inputs["scanset.json#views"] = hash_bytes(views.dump());
  if (!request.marks.empty()) record.inputs["marks"] = hash_file(request.marks);

  return run_stage(folder, std::move(record), mode, context, [&](StageRecord& out) {
    ScanSet set = read_scan_set(folder, context);
    std::vector<ViewMeshResult> results(set.views.size());
    std::vector<std::vector<ViewMeshResult>> levels(set.views.size());
    for_each_index(
        context, results.size(),
        [&](std::size_t i) {
          View const& view = set.views[i];
          MeshMarks const own = marks.contains(view.name) ? marks.at(view.name) : MeshMarks{};
          results[i] = mesh_range_image(view.image, options, context, own);
          fs::path const to = folder / view_folder(view.name);
          write_view_mesh(to, results[i].view_mesh);
          write_file(to / "mesh.glb", encode_glb({&results[i].view_mesh}, set, {i}));
          for (int level = 1; level < request.levels; ++level) {
            levels[i].push_back(
                mesh_range_image(view.image, coarser(options, results[i].tolerance, level), context, own));
            write_triangle_mesh(to / level_file(level), levels[i].back().view_mesh.mesh);
          }
          remove_levels_from(to, request.levels);
        },
        "mesh");
    set.error_budget.approximation = approximation_error(set, results);
    write_manifest(folder, set);
    out.figures["views"] = Json::array();
    double tolerance = 0;
    for (std::size_t i = 0; i < results.size(); ++i) {
      Json figures = to_json(results[i].figures);
      figures["name"] = set.views[i].name;
      for (ViewMeshResult const& level : levels[i]) {
        Json& list = figures["levels"];
        list.push_back(to_json(level.figures));
        list.back()["tolerance"] = level.tolerance;
      }
      out.figures["views"].push_back(figures);
      tolerance = std::max(tolerance, results[i].tolerance);
      std::vector<std::string> names = {"mesh.ply", "feather.png", "mesh.glb"};
      for (int level = 1; level < request.levels; ++level) names.push_back(level_file(level));
      for (std::string const& name : names) {
        fs::path const file = view_folder(set.views[i].name) / name;
        out.outputs[file.generic_string()] = hash_file(folder / file);
      }
      if (results[i].figures.triangles == 0)
        context.warn("view " + set.views[i].name + " has too few depths for a mesh");
    }
    out.figures["tolerance"] = tolerance;
    out.figures["tolerance_kind"] = options.tolerance_kind == MeshOptions::Tolerance::units ? "units" : "sigmas";
    return mesh_section(set, results);
  });
}

}  // namespace scanview
