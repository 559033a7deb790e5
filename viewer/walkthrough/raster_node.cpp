#include "viewer/walkthrough/raster_node.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "base/median.h"
#include "viewer/raster/raster_texture.h"
#include "viewer/view_based/view_transform.h"
#include "viewer/walkthrough/node_atlas.h"

namespace scanview {
namespace {

using Eigen::Vector3d;

/// A plane that a region lies on the positive side of.
struct Plane {
  Vector3d normal;
  double offset;
  double at(Vector3d const& point) const { return normal.dot(point) + offset; }
};

std::vector<Eigen::Vector2d> corners_of(Camera const& camera) {
  double const w = camera.width() - 0.5, h = camera.height() - 0.5;
  return {{-0.5, -0.5}, {w, -0.5}, {w, h}, {-0.5, h}};
}

/// A pyramid, or the box that an orthographic camera sees: where its edges begin, and where they go.
struct Edges {
  std::vector<Vector3d> origins, directions;

  std::vector<Plane> planes() const {
    std::vector<Plane> result;
    for (std::size_t i = 0; i < origins.size(); ++i) {
      std::size_t const next = (i + 1) % origins.size();
      Vector3d const normal = directions[i].cross(origins[next] + directions[next] - origins[i]);
      Vector3d const turned = normal.dot(directions[(i + 2) % 4]) + normal.dot(origins[(i + 2) % 4] - origins[i]) < 0
                                  ? Vector3d(-normal.normalized())
                                  : Vector3d(normal.normalized());
      result.push_back({turned, -turned.dot(origins[i])});
    }
    return result;
  }
  /// Whether all of it is on the negative side, and not merely beside rounding.
  bool is_behind(Plane const& plane) const {
    constexpr double kRounding = 1e-12;
    for (std::size_t i = 0; i < origins.size(); ++i) {
      double const scale = origins[i].norm() + std::abs(plane.offset);
      if (plane.at(origins[i]) > -kRounding * scale ||
          plane.normal.dot(directions[i]) > -kRounding * directions[i].norm())
        return false;
    }
    return true;
  }
};

bool is_behind(Eigen::AlignedBox3d const& box, Plane const& plane) {
  for (int i = 0; i < 8; ++i)
    if (plane.at(box.corner(static_cast<Eigen::AlignedBox3d::CornerType>(i))) >= 0) return false;
  return true;
}

RasterMesh pane_mesh(NodeMesh const& node, NodeMesh::Side const& side) {
  TriangleMesh mesh;
  std::vector<int> index(node.panes.vertices.size(), -1);
  for (std::size_t t = side.first_pane; t < side.end_pane; ++t) {
    Eigen::Vector3i triangle;
    for (int i = 0; i < 3; ++i) {
      int& at = index[node.panes.triangles[t][i]];
      if (at < 0) {
        at = int(mesh.vertices.size());
        mesh.vertices.push_back(node.panes.vertices[node.panes.triangles[t][i]]);
      }
      triangle[i] = at;
    }
    mesh.triangles.push_back(triangle);
  }
  return raster_mesh(mesh, std::vector<std::uint32_t>(mesh.triangles.size(), 65535));
}

std::vector<float> vertex_quality(NodeMesh const& node, NodeQuality quality, double walking_radius) {
  constexpr float kLeast = 4.0F / 65535;  // in 16 bits still more than nothing
  std::vector<float> result = node.smooth_quality();
  for (std::size_t v = 0; v < result.size(); ++v) {
    double const times = node.vertices[v].cast<double>().norm() / walking_radius;
    if (quality == NodeQuality::density && times > 1) result[v] /= float(times * times);
    result[v] = std::max(result[v], kLeast);
  }
  return result;
}

}  // namespace

RasterNode::RasterNode(NodeMesh const& node, NodeQuality quality, double walking_radius) : position_(node.position) {
  NodeAtlas const atlas = node_atlas(node);
  texture_ = raster_texture(atlas.pyramid);
  std::vector<float> const smooth =
      quality == NodeQuality::flat ? std::vector<float>() : vertex_quality(node, quality, walking_radius);
  std::vector<double> distances;
  for (auto const& vertex : node.vertices) distances.push_back(vertex.cast<double>().norm());
  // Most of a node may be far away, as the sky is, and what is near still be looked at from nearby.
  constexpr double kOfMedian = 1e-6, kOfNearest = 1e-3;
  if (!distances.empty())
    nearest_ =
        std::min(kOfMedian * median(distances), kOfNearest * *std::min_element(distances.begin(), distances.end()));
  for (std::size_t s = 0; s < node.sides.size(); ++s) {
    NodeMesh::Side const& from = node.sides[s];
    Side side;
    TriangleMesh mesh;
    std::vector<int> index(node.vertices.size(), -1);
    std::vector<float> of_vertices;
    std::vector<std::uint32_t> labels;
    for (std::size_t t = from.first; t < from.end; ++t) {
      Eigen::Vector3i triangle;
      for (int i = 0; i < 3; ++i) {
        int const v = node.triangles[t][i];
        if (index[v] < 0) {
          index[v] = int(mesh.vertices.size());
          mesh.vertices.push_back(node.vertices[v]);
          side.bounds.extend(node.vertices[v].cast<double>());
          if (!smooth.empty()) of_vertices.push_back(smooth[v]);
        }
        triangle[i] = index[v];
      }
      mesh.triangles.push_back(triangle);
      constexpr float kOne = 65535;
      labels.push_back(smooth.empty() ? std::uint32_t(std::max(1L, std::lround(kOne * node.quality[t])))
                                      : std::uint32_t(kOne));
    }
    side.mesh = raster_mesh(mesh, std::move(labels));
    if (!smooth.empty()) {
      of_vertices.resize(side.mesh.vertices.x.size(), 0.0F);
      side.mesh.vertices.quality = std::move(of_vertices);
    }
    side.panes = pane_mesh(node, from);
    for (std::size_t i = 0; i < side.panes.vertices.count; ++i)
      side.bounds.extend(Vector3d(side.panes.vertices.x[i], side.panes.vertices.y[i], side.panes.vertices.z[i]));
    side.texture_from_node.setZero();
    side.texture_from_node.leftCols<3>() =
        picture_from_camera(from.camera, -atlas.origins[s].x, -atlas.origins[s].y).leftCols<3>() *
        from.node_from_camera.transpose();
    for (auto const& corner : corners_of(from.camera))
      side.rays.push_back(from.node_from_camera * from.camera.ray_direction(corner.x(), corner.y()));
    sides_.push_back(std::move(side));
  }
}

std::size_t RasterNode::triangles() const {
  std::size_t count = 0;
  for (Side const& side : sides_) count += side.mesh.labels.size();
  return count;
}

std::size_t RasterNode::bytes() const {
  std::size_t count = 4 * (texture_.texels.size() + texture_.feather.size());
  for (Side const& side : sides_)
    count += 4 * (4 * side.mesh.vertices.x.size() + side.mesh.corners.size() + side.mesh.labels.size());
  return count;
}

bool RasterNode::may_show(Side const& side, RasterMesh const& mesh, Camera const& camera,
                          Eigen::Isometry3d const& node_from_camera) const {
  if (mesh.labels.empty()) return false;
  Edges frustum, pyramid;
  for (auto const& corner : corners_of(camera)) {
    frustum.origins.push_back(node_from_camera * camera.ray_origin(corner.x(), corner.y()));
    frustum.directions.push_back(node_from_camera.linear() * camera.ray_direction(corner.x(), corner.y()));
  }
  pyramid.origins.assign(4, Vector3d::Zero());
  pyramid.directions = side.rays;
  for (Plane const& plane : frustum.planes())
    if (pyramid.is_behind(plane) || is_behind(side.bounds, plane)) return false;
  for (Plane const& plane : pyramid.planes())
    if (frustum.is_behind(plane)) return false;
  if (camera.is_perspective()) {
    Vector3d const forward = node_from_camera.linear().col(2);
    if (is_behind(side.bounds, {forward, -forward.dot(node_from_camera.translation())})) return false;
  }
  return true;
}

LayerRasterizer::Layer RasterNode::layer(Camera const& camera, Eigen::Isometry3d const& scene_from_camera,
                                         What what) const {
  // In double precision: eye and node may be far from the origin, their difference is not.
  Eigen::Isometry3d node_from_camera = scene_from_camera;
  node_from_camera.translation() -= position_;
  Eigen::Isometry3d const camera_from_node = node_from_camera.inverse();
  LayerRasterizer::Layer layer;
  layer.largest_lod = float(texture_.levels.size() - 1);
  layer.culling = Culling::backs_hide;
  for (Side const& side : sides_) {
    LayerRasterizer::Part part;
    part.mesh = what == What::surfaces ? &side.mesh : &side.panes;
    if (!may_show(side, *part.mesh, camera, node_from_camera)) continue;
    part.transform = screen_transform(camera, camera_from_node, {nearest_, 0});
    for (int c = 0; c < 4; ++c) {
      part.transform.rows[ScreenTransform::s][c] = side.texture_from_node(0, c);
      part.transform.rows[ScreenTransform::t][c] = side.texture_from_node(1, c);
      part.transform.rows[ScreenTransform::texture_w][c] = side.texture_from_node(2, c);
    }
    layer.parts.push_back(part);
  }
  return layer;
}

}  // namespace scanview
