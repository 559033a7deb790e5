#include <Eigen/Dense>
#include <algorithm>
#include <array>
#include <cmath>
#include <opencv2/imgproc.hpp>
#include <span>
#include <utility>
#include <vector>

#include "acquire/depth_noise.h"
#include "acquire/segment_background.h"

namespace scanview {
namespace {

constexpr double kClusterSigmas = 3;  // half the width of a cluster of depths
constexpr float kColorFloor = 1.5f;   // of 255: noise that rounding and compression leave in any picture
constexpr float kSameColor = 3;       // times the colour noise, of one channel: still the same colour
constexpr int kFitRadius = 6;         // of the window that carries the background on where it is rarely seen
constexpr int kFewestToFit = 20;
constexpr double kSmallestSeed = 0.01;  // of the picture; smaller still pieces come back by growing, or are chance
constexpr int kMostTries = 3;           // to take a pixel in, as its surroundings become known
constexpr double kBridgeSlope = 0.25;   // by which a bridged background may depart from the truth, per length

struct Sighting {
  float depth, sigma;
  int view;
};

/// Sorted from far to near.
std::vector<Sighting> sightings(std::vector<RangeImage const*> const& images, int x, int y) {
  std::vector<Sighting> seen;
  for (std::size_t i = 0; i < images.size(); ++i)
    if (images[i]->has_depth(x, y))
      seen.push_back({images[i]->depth(y, x), images[i]->sigma(y, x), static_cast<int>(i)});
  std::stable_sort(seen.begin(), seen.end(), [](Sighting const& a, Sighting const& b) { return a.depth > b.depth; });
  return seen;
}

/// How depths scatter from view to view where nothing moved, relative to sigma: 90th percentile of |z - median| /
/// sigma, as if normal. More than what a plane fitted to one view leaves, since a matching window correlates its
/// pixels.
double temporal_noise(std::vector<RangeImage const*> const& images) {
  std::vector<float> ratios;
  for (int y = 0; y < images[0]->depth.rows; y += 2)
    for (int x = 0; x < images[0]->depth.cols; x += 2) {
      auto const seen = sightings(images, x, y);
      if (seen.size() < 3 || seen.size() * 2 < images.size()) continue;
      Sighting const& middle = seen[seen.size() / 2];
      if (seen.front().depth - seen.back().depth > 20 * middle.sigma) continue;
      for (auto const& s : seen)
        if (s.view != middle.view) ratios.push_back(std::abs(s.depth - middle.depth) / middle.sigma);
    }
  if (ratios.size() < 100) return 1;
  auto const at = ratios.begin() + static_cast<std::ptrdiff_t>(ratios.size() * 9 / 10);
  std::nth_element(ratios.begin(), at, ratios.end());
  return std::clamp(*at / 1.645, 1.0, 4.0);
}

/// The run of sightings (sorted) that agree, with the most views; the farther of equals.
std::span<Sighting const> largest_cluster(std::vector<Sighting> const& seen, double noise_factor) {
  std::span<Sighting const> best;
  std::size_t last = 0;
  for (std::size_t first = 0; first < seen.size(); ++first) {
    double const width = 2 * kClusterSigmas * noise_factor * seen[first].sigma;
    while (last + 1 < seen.size() && seen[first].depth - seen[last + 1].depth <= width) ++last;
    if (last - first + 1 > best.size()) best = std::span(seen).subspan(first, last - first + 1);
  }
  return best;
}

/// The sightings that agree with a depth that was predicted.
std::span<Sighting const> cluster_at(std::vector<Sighting> const& seen, double z, double noise_factor) {
  auto const near = [&](Sighting const& s) { return std::abs(s.depth - z) <= kClusterSigmas * noise_factor * s.sigma; };
  auto const first = std::find_if(seen.begin(), seen.end(), near);
  auto const last = std::find_if_not(first, seen.end(), near);
  return {first, last};
}

float median(std::vector<float>& values) {
  auto const at = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::nth_element(values.begin(), at, values.end());
  return *at;
}

/// A plane is linear in 1/z over a perspective picture, in z over an orthographic one.
double to_linear(Camera const& camera, double z) { return camera.is_perspective() ? 1 / z : z; }

/// Predicts the linear quantity at (x, y) from the known pixels around by least squares; false where they are too few
/// or on a line.
bool predict(cv::Mat1d const& linear, cv::Mat1b const& known, int x, int y, double& value) {
  Eigen::Matrix3d normal = Eigen::Matrix3d::Zero();
  Eigen::Vector3d right = Eigen::Vector3d::Zero();
  int count = 0;
  for (int v = std::max(0, y - kFitRadius); v <= std::min(linear.rows - 1, y + kFitRadius); ++v)
    for (int u = std::max(0, x - kFitRadius); u <= std::min(linear.cols - 1, x + kFitRadius); ++u) {
      if (known(v, u) == 0) continue;
      Eigen::Vector3d const row(1, u - x, v - y);
      normal += row * row.transpose();
      right += row * linear(v, u);
      ++count;
    }
  if (count < kFewestToFit || normal.determinant() < 1e-3 * count * count * count) return false;
  value = normal.ldlt().solve(right)(0);
  return true;
}

/// Fills what is unknown by the smoothest surface (Laplace's equation in the linear quantity), coarse to fine: a plane
/// seen all round an object is continued behind it exactly.
void bridge(cv::Mat1d& linear, cv::Mat1b const& known) {
  if (cv::countNonZero(known) == 0) return;
  if (std::min(linear.rows, linear.cols) > 8) {
    cv::Mat1d coarse((linear.rows + 1) / 2, (linear.cols + 1) / 2, 0.0);
    cv::Mat1b coarse_known(coarse.size(), static_cast<std::uint8_t>(0));
    for (int y = 0; y < coarse.rows; ++y)
      for (int x = 0; x < coarse.cols; ++x) {
        double sum = 0;
        int count = 0;
        for (int v = 2 * y; v < std::min(2 * y + 2, linear.rows); ++v)
          for (int u = 2 * x; u < std::min(2 * x + 2, linear.cols); ++u)
            if (known(v, u) != 0) sum += linear(v, u), ++count;
        if (count > 0) coarse(y, x) = sum / count, coarse_known(y, x) = 255;
      }
    bridge(coarse, coarse_known);
    for (int y = 0; y < linear.rows; ++y)
      for (int x = 0; x < linear.cols; ++x)
        if (known(y, x) == 0) linear(y, x) = coarse(y / 2, x / 2);
  }
  for (int sweep = 0; sweep < 60; ++sweep)
    for (int y = 0; y < linear.rows; ++y)
      for (int x = 0; x < linear.cols; ++x) {
        if (known(y, x) != 0) continue;
        double const left = linear(y, std::max(x - 1, 0)), right = linear(y, std::min(x + 1, linear.cols - 1));
        double const up = linear(std::max(y - 1, 0), x), down = linear(std::min(y + 1, linear.rows - 1), x);
        linear(y, x) = (left + right + up + down) / 4;
      }
}

/// Brightness of each view relative to the median over the views, where nothing moved: cameras adapt their exposure.
std::vector<cv::Vec3f> exposure_gains(std::vector<RangeImage const*> const& images, cv::Mat1b const& still) {
  std::vector<cv::Vec3f> gains(images.size(), cv::Vec3f(1, 1, 1));
  std::vector<std::array<std::vector<float>, 3>> ratios(images.size());
  std::vector<float> values(images.size());
  for (int y = 0; y < still.rows; y += 2)
    for (int x = 0; x < still.cols; x += 2) {
      if (still(y, x) == 0) continue;
      for (int c = 0; c < 3; ++c) {
        for (std::size_t i = 0; i < images.size(); ++i) values[i] = images[i]->color(y, x)[c];
        float const middle = median(values);
        if (middle < 20 || middle > 235) continue;
        for (std::size_t i = 0; i < images.size(); ++i)
          if (images[i]->color(y, x)[c] > 10)
            ratios[i][static_cast<std::size_t>(c)].push_back(middle / images[i]->color(y, x)[c]);
      }
    }
  for (std::size_t i = 0; i < images.size(); ++i)
    for (int c = 0; c < 3; ++c)
      if (auto& r = ratios[i][static_cast<std::size_t>(c)]; r.size() >= 100) gains[i][c] = median(r);
  return gains;
}

/// The model while it grows: what is known of each pixel.
class ModelBuilder {
 public:
  explicit ModelBuilder(std::vector<RangeImage const*> const& images)
      : images_(images),
        camera_(images.at(0)->camera),
        size_(camera_.width(), camera_.height()),
        noise_factor_(temporal_noise(images)),
        linear_(size_, 0.0),
        known_(size_, static_cast<std::uint8_t>(0)) {
    model_.noise_factor = noise_factor_;
    model_.depth = cv::Mat1f(size_, kMissing);
    model_.sigma = cv::Mat1f(size_, kMissing);
    model_.color = cv::Mat3f(size_, cv::Vec3f(0, 0, 0));
    model_.color_sigma = cv::Mat1f(size_, kMissing);
  }

  BackgroundModel build() {
    find_seeds();
    grow();
    if (cv::countNonZero(known_) > 0) {
      bridge_gaps();
      grow_color();
    }
    return std::move(model_);
  }

 private:
  /// Takes a cluster for the background of this pixel.
  void accept(int x, int y, std::span<Sighting const> cluster) {
    Sighting const& middle = cluster[cluster.size() / 2];
    model_.depth(y, x) = middle.depth;
    model_.sigma(y, x) = static_cast<float>(noise_factor_ * middle.sigma);
    linear_(y, x) = to_linear(camera_, middle.depth);
    known_(y, x) = 255;
    float spread = 0;
    model_.color(y, x) = color_of(x, y, cluster, spread);
    model_.color_sigma(y, x) = std::hypot(spread, color_noise_);
  }

  cv::Vec3f matched(std::size_t view, int x, int y) const {
    cv::Vec3f color;
    for (int c = 0; c < 3; ++c) color[c] = images_[view]->color(y, x)[c] * gains_[view][c];
    return color;
  }

  /// Median over the views of a cluster; `spread` is the largest of the channels', as a standard deviation.
  cv::Vec3f color_of(int x, int y, std::span<Sighting const> cluster, float& spread) const {
    cv::Vec3f color;
    std::vector<float> values;
    spread = 0;
    for (int c = 0; c < 3; ++c) {
      values.clear();
      for (auto const& s : cluster) values.push_back(matched(static_cast<std::size_t>(s.view), x, y)[c]);
      color[c] = median(values);
      for (float& value : values) value = std::abs(value - color[c]);
      spread = std::max(spread, 1.4826f * median(values));
    }
    return color;
  }

  void forget(int x, int y) {
    known_(y, x) = 0;
    model_.color_sigma(y, x) = kMissing;
  }

  /// Sure is what three quarters of the views agree on in depth, and most in colour, in pieces too large for chance. A
  /// textured object that looks the same from all sides keeps its depth, but not its colour.
  void find_seeds() {
    cv::Mat1b still(size_, static_cast<std::uint8_t>(0));
    auto const for_still = [&](auto const& what) {
      for (int y = 0; y < size_.height; ++y)
        for (int x = 0; x < size_.width; ++x) {
          auto const seen = sightings(images_, x, y);
          auto const cluster = largest_cluster(seen, noise_factor_);
          if (cluster.size() * 4 >= images_.size() * 3) what(x, y, cluster);
        }
    };
    for_still([&](int x, int y, auto const&) { still(y, x) = 255; });
    gains_ = exposure_gains(images_, still);
    std::vector<float> spreads;
    for_still([&](int x, int y, auto const& cluster) {
      float spread = 0;
      color_of(x, y, cluster, spread);
      spreads.push_back(spread);
    });
    if (!spreads.empty()) color_noise_ = std::max(kColorFloor, median(spreads));
    for_still([&](int x, int y, auto const& cluster) {
      accept(x, y, cluster);
      if (model_.color_sigma(y, x) > kSameColor * color_noise_) forget(x, y);
    });
    cv::Mat1i labels;
    cv::Mat stats, centers;
    cv::connectedComponentsWithStats(known_, labels, stats, centers, 4, CV_32S);
    for (int y = 0; y < size_.height; ++y)
      for (int x = 0; x < size_.width; ++x)
        if (known_(y, x) != 0 && stats.at<int>(labels(y, x), cv::CC_STAT_AREA) < kSmallestSeed * size_.area())
          forget(x, y);
  }

  /// From there the background is carried on, plane by plane, to what fewer views saw: what else was seen there is
  /// nearer than that prediction, and is the object.
  void grow() {
    // Chance agreement grows with the number of views.
    std::size_t const fewest = images_.size() < 6 ? 1 : std::max<std::size_t>(2, images_.size() / 5);
    std::vector<cv::Point> front;
    for (int y = 0; y < size_.height; ++y)
      for (int x = 0; x < size_.width; ++x)
        if (known_(y, x) != 0) front.emplace_back(x, y);
    cv::Mat1b tried(size_, static_cast<std::uint8_t>(0));
    cv::Rect const inside({0, 0}, size_);
    while (!front.empty()) {
      std::vector<cv::Point> next;
      for (cv::Point const p : front)
        for (cv::Point const q :
             {p + cv::Point(1, 0), p + cv::Point(-1, 0), p + cv::Point(0, 1), p + cv::Point(0, -1)}) {
          if (!inside.contains(q) || known_(q) != 0 || tried(q) >= kMostTries) continue;
          ++tried(q);
          auto const seen = sightings(images_, q.x, q.y);
          double predicted = 0;
          if (seen.size() < fewest || !predict(linear_, known_, q.x, q.y, predicted)) continue;
          auto const cluster = cluster_at(seen, to_linear(camera_, predicted), noise_factor_);  // its own inverse
          if (cluster.size() < fewest) continue;
          if (cluster.data() - seen.data() >= static_cast<std::ptrdiff_t>(fewest))
            continue;  // something lies behind it
          accept(q.x, q.y, cluster);
          if (model_.color_sigma(q) > kSameColor * color_noise_)
            forget(q.x, q.y);
          else
            next.push_back(q);
        }
      front = std::move(next);
    }
  }

  cv::Mat1f distance_to_known() const {
    cv::Mat1f distance;
    cv::distanceTransform(known_ == 0, distance, cv::DIST_L2, cv::DIST_MASK_PRECISE);
    return distance;
  }

  double bridge_error(double z, double pixels) const { return kBridgeSlope * camera_.pixel_size(z) * pixels; }

  /// The background's colour reaches farther than its depth, which is missing beside an object: a view's colour counts
  /// where it is that of the nearest known pixels. These stay the standard, lest small steps lead onto the object.
  void grow_color() {
    find_still_colors();
    struct Place {
      cv::Point at;
      cv::Vec3f standard;
    };
    std::vector<Place> front;
    for (int y = 0; y < size_.height; ++y)
      for (int x = 0; x < size_.width; ++x)
        if (std::isfinite(model_.color_sigma(y, x))) front.push_back({{x, y}, model_.color(y, x)});
    cv::Mat1b tried(size_, static_cast<std::uint8_t>(0));
    cv::Rect const inside({0, 0}, size_);
    while (!front.empty()) {
      std::vector<Place> next;
      for (auto const& [p, standard] : front)
        for (cv::Point const q :
             {p + cv::Point(1, 0), p + cv::Point(-1, 0), p + cv::Point(0, 1), p + cv::Point(0, -1)}) {
          if (!inside.contains(q) || std::isfinite(model_.color_sigma(q)) || tried(q) >= kMostTries) continue;
          ++tried(q);
          if (continue_color(q, standard)) next.push_back({q, standard});
        }
      front = std::move(next);
    }
  }

  /// A colour that three quarters of the views agree on needs no depth to be the background's.
  void find_still_colors() {
    std::vector<float> values(images_.size());
    for (int y = 0; y < size_.height; ++y)
      for (int x = 0; x < size_.width; ++x) {
        if (std::isfinite(model_.color_sigma(y, x))) continue;
        cv::Vec3f middle;
        for (int c = 0; c < 3; ++c) {
          for (std::size_t i = 0; i < images_.size(); ++i) values[i] = matched(i, x, y)[c];
          middle[c] = median(values);
        }
        std::size_t agreeing = 0;
        for (std::size_t i = 0; i < images_.size(); ++i)
          agreeing += cv::norm(matched(i, x, y) - middle) < kSameColor * color_noise_;
        if (agreeing * 4 < images_.size() * 3) continue;
        model_.color(y, x) = middle;
        model_.color_sigma(y, x) = 2 * color_noise_;
      }
  }

  bool continue_color(cv::Point q, cv::Vec3f const& standard) {
    cv::Vec3f sum(0, 0, 0);
    int agreeing = 0;
    for (std::size_t i = 0; i < images_.size(); ++i) {
      // What has a depth must have the background's; what has none may be it.
      double const in_front = model_.depth(q) - images_[i]->depth(q);  // NaN where there is no depth
      if (std::abs(in_front) > kClusterSigmas * model_.sigma(q)) continue;
      cv::Vec3f const color = matched(i, q.x, q.y);
      if (cv::norm(color - standard) < kSameColor * color_noise_) sum += color, ++agreeing;
    }
    if (agreeing < 2) return false;
    model_.color(q) = sum * (1.0f / static_cast<float>(agreeing));
    model_.color_sigma(q) = 2 * color_noise_;
    return true;
  }

  /// Behind what always covers it the background is only bridged: less sure the farther from what was seen.
  void bridge_gaps() {
    bridge(linear_, known_);
    cv::Mat1f const distance = distance_to_known();
    for (int y = 0; y < size_.height; ++y)
      for (int x = 0; x < size_.width; ++x) {
        if (known_(y, x) != 0) continue;
        double const z = to_linear(camera_, linear_(y, x));
        model_.depth(y, x) = static_cast<float>(z);
        model_.sigma(y, x) = static_cast<float>(bridge_error(z, distance(y, x)));
      }
  }

  std::vector<RangeImage const*> const& images_;
  Camera camera_;
  cv::Size size_;
  double noise_factor_;
  std::vector<cv::Vec3f> gains_;
  float color_noise_ = kColorFloor;
  cv::Mat1d linear_;  ///< what is linear over a plane
  cv::Mat1b known_;
  BackgroundModel model_;
};

}  // namespace

BackgroundModel static_background(std::vector<RangeImage const*> const& images) { return ModelBuilder(images).build(); }

}  // namespace scanview
