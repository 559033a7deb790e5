#pragma once
#include <filesystem>

#include "synth/capture.h"

namespace scanview {

/// Takes and writes a whole capture into an existing folder (usually NewFolder::path()), as DESIGN.md describes it:
/// capture.json, rig.yml, view_NNN/{left,right}/FRAME.png, view_NNN/{left,right}_color.png, empty/ likewise where there
/// is a stage, boards/{left,right}/NN.png with boards.json (their true poses), and beside them the truth:
/// truth/scanset.json (the ideal left camera's poses), truth/NNN.exr (depth of the object), truth/visible_NNN.png,
/// truth/model.ply, truth/rig.yml (the rig that took the frames). Memory: the frames of one camera and view. Reports
/// progress as stage "capture".
void write_capture(std::filesystem::path const& folder, TriangleMesh const& model, CaptureRig const& rig,
                   Context& context);

}  // namespace scanview
