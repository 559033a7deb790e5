#include "viewer/walkthrough/node_atlas.h"

#include <algorithm>
#include <cmath>

namespace scanview {
namespace {

constexpr int kAlign = 16;  // of origins: each level halves

cv::Vec3b bilinear(cv::Mat3b const& picture, double x, double y) {
  x = std::clamp(x, 0.0, picture.cols - 1.0);
  y = std::clamp(y, 0.0, picture.rows - 1.0);
  int const left = int(x), top = int(y), right = std::min(left + 1, picture.cols - 1),
            bottom = std::min(top + 1, picture.rows - 1);
  double const u = x - left, v = y - top;
  cv::Vec3b result;
  for (int c = 0; c < 3; ++c)
    result[c] = cv::saturate_cast<uchar>((1 - v) * ((1 - u) * picture(top, left)[c] + u * picture(top, right)[c]) +
                                         v * ((1 - u) * picture(bottom, left)[c] + u * picture(bottom, right)[c]));
  return result;
}

/// What lies beyond the picture of side `of`, at a place of it.
cv::Vec3b beyond(NodeMesh const& node, std::size_t of, int x, int y) {
  NodeMesh::Side const& side = node.sides[of];
  Eigen::Vector3d const ray = side.node_from_camera * side.camera.ray_direction(x, y);
  for (std::size_t s = 0; s < node.sides.size(); ++s) {
    if (s == of) continue;
    NodeMesh::Side const& other = node.sides[s];
    Eigen::Vector3d const seen = other.node_from_camera.transpose() * ray;
    if (!(seen.z() > 0)) continue;
    Eigen::Vector2d const place = other.camera.project(seen);
    if (other.camera.contains(place)) return bilinear(other.color, place.x(), place.y());
  }
  return side.color(std::clamp(y, 0, side.color.rows - 1), std::clamp(x, 0, side.color.cols - 1));
}

}  // namespace

NodeAtlas node_atlas(NodeMesh const& node) {
  auto const cell = [](int size) { return (size + 2 * NodeAtlas::kGutter + kAlign - 1) / kAlign * kAlign; };
  int width = 0, height = 0;
  for (NodeMesh::Side const& side : node.sides) {
    width = std::max(width, cell(side.camera.width()));
    height = std::max(height, cell(side.camera.height()));
  }
  int const count = int(node.sides.size()), columns = int(std::ceil(std::sqrt(count)));
  int const rows = (count + columns - 1) / columns;
  NodeAtlas atlas;
  atlas.pyramid.area = cv::Rect(0, 0, columns * width, rows * height);
  cv::Mat3b picture(atlas.pyramid.area.size(), cv::Vec3b(0, 0, 0));
  atlas.pyramid.feather = cv::Mat1b::zeros(picture.size());
  for (int s = 0; s < count; ++s) {
    NodeMesh::Side const& side = node.sides[s];
    cv::Point const origin(s % columns * width + NodeAtlas::kGutter, s / columns * height + NodeAtlas::kGutter);
    atlas.origins.push_back(origin);
    int const right = width - NodeAtlas::kGutter, bottom = height - NodeAtlas::kGutter;
    for (int y = -NodeAtlas::kGutter; y < bottom; ++y)
      for (int x = -NodeAtlas::kGutter; x < right; ++x) {
        bool const inside = x >= 0 && y >= 0 && x < side.color.cols && y < side.color.rows;
        picture(origin.y + y, origin.x + x) = inside ? side.color(y, x) : beyond(node, s, x, y);
        // The mesh ends at the picture's edge only where no other side goes on: there its own feather says so.
        int const fx = std::clamp(x, 0, side.color.cols - 1), fy = std::clamp(y, 0, side.color.rows - 1);
        atlas.pyramid.feather(origin.y + y, origin.x + x) = uchar(std::lround(std::sqrt(255.0 * side.feather(fy, fx))));
      }
  }
  atlas.pyramid.levels = picture_levels(picture, NodeAtlas::kLevels);
  return atlas;
}

}  // namespace scanview
