#pragma once
#include <Eigen/Geometry>
#include <opencv2/core/mat.hpp>

#include "calib/camera.h"

namespace scanview {

/// A rendered picture. color: 8-bit sRGB, straight alpha, OpenCV's order (BGRA); alpha 0 where nothing was drawn.
/// depth: z in the rendering camera, NaN where nothing was drawn. Both have the camera's size.
struct Frame {
  cv::Mat4b color;
  cv::Mat1f depth;
};

/// Anything that can draw a scene from a camera: view-based, full model, culled, walkthrough, LDI tree. One interface,
/// so that one evaluation compares them all. Not thread-safe; use one a thread.
class Renderer {
 public:
  virtual ~Renderer() = default;
  virtual Frame render(Camera const& camera, Eigen::Isometry3d const& object_from_camera) = 0;
};

}  // namespace scanview
