#pragma once
#include <Eigen/Core>
#include <vector>

#include "acquire/camera_light.h"
#include "mesh/view_mesh.h"

namespace scanview {

/// What re-lights a view (CameraLight): a pixel that camera C shows of it is multiplied by
/// exp(light(normal in C) − light(normal in the view's camera)), between ½ and 2.
struct VertexLight {
  std::vector<Eigen::Vector3f> normals;     ///< a vertex: unit, towards the view's camera, smoothed over neighbours
  std::vector<Eigen::Vector3f> logarithms;  ///< the light there as the view's camera saw it
};
VertexLight vertex_light(TriangleMesh const& mesh, CameraLight const& light);

}  // namespace scanview
