#include "synth/surface_paint.h"

#include "synth/linear_color.h"
#include "synth/texture_lookup.h"

namespace scanview {
namespace {

cv::Vec3b const kPlaster(205, 214, 222);

}  // namespace

Eigen::Vector3f SurfacePaint::at(RayHit const& hit) const {
  if (has_texture(hit.triangle)) {
    TextureCorners const& c = textures_->corners[hit.triangle];
    return texture_color(textures_->textures[textures_->of_triangle[hit.triangle]],
                         (1 - hit.u - hit.v) * c[0] + hit.u * c[1] + hit.v * c[2]);
  }
  Eigen::Vector3i const& t = triangles_[hit.triangle];
  return (1 - hit.u - hit.v) * at_vertex(t[0]) + hit.u * at_vertex(t[1]) + hit.v * at_vertex(t[2]);
}

Eigen::Vector3f SurfacePaint::at_vertex(int vertex) const {
  return linear_from_bgr(colors_.empty() ? kPlaster : colors_[vertex]);
}

}  // namespace scanview
