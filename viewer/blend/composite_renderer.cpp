#include "viewer/blend/composite_renderer.h"

#include "base/error.h"

namespace scanview {

CompositeRenderer::CompositeRenderer(std::vector<Part> parts) : parts_(std::move(parts)) {
  if (parts_.empty()) throw Error(ErrorCode::usage, {}, "a scene without objects");
}

Frame CompositeRenderer::render(Camera const& camera, Eigen::Isometry3d const& scene_from_camera) {
  Frame scene;
  for (auto const& part : parts_) {
    Frame frame = part.renderer->render(camera, part.scene_from_object.inverse() * scene_from_camera);
    if (scene.color.empty()) {
      scene = std::move(frame);
      continue;
    }
    for (int y = 0; y < camera.height(); ++y) {
      for (int x = 0; x < camera.width(); ++x) {
        bool const drawn = frame.color(y, x)[3] != 0, empty = scene.color(y, x)[3] == 0;
        if (!drawn || !(empty || frame.depth(y, x) < scene.depth(y, x))) continue;
        scene.color(y, x) = frame.color(y, x);
        scene.depth(y, x) = frame.depth(y, x);
      }
    }
  }
  return scene;
}

}  // namespace scanview
