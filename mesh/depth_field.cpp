#include "mesh/depth_field.h"

#include <algorithm>
#include <cmath>

#include "mesh/pixel_spans.h"

namespace scanview {
namespace {

/// Its square, times a picture's width squared, is a number of single precision.
constexpr double kGreatestWeight = 1e15;

constexpr int kLanes = 4;
using Lanes = Eigen::Array<float, kLanes, 1>;

Lanes const& ramp() {
  static Lanes const values(0.0f, 1.0f, 2.0f, 3.0f);
  return values;
}

/// The errors of a plane along a row, four pixels at a time. Differences are taken to the depth at the row's begin, so
/// that single precision loses nothing beside large depths. Lanes beyond the row's end have no weight; what is read for
/// them is the next row's begin (make_depth_field() keeps room after the last).
class RowErrors {
 public:
  RowErrors(DepthField const& field, DepthPlane const& plane, int y, int begin, int end)
      : depth_(field.depth[y] + begin),
        weight_(field.weight[y] + begin),
        count_(end - begin),
        slope_(float(plane.slope.x())) {
    double const at = plane.at({double(begin), double(y)});
    base_ = float(at);
    rest_ = float(at - base_);
  }
  /// Calls add(error, weight, column from the row's begin) with four of each.
  template <typename Add>
  void for_each_four(Add&& add) const {
    Lanes index = ramp();
    int i = 0;
    for (; i + kLanes <= count_; i += kLanes, index += float(kLanes))
      add(errors(i, index), Lanes(Eigen::Map<Lanes const>(weight_ + i)), index);
    if (i == count_) return;
    Lanes const inside = (index < float(count_)).cast<float>();
    add(errors(i, index), Lanes(Eigen::Map<Lanes const>(weight_ + i) * inside), index);
  }

 private:
  Lanes errors(int i, Lanes const& index) const {
    return (Eigen::Map<Lanes const>(depth_ + i) - base_) - (slope_ * index + rest_);
  }

  float const* depth_;
  float const* weight_;
  int count_;
  float slope_, base_, rest_;
};

/// Zeros, with room for four more than there are.
cv::Mat1f padded_zeros(cv::Size size) {
  return cv::Mat1f(cv::Mat1f::zeros(size.height + 1, std::max(size.width, kLanes)))
      .rowRange(0, size.height)
      .colRange(0, size.width);
}

}  // namespace

DepthField make_depth_field(RangeImage const& image, SurfaceLinks const& links, cv::Mat1f const& tolerance) {
  cv::Mat1f linear(tolerance.size());
  bool const perspective = image.camera.is_perspective();
  for (int y = 0; y < linear.rows; ++y) {
    for (int x = 0; x < linear.cols; ++x) {
      double const d = image.depth(y, x), t = tolerance(y, x);
      linear(y, x) = float(perspective ? 1 / (d * (d / t) + d) : t);
    }
  }
  return make_linear_depth_field(image, links, linear);
}

DepthField make_linear_depth_field(RangeImage const& image, SurfaceLinks const& links, cv::Mat1f const& tolerance) {
  DepthField field{padded_zeros(image.depth.size()), padded_zeros(image.depth.size())};
  for (int y = 0; y < field.height(); ++y) {
    for (int x = 0; x < field.width(); ++x) {
      if (links.object(y, x) == 0) continue;
      field.depth(y, x) = float(linear_depth(image.camera, image.depth(y, x)));
      field.weight(y, x) = float(std::min(1.0 / tolerance(y, x), kGreatestWeight));
    }
  }
  return field;
}

DepthPlane DepthTriangle::plane() const {
  Eigen::Vector2d const u = corner[1] - corner[0], v = corner[2] - corner[0];
  double const a = depth[1] - depth[0], b = depth[2] - depth[0], area = turn();
  if (area == 0) return {corner[0], depth[0], {0, 0}};
  return {corner[0], depth[0], {(a * v.y() - b * u.y()) / area, (b * u.x() - a * v.x()) / area}};
}

Eigen::Vector2d DepthTriangle::barycentric_slope(int i) const {
  Eigen::Vector2d const edge = corner[(i + 2) % 3] - corner[(i + 1) % 3];
  return Eigen::Vector2d(-edge.y(), edge.x()) / turn();
}

TriangleError scan_error(DepthField const& field, DepthTriangle const& triangle) {
  DepthPlane const plane = triangle.plane();
  TriangleError result;
  Lanes squares = Lanes::Zero();
  for_each_span(triangle.corner[0], triangle.corner[1], triangle.corner[2], field.width(), field.height(),
                [&](int y, int begin, int end) {
                  Lanes row_squares = Lanes::Zero(), worst = Lanes::Zero();
                  RowErrors(field, plane, y, begin, end)
                      .for_each_four([&](Lanes const& error, Lanes const& weight, Lanes const&) {
                        Lanes const weighted = error * weight;
                        row_squares += weighted * weighted;
                        worst = worst.max(weighted.abs());
                      });
                  squares += row_squares;
                  float const row_worst = worst.maxCoeff();
                  if (row_worst > result.worst) {
                    result.worst = row_worst;
                    result.row = y;
                  }
                });
  result.squares = double(squares.sum());
  return result;
}

int find_worst_column(DepthField const& field, DepthTriangle const& triangle, TriangleError const& error) {
  DepthPlane const plane = triangle.plane();
  int column = -1;
  for_each_span(triangle.corner[0], triangle.corner[1], triangle.corner[2], field.width(), field.height(),
                [&](int y, int begin, int end) {
                  if (y != error.row) return;
                  float worst = -1;
                  RowErrors(field, plane, y, begin, end)
                      .for_each_four([&](Lanes const& error, Lanes const& weight, Lanes const& index) {
                        for (int k = 0; k < kLanes; ++k) {
                          float const here = std::abs(error[k] * weight[k]);
                          if (here <= worst || int(index[k]) >= end - begin) continue;
                          worst = here;
                          column = begin + int(index[k]);
                        }
                      });
                });
  return column;
}

TriangleSums scan_sums(DepthField const& field, DepthTriangle const& triangle) {
  DepthPlane const plane = triangle.plane();
  Eigen::Vector2d const origin = triangle.corner[0];
  TriangleSums sums;
  Lanes pixels = Lanes::Zero();
  for_each_span(triangle.corner[0], triangle.corner[1], triangle.corner[2], field.width(), field.height(),
                [&](int y, int begin, int end) {
                  // Over the row, x counted from its begin: w, wi, wii, wr, wri, wrr.
                  Lanes s0 = Lanes::Zero(), s1 = s0, s2 = s0, r0 = s0, r1 = s0, r2 = s0;
                  RowErrors(field, plane, y, begin, end)
                      .for_each_four([&](Lanes const& error, Lanes const& weight, Lanes const& index) {
                        Lanes const w = weight * weight, wi = w * index, wr = w * error;
                        s0 += w;
                        s1 += wi;
                        s2 += wi * index;
                        r0 += wr;
                        r1 += wr * index;
                        r2 += wr * error;
                        pixels += (weight > 0.0f).cast<float>();
                      });
                  double const x0 = begin - origin.x(), dy = y - origin.y();
                  double const w = s0.sum(), wi = s1.sum(), wii = s2.sum(), wr = r0.sum(), wri = r1.sum();
                  double const wx = wi + x0 * w, wrx = wri + x0 * wr;
                  sums.w += w;
                  sums.wx += wx;
                  sums.wy += dy * w;
                  sums.wxx += wii + 2 * x0 * wi + x0 * x0 * w;
                  sums.wxy += dy * wx;
                  sums.wyy += dy * dy * w;
                  sums.wr += wr;
                  sums.wrx += wrx;
                  sums.wry += dy * wr;
                  sums.wrr += r2.sum();
                });
  sums.pixels = int(pixels.sum());
  return sums;
}

CornerEquations corner_equations(DepthTriangle const& triangle, TriangleSums const& sums) {
  CornerEquations result;
  Eigen::Vector2d const g[3] = {triangle.barycentric_slope(0), triangle.barycentric_slope(1),
                                triangle.barycentric_slope(2)};
  for (int i = 0; i < 3; ++i) {
    double const ci = i == 0;  // λᵢ = ci + g · (x, y), relative to corner 0
    result.right[i] = ci * sums.wr + g[i].x() * sums.wrx + g[i].y() * sums.wry;
    for (int j = i; j < 3; ++j) {
      double const cj = j == 0;
      result.matrix(i, j) = result.matrix(j, i) =
          ci * cj * sums.w + (ci * g[j].x() + cj * g[i].x()) * sums.wx + (ci * g[j].y() + cj * g[i].y()) * sums.wy +
          g[i].x() * g[j].x() * sums.wxx + (g[i].x() * g[j].y() + g[i].y() * g[j].x()) * sums.wxy +
          g[i].y() * g[j].y() * sums.wyy;
    }
  }
  return result;
}

}  // namespace scanview
