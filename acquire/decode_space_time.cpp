#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>
#include <limits>
#include <opencv2/core.hpp>
#include <optional>

#include "acquire/decode_sweep.h"
#include "acquire/peak_fit.h"
#include "base/error.h"
#include "base/parallel.h"

namespace scanview {
namespace {

constexpr int kReach = SpaceTimeDecoder::kReach;
constexpr int kSpan = 2 * kReach + 1;
static_assert(kSpan <= PeakSamples::kMost);
constexpr double kRangeSigmas = 6;    // between the least and the greatest value of a pixel that may be lit
constexpr double kLightSigmas = 4.5;  // least height of a fitted peak
constexpr double kSecondPeak = 0.7;   // of the first one's height
constexpr double kGoodFit = 3;        // chi² a degree of freedom that is not questioned,
constexpr double kWorstFit = 40;      // and that is no peak at all; between them sigma grows
constexpr double kNarrowBeam = 0.5;   // steps; a narrower one has less than two frames in its peak,
constexpr double kNarrowGuess = 0.3;  // and is off by up to half a step where it has one
constexpr double kWidthShare = 0.5;   // a peak this much wider or narrower than most is none
constexpr int kSampleStep = 5;        // rows and columns looked at for noise and width
constexpr int kBandRows = 16;
constexpr int kLeastUsable = 5;  // of kSpan values; four parameters

/// Collects peaks and fits them some at once. `use(x, samples, peak)` gets each, in order.
class PeakQueue {
 public:
  PeakQueue(PixelNoise const& noise, WidthPrior const& prior, PeakDetail detail)
      : noise_(noise), prior_(prior), detail_(detail) {}

  template <class Use>
  void add(int x, PeakSamples const& samples, Use const& use) {
    x_[count_] = x;
    samples_[count_++] = samples;
    if (count_ == kPeaksAtOnce) flush(use);
  }
  template <class Use>
  void flush(Use const& use) {
    if (count_ == 0) return;
    std::array<Peak, kPeaksAtOnce> peaks;
    fit_peaks(samples_.data(), static_cast<int>(count_), kReach, noise_, prior_, peaks.data(), detail_);
    for (std::size_t i = 0; i < count_; ++i) use(x_[i], samples_[i], peaks[i]);
    count_ = 0;
  }

 private:
  PixelNoise noise_;
  WidthPrior prior_;
  PeakDetail detail_;
  std::array<PeakSamples, kPeaksAtOnce> samples_;
  std::array<int, kPeaksAtOnce> x_ = {};
  std::size_t count_ = 0;
};

}  // namespace

struct SpaceTimeDecoder::State {
  virtual ~State() = default;
  virtual void add(cv::Mat const& frame) = 0;
  virtual CodeImage finish(SweepFigures& figures, Context& context) = 0;
};

/// T: the type of a pixel's value.
template <class T>
struct SpaceTimeDecoder::TypedState final : State {
  static constexpr double kFull = std::numeric_limits<T>::max();
  cv::Mat_<T> best, second, least;
  cv::Mat1b age;         // frames since the best one, at most 255
  cv::Mat1w best_frame;  // where the values around the best one are known
  cv::Mat_<T> around;    // kSpan values a pixel, from best_frame - kReach on
  std::deque<cv::Mat_<T>> recent;
  int frames = 0;

  void add(cv::Mat const& frame) override {
    cv::Mat_<T> const values = frame;
    if (frames == 0) {
      values.copyTo(best);
      values.copyTo(least);
      second = cv::Mat_<T>(values.size(), T{0});
      age = cv::Mat1b(values.size(), std::uint8_t{0});
      best_frame = cv::Mat1w(values.size(), std::uint16_t{0});
      around = cv::Mat_<T>(values.rows, values.cols * kSpan, T{0});
    } else {
      for (int y = 0; y < values.rows; ++y) note_row(values[y], values.cols, best[y], second[y], least[y], age[y]);
    }
    recent.push_back(values);
    if (recent.size() > kSpan) recent.pop_front();
    ++frames;
    for (int y = 0; y < values.rows; ++y) keep_row(y, kReach);
  }

  /// Without branches and all of one width: the compiler makes vectors of it.
  static void note_row(T const* value, int n, T* best, T* second, T* least, std::uint8_t* age) {
    for (int x = 0; x < n; ++x) {
      T const v = value[x], b = best[x];
      bool const is_best = v > b, is_far = age[x] >= kReach;
      T const other = is_best ? b : v;  // what is not, or no longer, the best
      second[x] = is_far && other > second[x] ? other : second[x];
      best[x] = is_best ? v : b;
      least[x] = v < least[x] ? v : least[x];
      age[x] = static_cast<std::uint8_t>(is_best ? 0 : age[x] + (age[x] < 255));
    }
  }

  /// Keeps the values around the best one of every pixel whose best frame was `ago` frames before.
  void keep_row(int y, int ago) {
    std::uint8_t const* const ages = age[y];
    int const best_at = frames - 1 - ago;
    int const oldest = frames - static_cast<int>(recent.size());
    if (best_at < 0) return;
    std::array<T const*, kSpan> rows = {};
    for (int k = 0; k < kSpan; ++k) {
      int const frame = best_at - kReach + k;
      rows[static_cast<std::size_t>(k)] =
          frame >= oldest && frame < frames ? recent[static_cast<std::size_t>(frame - oldest)][y] : nullptr;
    }
    std::uint8_t const* const end = ages + age.cols;
    for (std::uint8_t const* at = ages;
         (at = static_cast<std::uint8_t const*>(std::memchr(at, ago, static_cast<std::size_t>(end - at)))) != nullptr;
         ++at) {
      auto const x = static_cast<int>(at - ages);
      best_frame(y, x) = static_cast<std::uint16_t>(best_at);
      T* const kept = around[y] + static_cast<std::ptrdiff_t>(x) * kSpan;
      for (std::size_t k = 0; k < kSpan; ++k) kept[k] = rows[k] ? rows[k][x] : T{0};
    }
  }

  PeakSamples samples(int x, int y) const {
    PeakSamples s;
    s.count = kSpan;
    T const* const kept = around[y] + static_cast<std::ptrdiff_t>(x) * kSpan;
    int const first = best_frame(y, x) - kReach;
    for (int k = 0; k < kSpan; ++k) {
      s.value[k] = kept[k];
      s.usable[k] = first + k >= 0 && first + k < frames && kept[k] < std::numeric_limits<T>::max();
    }
    // Values outside the sweep would be mistaken for the least one.
    for (int k = 0; k < kSpan; ++k)
      if (first + k < 0 || first + k >= frames) s.value[k] = least(y, x);
    return s;
  }

  bool may_be_lit(int x, int y, PixelNoise const& noise) const {
    double const height = best(y, x) - least(y, x);
    return height >= kRangeSigmas * std::sqrt(noise.variance(least(y, x)));
  }

  CodeImage finish(SweepFigures& figures, Context& context) override {
    for (int ago = kReach - 1; ago >= 0; --ago)
      for (int y = 0; y < age.rows; ++y) keep_row(y, ago);
    recent.clear();
    WidthPrior prior;
    measure(figures, prior);
    CodeImage image;
    image.code = cv::Mat1f(best.size(), kMissing);
    image.sigma = cv::Mat1f(best.size(), kMissing);
    image.bias = cv::Mat1f(best.size(), kMissing);
    image.classes = cv::Mat1b(best.size());
    cv::Mat(best - least).convertTo(image.lit, CV_8U, 255 / kFull);
    auto const bands = static_cast<std::size_t>((best.rows + kBandRows - 1) / kBandRows);
    for_each_index(context, bands, [&](std::size_t band) {
      int const first = static_cast<int>(band) * kBandRows;
      for (int y = first; y < std::min(first + kBandRows, best.rows); ++y) decode_row(y, figures.noise, prior, image);
    });
    return image;
  }

  /// Noise and the beam's width, from thinly sampled pixels: first with a guess, then with what that gave.
  void measure(SweepFigures& figures, WidthPrior& prior) {
    double const level = kFull / 255;  // of 8 bits
    figures.noise = {level * level, 0.02 * level};
    for (int round = 0; round < 2; ++round) {
      NoiseFit fit(kFull);
      std::vector<double> widths;
      auto const note = [&](int, PeakSamples const& s, Peak const& peak) {
        if (!peak.converged || peak.degrees_of_freedom < 1) return;
        for (int k = 0; k < kSpan; ++k) {
          double const u = (k - peak.time) / peak.width, share = 1 - peak.leverage[k];
          if (!s.usable[k] || share < 0.2) continue;
          double const model = peak.ambient + peak.height * std::exp(-0.5 * u * u);
          fit.add(model, (s.value[k] - model) / std::sqrt(share));
        }
        if (peak.height < 20 * std::sqrt(figures.noise.variance(peak.ambient))) return;
        widths.push_back(peak.width);
      };
      PeakQueue queue(figures.noise, prior, PeakDetail::with_leverage);
      for (int y = kSampleStep / 2; y < best.rows; y += kSampleStep)
        for (int x = kSampleStep / 2; x < best.cols; x += kSampleStep)
          if (may_be_lit(x, y, figures.noise)) queue.add(x, samples(x, y), note);
      queue.flush(note);
      figures.noise = fit.solve(figures.noise);  // with next to no light, the guess
      if (widths.empty()) return;
      auto const middle = widths.begin() + static_cast<std::ptrdiff_t>(widths.size() / 2);
      std::nth_element(widths.begin(), middle, widths.end());
      figures.beam_sigma = *middle;
      // Wide enough to let a peak have its own width wherever it can tell.
      prior = {figures.beam_sigma, 0.3 * figures.beam_sigma};
    }
  }

  void decode_row(int y, PixelNoise const& noise, WidthPrior const& prior, CodeImage& image) const {
    auto const finish_pixel = [&](int x, PeakSamples const&, Peak const& peak) {
      image.classes(y, x) = static_cast<std::uint8_t>(
          judge(x, y, peak, noise, prior, image.code(y, x), image.sigma(y, x), image.bias(y, x)));
    };
    PeakQueue queue(noise, prior, PeakDetail::without_leverage);
    for (int x = 0; x < best.cols; ++x) {
      if (auto const why = why_none(x, y, noise)) {
        image.classes(y, x) = static_cast<std::uint8_t>(*why);
        continue;
      }
      PeakSamples const s = samples(x, y);
      if (std::count(s.usable, s.usable + kSpan, true) >= kLeastUsable)
        queue.add(x, s, finish_pixel);
      else
        image.classes(y, x) =
            static_cast<std::uint8_t>(is_saturated(x, y) ? PixelClass::saturated : PixelClass::no_light);
    }
    queue.flush(finish_pixel);
  }

  bool is_saturated(int x, int y) const { return best(y, x) == std::numeric_limits<T>::max(); }

  /// Of a pixel that has no single peak to fit.
  std::optional<PixelClass> why_none(int x, int y, PixelNoise const& noise) const {
    if (!may_be_lit(x, y, noise)) return PixelClass::no_light;
    double const height = best(y, x) - least(y, x);
    if (second(y, x) - least(y, x) > kSecondPeak * height)  // full scale for long is one peak, cut off
      return second(y, x) == std::numeric_limits<T>::max() ? PixelClass::saturated : PixelClass::several_peaks;
    return {};
  }

  PixelClass judge(int x, int y, Peak const& peak, PixelNoise const& noise, WidthPrior const& prior, float& code,
                   float& sigma, float& bias) const {
    PixelClass const failed = is_saturated(x, y) ? PixelClass::saturated : PixelClass::several_peaks;
    if (!peak.converged || std::abs(peak.time - kReach) > 2) return failed;
    double const time = best_frame(y, x) - kReach + peak.time;
    if (time < 0 || time > frames - 1) return PixelClass::no_light;  // the beam's middle never came
    if (peak.height < kLightSigmas * std::sqrt(noise.variance(peak.ambient))) return PixelClass::no_light;
    double const ratio = peak.width / prior.width;
    if (ratio > 1 + kWidthShare || ratio < 1 - kWidthShare) return failed;
    double const fit = peak.chi_square / std::max(peak.degrees_of_freedom, 1);
    if (fit > kWorstFit) return failed;
    if (!(peak.time_sigma < 0.5)) return is_saturated(x, y) ? PixelClass::saturated : PixelClass::no_light;
    code = static_cast<float>(time);
    sigma = static_cast<float>(peak.time_sigma);
    // Of a beam much narrower than the step one frame alone tells, and where between two the peak was is a guess.
    double const guess = kNarrowGuess * std::max(0.0, kNarrowBeam - prior.width);
    bias = static_cast<float>(std::hypot(fit > kGoodFit ? peak.time_sigma * std::sqrt(fit - 1) : 0, guess));
    return PixelClass::object;
  }
};

SpaceTimeDecoder::SpaceTimeDecoder() = default;
SpaceTimeDecoder::~SpaceTimeDecoder() = default;

void SpaceTimeDecoder::add(cv::Mat const& frame) {
  if (!state_) {
    if (frame.depth() == CV_8U)
      state_ = std::make_unique<TypedState<std::uint8_t>>();
    else
      state_ = std::make_unique<TypedState<std::uint16_t>>();
  }
  state_->add(frame);
}

CodeImage SpaceTimeDecoder::finish(Context& context) {
  figures_ = {};
  if (!state_) return {};
  return std::exchange(state_, nullptr)->finish(figures_, context);
}

}  // namespace scanview
