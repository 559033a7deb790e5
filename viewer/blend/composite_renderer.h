#pragma once
#include <memory>
#include <vector>

#include "viewer/renderer.h"

namespace scanview {

/// Several objects in one scene, each drawn by a renderer of its own (Pulli 1997, discussion): in every pixel the
/// nearest one shows. Each is drawn as if it were alone, so objects may stand in front of and inside one another.
class CompositeRenderer final : public Renderer {
 public:
  struct Part {
    std::unique_ptr<Renderer> renderer;
    Eigen::Isometry3d scene_from_object = Eigen::Isometry3d::Identity();
  };
  /// At least one part (Error{usage}).
  explicit CompositeRenderer(std::vector<Part> parts);
  /// `scene_from_camera` takes the place of object_from_camera. Of equal depths the earlier part shows.
  Frame render(Camera const& camera, Eigen::Isometry3d const& scene_from_camera) override;

 private:
  std::vector<Part> parts_;
};

}  // namespace scanview
