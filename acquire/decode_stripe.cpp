#include <algorithm>
#include <cmath>
#include <opencv2/core.hpp>

#include "acquire/decode_sweep.h"

namespace scanview {
namespace {

constexpr int kApart = 5;          // frames after which the stripe is elsewhere
constexpr float kLightSigmas = 6;  // least height of a stripe
constexpr float kLeastLevels = 4;  // of 8 bits
constexpr float kWidestGap = 4;    // median distances between the stripes of successive frames on one surface
constexpr int kNoiseStep = 16;     // rows
constexpr int kNoiseFrames = 5;    // from so many frames on the noise is known

}  // namespace

void StripeDecoder::add(cv::Mat const& frame) {
  cv::Mat1f values;
  frame.convertTo(values, CV_32F, frame.depth() == CV_16U ? 1.0 / 257 : 1);
  if (frames_ == 0) {
    values.copyTo(brightest_);
    values.copyTo(least_);
    rows_.resize(static_cast<std::size_t>(values.rows));
  } else {
    brightest_ = cv::max(brightest_, values);
    least_ = cv::min(least_, values);
    // The camera's noise, from what two frames differ by where the stripe is in neither (most of the picture).
    cv::Mat1f const& before = recent_.back();
    if (frames_ <= kNoiseFrames)
      for (int y = 0; y < values.rows; y += kNoiseStep)
        for (int x = 0; x < values.cols; ++x)
          fit_.add(0.5 * (values(y, x) + before(y, x)), (values(y, x) - before(y, x)) / std::sqrt(2.0));
  }
  recent_.push_back(values);
  ++frames_;
  if (recent_.size() > 2 * kApart + 1) recent_.pop_front();
  // The ambient light of a frame is what the frames `kApart` before and after it show; the first ones have none before.
  if (frames_ > kApart) process(frames_ - 1 - kApart);
}

void StripeDecoder::process(int frame) {
  int const oldest = frames_ - static_cast<int>(recent_.size());
  cv::Mat1f ambient;
  for (int const other : {frame - kApart, frame + kApart}) {
    if (other < oldest || other >= frames_) continue;
    cv::Mat1f const& values = recent_[static_cast<std::size_t>(other - oldest)];
    ambient = ambient.empty() ? values : cv::Mat1f(cv::min(ambient, values));
  }
  if (!ambient.empty()) find_stripes(frame, recent_[static_cast<std::size_t>(frame - oldest)] - ambient);
}

void StripeDecoder::find_stripes(int frame, cv::Mat1f const& light) {
  if (frame == 0) noise_ = fit_.solve();
  for (int y = 0; y < light.rows; ++y) {
    float const* const value = light[y];
    for (int x = 0; x < light.cols; ++x) {
      // A stripe is a run of lit pixels, its middle the centroid of what is above half the run's height.
      auto const least = [&](int i) {
        return std::max(kLeastLevels, kLightSigmas * static_cast<float>(std::sqrt(2 * noise_.variance(least_(y, i)))));
      };
      if (value[x] < least(x)) continue;
      int end = x;
      float height = 0;
      while (end < light.cols && value[end] >= 0.5F * least(end)) height = std::max(height, value[end++]);
      float weight = 0, sum = 0, square = 0;
      for (int i = x; i < end; ++i) {
        float const w = value[i] - 0.5F * height;
        if (w <= 0) continue;
        weight += w, sum += w * static_cast<float>(i - x);
        square += static_cast<float>((i - x) * (i - x)) * w;
      }
      float const middle = sum / weight, spread = std::max(square / weight - middle * middle, 0.08F);
      float const sigma = static_cast<float>(std::sqrt(noise_.variance(height))) / weight * std::sqrt(spread) *
                          std::sqrt(static_cast<float>(end - x));
      rows_[static_cast<std::size_t>(y)].push_back({static_cast<float>(x) + middle, std::max(sigma, 0.01F), frame});
      x = end;
    }
  }
}

CodeImage StripeDecoder::finish() {
  for (int frame = std::max(0, frames_ - kApart); frame < frames_; ++frame) process(frame);
  recent_.clear();
  CodeImage image;
  image.code = cv::Mat1f(brightest_.size(), kMissing);
  image.sigma = cv::Mat1f(brightest_.size(), kMissing);
  image.bias = cv::Mat1f(brightest_.size(), kMissing);
  image.classes = cv::Mat1b(brightest_.size(), static_cast<std::uint8_t>(PixelClass::no_light));
  cv::Mat(brightest_ - least_).convertTo(image.lit, CV_8U);
  centres_ = cv::Mat1b(brightest_.size(), std::uint8_t{0});

  // Stripes come frame by frame; in each row the nearest one of the next frame continues the surface.
  auto const next_of = [](std::vector<Stripe> const& row, std::size_t i) {
    std::size_t best = row.size();
    for (std::size_t j = i + 1; j < row.size() && row[j].frame <= row[i].frame + 1; ++j)
      if (row[j].frame == row[i].frame + 1 &&
          (best == row.size() || std::abs(row[j].x - row[i].x) < std::abs(row[best].x - row[i].x)))
        best = j;
    return best;
  };
  std::vector<float> gaps;
  for (auto const& row : rows_)
    for (std::size_t i = 0; i < row.size(); ++i)
      if (auto const j = next_of(row, i); j < row.size()) gaps.push_back(std::abs(row[j].x - row[i].x));
  if (gaps.empty()) return image;
  auto const middle = gaps.begin() + static_cast<std::ptrdiff_t>(gaps.size() / 2);
  std::nth_element(gaps.begin(), middle, gaps.end());
  float const widest = kWidestGap * *middle;
  for (int y = 0; y < image.code.rows; ++y) {
    auto const& row = rows_[static_cast<std::size_t>(y)];
    for (std::size_t i = 0; i < row.size(); ++i) {
      auto const j = next_of(row, i);
      if (j == row.size() || std::abs(row[j].x - row[i].x) > widest || row[j].x == row[i].x) continue;
      Stripe const &a = row[i].x < row[j].x ? row[i] : row[j], &b = row[i].x < row[j].x ? row[j] : row[i];
      float const slope = static_cast<float>(b.frame - a.frame) / (b.x - a.x);
      for (int x = static_cast<int>(std::ceil(a.x)); static_cast<float>(x) <= b.x && x < image.code.cols; ++x) {
        float const share = (static_cast<float>(x) - a.x) / (b.x - a.x);
        image.code(y, x) = static_cast<float>(a.frame) + slope * (static_cast<float>(x) - a.x);
        image.sigma(y, x) = std::abs(slope) * std::hypot((1 - share) * a.sigma, share * b.sigma);
        image.bias(y, x) = 0;
        image.classes(y, x) = static_cast<std::uint8_t>(PixelClass::object);
        centres_(y, x) |= static_cast<float>(x) - a.x <= 0.5F || b.x - static_cast<float>(x) <= 0.5F;
      }
    }
  }
  return image;
}

}  // namespace scanview
