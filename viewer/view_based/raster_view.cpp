#include "viewer/view_based/raster_view.h"

#include "viewer/blend/soft_z.h"
#include "viewer/raster/raster_texture.h"
#include "viewer/view_based/vertex_light.h"
#include "viewer/view_based/view_transform.h"

namespace scanview {
RasterView::RasterView(View const& view, ViewMesh const& view_mesh, cv::Mat3b const& picture,
                       std::optional<CameraLight> const& light)
    : camera_(view_mesh.camera),
      object_from_camera_(*view.object_from_camera),
      gain_(view.gain.cast<float>()),
      light_(light) {
  for (auto const& vertex : view_mesh.mesh.vertices) bounds_.extend(vertex.cast<double>());
  PicturePyramid const pyramid = picture_pyramid(picture, view_mesh);
  area_ = pyramid.area;
  texture_ = raster_texture(pyramid);
  auto const labels = cosine_labels(view_mesh);
  mesh_ = raster_mesh(view_mesh.mesh, {labels.begin(), labels.end()});
  if (!light_) return;
  VertexLight const of_vertices = vertex_light(view_mesh.mesh, *light_);
  for (int c = 0; c < 3; ++c) {
    mesh_.vertices.normal[c].assign(mesh_.vertices.x.size(), 0.0F);
    mesh_.vertices.light[c].assign(mesh_.vertices.x.size(), 0.0F);
    for (std::size_t i = 0; i < of_vertices.normals.size(); ++i) {
      mesh_.vertices.normal[c][i] = of_vertices.normals[i][c];
      mesh_.vertices.light[c][i] = of_vertices.logarithms[i][c];
    }
  }
}

bool RasterView::transform_to(Camera const& camera, Eigen::Isometry3d const& object_from_camera, double spacing,
                              bool relight, ScreenTransform& transform) const {
  // In double precision: the two poses may be far from the origin, their difference is not.
  Eigen::Isometry3d const camera_from_source = object_from_camera.inverse() * object_from_camera_;
  DepthRange range;
  if (!depth_range(bounds_, camera_from_source, camera.is_perspective(), range)) return false;
  transform = screen_transform(camera, camera_from_source, range);
  Eigen::Matrix<double, 3, 4> const texture = picture_from_camera(camera_, area_.x, area_.y);
  for (int c = 0; c < 4; ++c) {
    transform.rows[ScreenTransform::s][c] = texture(0, c);
    transform.rows[ScreenTransform::t][c] = texture(1, c);
    transform.rows[ScreenTransform::texture_w][c] = texture(2, c);
  }
  Eigen::Vector3d const source = camera_.is_perspective() ? Eigen::Vector3d(camera_from_source.translation())
                                                          : Eigen::Vector3d(-camera_from_source.linear().col(2));
  for (int c = 0; c < 3; ++c) transform.source[c] = static_cast<float>(source[c]);
  transform.source_far = !camera_.is_perspective();
  transform.angle_scale = static_cast<float>(1 / (SoftZ::kNearSpacings * SoftZ::kNearSpacings * spacing * spacing));
  transform.lit = relight && light_;
  if (transform.lit) {
    for (int r = 0; r < 3; ++r) {
      for (int c = 0; c < 3; ++c) {
        transform.camera_from_source[r][c] = static_cast<float>(camera_from_source.linear()(r, c));
      }
      for (int k = 0; k < CameraLight::kTerms; ++k) {
        transform.light[k][r] = static_cast<float>(light_->coefficients(k, r));
      }
    }
  }
  return true;
}

RasterViews::RasterViews(std::shared_ptr<ViewLibrary> library) : library_(std::move(library)) {
  views_.resize(library_->meshes().size());
}

RasterView const* RasterViews::get(std::size_t view, bool wait) {
  if (!views_[view]) {
    cv::Mat3b const picture = wait ? library_->picture(view) : library_->picture_if_ready(view);
    if (picture.empty()) return nullptr;
    views_[view].emplace(library_->set().views[view], library_->meshes()[view], picture, library_->set().light);
  }
  return &*views_[view];
}

}  // namespace scanview
