#include "register/observers.h"

#include <algorithm>
#include <cmath>

#include "acquire/section_pictures.h"
#include "register/alignment_figures.h"

namespace scanview {

Observers count_observers(ScanSet const& set, std::vector<SurfacePyramid> const& surfaces,
                          std::vector<Eigen::Isometry3d> const& object_from_camera, std::size_t view, double gate,
                          std::size_t pixels) {
  RangeImage const& image = set.views[view].image;
  cv::Rect const box = object_box(image);
  int const pitch = std::max(1, static_cast<int>(std::ceil(std::sqrt(box.area() / static_cast<double>(pixels)))));
  std::vector<Eigen::Isometry3d> other_from_view;
  for (Eigen::Isometry3d const& pose : object_from_camera)
    other_from_view.push_back(pose.inverse() * object_from_camera[view]);

  Observers result;
  result.view = view;
  result.counts.create((box.height + pitch - 1) / pitch, (box.width + pitch - 1) / pitch);
  std::size_t depths = 0, seen = 0;
  for (int row = 0; row < result.counts.rows; ++row)
    for (int col = 0; col < result.counts.cols; ++col) {
      int const x = box.x + col * pitch, y = box.y + row * pitch;
      short& count = result.counts(row, col) = -1;
      SurfacePixel const& pixel = surfaces[view].levels[0].at(x, y);
      if (!image.has_depth(x, y) || !pixel.has_surface()) continue;
      Eigen::Vector3d const point = image.point(x, y);
      Eigen::Vector3d const normal(pixel.normal[0], pixel.normal[1], pixel.normal[2]);
      count = 0;
      for (std::size_t other = 0; other < surfaces.size(); ++other)
        if (other != view && distance_to_surface(surfaces[other].levels[0], other_from_view[other] * point,
                                                 other_from_view[other].linear() * normal, gate))
          ++count;
      ++depths;
      seen += count > 0;
    }
  if (depths > 0) result.seen = static_cast<double>(seen) / static_cast<double>(depths);
  return result;
}

}  // namespace scanview
