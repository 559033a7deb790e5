#include <fmt/format.h>

#include <chrono>

#include "acquire/scan_set_file.h"
#include "base/error.h"
#include "base/parallel.h"
#include "cli/report.h"
#include "cli/stages.h"

namespace scanview {
namespace fs = std::filesystem;

StageOutcome run_stage(fs::path const& folder, StageRecord record, StageMode mode, Context& context,
                       std::function<ReportSection(StageRecord&)> const& work) {
  StageOutcome outcome;
  if (mode != StageMode::force && is_up_to_date(folder, record)) {
    outcome.was_up_to_date = true;
    outcome.figures = read_stage_record(folder, record.stage).figures;
    outcome.exit_code = outcome.figures.value("stage_exit", 0);
    return outcome;
  }
  if (mode == StageMode::check) return outcome;
  reset_peak_memory();
  auto const start = std::chrono::steady_clock::now();
  std::size_t const warnings_before = context.warnings().size();
  record.outputs = Json::object();
  record.figures = Json::object();
  ReportSection const section = work(record);
  write_report_section(folder, section);
  record.outputs["report/" + section.id + ".html"] = hash_file(folder / "report" / (section.id + ".html"));
  auto const warnings = context.warnings();
  record.figures["warnings"] =
      std::vector<std::string>(warnings.begin() + static_cast<std::ptrdiff_t>(warnings_before), warnings.end());
  write_timing(folder, record.stage, std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count(),
               peak_memory_mb(), context.threads);
  write_stage_record(folder, record);
  write_report(folder);
  outcome.figures = record.figures;
  outcome.exit_code = record.figures.value("stage_exit", 0);
  return outcome;
}

Json image_hashes(fs::path const& folder, ScanSet const& set) {
  Json hashes = Json::object();
  for (auto const& file : image_files(set)) hashes[file.generic_string()] = hash_file(folder / file);
  return hashes;
}

Json picture_inputs(fs::path const& folder, ScanSet const& set) {
  Json inputs = image_hashes(folder, set);
  for (auto const& view : set.views)
    for (char const* name : {"mesh.ply", "feather.png"}) {
      fs::path const file = view_folder(view.name) / name;
      if (!fs::exists(folder / file))
        throw Error(ErrorCode::bad_input, folder, "has no meshes yet (run 'scanview mesh' first)");
      inputs[file.generic_string()] = hash_file(folder / file);
    }
  inputs["scanset.json"] = hash_file(folder / "scanset.json");
  return inputs;
}

std::vector<ViewMesh> read_view_meshes(fs::path const& folder, ScanSet const& set, Context& context) {
  std::vector<ViewMesh> meshes(set.views.size());
  for_each_index(context, meshes.size(), [&](std::size_t i) {
    fs::path const in = folder / view_folder(set.views[i].name);
    if (!fs::exists(in / "mesh.ply"))
      throw Error(ErrorCode::bad_input, in, "has no mesh yet (run 'scanview mesh' first)");
    meshes[i] = read_view_mesh(in, set.views[i].image.camera);
  });
  return meshes;
}

void require_replaceable(fs::path const& folder) {
  std::error_code error;
  if (!fs::exists(folder, error)) return;
  if (!fs::is_directory(folder, error)) throw Error(ErrorCode::bad_input, folder, "exists and is not a folder");
  if (!fs::is_empty(folder, error) && !fs::exists(folder / "scanset.json", error))
    throw Error(ErrorCode::bad_input, folder, "exists and is not a scan set; it will not be replaced");
}

}  // namespace scanview
