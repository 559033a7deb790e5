#include "viewer/view_based/raster_view.h"

#include "viewer/raster/raster_texture.h"
#include "viewer/view_based/view_transform.h"

namespace scanview {
namespace {

VertexArrays vertex_arrays(std::vector<Eigen::Vector3f> const& vertices) {
  VertexArrays arrays;
  arrays.count = vertices.size();
  std::size_t const padded = vertices.size() + 16;
  for (auto* const array : {&arrays.x, &arrays.y, &arrays.z}) array->assign(padded, 0.0F);
  for (std::size_t i = 0; i < vertices.size(); ++i) {
    arrays.x[i] = vertices[i].x();
    arrays.y[i] = vertices[i].y();
    arrays.z[i] = vertices[i].z();
  }
  return arrays;
}

}  // namespace

RasterView::RasterView(View const& view, ViewMesh const& view_mesh, cv::Mat3b const& picture)
    : camera_(view_mesh.camera), object_from_camera_(*view.object_from_camera), gain_(view.gain.cast<float>()) {
  for (auto const& vertex : view_mesh.mesh.vertices) bounds_.extend(vertex.cast<double>());
  PicturePyramid const pyramid = picture_pyramid(picture, view_mesh);
  area_ = pyramid.area;
  texture_ = raster_texture(pyramid);
  mesh_.vertices = vertex_arrays(view_mesh.mesh.vertices);
  for (auto const& triangle : view_mesh.mesh.triangles) {
    for (int k = 0; k < 3; ++k) mesh_.corners.push_back(triangle[k]);
  }
  auto const labels = cosine_labels(view_mesh);
  mesh_.labels.assign(labels.begin(), labels.end());
}

bool RasterView::transform_to(Camera const& camera, Eigen::Isometry3d const& object_from_camera,
                              ScreenTransform& transform) const {
  // In double precision: the two poses may be far from the origin, their difference is not.
  Eigen::Isometry3d const camera_from_source = object_from_camera.inverse() * object_from_camera_;
  DepthRange range;
  if (!depth_range(bounds_, camera_from_source, camera.is_perspective(), range)) return false;
  Eigen::Matrix<double, ScreenTransform::kRows, 4> rows;
  auto picture = picture_from_camera(camera);
  picture.topRows<2>() -= 0.5 * picture.row(2).replicate<2, 1>();  // from corners to centres
  rows << picture * camera_from_source.matrix(), picture_from_camera(camera_, area_.x, area_.y),
      camera_from_source.matrix().row(2);
  for (int r = 0; r < ScreenTransform::kRows; ++r) {
    for (int c = 0; c < 4; ++c) transform.rows[r][c] = rows(r, c);
  }
  transform.perspective = camera.is_perspective();
  transform.near = range.near;
  return true;
}

}  // namespace scanview
