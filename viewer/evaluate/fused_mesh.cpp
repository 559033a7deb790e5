#include "viewer/evaluate/fused_mesh.h"

#ifdef SCANVIEW_WITH_OPEN3D
#include <open3d/camera/PinholeCameraIntrinsic.h>
#include <open3d/geometry/Image.h>
#include <open3d/geometry/RGBDImage.h>
#include <open3d/geometry/TriangleMesh.h>
#include <open3d/pipelines/integration/ScalableTSDFVolume.h>

#include <algorithm>
#include <cmath>

#include "base/error.h"
#include "viewer/evaluate/held_out.h"
#include "viewer/raster/id_buffer.h"
#endif

namespace scanview {

#ifdef SCANVIEW_WITH_OPEN3D
namespace {

class FusedMesh final : public HeldOutRenderer {
 public:
  explicit FusedMesh(ScanSet const& set) : set_(set) { exclude({}); }

  void exclude(std::vector<std::size_t> const& views) override {
    double const voxel = 2 * set_.radius() / 300;
    open3d::pipelines::integration::ScalableTSDFVolume volume(
        voxel, 4 * voxel, open3d::pipelines::integration::TSDFVolumeColorType::RGB8);
    bool any = false;
    for (std::size_t i = 0; i < set_.views.size(); ++i) {
      if (std::find(views.begin(), views.end(), i) != views.end()) continue;
      integrate(set_.views[i], volume);
      any = true;
    }
    if (!any) throw Error(ErrorCode::bad_input, {}, "no view is left to fuse");
    auto const mesh = volume.ExtractTriangleMesh();
    mesh_ = TriangleMesh();
    colors_ = mesh->vertex_colors_;
    for (auto const& vertex : mesh->vertices_) mesh_.vertices.push_back(vertex.cast<float>());
    for (auto const& triangle : mesh->triangles_) mesh_.triangles.push_back(triangle);
  }

  Frame render(Camera const& camera, Eigen::Isometry3d const& object_from_camera) override {
    IdBuffer const ids = draw_id_buffer(mesh_, camera, object_from_camera);
    Frame frame;
    frame.depth = ids.depth;
    frame.color = cv::Mat4b(camera.height(), camera.width(), cv::Vec4b(0, 0, 0, 0));
    for (int y = 0; y < camera.height(); ++y) {
      for (int x = 0; x < camera.width(); ++x) {
        if (ids.id(y, x) == kNoTriangle) continue;
        auto const& corners = mesh_.triangles[static_cast<std::size_t>(ids.id(y, x))];
        Eigen::Vector3d const p = object_from_camera * camera.unproject(x, y, ids.depth(y, x));
        Eigen::Vector3d const color = color_at(corners, p);
        for (int c = 0; c < 3; ++c) {
          frame.color(y, x)[2 - c] = static_cast<std::uint8_t>(std::lround(255 * std::clamp(color[c], 0.0, 1.0)));
        }
        frame.color(y, x)[3] = 255;
      }
    }
    return frame;
  }

 private:
  static void integrate(View const& view, open3d::pipelines::integration::ScalableTSDFVolume& volume) {
    Camera const& camera = view.image.camera;
    cv::Mat3b const photograph = exposed_photograph(view);
    open3d::geometry::RGBDImage frame;
    frame.color_.Prepare(camera.width(), camera.height(), 3, 1);
    frame.depth_.Prepare(camera.width(), camera.height(), 1, 4);
    for (int y = 0; y < camera.height(); ++y) {
      for (int x = 0; x < camera.width(); ++x) {
        for (int c = 0; c < 3; ++c) *frame.color_.PointerAt<std::uint8_t>(x, y, c) = photograph(y, x)[2 - c];
        *frame.depth_.PointerAt<float>(x, y) = view.image.has_depth(x, y) ? view.image.depth(y, x) : 0.0F;
      }
    }
    open3d::camera::PinholeCameraIntrinsic const intrinsic(camera.width(), camera.height(), camera.fx(), camera.fy(),
                                                           camera.cx(), camera.cy());
    volume.Integrate(frame, intrinsic, view.object_from_camera->inverse().matrix());
  }

  /// Between the corners' colours, by areas.
  Eigen::Vector3d color_at(Eigen::Vector3i const& corners, Eigen::Vector3d const& p) const {
    Eigen::Vector3d v[3];
    for (int k = 0; k < 3; ++k) v[k] = mesh_.vertices[static_cast<std::size_t>(corners[k])].cast<double>();
    Eigen::Vector3d const normal = (v[1] - v[0]).cross(v[2] - v[0]);
    Eigen::Vector3d share;
    for (int k = 0; k < 3; ++k) {
      share[k] = std::max(0.0, (v[(k + 2) % 3] - v[(k + 1) % 3]).cross(p - v[(k + 1) % 3]).dot(normal));
    }
    double const sum = share.sum();
    if (sum > 0) {
      share /= sum;
    } else {
      share = {1, 0, 0};
    }
    Eigen::Vector3d color = Eigen::Vector3d::Zero();
    for (int k = 0; k < 3; ++k) color += share[k] * colors_[static_cast<std::size_t>(corners[k])];
    return color;
  }

  ScanSet const& set_;
  TriangleMesh mesh_;
  std::vector<Eigen::Vector3d> colors_;  ///< sRGB
};

}  // namespace

std::unique_ptr<HeldOutRenderer> make_fused_mesh_renderer(ScanSet const& set) {
  for (auto const& view : set.views) {
    if (!view.image.camera.is_perspective()) return nullptr;
  }
  return std::make_unique<FusedMesh>(set);
}
#else
std::unique_ptr<HeldOutRenderer> make_fused_mesh_renderer(ScanSet const&) { return nullptr; }
#endif

}  // namespace scanview
