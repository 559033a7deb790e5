#pragma once
#include <filesystem>

#include "acquire/scan_set.h"

namespace scanview {

/// Takes the poses of `set`'s views from another program's file (the images are needed for marks only):
///   *.conf        Stanford: of scans that `import stanford` has read (or their archive); the scans lie beside it
///   *.aln         MeshLab: number of meshes, then NAME, '#', four rows of world_from_mesh
///   *.json        a scanset.json (views by name), an rgbd.json (frames in order), or marks:
///                 {"marks": {"VIEW": {"POINT": [u, v], ...}, ...}}: points named in two views or more, as pixels with
///                 a depth; each further view is fitted (Umeyama 1991) to the marks placed so far
///   otherwise     TUM: "stamp tx ty tz qx qy qz qw" a line, views in order; '#' starts a comment
/// Throws Error{bad_input} where a view gets no pose, a pose is not rigid, or marks do not determine one (fewer than
/// three common points, or collinear).
void read_poses(std::filesystem::path const& path, ScanSet& set);

}  // namespace scanview
