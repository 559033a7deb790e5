#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "acquire/soundness.h"
#include "base/median.h"

namespace scanview {
namespace {

constexpr float kFullScale = 0.998F;
constexpr float kLeastContrast = 0.06F;     // white above black, of full scale
constexpr std::size_t kMostSamples = 3000;  // of a bit, for each of its figures
constexpr std::size_t kFewestSamples = 200;
constexpr int kGammaSteps = 14;       // halvings of its range: to 0.0003
constexpr double kWrongPair = 0.33;   // of lit pixels: a pair from two bits disagrees at half of them
constexpr double kClear = 0.6;        // of lit pixels wholly bright or dark: wide stripes
constexpr float kLeastSlope = 0.02F;  // of a pair's sum, full scales a pixel: enough to see it move

/// Keeps evenly spread ones, `most` at most; returns how many were looked at for each.
template <typename T>
std::size_t thin(std::vector<T>& values, std::size_t most) {
  std::size_t const stride = values.size() / most + 1;
  for (std::size_t k = 0; k * stride < values.size(); ++k) values[k] = values[k * stride];
  values.resize((values.size() + stride - 1) / stride);
  return stride;
}

}  // namespace

void GraySoundness::add(cv::Mat const& picture) {
  auto values = samples_.take(picture, std::move(spare_));
  ++frames_;
  if (!options_.inverse) {
    add_bit(values, {});
    spare_ = std::move(values);
  } else if (pattern_.empty()) {
    pattern_ = std::move(values);
  } else {
    add_bit(pattern_, values);
    pattern_.clear();
    spare_ = std::move(values);
  }
}

void GraySoundness::add_bit(std::vector<float> const& pattern, std::vector<float> const& inverse) {
  if (white_.empty() && !inverse.empty()) {
    // The first pair stands in: what is bright in one of its pictures, and dark in the other.
    white_.resize(pattern.size());
    black_.resize(pattern.size());
    for (std::size_t i = 0; i < pattern.size(); ++i) {
      white_[i] = std::max(pattern[i], inverse[i]);
      black_[i] = std::min(pattern[i], inverse[i]);
    }
  }
  Bit bit;
  if (white_.empty()) {
    bits_.push_back(bit);
    return;
  }
  std::size_t const index = bits_.size();
  bool const along_rows = index < options_.column_bits;
  std::vector<double> pattern_gains, inverse_gains;
  std::vector<std::size_t> blurred;
  std::size_t lit = 0, wrong = 0, equal = 0, clear = 0, lines = 0, changes = 0;
  for (LineSamples::Line const& line : samples_.lines()) {
    int last = 0;
    std::size_t lit_here = 0;
    for (std::size_t i = line.first; i < line.first + line.length; ++i) {
      float const black = black_.empty() ? 0 : black_[i], contrast = white_[i] - black;
      if (contrast < kLeastContrast || white_[i] >= kFullScale) continue;
      float const other = inverse.empty() ? white_[i] + black - pattern[i] : inverse[i];
      float const difference = (pattern[i] - other) / contrast;
      ++lit_here;
      wrong += std::abs(pattern[i] + other - white_[i] - black) > 0.4F * contrast ? 1 : 0;
      equal += std::abs(difference) < 0.15F ? 1 : 0;
      clear += std::abs(difference) > 0.8F ? 1 : 0;
      if (difference > 0.8F) pattern_gains.push_back(static_cast<double>(pattern[i] / white_[i]));
      if (difference < -0.8F) inverse_gains.push_back(static_cast<double>(other / white_[i]));
      if (!inverse.empty() && std::abs(difference) < 0.6F) blurred.push_back(i);
      if (line.is_row != along_rows) continue;
      // A change counts once it is distinct: noise around a tie is none.
      int const sign = difference > 0.3F ? 1 : difference < -0.3F ? -1 : 0;
      changes += sign != 0 && last != 0 && sign != last ? 1 : 0;
      if (sign != 0) last = sign;
    }
    lit += lit_here;
    lines += line.is_row == along_rows && lit_here >= line.length / 10 ? 1 : 0;
  }
  if (lit >= kFewestSamples) {
    auto const share = [&](std::size_t count) { return static_cast<double>(count) / static_cast<double>(lit); };
    bit.mismatch = share(wrong);
    bit.equal = share(equal);
    bit.clear = share(clear);
    if (lines >= 3) bit.transitions = static_cast<double>(changes) / static_cast<double>(lines);
    if (std::min(pattern_gains.size(), inverse_gains.size()) >= kFewestSamples && !inverse.empty()) {
      thin(pattern_gains, kMostSamples);
      thin(inverse_gains, kMostSamples);
      bit.pattern_gain = median(std::move(pattern_gains));
      bit.inverse_gain = median(std::move(inverse_gains));
    }
    if (bit.mismatch < kWrongPair && bit.clear > kClear && !inverse.empty()) measure_motion(pattern, inverse, bit);
    // Edges between wide stripes only: in fine ones projectors and cameras overshoot. Ties of a wrong pair are no
    // edges.
    if (bit.mismatch < kWrongPair && bit.clear > kClear && std::isfinite(bit.pattern_gain)) {
      thin(blurred, kMostSamples);
      for (std::size_t const i : blurred) {
        blurred_.push_back({pattern[i] / static_cast<float>(bit.pattern_gain),
                            inverse[i] / static_cast<float>(bit.inverse_gain), white_[i],
                            black_.empty() ? 0 : black_[i]});
      }
    }
  }
  bits_.push_back(bit);
}

// A pair's sum that moved by m pixels along a line differs from the first by -m times their mean slope, and by the
// lamp's gain. Noise and the other direction's slope scatter around that; least squares, then again without what is far
// off. One picture's slope would be off by half the shift times its curvature; the mean of both is not.
void GraySoundness::measure_motion(std::vector<float> const& pattern, std::vector<float> const& inverse,
                                   Bit& bit) const {
  if (black_.empty()) return;
  auto const first = [&](std::size_t i) { return white_[i] + black_[i]; };
  auto const sum = [&](std::size_t i) { return pattern[i] + inverse[i]; };
  // Where stripes blur the sum shows the camera's response, and at full scale it shows nothing.
  std::vector<std::uint8_t> tells(white_.size());
  for (std::size_t i = 0; i < tells.size(); ++i) {
    float const contrast = white_[i] - black_[i];
    bool const is_clear = std::abs(pattern[i] - inverse[i]) > 0.6F * contrast;
    bool const is_below = std::max(white_[i], std::max(pattern[i], inverse[i])) < kFullScale;
    tells[i] = static_cast<std::uint8_t>(contrast >= kLeastContrast) & static_cast<std::uint8_t>(is_clear) &
               static_cast<std::uint8_t>(is_below);
  }
  for (bool const is_row : {true, false}) {
    struct Sample {
      double slope, level, change;
    };
    std::vector<Sample> samples;
    for (LineSamples::Line const& line : samples_.lines()) {
      if (line.is_row != is_row) continue;
      for (std::size_t i = line.first + 1; i + 1 < line.first + line.length; ++i) {
        if ((tells[i - 1] & tells[i] & tells[i + 1]) == 0) continue;
        float const slope = 0.25F * (first(i + 1) - first(i - 1) + sum(i + 1) - sum(i - 1));
        if (std::abs(slope) < kLeastSlope) continue;
        samples.push_back(
            {static_cast<double>(slope), static_cast<double>(first(i)), static_cast<double>(sum(i) - first(i))});
      }
    }
    std::size_t const stride = thin(samples, kMostSamples);
    if (samples.size() < kFewestSamples) continue;
    double shift = 0, gain = 0, cut = std::numeric_limits<double>::infinity(), std = 0;
    for (int round = 0; round < 4; ++round) {
      double ss = 0, sl = 0, ll = 0, sc = 0, lc = 0;
      for (Sample const& s : samples) {
        if (std::abs(s.change + shift * s.slope - gain * s.level) > cut) continue;
        ss += s.slope * s.slope, sl += s.slope * s.level, ll += s.level * s.level;
        sc += s.slope * s.change, lc += s.level * s.change;
      }
      double const determinant = ss * ll - sl * sl;
      if (!(determinant > 1e-9 * ss * ll)) break;
      shift = -(sc * ll - lc * sl) / determinant;
      gain = (lc * ss - sc * sl) / determinant;
      std::vector<double> errors;
      for (Sample const& s : samples) errors.push_back(s.change + shift * s.slope - gain * s.level);
      double const scatter = robust_deviation(std::move(errors));
      cut = 3 * scatter + samples_.resolution();
      // Neighbours share an edge's error; a tenth of all counts as independent.
      std = scatter / std::sqrt(std::min(1.0, 0.1 * static_cast<double>(stride)) * ss);
    }
    bit.shift[is_row ? 0 : 1] = shift;
    bit.shift_std[is_row ? 0 : 1] = std;
  }
}

SoundnessFigures GraySoundness::finish() {
  SoundnessFigures figures;
  figures.frames = frames_;
  auto const warn = [&](std::string text) { figures.warnings.push_back(camera_ + ": " + text); };
  std::size_t const expected = (options_.column_bits + options_.row_bits) * (options_.inverse ? 2 : 1);
  if (frames_ != expected)
    warn(fmt::format("{} pattern pictures where {} are expected: pictures are missing, or 'bits' is wrong", frames_,
                     expected));
  if (white_.empty()) return figures;

  std::size_t lit = 0, clipped = 0;
  for (std::size_t i = 0; i < white_.size(); ++i) {
    float const black = black_.empty() ? 0 : black_[i];
    if (white_[i] - black < kLeastContrast) continue;
    ++lit;
    clipped += white_[i] >= kFullScale && black < kFullScale ? 1 : 0;
  }
  figures.lit_share = static_cast<double>(lit) / static_cast<double>(white_.size());
  if (lit > 0) figures.saturated_share = static_cast<double>(clipped) / static_cast<double>(lit);
  if (figures.lit_share < 0.01) warn("white and black hardly differ: is the projector on, and are these its pictures?");
  if (figures.saturated_share > 0.02)
    warn(fmt::format("{:.0f} % of the lit pixels are at full scale under white light: expose shorter",
                     100 * figures.saturated_share));

  std::vector<double> changes;
  figures.pair_mismatch = options_.inverse ? 0 : SoundnessFigures::kNone;
  std::vector<bool> bad(bits_.size(), false);
  for (std::size_t i = 0; i < bits_.size(); ++i) {
    Bit const& bit = bits_[i];
    if (!options_.inverse) break;
    figures.pair_mismatch = std::max(figures.pair_mismatch, bit.mismatch);
    std::string const pair = fmt::format("pictures {} and {} (bit {})", 2 * i, 2 * i + 1, i);
    // The finest stripes may be all blur; a pair of equal pictures has sums that are twice white or twice black.
    if (bit.mismatch > kWrongPair) {
      bad[i] = true;
      if (bit.equal > 0.6) {
        figures.doubled.push_back(2 * i + 1);
        warn(pair + " are equal instead of a pattern and its inverse: a picture was stored twice");
      } else {
        figures.out_of_order.push_back(2 * i);
        warn(pair + " are no pattern and its inverse: a picture is missing or out of order, or the scene moved");
      }
    } else if (std::isfinite(bit.pattern_gain) && bit.clear > 0.3) {
      changes.push_back(std::log(bit.pattern_gain / bit.inverse_gain));
    }
  }
  if (changes.size() >= 3) {
    double squares = 0;
    for (double const change : changes) squares += change * change;
    // Of two pictures that vary independently.
    figures.flicker = std::sqrt(squares / (2 * static_cast<double>(changes.size())));
  }
  if (figures.flicker > 0.03)
    warn(
        fmt::format("the projector's brightness varies by {:.0f} % from picture to picture: let it warm up, or expose "
                    "for whole periods of its frame",
                    100 * figures.flicker));

  for (Bit const& bit : bits_)
    for (std::size_t along = 0; along < 2; ++along) {
      double const moved = std::abs(bit.shift[along]);
      if (!std::isfinite(moved) || bit.shift_std[along] > 0.1 || moved < figures.motion_px) continue;
      figures.motion_px = moved;
      figures.motion_std_px = bit.shift_std[along];
    }
  if (figures.moved())
    warn(
        fmt::format("the scene lies {:.1f} px beside its place in the first picture: the camera or the scene moved "
                    "while the pictures were taken; fix both, release the camera from afar, and take the view again",
                    figures.motion_px));

  // Each bit has twice the changes of the one before, as long as its stripes can be told apart.
  for (auto const& [first, last] : {std::pair{std::size_t{0}, std::min(options_.column_bits, bits_.size())},
                                    std::pair{std::min(options_.column_bits, bits_.size()), bits_.size()}})
    for (std::size_t i = first + 1; i < last; ++i) {
      Bit const &before = bits_[i - 1], &bit = bits_[i];
      // The lit part of the code must be some stripes wide, or the ratio is chance.
      bool const countable = before.clear > 0.3 && bit.clear > 0.3 && !bad[i] && !bad[i - 1];
      if (!countable || std::max(before.transitions, bit.transitions) < 1.5) continue;
      double const ratio = bit.transitions / std::max(before.transitions, 1e-6);
      std::size_t const picture = (options_.inverse ? 2 : 1) * i;
      if (ratio > 0.8 && ratio < 1.15 && bit.transitions > 3) {
        figures.doubled.push_back(picture);
        warn(fmt::format("bit {} (picture {}) has stripes as wide as those of the bit before: it was stored twice", i,
                         picture));
      } else if (ratio <= 0.8) {
        figures.out_of_order.push_back(picture);
        warn(fmt::format("bit {} (picture {}) has wider stripes than the bit before: pictures are out of order", i,
                         picture));
      } else if (ratio > 3 && before.transitions > 1.5) {
        figures.missing.push_back(picture);
        warn(fmt::format(
            "bit {} (picture {}) has stripes less than a third as wide as those of the bit before: a bit is "
            "missing, or pictures are out of order",
            i, picture));
      }
    }

  if (blurred_.size() >= kFewestSamples) {
    auto const light = [](float value, float gamma) { return std::pow(std::max(0.0F, value), gamma); };
    auto const excess = [&](double gamma) {
      auto const g = static_cast<float>(gamma);
      std::vector<double> values;
      values.reserve(blurred_.size());
      for (Blurred const& b : blurred_)
        values.push_back(
            static_cast<double>((light(b.pattern, g) + light(b.inverse, g) - light(b.white, g) - light(b.black, g)) /
                                (light(b.white, g) - light(b.black, g))));
      return values;
    };
    double low = 0.3, high = 5;
    for (int step = 0; step < kGammaSteps; ++step) {
      double const middle = (low + high) / 2;
      (median(excess(middle)) > 0 ? low : high) = middle;
    }
    figures.gamma = (low + high) / 2;
    double const slope = (median(excess(figures.gamma * 1.05)) - median(excess(figures.gamma / 1.05))) /
                         (figures.gamma * (1.05 - 1 / 1.05));
    // Pixels along a line share what is wrong with their surface; a tenth of them counts as independent.
    double const error =
        1.2533 * robust_deviation(excess(figures.gamma)) / std::sqrt(0.1 * static_cast<double>(blurred_.size()));
    figures.gamma_std = error / std::max(1e-9, std::abs(slope));
    if (auto text = response_warning(camera_, figures.gamma, figures.gamma_std); !text.empty())
      figures.warnings.push_back(std::move(text));
  }
  return figures;
}

}  // namespace scanview
