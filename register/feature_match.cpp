#include "register/feature_match.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numeric>
#include <opencv2/features2d.hpp>
#include <opencv2/imgproc.hpp>
#include <tuple>

#include "base/random.h"

namespace scanview {
namespace {

constexpr float kRatio = 0.85f;  // nearest to second nearest (Lowe 2004, section 7.1)
constexpr int kMaxFeatures = 2000;

struct Match {
  int a, b;
};

// Descriptors have unit length: the largest product is the nearest. (Eigen: one thread, so always the same bits.)
Eigen::MatrixXf products_of(cv::Mat const& a, cv::Mat const& b) {
  using Rows = Eigen::Map<Eigen::Matrix<float, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor> const>;
  return Rows(a.ptr<float>(), a.rows, a.cols) * Rows(b.ptr<float>(), b.rows, b.cols).transpose();
}

// Nearest in descriptor space, clearly nearer than the second, and mutual.
std::vector<Match> mutual_matches(cv::Mat const& a, cv::Mat const& b) {
  std::vector<Match> matches;
  if (a.rows < 3 || b.rows < 3) return matches;
  Eigen::MatrixXf const products = products_of(a, b);
  std::vector<int> best_of_b(static_cast<std::size_t>(b.rows), -1);
  for (int j = 0; j < b.rows; ++j) {
    float best = -1;
    for (int i = 0; i < a.rows; ++i)
      if (products(i, j) > best) {
        best = products(i, j);
        best_of_b[static_cast<std::size_t>(j)] = i;
      }
  }
  for (int i = 0; i < a.rows; ++i) {
    int nearest = -1;
    float best = -1, second = -1;
    for (int j = 0; j < b.rows; ++j) {
      float const product = products(i, j);
      if (product > best) {
        second = best;
        best = product;
        nearest = j;
      } else {
        second = std::max(second, product);
      }
    }
    float const distance = std::sqrt(std::max(0.0f, 2 - 2 * best));
    float const next = std::sqrt(std::max(0.0f, 2 - 2 * second));
    if (distance < kRatio * next && best_of_b[static_cast<std::size_t>(nearest)] == i) matches.push_back({i, nearest});
  }
  return matches;
}

}  // namespace

std::vector<FeatureMatch> nearest_matches(Features const& a, Features const& b, int nearest) {
  std::vector<FeatureMatch> matches;
  if (a.points.empty() || b.points.empty()) return matches;
  Eigen::MatrixXf const products = products_of(a.descriptors, b.descriptors);
  auto const most_alike = [&](Eigen::Index count, auto const& product, auto const& add) {
    std::vector<std::pair<float, Eigen::Index>> all;
    for (Eigen::Index j = 0; j < count; ++j) all.emplace_back(-product(j), j);
    auto const kept = all.begin() + std::min<Eigen::Index>(nearest, count);
    std::partial_sort(all.begin(), kept, all.end());
    for (auto it = all.begin(); it != kept; ++it) add(it->second, -it->first);
  };
  for (Eigen::Index i = 0; i < products.rows(); ++i)
    most_alike(
        products.cols(), [&](Eigen::Index j) { return products(i, j); },
        [&](Eigen::Index j, float likeness) {
          matches.push_back({static_cast<std::size_t>(i), static_cast<std::size_t>(j), likeness});
        });
  for (Eigen::Index j = 0; j < products.cols(); ++j)
    most_alike(
        products.rows(), [&](Eigen::Index i) { return products(i, j); },
        [&](Eigen::Index i, float likeness) {
          matches.push_back({static_cast<std::size_t>(i), static_cast<std::size_t>(j), likeness});
        });
  std::sort(matches.begin(), matches.end(),
            [](FeatureMatch const& l, FeatureMatch const& r) { return std::pair(l.a, l.b) < std::pair(r.a, r.b); });
  // What stands twice was found from both sides.
  std::vector<FeatureMatch> mutual;
  for (std::size_t k = 1; k < matches.size(); ++k)
    if (matches[k].a == matches[k - 1].a && matches[k].b == matches[k - 1].b) mutual.push_back(matches[k]);
  return mutual;
}

Features find_features(RangeImage const& image, ViewSurface const& surface) {
  Features features;
  if (image.color.empty()) return features;
  cv::Mat gray;
  cv::cvtColor(image.color, gray, cv::COLOR_BGR2GRAY);
  cv::Mat1b mask(gray.size(), uchar{0});
  for (int y = 0; y < mask.rows; ++y)
    for (int x = 0; x < mask.cols; ++x)
      if (surface.has_surface(x, y)) mask(y, x) = 255;
  std::vector<cv::KeyPoint> keypoints;
  cv::Ptr<cv::SIFT> const sift = cv::SIFT::create(kMaxFeatures, 3, 0.02);
  sift->detect(gray, keypoints, mask);
  std::sort(keypoints.begin(), keypoints.end(), [](cv::KeyPoint const& l, cv::KeyPoint const& r) {
    return std::tie(l.pt.y, l.pt.x, l.size, l.angle, l.octave) < std::tie(r.pt.y, r.pt.x, r.size, r.angle, r.octave);
  });
  cv::Mat descriptors;
  sift->compute(gray, keypoints, descriptors);
  for (std::size_t k = 0; k < keypoints.size(); ++k) {
    cv::Point2f const at = keypoints[k].pt;
    int const x = cvRound(at.x), y = cvRound(at.y);
    if (x < 0 || y < 0 || x >= mask.cols || y >= mask.rows || mask(y, x) == 0) continue;
    cv::Mat row = descriptors.row(static_cast<int>(k)).clone();
    double const length = cv::norm(row);
    if (!(length > 0)) continue;
    row /= length;
    features.points.push_back(surface.camera.unproject(at.x, at.y, surface.depth(x, y)));
    float const* const n = surface.at(x, y).normal;
    features.normals.push_back({n[0], n[1], n[2]});
    features.descriptors.push_back(row);
  }
  return features;
}

Eigen::Isometry3d fit_motion(std::vector<Eigen::Vector3d> const& from, std::vector<Eigen::Vector3d> const& to) {
  Eigen::Matrix3Xd source(3, from.size()), target(3, to.size());
  for (std::size_t i = 0; i < from.size(); ++i) {
    source.col(static_cast<Eigen::Index>(i)) = from[i];
    target.col(static_cast<Eigen::Index>(i)) = to[i];
  }
  Eigen::Isometry3d result;
  result.matrix() = Eigen::umeyama(source, target, false);
  return result;
}

FeatureMotion match_features(Features const& a, Features const& b, FeatureMotionOptions const& options) {
  FeatureMotion result;
  std::vector<Match> const matches = mutual_matches(a.descriptors, b.descriptors);
  result.matches = matches.size();
  if (matches.size() < std::max<std::size_t>(3, options.min_inliers)) return result;

  auto const count = static_cast<std::uint32_t>(matches.size());
  auto const inliers_of = [&](Eigen::Isometry3d const& motion) {
    std::vector<std::size_t> inliers;
    for (std::size_t k = 0; k < matches.size(); ++k) {
      Eigen::Vector3d const& p = a.points[static_cast<std::size_t>(matches[k].a)];
      Eigen::Vector3d const& q = b.points[static_cast<std::size_t>(matches[k].b)];
      if ((motion * p - q).norm() < options.threshold) inliers.push_back(k);
    }
    return inliers;
  };
  auto const fit = [&](std::vector<std::size_t> const& chosen) {
    std::vector<Eigen::Vector3d> from, to;
    for (std::size_t k : chosen) {
      from.push_back(a.points[static_cast<std::size_t>(matches[k].a)]);
      to.push_back(b.points[static_cast<std::size_t>(matches[k].b)]);
    }
    return fit_motion(from, to);
  };

  CounterRandom random(options.seed, options.item);
  std::vector<std::size_t> best;
  for (int trial = 0; trial < options.trials; ++trial) {
    std::array<std::size_t, 3> const pick{random.below(count), random.below(count), random.below(count)};
    if (pick[0] == pick[1] || pick[1] == pick[2] || pick[0] == pick[2]) continue;
    bool wide = true;  // a small triangle fixes no rotation, and one whose sides differ fits nothing
    for (int k = 0; k < 3 && wide; ++k) {
      Match const& m = matches[pick[static_cast<std::size_t>(k)]];
      Match const& n = matches[pick[static_cast<std::size_t>((k + 1) % 3)]];
      double const side_a = (a.points[static_cast<std::size_t>(m.a)] - a.points[static_cast<std::size_t>(n.a)]).norm();
      double const side_b = (b.points[static_cast<std::size_t>(m.b)] - b.points[static_cast<std::size_t>(n.b)]).norm();
      wide = side_a > 3 * options.threshold && std::abs(side_a - side_b) < 2 * options.threshold;
    }
    if (!wide) continue;
    std::vector<std::size_t> const inliers = inliers_of(fit({pick.begin(), pick.end()}));
    if (inliers.size() > best.size()) best = inliers;
  }
  for (int round = 0; round < 3 && best.size() >= 3; ++round) {
    result.b_from_a = fit(best);
    best = inliers_of(result.b_from_a);
  }
  result.inliers = best.size();
  for (std::size_t k : best) result.points.push_back(b.points[static_cast<std::size_t>(matches[k].b)]);
  result.found = best.size() >= options.min_inliers;
  return result;
}

}  // namespace scanview
