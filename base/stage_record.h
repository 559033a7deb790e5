#pragma once
#include <filesystem>
#include <string>

#include "base/files.h"

namespace scanview {

/// The program's version, as it stands in every record.
std::string version();

/// What a stage read and wrote, kept as STAGE.json in the set's folder; written last, so that it vouches for the rest.
struct StageRecord {
  std::string stage;  ///< the verb: "import", "register", "mesh" ...
  Json options;       ///< everything that changes the result (not threads)
  Json inputs;        ///< object: name of a file or field -> hash
  Json outputs;       ///< object: path relative to the set -> hash; fields of scanset.json as "scanset.json#name"
  Json figures;       ///< what the stage measured: the verb's keys of --report, without times
};

/// True where FOLDER/STAGE.json was written by this version with equal options and inputs, and every output file still
/// has its hash (fields "…#…" are not checked here: they are the caller's). Never throws: a damaged record is no
/// record.
bool is_up_to_date(std::filesystem::path const& folder, StageRecord const& wanted);

/// Reads FOLDER/STAGE.json; throws Error{bad_input}.
StageRecord read_stage_record(std::filesystem::path const& folder, std::string const& stage);
void write_stage_record(std::filesystem::path const& folder, StageRecord const& record);

}  // namespace scanview
