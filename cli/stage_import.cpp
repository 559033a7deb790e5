#include <fmt/format.h>

#include <algorithm>
#include <chrono>

#include "acquire/scan_set_file.h"
#include "base/error.h"
#include "cli/report.h"
#include "cli/stages.h"

namespace scanview {
namespace fs = std::filesystem;
namespace {

Json to_json(ImportRequest const& request) {
  ImportOptions const& options = request.options;
  Json json = {{"kind", request.kind}, {"input", request.input.filename().string()}};
  if (options.box) {
    json["box"] = Json::array();
    for (auto const& corner : *options.box)
      for (int i = 0; i < 3; ++i) json["box"].push_back(corner[i]);
  }
  json["cut_ground"] = options.cut_ground;
  json["min_depth"] = options.min_depth;
  if (std::isfinite(options.max_depth)) json["max_depth"] = options.max_depth;
  json["background"] = static_cast<int>(options.background);
  json["step"] = options.step;
  return json;
}

/// Names of everything below the input: a frame that was added changes the result although no old file changed.
std::string hash_listing(fs::path const& input) {
  std::vector<std::string> names;
  if (fs::is_directory(input))
    for (auto const& entry : fs::recursive_directory_iterator(input))
      names.push_back(fs::relative(entry.path(), input).generic_string());
  std::sort(names.begin(), names.end());
  std::string all;
  for (auto const& name : names) all += name + "\n";
  return hash_bytes(all);
}

/// The folder that names of inputs are relative to, absolute: of a bare file name, the parent path is empty.
fs::path input_root(fs::path const& input) {
  fs::path const path = fs::absolute(input).lexically_normal();
  return fs::is_directory(path) ? path : path.parent_path();
}

std::string input_name(fs::path const& file, fs::path const& input) {
  return fs::absolute(file).lexically_normal().lexically_relative(input_root(input)).generic_string();
}

/// Inputs as the last import recorded them, hashed anew. Any file that is gone makes it differ.
Json hash_recorded_inputs(fs::path const& folder, fs::path const& input) {
  Json inputs = Json::object();
  try {
    fs::path const root = input_root(input);
    StageRecord const record = read_stage_record(folder, "import");
    for (auto const& [name, hash] : record.inputs.items())
      if (name != "listing") inputs[name] = hash_file(root / name);
  } catch (Error const&) {
    return Json::object();
  }
  inputs["listing"] = hash_listing(input);
  return inputs;
}

ImportResult copy_scan_set(fs::path const& path, Context& context) {
  ImportResult result;
  result.set = read_scan_set(path, context);
  result.files_read.push_back(path / "scanset.json");
  for (auto const& file : image_files(result.set)) result.files_read.push_back(path / file);
  for (auto const& view : result.set.views) result.depths += view.image.count_depths();
  result.set.error_budget.registration = result.set.error_budget.approximation = {};
  return result;
}

ImportResult import_any(ImportRequest const& request, Context& context) {
  if (!fs::exists(request.input)) throw Error(ErrorCode::bad_input, request.input, "does not exist");
  if (request.kind == "rgbd") return import_rgbd(request.input, request.options, context);
  if (request.kind == "stanford") return import_stanford(request.input, request.options, context);
  if (request.kind == "nerfstudio") return import_nerfstudio(request.input, request.options, context);
  if (request.kind == "colmap") return import_colmap(request.input, request.options, context);
  if (request.kind == "scanset") return copy_scan_set(request.input, context);
  throw Error(ErrorCode::usage, {},
              fmt::format("cannot import '{}': known are rgbd, stanford, nerfstudio, colmap, scanset", request.kind));
}

}  // namespace

StageOutcome import_stage(fs::path const& folder, ImportRequest const& request, StageMode mode, Context& context) {
  require_replaceable(folder);
  StageRecord wanted{"import", to_json(request), hash_recorded_inputs(folder, request.input), {}, {}};
  StageOutcome outcome;
  if (mode != StageMode::force && !wanted.inputs.empty() && is_up_to_date(folder, wanted)) {
    outcome.was_up_to_date = true;
    outcome.figures = read_stage_record(folder, "import").figures;
    outcome.exit_code = outcome.figures.value("stage_exit", 0);
    return outcome;
  }
  if (mode == StageMode::check) return outcome;

  // A new import makes every later stage's output stale, so the whole folder is replaced at once.
  NewFolder fresh(folder);
  outcome = run_stage(fresh.path(), std::move(wanted), StageMode::force, context, [&](StageRecord& record) {
    ImportResult const result = import_any(request, context);
    write_scan_set(fresh.path(), result.set, context);
    auto files = result.files_read;
    std::sort(files.begin(), files.end());
    files.erase(std::unique(files.begin(), files.end()), files.end());
    record.inputs = Json::object();
    for (auto const& file : files) record.inputs[input_name(file, request.input)] = hash_file(file);
    record.inputs["listing"] = hash_listing(request.input);
    record.outputs = image_hashes(fresh.path(), result.set);
    record.figures = {{"views", result.set.views.size()},
                      {"depths", result.depths},
                      {"unit", to_string(result.set.unit)},
                      {"background_removed", result.background_removed},
                      {"failed", result.failed_views}};
    if (!result.failed_views.empty()) record.figures["stage_exit"] = static_cast<int>(ErrorCode::partial);
    return import_section(result.set);
  });
  fresh.commit();
  // Its title is the folder's name, which is only now the final one.
  write_report(folder);
  return outcome;
}

}  // namespace scanview
