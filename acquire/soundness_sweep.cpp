#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "acquire/soundness.h"
#include "base/median.h"

namespace scanview {
namespace {

constexpr std::size_t kDelay = 6;          // frames after which the beam has left a pixel
constexpr std::size_t kAmbientStride = 7;  // between samples that the room's light is averaged over
constexpr float kFullScale = 0.998F;
constexpr double kLeastLit = 0.03;      // of full scale: a change that a beam makes
constexpr double kLeastOverlap = 0.02;  // below, the frames are just far apart
constexpr double kTailless = 0.65;      // steps: least width of a beam for the lamp's brightness
constexpr double kUneven = 0.25;        // scatter of the steps beyond which they are called uneven
constexpr std::size_t kWindow = 6;      // frames on each side that say what is usual

// Distance in units of twice the beam from the share in which two frames overlap; NaN where one is dark.
double distance(double overlap) { return std::sqrt(-std::log(std::clamp(overlap, kLeastOverlap, 1.0))); }

// Median of the values around k, without it.
double usual(std::vector<double> const& values, std::size_t k) {
  std::vector<double> around;
  for (std::size_t i = k > kWindow ? k - kWindow : 0; i < std::min(values.size(), k + kWindow + 1); ++i)
    if (i != k && std::isfinite(values[i])) around.push_back(values[i]);
  return around.size() < 3 ? SoundnessFigures::kNone : median(std::move(around));
}

std::string list(std::vector<std::size_t> const& frames) {
  std::string text;
  for (std::size_t i = 0; i < frames.size() && i < 8; ++i)
    text.append(i > 0 ? ", " : "").append(std::to_string(frames[i]));
  return frames.size() > 8 ? text.append(" ...") : text;
}

}  // namespace

void ChangeHistogram::add(std::vector<float> const& a, std::vector<float> const& b) {
  constexpr std::size_t kStride = 11;
  for (std::size_t i = 0; i < a.size(); i += kStride) {
    auto const bin = static_cast<std::size_t>(std::abs(a[i] - b[i]) * (kBins - 1) + 0.5F);
    ++counts_[std::min(bin, kBins - 1)];
    ++total_;
  }
}

double ChangeHistogram::deviation() const {
  if (total_ == 0) return 0;
  std::size_t below = 0, bin = 0;
  while (below + counts_[bin] <= total_ / 2) below += counts_[bin++];
  return 1.4826 * static_cast<double>(bin) / (kBins - 1);
}

void SweepSoundness::add(cv::Mat const& frame) {
  auto values = samples_.take(frame, std::move(spare_));
  if (darkest_.empty()) {
    darkest_ = brightest_ = values;
    saturated_.assign(values.size(), 0);
    identical_.push_back(false);
  } else {
    auto const& last = waiting_.back();
    changes_.add(values, last);
    identical_.push_back(values == last);
    for (std::size_t i = 0; i < values.size(); ++i) darkest_[i] = std::min(darkest_[i], values[i]);
    for (std::size_t i = 0; i < values.size(); ++i) brightest_[i] = std::max(brightest_[i], values[i]);
  }
  for (std::size_t i = 0; i < values.size(); ++i) saturated_[i] += static_cast<std::uint32_t>(values[i] >= kFullScale);
  // Quantisation alone makes 0.29 of a level.
  noise_ = std::max(changes_.deviation() / std::sqrt(2.0), 0.29 * samples_.resolution());
  waiting_.push_back(std::move(values));
  if (waiting_.size() > kDelay) {
    evaluate(waiting_.front());
    spare_ = std::move(waiting_.front());
    waiting_.pop_front();
  }
}

void SweepSoundness::evaluate(std::vector<float> const& frame) {
  // The oldest is cleared and becomes the newest.
  std::swap(excess_two_before_, excess_before_);
  std::swap(excess_before_, excess_);
  excess_.resize(frame.size());
  lit_.resize(frame.size());
  // The darkest of many noisy values lies about two deviations below their mean.
  auto const bias = static_cast<float>(2 * noise_), least = static_cast<float>(5 * noise_ + 0.01);
  for (std::size_t i = 0; i < frame.size(); ++i) {
    float const above = frame[i] - darkest_[i] - bias;
    excess_[i] = above > least ? above : 0;
  }
  // No branch, which would be mispredicted at every rim of the light.
  std::size_t lit = 0;
  for (std::size_t i = 0; i < frame.size(); ++i) {
    lit_[lit] = static_cast<std::uint32_t>(i);
    lit += excess_[i] > 0 ? 1 : 0;
  }
  lit_.resize(lit);
  Step step;
  double dark = 0;
  std::size_t dark_count = 0;
  for (std::size_t i = 0; i < frame.size(); i += kAmbientStride) {
    if (excess_[i] > 0) continue;
    dark += static_cast<double>(frame[i] - darkest_[i] - bias);
    ++dark_count;
  }
  std::size_t const k = steps_.size();
  step.identical = identical_[k];
  if (kAmbientStride * dark_count > frame.size() / 4) step.ambient = dark / static_cast<double>(dark_count);
  auto const product = [&](std::vector<float> const& other) {
    double sum = 0;
    for (std::size_t const i : lit_) sum += static_cast<double>(excess_[i]) * static_cast<double>(other[i]);
    return sum;
  };
  step.energy = product(excess_);
  if (k >= 1) step.overlap = product(excess_before_);
  if (k >= 2) {
    step.overlap_two = product(excess_two_before_);
    auto const clear = static_cast<float>(std::max(12 * noise_, 0.02));
    std::vector<double> ratios;  // one logarithm, of their median
    for (std::size_t const i : lit_) {
      float const before = excess_two_before_[i], middle = excess_before_[i], after = excess_[i];
      if (before < clear || middle < clear || after < clear || brightest_[i] >= kFullScale) continue;
      ratios.push_back(static_cast<double>(before) * static_cast<double>(after) /
                       (static_cast<double>(middle) * static_cast<double>(middle)));
    }
    if (ratios.size() >= 30) step.curvature = std::log(median(std::move(ratios)));
  }
  steps_.push_back(step);
}

SoundnessFigures SweepSoundness::finish() {
  while (!waiting_.empty()) {
    evaluate(waiting_.front());
    waiting_.pop_front();
  }
  SoundnessFigures figures;
  figures.frames = steps_.size();
  if (figures.frames < 2) return figures;
  figures.noise = noise_;

  std::size_t lit = 0, clipped = 0;
  for (std::size_t i = 0; i < darkest_.size(); ++i) {
    if (static_cast<double>(brightest_[i] - darkest_[i]) < std::max(kLeastLit, 8 * noise_)) continue;
    ++lit;
    clipped += saturated_[i] > 0 && 2 * saturated_[i] < figures.frames ? 1 : 0;
  }
  figures.lit_share = static_cast<double>(lit) / static_cast<double>(darkest_.size());
  if (lit > 0) figures.saturated_share = static_cast<double>(clipped) / static_cast<double>(lit);

  // Distances between frames that have enough light to tell.
  std::vector<double> energies;
  for (Step const& step : steps_) energies.push_back(step.energy);
  double const dark = 0.02 * median(energies);
  auto const seen = [&](std::size_t k) { return steps_[k].energy > dark && steps_[k].energy > 0; };
  std::vector<double> one(figures.frames, SoundnessFigures::kNone), two = one, curvatures, ambients;
  std::vector<double> curvature_at(figures.frames, SoundnessFigures::kNone);
  for (std::size_t k = 1; k < figures.frames; ++k) {
    if (seen(k) && seen(k - 1)) one[k] = distance(steps_[k].overlap / std::sqrt(energies[k] * energies[k - 1]));
    if (k >= 2 && seen(k) && seen(k - 2))
      two[k] = distance(steps_[k].overlap_two / std::sqrt(energies[k] * energies[k - 2]));
    curvature_at[k] = steps_[k].curvature;
    if (std::isfinite(steps_[k].curvature)) curvatures.push_back(steps_[k].curvature);
    if (std::isfinite(steps_[k].ambient)) ambients.push_back(steps_[k].ambient);
  }
  if (curvatures.size() >= 5 && median(curvatures) < 0) figures.beam_steps = 1 / std::sqrt(-median(curvatures));
  if (ambients.size() >= 5) figures.ambient_scatter = robust_deviation(ambients);
  std::vector<double> deviations;
  for (std::size_t k = 2; k < figures.frames; ++k)
    if (double const expected = usual(curvature_at, k); std::isfinite(expected) && std::isfinite(curvature_at[k]))
      deviations.push_back(curvature_at[k] - expected);
  // Of gains g: log g[k-1] - 2 log g[k] + log g[k+1], six times a gain's variance.
  // A narrow beam's neighbouring frames see its tails only, where light by way of other surfaces counts.
  if (deviations.size() >= 8 && figures.beam_steps > kTailless)
    figures.flicker = robust_deviation(deviations) / std::sqrt(6.0);

  std::vector<double> known, scatter;
  for (double const value : one)
    if (std::isfinite(value)) known.push_back(value);
  double const typical = median(known);
  // Frames twice the usual step apart must still overlap measurably.
  bool const order_shows = known.size() >= 5 && 1.7 * typical < distance(0);
  auto const expected_step = [&](std::size_t k) {
    double const around = usual(one, k);
    return std::isfinite(around) ? around : typical;
  };
  enum class Order { good, closer_after, closer_before, misplaced };
  std::vector<Order> order(figures.frames + 1, Order::good);
  for (std::size_t k = 1; order_shows && k + 1 < figures.frames; ++k) {
    if (!std::isfinite(one[k]) || !std::isfinite(one[k + 1]) || !std::isfinite(two[k + 1])) continue;
    double const margin = 0.4 * expected_step(k);
    bool const first = two[k + 1] < one[k] - margin, second = two[k + 1] < one[k + 1] - margin;
    order[k] = first && second ? Order::misplaced
               : first         ? Order::closer_after
               : second        ? Order::closer_before
                               : Order::good;
  }
  std::vector<bool> explained(figures.frames + 2, false);
  for (std::size_t k = 1; k + 1 < figures.frames; ++k) {
    if (order[k] == Order::misplaced) {
      figures.out_of_order.push_back(k);
      explained[k] = explained[k + 1] = true;
    } else if (order[k] == Order::closer_after && order[k + 1] == Order::closer_before) {
      figures.out_of_order.push_back(k);
      explained[k] = explained[k + 1] = explained[k + 2] = true;
    }
  }
  // A gap lies between the frames two apart, too: three steps instead of two, as far as such a distance can be told.
  auto const wide_at = [&](std::size_t k) {
    double const least = 1.25 * usual(two, k);
    return k >= figures.frames || !std::isfinite(two[k]) || !(least < 0.95 * distance(0)) || two[k] > least;
  };
  for (std::size_t k = 1; k < figures.frames; ++k) {
    double const expected = expected_step(k);
    bool const same = std::isfinite(one[k]) && one[k] < 0.3 * expected && known.size() >= 5;
    if (same || (steps_[k].identical && noise_ > 0.3 * samples_.resolution())) {
      figures.doubled.push_back(k);
    } else if (order_shows && !explained[k] && one[k] > 1.6 * expected) {
      // Where the beam only grazes something both frames around are weak, too: a gap shows among strong frames only.
      bool const strong = std::min(energies[k], energies[k - 1]) > 0.1 * median(energies);
      if (strong && wide_at(k) && wide_at(k + 1)) figures.missing.push_back(k);
    } else if (!explained[k] && std::isfinite(one[k]) && one[k] > 0) {
      scatter.push_back(one[k] / expected - 1);
    }
  }
  if (scatter.size() >= 8) figures.step_scatter = robust_deviation(scatter);
  if (figures.step_scatter > kUneven) {
    // Steps of any length: what looks like a gap or a changed brightness follows from them.
    figures.missing.clear();
    std::erase_if(figures.doubled, [&](std::size_t k) { return !steps_[k].identical; });
    figures.flicker = SoundnessFigures::kNone;
  }

  auto const warn = [&](std::string text) { figures.warnings.push_back(camera_ + ": " + text); };
  if (figures.lit_share < 0.01)
    warn("the light is hardly visible in the frames: is the lamp on, and are these the pictures of the sweep?");
  if (figures.saturated_share > 0.02)
    warn(fmt::format("{:.0f} % of the lit pixels are at full scale: expose shorter or close the aperture",
                     100 * figures.saturated_share));
  if (!figures.doubled.empty())
    warn(
        fmt::format("frame {} shows the same light as the one before: a picture was stored twice, or the light did not "
                    "move",
                    list(figures.doubled)));
  if (!figures.missing.empty())
    warn(
        fmt::format("{} before frame {}: the light moves twice as far as usual", kMissingFrame, list(figures.missing)));
  if (!figures.out_of_order.empty())
    warn(fmt::format("frame {} is out of order: the light goes back and forth", list(figures.out_of_order)));
  if (figures.flicker > 0.04)
    warn(
        fmt::format("the lamp's brightness varies by {:.0f} % from frame to frame: let it warm up, or expose for whole "
                    "periods of the mains",
                    100 * figures.flicker));
  if (figures.ambient_scatter > 0.01)
    warn(fmt::format("the room's light varies by {:.1f} % of full scale from frame to frame: darken the room",
                     100 * figures.ambient_scatter));
  if (figures.step_scatter > kUneven)
    warn(fmt::format("{} by {:.0f} %: it lags behind the camera, or its drive slips", kUnevenSteps,
                     100 * figures.step_scatter));
  if (figures.lit_share >= 0.01 && !(figures.beam_steps >= 0.5))
    warn(
        "the beam is narrower than half its step, so that peaks between frames are missed: make smaller steps, or "
        "widen the beam");
  return figures;
}

}  // namespace scanview
