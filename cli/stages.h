#pragma once
#include <filesystem>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "acquire/acquire.h"
#include "acquire/import.h"
#include "base/context.h"
#include "base/html.h"
#include "base/stage_record.h"
#include "cli/session.h"
#include "mesh/view_mesh.h"
#include "register/alignment.h"

namespace scanview {

/// How a stage ended for its set.
struct StageOutcome {
  Json figures;                 ///< the verb's keys of --report
  bool was_up_to_date = false;  ///< nothing was done: inputs, options and version are those of the last time
  int exit_code = 0;            ///< 0, 4 (no solution) or 6 (part of the views failed)
};

/// When a stage works and what it only tells.
enum class StageMode {
  resume,  ///< work only where something changed
  force,   ///< work in any case
  check    ///< change nothing; `was_up_to_date` tells whether it would work
};

struct AcquireRequest {
  std::filesystem::path folder;    ///< where the pictures are
  std::filesystem::path manifest;  ///< capture.json
  AcquireOptions options;
  bool measure_reading = false;  ///< also tell how long only reading the pictures takes
};
struct ImportRequest {
  std::string kind;  ///< rgbd, stanford, nerfstudio, colmap, or scanset (a copy of a set)
  std::filesystem::path input;
  ImportOptions options;
};
struct RegisterRequest {
  enum class Start { automatic, options, file } start = Start::automatic;  ///< automatic: given poses, else a turntable
  std::filesystem::path pose_file;                                         ///< Start::file
  RegisterOptions options;
  /// 2: also bring the views to one exposure (View::gain, ScanSet::light); 1: by gains alone; 0: all gains 1.
  int exposure = 2;
};
struct MeshRequest {
  MeshOptions options;
  int levels = 1;  ///< of detail: mesh.ply is level 0, every other has twice the tolerance of the one before
  std::filesystem::path marks;  ///< mesh_marks.h; empty: none
};
struct EvaluateRequest {
  std::string hold_out = "one";  ///< one (each in turn), every:N, or names with commas
};

/// A stage reads the set in `folder`, works, writes its output and its record, notes its time in timings.json and
/// renews report.html. Each can be run again at any time; what an interrupted one left is replaced.
StageOutcome acquire_stage(std::filesystem::path const& folder, AcquireRequest const& request, StageMode mode,
                           Context& context);
StageOutcome import_stage(std::filesystem::path const& folder, ImportRequest const& request, StageMode mode,
                          Context& context);
StageOutcome register_stage(std::filesystem::path const& folder, RegisterRequest const& request, StageMode mode,
                            Context& context);
StageOutcome mesh_stage(std::filesystem::path const& folder, MeshRequest const& request, StageMode mode,
                        Context& context);
/// Pictures for the report: an orbit and from halfway between views.
StageOutcome render_stage(std::filesystem::path const& folder, StageMode mode, Context& context);
StageOutcome evaluate_stage(std::filesystem::path const& folder, EvaluateRequest const& request, StageMode mode,
                            Context& context);

/// The part all stages share. `inputs` names what decides the result; `work` fills outputs and figures of the record
/// and returns the section of the report.
StageOutcome run_stage(std::filesystem::path const& folder, StageRecord record, StageMode mode, Context& context,
                       std::function<ReportSection(StageRecord&)> const& work);

/// Hash of each image file of the set, by relative path.
Json image_hashes(std::filesystem::path const& folder, ScanSet const& set);
/// What pictures depend on: images, meshes, and all that the manifest says. Throws Error{bad_input} without meshes.
Json picture_inputs(std::filesystem::path const& folder, ScanSet const& set);
/// The meshes that `mesh` wrote, in the order of the views. Throws Error{bad_input} where they are missing.
std::vector<ViewMesh> read_view_meshes(std::filesystem::path const& folder, ScanSet const& set, Context& context);
/// Throws Error{bad_input} where `folder` exists and is neither empty nor a scan set: it would be replaced.
void require_replaceable(std::filesystem::path const& folder);

}  // namespace scanview
