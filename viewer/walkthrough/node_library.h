#pragma once
#include <Eigen/Core>
#include <cstddef>
#include <memory>
#include <string>
#include <vector>

#include "viewer/walkthrough/raster_node.h"

namespace scanview {

/// Where the nodes are that a renderer draws, and the nodes themselves as far as they are in memory.
class NodeLibrary {
 public:
  virtual ~NodeLibrary() = default;
  virtual std::vector<Eigen::Vector3d> const& positions() const = 0;
  /// How far an eye may be from a node that its triangles were made for.
  virtual double walking_radius() const = 0;
  /// Pixels across 90 degrees of the nodes' pictures, the median: what a pixel of parallax is.
  virtual double focal_length() const = 0;
  /// A node to be drawn for an eye at this distance, in the detail that such an eye needs. Null where it failed, or,
  /// unless `wait` is `Wait::yes`, is still being read.
  enum class Wait { no, yes };
  virtual std::shared_ptr<RasterNode const> get(std::size_t node, double distance, Wait wait) = 0;
  /// One line a node that failed, in their order.
  virtual std::vector<std::string> failures() const = 0;
  /// Where the eye is now, by which nodes are read ahead and forgotten.
  virtual void follow(Eigen::Vector3d const& eye) = 0;
};

/// Of nodes in memory, all in full detail.
std::shared_ptr<NodeLibrary> make_node_library(std::vector<NodeMesh> const& nodes, double walking_radius,
                                               NodeQuality quality = NodeQuality::density);

}  // namespace scanview
