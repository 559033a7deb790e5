#pragma once
#include <memory>

#include "acquire/scan_set.h"
#include "viewer/evaluate/contender.h"

namespace scanview {

/// A single mesh fused from all depths, with a colour a vertex: Open3D's ScalableTSDFVolume, voxels of 1/300 of the
/// object's size (twice its radius), truncation four voxels, same poses and masks. Fused again whenever other views are
/// excluded. Null where the program was built without Open3D, or for orthographic views, which Open3D cannot fuse. The
/// set must outlive it.
std::unique_ptr<HeldOutRenderer> make_fused_mesh_renderer(ScanSet const& set);

}  // namespace scanview
