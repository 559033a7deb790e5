#include "mesh/padded_texture.h"

#include <opencv2/imgproc.hpp>
#include <vector>

#include "base/error.h"

namespace scanview {

cv::Mat3b padded_texture(RangeImage const& image, ViewMesh const& view_mesh) {
  cv::Size const size(view_mesh.camera.width(), view_mesh.camera.height());
  if (image.color.size() != size || image.classes.size() != size || view_mesh.feather.size() != size) {
    throw Error(ErrorCode::bad_input, {}, "a view's picture, mask or feather does not have its mesh's camera's size");
  }
  cv::Mat1b empty(size, 255);  // 0 where the colour is the object's
  std::size_t covered = 0;
  for (int y = 0; y < size.height; ++y) {
    for (int x = 0; x < size.width; ++x) {
      if (!image.has_depth(x, y) && view_mesh.feather(y, x) == 0) continue;
      empty(y, x) = 0;
      ++covered;
    }
  }
  if (covered == 0) return image.color.clone();

  cv::Mat1f distance;
  cv::Mat1i label;
  cv::distanceTransform(empty, distance, label, cv::DIST_L2, cv::DIST_MASK_5, cv::DIST_LABEL_PIXEL);
  std::vector<cv::Vec3b> color_of_label(covered + 1);
  for (int y = 0; y < size.height; ++y) {
    for (int x = 0; x < size.width; ++x) {
      if (empty(y, x) == 0) color_of_label.at(static_cast<std::size_t>(label(y, x))) = image.color(y, x);
    }
  }
  cv::Mat3b padded(size);
  for (int y = 0; y < size.height; ++y) {
    for (int x = 0; x < size.width; ++x) {
      padded(y, x) = empty(y, x) == 0 ? image.color(y, x) : color_of_label.at(static_cast<std::size_t>(label(y, x)));
    }
  }
  return padded;
}

}  // namespace scanview
