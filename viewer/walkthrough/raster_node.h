#pragma once
#include <Eigen/Geometry>
#include <cstddef>
#include <vector>

#include "mesh/node_mesh.h"
#include "viewer/raster/layer_rasterizer.h"

namespace scanview {

/// What says which of several nodes' samples of a surface is the better one. flat: its triangle's |N · R| (Darsa 1998,
/// §4.4). smooth: interpolated between vertices (§6.2: "Gouraud shading can be used"). density: how many texels a unit
/// of the surface has, |N · R| / d², d the distance from the node where it is more than the walking radius; in a
/// mixture its fourth power counts, since blur adds up where noise would average.
enum class NodeQuality { flat, smooth, density };

/// A node as the rasteriser draws it: a mesh a side, all pictures in one atlas. Around every picture lies a gutter that
/// shows what the neighbouring sides see there, so that filtering finds no seam.
class RasterNode {
 public:
  /// `walking_radius`: of all nodes that are drawn together.
  RasterNode(NodeMesh const& node, NodeQuality quality, double walking_radius);
  Eigen::Vector3d const& position() const { return position_; }
  RasterTexture const& texture() const { return texture_; }
  std::size_t triangles() const;
  std::size_t bytes() const;  ///< of memory, about

  /// The sides that may show something in the picture, for drawing them as one layer; no parts: none of them. Sides are
  /// left out whole (§5): those whose pyramid or whose triangles' box lies outside a side of the camera's frustum, or
  /// the frustum outside a side of the pyramid. Backs hide what is behind them: seen from there, a wall is not
  /// transparent.
  enum class What { surfaces, panes };
  LayerRasterizer::Layer layer(Camera const& camera, Eigen::Isometry3d const& scene_from_camera,
                               What what = What::surfaces) const;

 private:
  struct Side {
    RasterMesh mesh, panes;
    Eigen::Matrix<double, 3, 4> texture_from_node;  ///< homogeneous texels (s w, t w, w) of a point
    Eigen::AlignedBox3d bounds;                     ///< node coordinates
    std::vector<Eigen::Vector3d> rays;              ///< through the picture's corners, in their order around it
  };
  bool may_show(Side const& side, RasterMesh const& mesh, Camera const& camera,
                Eigen::Isometry3d const& node_from_camera) const;

  Eigen::Vector3d position_;
  std::vector<Side> sides_;
  RasterTexture texture_;
  double nearest_ = 0;  ///< what is nearer to the eye is not drawn
};

}  // namespace scanview
