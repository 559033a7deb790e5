#pragma once
#include <Eigen/Core>
#include <string>
#include <vector>

namespace scanview {

/// Lines, dots and words over the picture, in pixels of the viewport.
struct Overlay {
  struct Line {
    std::vector<Eigen::Vector2d> points;
    Eigen::Vector3f color;  ///< R G B as shown, 0 to 1
    bool closed = false;
  };
  struct Dot {
    Eigen::Vector2d at;
    Eigen::Vector3f color;
    std::string label;  ///< beside it; may be empty
  };
  std::vector<Line> lines;
  std::vector<Dot> dots;
};

}  // namespace scanview
