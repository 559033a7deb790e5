#pragma once
#include <opencv2/core/types.hpp>
#include <vector>

#include "mesh/node_mesh.h"
#include "viewer/view_based/picture_pyramid.h"

namespace scanview {

/// The pictures of a node's sides in one, each with a gutter of kGutter pixels or more around it.
struct NodeAtlas {
  static constexpr int kGutter = 16;
  static constexpr std::size_t kLevels = 4;  ///< the coarsest level's filter stays within the gutter
  PicturePyramid pyramid;
  std::vector<cv::Point> origins;  ///< where each side's first pixel lies
};

/// In the gutter is what another side's picture shows in that direction, and where none does, the nearest pixel.
NodeAtlas node_atlas(NodeMesh const& node);

}  // namespace scanview
