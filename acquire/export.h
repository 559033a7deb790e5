#pragma once
#include <filesystem>

#include "acquire/scan_set.h"
#include "base/context.h"

namespace scanview {

// A scan set in the formats of other programs. Each output appears whole or not at all; a folder replaces an earlier
// export of its kind, never a folder that holds anything else (Error{bad_input}). Colours are multiplied by the
// view's gain (in linear light), as our renderers do. All throw Error{bad_input} for a set without views, with a view
// that has no pose or no colour, and Error{io} where writing fails.

/// Throws Error{bad_input, path} naming the first view that has no pose, or where the set has no views.
void require_poses(std::filesystem::path const& path, ScanSet const& set);

/// All depths of all views as one coloured point cloud in object coordinates: binary little-endian PLY with x y z,
/// nx ny nz (float; towards the camera that saw the point; 0 0 0 where it has too few neighbours) and red green blue.
/// About 72 bytes of memory a point.
void export_point_cloud(std::filesystem::path const& path, ScanSet const& set, Context& context);

/// A COLMAP workspace: sparse/cameras.txt, images.txt and points3D.txt (some 50 000 of the depths, each observed by its
/// own view), images/NAME.png and stereo/depth_maps/NAME.png.geometric.bin, with COLMAP's pixel centres at halves. The
/// world is the object's coordinate system, in the set's unit. COLMAP has perspective cameras only: an orthographic
/// view is an Error{bad_input} that names it.
void export_colmap(std::filesystem::path const& folder, ScanSet const& set, Context& context);

/// nerfstudio's transforms.json (camera axes as in OpenGL: y up, looking along -z; pixel centres at halves) with
/// images/NAME.png, depths/NAME.png and masks/NAME.png (255: the object, 0: background). Depth is 16-bit z in steps of
/// `depth_unit_scale_factor` units, the finest step of two digits with which the set's greatest depth fits; 0 is
/// missing. `unit` names the set's unit. Orthographic views are refused as above.
void export_nerfstudio(std::filesystem::path const& folder, ScanSet const& set, Context& context);

}  // namespace scanview
