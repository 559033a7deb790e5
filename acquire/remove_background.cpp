#include "acquire/remove_background.h"

#include <cmath>

namespace scanview {
namespace {

constexpr double kSigmas = 4;
constexpr double kDarkest = 24;       // of R + G + B: below, chromaticity is noise
constexpr double kSameColor = 0.05;   // of chromaticity
constexpr double kSameBright = 0.25;  // relative

Eigen::Vector2d chromaticity(Eigen::Vector3d const& rgb) { return rgb.head<2>() / rgb.sum(); }

Eigen::Vector3d rgb(cv::Vec3b const& bgr) {
  return {static_cast<double>(bgr[2]), static_cast<double>(bgr[1]), static_cast<double>(bgr[0])};
}

/// Paint of another kind; shade alone is no difference.
bool differs(Eigen::Vector3d const& a, Eigen::Vector3d const& b) {
  if (a.sum() < kDarkest || b.sum() < kDarkest) return (a - b).norm() > kDarkest;
  return (chromaticity(a) - chromaticity(b)).norm() > kSameColor;
}

bool is_backdrop(Eigen::Vector3d const& color, BackgroundModel const& model) {
  return model.backdrop && color.sum() >= kDarkest &&
         (chromaticity(color) - chromaticity(*model.backdrop)).norm() <= model.backdrop_tolerance;
}

bool is_background(RangeImage const& image, int x, int y, BackgroundModel const& model) {
  Eigen::Vector3d const color = rgb(image.color(y, x));
  bool const has_depth = image.has_depth(x, y);
  if (model.empty) {
    RangeImage const& empty = *model.empty;
    Eigen::Vector3d const empty_color = rgb(empty.color(y, x));
    if (has_depth && empty.has_depth(x, y)) {
      double const before = empty.depth(y, x) - image.depth(y, x);
      double const scatter = std::hypot(image.sigma(y, x), empty.sigma(y, x));
      if (before > kSigmas * scatter) return false;
      return !model.empty_has_color || !differs(color, empty_color);
    }
    if (!has_depth && model.empty_has_color && !differs(color, empty_color) &&
        std::abs(color.sum() - empty_color.sum()) <= kSameBright * empty_color.sum())
      return true;
  }
  return is_backdrop(color, model);
}

}  // namespace

std::size_t remove_background(RangeImage& image, BackgroundModel const& model) {
  std::size_t removed = 0;
  for (int y = 0; y < image.depth.rows; ++y)
    for (int x = 0; x < image.depth.cols; ++x) {
      if (!is_background(image, x, y, model)) continue;
      removed += image.has_depth(x, y);
      image.remove(x, y, PixelClass::background);
    }
  return removed;
}

}  // namespace scanview
