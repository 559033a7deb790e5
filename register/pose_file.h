#pragma once
#include <filesystem>

#include "acquire/scan_set.h"

namespace scanview {

/// Takes the poses of `set`'s views from another program's file (the images are needed for marks only):
///   *.conf        Stanford: of scans that `import stanford` has read (or their archive), which lie beside it; or of
///                 the set's own meshes, as write_poses names them
///   *.aln         MeshLab: number of meshes, then NAME, '#', four rows of world_from_mesh
///   *.json        a scanset.json (views by name), nerfstudio's transforms.json (by name), an rgbd.json (frames in
///                 order), or marks: {"marks": {"VIEW": {"POINT": [u, v], ...}, ...}} (see marks.h)
///   images.txt    COLMAP's text model, by name
///   otherwise     in the order of the views: a Redwood trajectory (blocks of "i j n" and four rows of
///                 world_from_camera) where the first line has three words, else TUM's "time tx ty tz qx qy qz qw"
/// or from the folder that holds one of these (see find_pose_file). A name is that of the file without its ending, made
/// safe as import does. Lengths are converted where file and set both name a unit, and else are the set's.
/// Throws Error{bad_input} naming file and view where a view gets no pose, a pose is not rigid, there are more or fewer
/// poses without a name than views, or marks do not determine a pose.
void read_poses(std::filesystem::path const& path, ScanSet& set);

/// The file that read_poses takes them from: of a folder its scanset.json, transforms.json, rgbd.json, or the
/// images.txt of the COLMAP model in it. Throws Error{bad_input} where there is none.
std::filesystem::path find_pose_file(std::filesystem::path const& path);

enum class PoseFormat { conf, aln, tum, redwood };

/// Writes the poses of a set, whole or not at all, with all digits: read_poses gives them back. Lengths are in the
/// set's unit. `folder` is the set's: .conf and .aln name its meshes (views/NAME/mesh.ply, which `mesh` writes, in
/// camera coordinates), relative to the file, so that MeshLab opens them as they lie. TUM's times and Redwood's numbers
/// count the views. Throws Error{bad_input} naming the view that has no pose, or where a .conf would have to name a
/// file with a space in its path; Error{io} where writing fails.
void write_poses(std::filesystem::path const& path, PoseFormat format, ScanSet const& set,
                 std::filesystem::path const& folder);

}  // namespace scanview
