#include "acquire/segment_background.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <opencv2/imgproc.hpp>
#include <opencv2/imgproc/detail/gcgraph.hpp>

#include "acquire/segment_outliers.h"
#include "base/parallel.h"

namespace scanview {
namespace {

constexpr double kInFront = 3;             // sigmas by which the object stands out
constexpr double kMostEvidence = 8;        // of one pixel, as a log likelihood ratio: no pixel is certain
constexpr double kUnsureNearStep = 0.1;    // what a depth is worth next to a step, where matching windows straddle it
constexpr double kShading = 0.04;          // by which the object's shadow may change the background's brightness
constexpr double kNoDepth = 1;             // what has none is sooner a shadow of the sensor's beside the object
constexpr int kStepReach = 8;              // pixels
constexpr double kSmallestSurface = 0.01;  // of the object's largest
constexpr double kSmoothness = 6;          // price of a mask border across a pair of equal colours

/// (background - depth) / sigma: positive in front of it. NaN where either is missing.
cv::Mat1f standing_out(RangeImage const& image, BackgroundModel const& model) {
  cv::Mat1f ratio(image.depth.size(), kMissing);
  for (int y = 0; y < ratio.rows; ++y)
    for (int x = 0; x < ratio.cols; ++x)
      if (image.has_depth(x, y) && std::isfinite(model.depth(y, x)))
        ratio(y, x) = static_cast<float>((model.depth(y, x) - image.depth(y, x)) /
                                         std::hypot(model.noise_factor * image.sigma(y, x), model.sigma(y, x)));
  return ratio;
}

/// The picture with the exposure that the background's colours had.
cv::Mat3f matched_color(RangeImage const& image, BackgroundModel const& model, cv::Mat1f const& ratio) {
  cv::Mat3f color;
  image.color.convertTo(color, CV_32F);
  for (int c = 0; c < 3; ++c) {
    std::vector<float> gains;
    for (int y = 0; y < ratio.rows; y += 2)
      for (int x = 0; x < ratio.cols; x += 2)
        if (std::abs(ratio(y, x)) < kInFront && std::isfinite(model.color_sigma(y, x)) && model.color(y, x)[c] > 20 &&
            model.color(y, x)[c] < 235 && color(y, x)[c] > 10)
          gains.push_back(model.color(y, x)[c] / color(y, x)[c]);
    if (gains.size() < 100) continue;
    auto const middle = gains.begin() + static_cast<std::ptrdiff_t>(gains.size() / 2);
    std::nth_element(gains.begin(), middle, gains.end());
    for (auto& pixel : color) pixel[c] *= *middle;
  }
  return color;
}

double depth_evidence(double r) {
  double const share = r / kInFront;
  if (share < 1) return -4 * (1 - std::max(share, 0.0) * share);
  return std::min(2 * std::log(share), kMostEvidence);
}

/// How much more often a colour is seen on what stands out for certain than on the background: a log ratio per cell of
/// the colour cube, with linear weights between cells.
class ColorModel {
 public:
  void add(cv::Vec3f const& color, bool object) {
    visit(color, [&](std::size_t cell, double weight) { (object ? object_ : background_)[cell] += weight; });
    (object ? objects_ : backgrounds_) += 1;
  }
  double evidence(cv::Vec3f const& color) const {
    double object = 0, background = 0;
    visit(color, [&](std::size_t cell, double weight) {
      object += weight * object_[cell];
      background += weight * background_[cell];
    });
    if (objects_ < 100 || backgrounds_ < 100) return 0;
    constexpr double kUnseen = 1e-4;  // share of a colour that was not seen at all
    return std::clamp(std::log((object / objects_ + kUnseen) / (background / backgrounds_ + kUnseen)), -2.0, 2.0);
  }

 private:
  static constexpr int kCells = 17;  // 16 levels apart
  template <typename Visitor>
  static void visit(cv::Vec3f const& color, Visitor const& visitor) {
    int low[3];
    double part[3];
    for (int c = 0; c < 3; ++c) {
      double const at = std::clamp(color[c] / 16.0, 0.0, 15.999);
      low[c] = static_cast<int>(at);
      part[c] = at - low[c];
    }
    for (int corner = 0; corner < 8; ++corner) {
      double weight = 1;
      std::size_t cell = 0;
      for (int c = 0; c < 3; ++c) {
        int const up = (corner >> c) & 1;
        weight *= up != 0 ? part[c] : 1 - part[c];
        cell = cell * kCells + static_cast<std::size_t>(low[c] + up);
      }
      visitor(cell, weight);
    }
  }
  std::vector<double> object_ = std::vector<double>(kCells * kCells * kCells, 0.0), background_ = object_;
  double objects_ = 0, backgrounds_ = 0;
};

/// Squared, in standard deviations. Brightness may differ by more than hue does: an object shades what is around it.
double color_distance(cv::Vec3f const& color, cv::Vec3f const& background, double sigma) {
  cv::Vec3f const d = color - background;
  double const length = cv::norm(background);
  double const along = length > 0 ? d.dot(background) / length : 0;
  double const shading = kShading * length;
  return (d.dot(d) - along * along) / (sigma * sigma) + along * along / (sigma * sigma + shading * shading);
}

/// Log likelihood ratio, object against background, of depth and colour of every pixel.
cv::Mat1d evidence(BackgroundModel const& model, cv::Mat1f const& ratio, cv::Mat3f const& color) {
  cv::Mat1b const in_front = ratio > kInFront;  // false where NaN
  cv::Mat1b const measured = ratio == ratio;
  cv::Mat const disk = cv::getStructuringElement(cv::MORPH_ELLIPSE, {2 * kStepReach + 1, 2 * kStepReach + 1});
  cv::Mat1b near_object, near_background;
  cv::dilate(in_front, near_object, disk);
  cv::dilate(~in_front & measured, near_background, disk);
  ColorModel colors;
  for (int y = 0; y < ratio.rows; ++y)
    for (int x = 0; x < ratio.cols; ++x)
      if (measured(y, x) != 0 && !(near_object(y, x) != 0 && near_background(y, x) != 0))
        colors.add(color(y, x), in_front(y, x) != 0);
  cv::Mat1d result(ratio.size(), 0.0);
  for (int y = 0; y < ratio.rows; ++y)
    for (int x = 0; x < ratio.cols; ++x) {
      if (measured(y, x) != 0) {
        double const r = ratio(y, x);
        bool const unsure = near_object(y, x) != 0 && near_background(y, x) != 0;
        result(y, x) += depth_evidence(r) * (unsure ? kUnsureNearStep : 1.0);
      }
      if (measured(y, x) == 0) result(y, x) -= kNoDepth;
      if (std::isfinite(model.color_sigma(y, x))) {
        double const squared = color_distance(color(y, x), model.color(y, x), model.color_sigma(y, x));
        result(y, x) += std::clamp((squared - 20) / 4, -5.0, 6.0);
      }
      result(y, x) += colors.evidence(color(y, x));
    }
  return result;
}

/// The frames around the pieces of positive evidence that are more than specks.
cv::Mat1b around_evidence(cv::Mat1d const& evidence) {
  cv::Mat1i labels;
  cv::Mat stats, centers;
  int const count = cv::connectedComponentsWithStats(evidence > 0, labels, stats, centers, 4, CV_32S);
  cv::Mat1b active(evidence.size(), static_cast<std::uint8_t>(0));
  for (int label = 1; label < count; ++label) {
    if (stats.at<int>(label, cv::CC_STAT_AREA) < kStepReach * kStepReach) continue;
    cv::Rect frame(stats.at<int>(label, cv::CC_STAT_LEFT) - 2 * kStepReach,
                   stats.at<int>(label, cv::CC_STAT_TOP) - 2 * kStepReach,
                   stats.at<int>(label, cv::CC_STAT_WIDTH) + 4 * kStepReach,
                   stats.at<int>(label, cv::CC_STAT_HEIGHT) + 4 * kStepReach);
    active(frame & cv::Rect({0, 0}, active.size())) = 255;
  }
  return active;
}

/// The mask that explains the evidence with a short border, which prefers to run along edges of the picture that are
/// not edges of the background (Boykov and Jolly 2001; Sun et al. 2006, "Background Cut").
cv::Mat1b cut_mask(cv::Mat1d const& evidence, cv::Mat3f const& color, BackgroundModel const& model) {
  int const width = evidence.cols, height = evidence.rows;
  auto const contrast = [&](cv::Point a, cv::Point b) {
    cv::Vec3f const d = color(a) - color(b);
    if (!std::isfinite(model.color_sigma(a)) || !std::isfinite(model.color_sigma(b)))
      return static_cast<double>(d.dot(d));
    cv::Vec3f const other = d - (model.color(a) - model.color(b));
    return static_cast<double>(std::min(d.dot(d), other.dot(other)));
  };
  std::array const steps{cv::Point(1, 0), cv::Point(0, 1), cv::Point(1, 1), cv::Point(-1, 1)};
  cv::Rect const inside(0, 0, width, height);
  double sum = 0;
  std::size_t pairs = 0;
  for (int y = 0; y < height; ++y)
    for (int x = 0; x < width; ++x)
      for (cv::Point const step : steps)
        if (inside.contains(cv::Point(x, y) + step)) sum += contrast({x, y}, cv::Point(x, y) + step), ++pairs;
  double const typical = std::max(sum / static_cast<double>(std::max<std::size_t>(pairs, 1)), 1.0);

  // Only what is near evidence for an object is worth a node; the rest is background.
  cv::Mat1b const active = around_evidence(evidence);
  cv::Mat1i node(evidence.size(), -1);
  int nodes = 0;
  for (int y = 0; y < height; ++y)
    for (int x = 0; x < width; ++x)
      if (active(y, x) != 0) node(y, x) = nodes++;
  cv::Mat1b mask(evidence.size(), static_cast<std::uint8_t>(0));
  if (nodes == 0) return mask;
  cv::detail::GCGraph<double> graph(static_cast<unsigned>(nodes), static_cast<unsigned>(4 * nodes));
  for (int i = 0; i < nodes; ++i) graph.addVtx();
  for (int y = 0; y < height; ++y)
    for (int x = 0; x < width; ++x) {
      if (node(y, x) >= 0)
        graph.addTermWeights(node(y, x), std::max(evidence(y, x), 0.0), std::max(-evidence(y, x), 0.0));
      for (cv::Point const step : steps) {
        cv::Point const q = cv::Point(x, y) + step;
        if (!inside.contains(q) || std::max(node(y, x), node(q)) < 0) continue;
        double const price = kSmoothness * std::exp(-contrast({x, y}, q) / (2 * typical)) / cv::norm(step);
        if (std::min(node(y, x), node(q)) >= 0)
          graph.addEdges(node(y, x), node(q), price, price);
        else
          graph.addTermWeights(std::max(node(y, x), node(q)), 0, price);
      }
    }
  graph.maxFlow();
  for (int y = 0; y < height; ++y)
    for (int x = 0; x < width; ++x)
      if (node(y, x) >= 0 && graph.inSourceSegment(node(y, x))) mask(y, x) = 255;
  return mask;
}

/// Keeps the pieces that depth speaks for, and that are not small beside the largest.
cv::Mat1b main_pieces(cv::Mat1b const& mask, cv::Mat1f const& ratio) {
  cv::Mat1i labels;
  int const count = cv::connectedComponents(mask, labels, 8, CV_32S);
  std::vector<int> area(static_cast<std::size_t>(count), 0), in_front = area;
  for (int y = 0; y < mask.rows; ++y)
    for (int x = 0; x < mask.cols; ++x) {
      auto const label = static_cast<std::size_t>(labels(y, x));
      ++area[label];
      in_front[label] += ratio(y, x) > kInFront;
    }
  area[0] = in_front[0] = 0;
  int const largest = *std::max_element(in_front.begin(), in_front.end());
  cv::Mat1b kept(mask.size(), static_cast<std::uint8_t>(0));
  for (int y = 0; y < mask.rows; ++y)
    for (int x = 0; x < mask.cols; ++x) {
      auto const label = static_cast<std::size_t>(labels(y, x));
      if (label != 0 && in_front[label] * 20 >= largest && in_front[label] * 4 >= area[label]) kept(y, x) = 255;
    }
  return kept;
}

/// Takes the background's depths away, and those inside the mask that are the background's still.
std::size_t apply_mask(RangeImage& image, cv::Mat1b const& mask, cv::Mat1f const& ratio) {
  std::size_t const before = image.count_depths();
  for (int y = 0; y < mask.rows; ++y)
    for (int x = 0; x < mask.cols; ++x) {
      if (mask(y, x) == 0)
        image.remove(x, y, PixelClass::background);
      else if (image.classes(y, x) == static_cast<std::uint8_t>(PixelClass::background))
        image.remove(x, y, PixelClass::no_depth);
    }
  std::vector<int> sizes;
  cv::Mat1i const labels = surface_pieces(image, sizes);
  // A surface of its own that is this small beside the object's largest is more often a scrap of the background that
  // noise lifted than a part of the object; where it is one, other views see it at better size.
  int const smallest = static_cast<int>(kSmallestSurface * *std::max_element(sizes.begin(), sizes.end()));
  std::vector<int> in_front(sizes.size(), 0);
  for (int y = 0; y < mask.rows; ++y)
    for (int x = 0; x < mask.cols; ++x)
      if (labels(y, x) > 0) in_front[static_cast<std::size_t>(labels(y, x))] += ratio(y, x) > kInFront;
  for (int y = 0; y < mask.rows; ++y)
    for (int x = 0; x < mask.cols; ++x) {
      auto const label = static_cast<std::size_t>(labels(y, x));
      if (label > 0 && (in_front[label] * 2 < sizes[label] || sizes[label] < smallest))
        image.remove(x, y, PixelClass::outlier);
    }
  remove_hanging_scraps(image, kSmallestSurface);
  remove_outliers(image);
  return before - image.count_depths();
}

}  // namespace

cv::Mat1b object_mask(RangeImage const& image, BackgroundModel const& model) {
  cv::Mat1f const ratio = standing_out(image, model);
  cv::Mat3f const color = matched_color(image, model, ratio);
  return main_pieces(cut_mask(evidence(model, ratio, color), color, model), ratio);
}

std::size_t remove_static_background(ScanSet& set, Context& context) {
  std::vector<RangeImage const*> images;
  std::vector<View*> views;
  for (auto& view : set.views) {
    if (!(view.image.camera == set.views.front().image.camera)) {
      context.warn(fmt::format("view {} has another camera than the first: its background stays", view.name));
      continue;
    }
    images.push_back(&view.image);
    views.push_back(&view);
  }
  if (images.size() < 3) {
    context.warn("fewer than three views from one fixed camera: the background stays");
    return 0;
  }
  BackgroundModel const model = static_background(images);
  if (cv::countNonZero(model.depth == model.depth) == 0) {
    context.warn("nothing stays the same over the views: no background is removed");
    return 0;
  }
  std::vector<std::size_t> removed(views.size(), 0);
  for_each_index(
      context, views.size(),
      [&](std::size_t i) {
        RangeImage& image = views[i]->image;
        removed[i] = apply_mask(image, object_mask(image, model), standing_out(image, model));
      },
      "background");
  std::size_t total = 0;
  for (std::size_t const count : removed) total += count;
  return total;
}

}  // namespace scanview
