#include "base/stage_record.h"

#include "base/error.h"

namespace scanview {
namespace {

std::filesystem::path record_path(std::filesystem::path const& folder, std::string const& stage) {
  return folder / (stage + ".json");
}

}  // namespace

std::string version() { return SCANVIEW_VERSION; }

bool is_up_to_date(std::filesystem::path const& folder, StageRecord const& wanted) {
  try {
    if (!std::filesystem::exists(record_path(folder, wanted.stage))) return false;
    Json const json = read_json(record_path(folder, wanted.stage));
    if (json.at("version") != version() || json.at("options") != wanted.options || json.at("inputs") != wanted.inputs)
      return false;
    for (auto const& [name, hash] : json.at("outputs").items())
      if (name.find('#') == std::string::npos && hash_file(folder / name) != hash.get<std::string>()) return false;
    return true;
  } catch (std::exception const&) {
    return false;
  }
}

StageRecord read_stage_record(std::filesystem::path const& folder, std::string const& stage) {
  auto const path = record_path(folder, stage);
  Json const json = read_json(path);
  try {
    return {stage, json.at("options"), json.at("inputs"), json.at("outputs"), json.at("figures")};
  } catch (nlohmann::json::exception const&) {
    throw Error(ErrorCode::bad_input, path, "is not the record of a stage");
  }
}

void write_stage_record(std::filesystem::path const& folder, StageRecord const& record) {
  write_json(record_path(folder, record.stage), Json{{"stage", record.stage},
                                                     {"version", version()},
                                                     {"options", record.options},
                                                     {"inputs", record.inputs},
                                                     {"outputs", record.outputs},
                                                     {"figures", record.figures}});
}

}  // namespace scanview
