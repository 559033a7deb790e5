#include "mesh/surface_links.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <vector>

namespace scanview {
namespace {

class StepTest {
 public:
  StepTest(RangeImage const& image, double step_sigmas)
      : image_(image), step_sigmas_(step_sigmas), pixel_(1.0 / std::max(image.camera.fx(), image.camera.fy())) {}

  /// Pixel (x, y) and the next one in direction (dx, dy), both with depths.
  bool is_step(int x, int y, int dx, int dy) const {
    double const za = image_.depth(y, x), zb = image_.depth(y + dy, x + dx);
    double const jump = std::abs(zb - za);
    double const width = image_.camera.is_perspective() ? std::min(za, zb) * pixel_ : pixel_;
    if (jump <= width) return false;  // whatever the noise: most pixels
    double const sigma = std::hypot(double(image_.sigma(y, x)), double(image_.sigma(y + dy, x + dx)));
    double const noise = step_sigmas_ * sigma;
    if (jump <= noise + width) return false;

    double const sign = zb > za ? 1 : -1;
    Side const a = side(x, y, -dx, -dy, za, sign), b = side(x + dx, y + dy, dx, dy, zb, -sign);
    // Where a side is too short to have a slope the other alone decides.
    double const both = std::isnan(a.jump) ? b.jump : std::isnan(b.jump) ? a.jump : std::min(a.jump, b.jump);
    double slope = std::max(a.sustained, b.sustained);
    if (both > 0) slope = std::max(slope, 2 * both);
    return jump > noise + std::max(width, slope);
  }

 private:
  /// What the surface on one side of a jump says about it, in units, positive in the direction of the jump.
  struct Side {
    double jump = std::numeric_limits<double>::quiet_NaN();  ///< predicted; NaN where there is but one pixel
    double sustained = 0;  ///< what two successive differences of three pixels both reach
  };

  /// The surface that starts at (x, y), at depth z, and goes on in direction (dx, dy), continued by one pixel the other
  /// way.
  Side side(int x, int y, int dx, int dy, double z, double sign) const {
    Side result;
    if (!has_depth(x + dx, y + dy)) return result;
    double const q0 = linear(x, y), q1 = linear(x + dx, y + dy);
    if (!has_depth(x + 2 * dx, y + 2 * dy)) {
      result.jump = sign * continued(q0, q0 - q1, z);
      return result;
    }
    double const q2 = linear(x + 2 * dx, y + 2 * dy);
    result.jump = sign * continued(q0, (q0 - q2) / 2, z);
    double const near = sign * continued(q0, q0 - q1, z), far = sign * continued(q0, q1 - q2, z);
    result.sustained = std::max(0.0, std::min(near, far));
    return result;
  }

  double continued(double q, double slope, double z) const {
    if (image_.camera.is_perspective() && q + slope <= 0) return std::numeric_limits<double>::infinity();
    return linear_depth(image_.camera, q + slope) - z;
  }
  double linear(int x, int y) const { return linear_depth(image_.camera, image_.depth(y, x)); }
  bool has_depth(int x, int y) const {
    return x >= 0 && y >= 0 && x < image_.depth.cols && y < image_.depth.rows && image_.has_depth(x, y);
  }

  RangeImage const& image_;
  double step_sigmas_;
  double pixel_;  ///< its width; under perspective, at depth 1
};

/// Whether the sides between the four pixels around the corner at (x − ½, y − ½) separate pixels.
int cracks_at_corner(SurfaceLinks const& links, int x, int y) {
  auto crack = [&](int x0, int y0, int x1, int y1) {
    bool const a = links.is_object(x0, y0), b = links.is_object(x1, y1);
    return a != b || (a && !links.linked(x0, y0, x1, y1));
  };
  return crack(x - 1, y - 1, x, y - 1) + crack(x - 1, y, x, y) + crack(x - 1, y - 1, x - 1, y) + crack(x, y - 1, x, y);
}

/// A single missing link between pixels that are linked all around says that the evidence is at the limit: no step.
void heal_single_cracks(SurfaceLinks& links) {
  cv::Mat1b const object = links.object;
  std::vector<cv::Point> right, down;
  for (int y = 0; y < object.rows; ++y)
    for (int x = 0; x < object.cols; ++x) {
      if (!object(y, x)) continue;
      if (links.is_object(x + 1, y) && !links.right(y, x) && cracks_at_corner(links, x + 1, y) == 1 &&
          cracks_at_corner(links, x + 1, y + 1) == 1)
        right.emplace_back(x, y);
      if (links.is_object(x, y + 1) && !links.down(y, x) && cracks_at_corner(links, x, y + 1) == 1 &&
          cracks_at_corner(links, x + 1, y + 1) == 1)
        down.emplace_back(x, y);
    }
  for (cv::Point const& p : right) links.right(p) = 1;
  for (cv::Point const& p : down) links.down(p) = 1;
}

}  // namespace

void drop_small_patches(SurfaceLinks& links, int min_patch_pixels) {
  enum : uchar { unknown, large, small };
  cv::Mat1b known = cv::Mat1b::zeros(links.object.size());
  std::vector<cv::Point> patch;
  for (int y = 0; y < known.rows; ++y)
    for (int x = 0; x < known.cols; ++x) {
      if (!links.object(y, x) || known(y, x) != unknown) continue;
      // From here until it is large enough or meets what is.
      bool is_large = false;
      patch = {{x, y}};
      known(y, x) = small;
      for (std::size_t i = 0; i < patch.size() && !is_large; ++i) {
        is_large = patch.size() >= std::size_t(min_patch_pixels);
        cv::Point const at = patch[i];
        auto const reach = [&](cv::Point const& next) {
          if (known(next) == large) is_large = true;
          if (known(next) != unknown) return;
          known(next) = small;
          patch.push_back(next);
        };
        if (links.right(at)) reach({at.x + 1, at.y});
        if (links.down(at)) reach({at.x, at.y + 1});
        if (at.x > 0 && links.right(at.y, at.x - 1)) reach({at.x - 1, at.y});
        if (at.y > 0 && links.down(at.y - 1, at.x)) reach({at.x, at.y - 1});
      }
      is_large = is_large || patch.size() >= std::size_t(min_patch_pixels);
      for (cv::Point const& at : patch) {
        known(at) = is_large ? large : small;
        if (is_large) continue;
        // Its links lead only to pixels of the same patch, which go as well.
        links.object(at) = links.right(at) = links.down(at) = 0;
        ++links.dropped;
      }
    }
}

SurfaceLinks find_surface_links(RangeImage const& image, double step_sigmas, int min_patch_pixels) {
  int const width = image.camera.width(), height = image.camera.height();
  SurfaceLinks links;
  links.object = cv::Mat1b::zeros(height, width);
  links.right = cv::Mat1b::zeros(height, width);
  links.down = cv::Mat1b::zeros(height, width);
  StepTest const test(image, step_sigmas);
  for (int y = 0; y < height; ++y)
    for (int x = 0; x < width; ++x) {
      if (!image.has_depth(x, y)) continue;
      links.object(y, x) = 1;
      if (x + 1 < width && image.has_depth(x + 1, y)) links.right(y, x) = !test.is_step(x, y, 1, 0);
      if (y + 1 < height && image.has_depth(x, y + 1)) links.down(y, x) = !test.is_step(x, y, 0, 1);
    }
  heal_single_cracks(links);
  drop_small_patches(links, min_patch_pixels);
  return links;
}

}  // namespace scanview
