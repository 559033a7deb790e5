#pragma once
#include <Eigen/Geometry>
#include <cstdint>
#include <opencv2/core/mat.hpp>

#include "calib/camera.h"
#include "mesh/triangle_mesh.h"
#include "viewer/raster/triangle_bins.h"
#include "viewer/view_based/view_transform.h"

namespace scanview {

inline constexpr std::int32_t kNoTriangle = -1;

/// Which triangle of a mesh each pixel shows, and its depth (z in the camera; NaN where there is none).
struct IdBuffer {
  cv::Mat1i id;  ///< kNoTriangle where there is none
  cv::Mat1f depth;
};

/// Draws a mesh whose vertices are in object coordinates. threads: at most so many; 0: all processors.
IdBuffer draw_id_buffer(TriangleMesh const& mesh, Camera const& camera, Eigen::Isometry3d const& object_from_camera,
                        Culling culling = Culling::none, int threads = 0);

/// A picture as the rasteriser leaves it, rows `stride` elements apart: the label of what each pixel shows, and its key
/// (ScreenVertex); −infinity: nothing.
struct KeyedIds {
  float* keys;
  std::uint32_t* ids;
  int stride;
};
/// The same in tiles, of any size, clipped at the near plane of `range`; on the threads of the arena it is called in.
void draw_keyed_ids(RasterMesh const& mesh, Camera const& camera, Eigen::Isometry3d const& object_from_camera,
                    DepthRange const& range, Culling culling, KeyedIds const& out);

}  // namespace scanview
