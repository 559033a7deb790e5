#include "acquire/depth_resample.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

namespace scanview {
namespace {

struct Corner {
  Eigen::Vector3d point;
  Eigen::Vector2d pixel;
};

double cross(Eigen::Vector2d const& a, Eigen::Vector2d const& b) { return a.x() * b.y() - a.y() * b.x(); }

/// The triangle's depth at every pixel centre it covers, borders included. 1/z (perspective) or z is linear there.
void rasterise(std::array<Corner const*, 3> const& corners, Camera const& camera, cv::Mat1f& nearest) {
  auto const& [a, b, c] = std::array{corners[0]->pixel, corners[1]->pixel, corners[2]->pixel};
  double const area = cross(b - a, c - a);
  if (!(std::abs(area) > 1e-12)) return;
  double const slack = -1e-7;  // a pixel centre on a shared side belongs to both
  auto const bound = [](double value, int size) {
    return static_cast<int>(std::clamp(value, -1.0, static_cast<double>(size)));
  };
  int const left = std::max(0, bound(std::ceil(std::min({a.x(), b.x(), c.x()}) - 1e-6), camera.width()));
  int const right =
      std::min(camera.width() - 1, bound(std::floor(std::max({a.x(), b.x(), c.x()}) + 1e-6), camera.width()));
  int const top = std::max(0, bound(std::ceil(std::min({a.y(), b.y(), c.y()}) - 1e-6), camera.height()));
  int const bottom =
      std::min(camera.height() - 1, bound(std::floor(std::max({a.y(), b.y(), c.y()}) + 1e-6), camera.height()));
  for (int y = top; y <= bottom; ++y)
    for (int x = left; x <= right; ++x) {
      Eigen::Vector2d const p(x, y);
      double const wa = cross(b - p, c - p) / area, wb = cross(c - p, a - p) / area, wc = 1 - wa - wb;
      if (wa < slack || wb < slack || wc < slack) continue;
      double const za = corners[0]->point.z(), zb = corners[1]->point.z(), zc = corners[2]->point.z();
      double const z = camera.is_perspective() ? 1 / (wa / za + wb / zb + wc / zc) : wa * za + wb * zb + wc * zc;
      if (!(z >= nearest(y, x))) nearest(y, x) = static_cast<float>(z);
    }
}

}  // namespace

cv::Mat1f resample_depth(cv::Mat3d const& points, Camera const& camera,
                         std::function<bool(Eigen::Vector3d const&, Eigen::Vector3d const&)> const& connected) {
  cv::Mat1f nearest(camera.height(), camera.width(), std::numeric_limits<float>::quiet_NaN());
  auto const corner = [&](int row, int col) {
    auto const& p = points(row, col);
    Corner corner{{p[0], p[1], p[2]}, {}};
    corner.pixel = camera.project(corner.point);
    return corner;
  };
  for (int row = 0; row + 1 < points.rows; ++row)
    for (int col = 0; col + 1 < points.cols; ++col) {
      // 0 1
      // 2 3
      std::array const quad{corner(row, col), corner(row, col + 1), corner(row + 1, col), corner(row + 1, col + 1)};
      std::array<bool, 4> good{};
      for (std::size_t i = 0; i < 4; ++i) good[i] = quad[i].point.allFinite() && quad[i].pixel.allFinite();
      auto const joined = [&](std::size_t i, std::size_t k) {
        return good[i] && good[k] && connected(quad[i].point, quad[k].point);
      };
      auto const triangle = [&](std::size_t i, std::size_t j, std::size_t k) {
        if (joined(i, j) && joined(j, k) && joined(k, i)) rasterise({&quad[i], &quad[j], &quad[k]}, camera, nearest);
      };
      // The diagonal with the smaller difference follows the surface; with a corner missing only the other one is left.
      bool const falling = good[0] && good[3] &&
                           (!(good[1] && good[2]) || (quad[0].point - quad[3].point).squaredNorm() <=
                                                         (quad[1].point - quad[2].point).squaredNorm());
      if (falling) {
        triangle(0, 1, 3);
        triangle(0, 3, 2);
      } else {
        triangle(0, 1, 2);
        triangle(1, 3, 2);
      }
    }
  return nearest;
}

cv::Mat1f reproject_depth(cv::Mat1f const& depth, Camera const& source, Camera const& target,
                          Eigen::Isometry3d const& target_from_source, DepthNoise const& noise) {
  cv::Mat3d points(depth.rows, depth.cols, cv::Vec3d::all(std::numeric_limits<double>::quiet_NaN()));
  for (int y = 0; y < depth.rows; ++y)
    for (int x = 0; x < depth.cols; ++x)
      if (std::isfinite(depth(y, x))) {
        Eigen::Vector3d const p = target_from_source * source.unproject(x, y, depth(y, x));
        points(y, x) = {p.x(), p.y(), p.z()};
      }
  // The two cameras look about the same way, so a step in the one is a step in the other. Sides of a pixel quad are at
  // most a diagonal long.
  return resample_depth(points, target, [&](Eigen::Vector3d const& a, Eigen::Vector3d const& b) {
    double const z = std::min(a.z(), b.z());
    return std::abs(a.z() - b.z()) <= largest_step(source, z, noise.sigma(z), noise.sigma(z), std::sqrt(2.0));
  });
}

void close_seams(cv::Mat1f& depth, Camera const& camera, DepthNoise const& noise) {
  auto const between = [&](cv::Mat1f const& from, int xa, int ya, int xb, int yb) {
    double const a = from(ya, xa), b = from(yb, xb);
    if (!std::isfinite(a) || !std::isfinite(b)) return kMissing;
    double const sigma = noise.sigma(std::min(a, b));
    if (std::abs(a - b) > largest_step(camera, std::min(a, b), sigma, sigma, 2)) return kMissing;
    return static_cast<float>(camera.is_perspective() ? 2 / (1 / a + 1 / b) : (a + b) / 2);
  };
  // The second pass closes the crossings of seams.
  for (int pass = 0; pass < 2; ++pass) {
    cv::Mat1f const before = depth.clone();
    for (int y = 0; y < depth.rows; ++y)
      for (int x = 0; x < depth.cols; ++x) {
        if (std::isfinite(before(y, x))) continue;
        if (x > 0 && x + 1 < depth.cols) depth(y, x) = between(before, x - 1, y, x + 1, y);
        if (y > 0 && y + 1 < depth.rows && !std::isfinite(depth(y, x)))
          depth(y, x) = between(before, x, y - 1, x, y + 1);
      }
  }
}

}  // namespace scanview
