#include "acquire/decode_gray.h"

#include <algorithm>
#include <cmath>
#include <opencv2/core.hpp>
#include <utility>

namespace scanview {
namespace {

constexpr int kNoiseRows = 8;  // every so many rows are sampled

}  // namespace

GrayDecoder::GrayDecoder(Capture const& capture) : capture_(capture) {}

void GrayDecoder::add(GrayFrame const& what, cv::Mat const& picture) {
  if (what.kind == GrayFrame::Kind::skip) return;
  if (what.kind == GrayFrame::Kind::white) white_ = picture;
  if (what.kind == GrayFrame::Kind::black) black_ = picture;
  if (what.kind != GrayFrame::Kind::bit) return;
  auto const is_pair = [&](Pending const& other) {
    return other.what.bit == what.bit && other.what.is_row == what.is_row && other.what.inverse != what.inverse;
  };
  auto const pair = std::find_if(pending_.begin(), pending_.end(), is_pair);
  if (pair == pending_.end()) {
    pending_.push_back({what, picture});
    return;
  }
  add_pair(what, what.inverse ? pair->picture : picture, what.inverse ? picture : pair->picture);
  pending_.erase(pair);
}

void GrayDecoder::add_pair(GrayFrame const& what, cv::Mat const& pattern, cv::Mat const& inverse) {
  is_16_bit_ = pattern.depth() == CV_16U;
  GrayBits& bits = what.is_row ? rows_ : columns_;
  bits.add(what.bit, pattern, inverse);
  // The coarsest bit's, whatever the order: where d passes zero the greater is half as bright, and fine stripes have
  // many such places.
  if (level_.empty() || (!what.is_row && what.bit > level_bit_)) {
    cv::addWeighted(pattern, 0.5, inverse, 0.5, 0, level_);
    cv::max(pattern, inverse, brightest_);
    level_bit_ = what.is_row ? -1 : what.bit;
  }
  sample_noise(pattern, inverse);
}

/// The sum of a pair is white + black for every bit, so what differs between two bits' sums is noise: of variance
/// 2 (var(white) + var(black)) = 4 var((white + black) / 2), where the variance is linear in brightness.
void GrayDecoder::sample_noise(cv::Mat const& pattern, cv::Mat const& inverse) {
  int const rows = (pattern.rows + kNoiseRows - 1) / kNoiseRows;
  cv::Mat1f sum(rows, pattern.cols);
  for (int i = 0; i < rows; ++i) {
    cv::Mat1f a, b;
    pattern.row(i * kNoiseRows).convertTo(a, CV_32F);
    inverse.row(i * kNoiseRows).convertTo(b, CV_32F);
    cv::Mat(a + b).copyTo(sum.row(i));
  }
  double const full = is_16_bit_ ? 65535 : 255;
  if (!fit_) fit_.emplace(full);
  if (!last_sum_.empty())
    for (int i = 0; i < rows; ++i)
      for (int x = 0; x < sum.cols; x += 2) {
        double const middle = 0.25 * (sum(i, x) + last_sum_(i, x));
        if (middle < 0.48 * full) fit_->add(middle, 0.5 * (sum(i, x) - last_sum_(i, x)));  // else one may be saturated
      }
  last_sum_ = sum;
}

/// Standard deviation of d = a - b at each level of (a + b) / 2: var(a) + var(b) = 2 var((a + b) / 2).
std::vector<float> GrayDecoder::noise_of_differences() const {
  std::vector<float> of_level(is_16_bit_ ? 65536 : 256);
  for (std::size_t level = 0; level < of_level.size(); ++level)
    of_level[level] = static_cast<float>(std::sqrt(2 * noise_.variance(static_cast<double>(level))));
  return of_level;
}

CodeImage GrayDecoder::finish() {
  for (auto const& [what, picture] : std::exchange(pending_, {})) {
    cv::Mat middle;
    cv::addWeighted(white_, 0.5, black_, 0.5, 0, middle);
    add_pair(what, what.inverse ? middle : picture, what.inverse ? picture : middle);
  }
  if (fit_) noise_ = fit_->solve();
  fit_.reset();
  last_sum_.release();
  DifferenceNoise const noise = {level_, noise_of_differences()};
  CodeImage image = border_codes(columns_, noise, capture_.projector_columns);
  if (!rows_.word.empty()) row_codes_ = whole_codes(rows_, noise, capture_.projector_rows);
  cv::Mat const brightest = white_.empty() ? brightest_ : white_;
  int const full = is_16_bit_ ? 65535 : 255;
  for (int y = 0; y < image.classes.rows; ++y)
    for (int x = 0; x < image.classes.cols; ++x) {
      int const level = is_16_bit_ ? brightest.at<std::uint16_t>(y, x) : brightest.at<std::uint8_t>(y, x);
      if (level == full && !image.has_code(x, y)) image.classes(y, x) = static_cast<int>(PixelClass::saturated);
    }
  brightest.convertTo(image.lit, CV_8U, is_16_bit_ ? 1.0 / 257 : 1);
  return image;
}

}  // namespace scanview
