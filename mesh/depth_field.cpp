#include "mesh/depth_field.h"

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

/// The errors of a plane along a row. Differences are taken to the depth at the row's begin, so that single precision
/// loses nothing beside large depths.
class RowErrors {
 public:
  RowErrors(DepthField const& field, DepthPlane const& plane, int y, int begin)
      : depth_(field.depth[y] + begin), weight_(field.weight[y] + begin), slope_(float(plane.slope.x())) {
    double const at = plane.at({double(begin), double(y)});
    base_ = float(at);
    rest_ = float(at - base_);
  }
  Lanes lanes(int i) const {
    Lanes const depth = Eigen::Map<Lanes const>(depth_ + i);
    return (depth - base_) - (slope_ * (ramp() + float(i)) + rest_);
  }
  Lanes weights(int i) const { return Eigen::Map<Lanes const>(weight_ + i); }
  float one(int i) const { return (depth_[i] - base_) - (slope_ * float(i) + rest_); }
  float weight(int i) const { return weight_[i]; }

 private:
  float const* depth_;
  float const* weight_;
  float slope_, base_, rest_;
};

}  // namespace

DepthField make_depth_field(RangeImage const& image, SurfaceLinks const& links, cv::Mat1f const& tolerance) {
  DepthField field{cv::Mat1f::zeros(image.depth.size()), cv::Mat1f::zeros(image.depth.size())};
  bool const perspective = image.camera.is_perspective();
  for (int y = 0; y < field.height(); ++y) {
    float const* const depths = image.depth[y];
    float const* const tolerances = tolerance[y];
    uchar const* const object = links.object[y];
    for (int x = 0; x < field.width(); ++x) {
      if (!object[x]) continue;
      double const d = depths[x], t = tolerances[x];
      field.depth(y, x) = float(perspective ? 1 / d : d);
      field.weight(y, x) = float(std::min(perspective ? d * ((d + t) / t) : 1 / t, kGreatestWeight));
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
  for_each_span(triangle.corner[0], triangle.corner[1], triangle.corner[2], field.width(), field.height(),
                [&](int y, int begin, int end) {
                  RowErrors const row(field, plane, y, begin);
                  int const count = end - begin;
                  Lanes squares = Lanes::Zero(), worst = Lanes::Zero();
                  int i = 0;
                  for (; i + kLanes <= count; i += kLanes) {
                    Lanes const error = row.lanes(i) * row.weights(i);
                    squares += error * error;
                    worst = worst.max(error.abs());
                  }
                  float row_squares = squares.sum(), row_worst = worst.maxCoeff();
                  for (; i < count; ++i) {
                    float const error = row.one(i) * row.weight(i);
                    row_squares += error * error;
                    row_worst = std::max(row_worst, std::abs(error));
                  }
                  result.squares += double(row_squares);
                  if (row_worst > result.worst) {
                    result.worst = row_worst;
                    result.row = y;
                  }
                });
  return result;
}

int find_worst_column(DepthField const& field, DepthTriangle const& triangle, TriangleError const& error) {
  DepthPlane const plane = triangle.plane();
  int column = -1;
  for_each_span(triangle.corner[0], triangle.corner[1], triangle.corner[2], field.width(), field.height(),
                [&](int y, int begin, int end) {
                  if (y != error.row) return;
                  RowErrors const row(field, plane, y, begin);
                  float worst = -1;
                  for (int i = 0; i < end - begin; ++i) {
                    float const here = std::abs(row.one(i) * row.weight(i));
                    if (here <= worst) continue;
                    worst = here;
                    column = begin + i;
                  }
                });
  return column;
}

TriangleSums scan_sums(DepthField const& field, DepthTriangle const& triangle) {
  DepthPlane const plane = triangle.plane();
  Eigen::Vector2d const origin = triangle.corner[0];
  TriangleSums sums;
  for_each_span(triangle.corner[0], triangle.corner[1], triangle.corner[2], field.width(), field.height(),
                [&](int y, int begin, int end) {
                  RowErrors const row(field, plane, y, begin);
                  int const count = end - begin;
                  // Over the row, x counted from its begin: w, wi, wii, wr, wri, wrr.
                  Lanes s0 = Lanes::Zero(), s1 = s0, s2 = s0, r0 = s0, r1 = s0, r2 = s0, n = s0;
                  auto const add = [&](Lanes const& error, Lanes const& weight, Lanes const& index) {
                    Lanes const w = weight * weight, wi = w * index, wr = w * error;
                    s0 += w;
                    s1 += wi;
                    s2 += wi * index;
                    r0 += wr;
                    r1 += wr * index;
                    r2 += wr * error;
                    n += (weight > 0.0f).template cast<float>();
                  };
                  int i = 0;
                  for (; i + kLanes <= count; i += kLanes) add(row.lanes(i), row.weights(i), ramp() + float(i));
                  for (; i < count; ++i) {
                    float const w = row.weight(i) * row.weight(i), r = row.one(i);
                    s0[0] += w;
                    s1[0] += w * float(i);
                    s2[0] += w * float(i) * float(i);
                    r0[0] += w * r;
                    r1[0] += w * r * float(i);
                    r2[0] += w * r * r;
                    n[0] += row.weight(i) > 0;
                  }
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
                  sums.pixels += int(n.sum());
                });
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
