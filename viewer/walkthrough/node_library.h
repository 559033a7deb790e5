#pragma once
#include <Eigen/Core>
#include <cstddef>
#include <memory>
#include <string>
#include <vector>

#include "viewer/walkthrough/raster_node.h"

namespace scanview {

/// What a library holds and does at a moment.
struct NodeTraffic {
  std::size_t nodes = 0;    ///< of which something is in memory
  std::size_t bytes = 0;    ///< of memory that they take, about
  std::size_t waiting = 0;  ///< that were asked for and are still to be read
  std::size_t settled = 0;  ///< readings that have ended so far, well or not: a change may change the picture
};

/// Where the nodes are that a renderer draws, and the nodes themselves as far as they are in memory.
class NodeLibrary {
 public:
  virtual ~NodeLibrary() = default;
  virtual std::vector<Eigen::Vector3d> const& positions() const = 0;
  /// How far an eye may be from a node that its triangles were made for.
  virtual double walking_radius() const = 0;
  /// Of the nodes' pictures, in pixels, the median: with the walking radius it says what a pixel of parallax is.
  virtual double focal_length() const = 0;
  /// A node to be drawn for an eye at this distance, in the detail that such an eye needs. Null where it failed, or,
  /// unless `wait` is `Wait::yes`, is still being read.
  enum class Wait { no, yes };
  virtual std::shared_ptr<RasterNode const> get(std::size_t node, double distance, Wait wait) = 0;
  /// One line a node that failed, in their order.
  virtual std::vector<std::string> failures() const = 0;
  /// Whether nothing of a node can be shown, ever: reading it has failed in every detail.
  virtual bool has_failed(std::size_t node) const = 0;
  virtual NodeTraffic traffic() const = 0;
  /// Where the eye is now, by which nodes are read ahead and forgotten.
  virtual void follow(Eigen::Vector3d const& eye) = 0;
};

/// Of nodes in memory, all in full detail.
std::shared_ptr<NodeLibrary> make_node_library(std::vector<NodeMesh> const& nodes, double walking_radius,
                                               NodeQuality quality = NodeQuality::density);

}  // namespace scanview
