#pragma once
#include <array>
#include <cstddef>
#include <cstdint>
#include <deque>
#include <limits>
#include <opencv2/core/mat.hpp>
#include <string>
#include <vector>

#include "base/files.h"

namespace scanview {

/// What one camera's frames of one view say about the capture before they are decoded. NaN: not measured, because the
/// pattern has no such figure or there was too little light to tell.
struct SoundnessFigures {
  static constexpr double kNone = std::numeric_limits<double>::quiet_NaN();
  std::size_t frames = 0;
  double lit_share = 0;            ///< of the pixels looked at: the pattern changes them
  double noise = kNone;            ///< standard deviation of a dark pixel, share of full scale
  double saturated_share = kNone;  ///< of the lit pixels: at full scale where the light is on
  double flicker = kNone;          ///< standard deviation of the lamp's brightness from picture to picture, relative
  double ambient_scatter = kNone;  ///< the same of what is not lit, share of full scale (sweep)
  double beam_steps = kNone;       ///< standard deviation of the beam, in steps (sweep)
  double step_scatter = kNone;     ///< standard deviation of the light's step, relative (sweep)
  double gamma = kNone;            ///< value = light^(1 / gamma); 1 is linear (gray)
  double gamma_std = kNone;
  double motion_px = kNone;  ///< largest shift of a pair's picture against the first picture (gray)
  double motion_std_px = kNone;
  double pair_mismatch = kNone;           ///< largest share of lit pixels where pattern + inverse is not white + black
  std::vector<std::size_t> doubled;       ///< frames that show the same light as the one before
  std::vector<std::size_t> missing;       ///< a frame is missing before this one
  std::vector<std::size_t> out_of_order;  ///< frames that are not where they belong
  std::vector<std::string> warnings;      ///< what a person should do something about, whole sentences

  bool moved() const;  ///< motion_px is above 0.3 and significant
  Json to_json() const;
};

inline constexpr char kMissingFrame[] = "a frame seems to be missing";  ///< what its warning says,
inline constexpr char kUnevenSteps[] = "the light's steps vary";        ///< and that of uneven steps

/// What the left and the right camera say together: a frame is missing only where both miss it, and steps are uneven
/// only where both find them so, for they see the same light, and each sees its own part of the scene besides. Takes a
/// claim of one camera alone back, with its warning.
void reconcile(SoundnessFigures& left, SoundnessFigures& right);

/// The pixels that are looked at: some whole rows and columns, evenly spread, one after the other. All figures come
/// from these, which keeps the cost far below that of reading a picture.
class LineSamples {
 public:
  static constexpr int kLines = 32;  ///< rows, and as many columns
  /// Gray pictures of 8 or 16 bits, as shares of full scale. Throws Error{bad_input} for another type or, from the
  /// second picture on, another size. `values` is memory to use again.
  std::vector<float> take(cv::Mat const& picture, std::vector<float> values = {});
  struct Line {
    std::size_t first = 0, length = 0;
    bool is_row = true;
  };
  std::vector<Line> const& lines() const { return lines_; }
  double resolution() const { return resolution_; }  ///< smallest difference of two values

 private:
  cv::Size size_;
  double resolution_ = 1.0 / 255;
  std::vector<Line> lines_;
  std::vector<int> columns_;  ///< where the lines along columns are
};

/// How much pixels change from frame to frame, over all frames so far: most are not lit in either, so the median is the
/// camera's noise. A frame costs its samples only, however many came before.
class ChangeHistogram {
 public:
  void add(std::vector<float> const& a, std::vector<float> const& b);
  double deviation() const;  ///< of a change, share of full scale, to 1 / 4080; 0 before the first

 private:
  static constexpr std::size_t kBins = 4081;  // sixteen a level of 8 bits
  std::vector<std::uint32_t> counts_ = std::vector<std::uint32_t>(kBins);
  std::size_t total_ = 0;
};

/// A light swept over the scene: feed the frames in order, then ask. How far the light went between two frames is
/// measured by how much their lit pixels overlap, ∝ exp(−(step / beam)² / 4), which depends neither on the scene's
/// shape nor on its paint; so one frame too few, too many or in the wrong place shows. The lamp's brightness follows
/// from second differences of log values over time, where a Gaussian beam leaves a constant. Memory: a few sets of
/// samples, whatever the number of frames.
class SweepSoundness {
 public:
  /// `camera` is its name in warnings.
  explicit SweepSoundness(std::string camera) : camera_(std::move(camera)) {}
  void add(cv::Mat const& frame);
  SoundnessFigures finish();

 private:
  struct Step {
    double energy = 0;
    double overlap = 0, overlap_two = 0;         ///< with the frame before, and the one before that
    double curvature = SoundnessFigures::kNone;  ///< median second difference of log values around the frame before
    double ambient = SoundnessFigures::kNone;
    bool identical = false;  ///< bit by bit
  };
  void evaluate(std::vector<float> const& frame);

  std::string camera_;
  LineSamples samples_;
  std::deque<std::vector<float>> waiting_;  ///< frames whose ambient light is not known yet
  std::vector<float> spare_;                ///< memory of a frame that is done with
  std::vector<float> darkest_, brightest_;
  std::vector<float> excess_, excess_before_, excess_two_before_;  ///< above the ambient light; 0 where not lit
  std::vector<std::uint32_t> lit_;                                 ///< where excess_ is not 0
  std::vector<std::uint32_t> saturated_;
  ChangeHistogram changes_;
  std::vector<bool> identical_;
  std::vector<Step> steps_;
  double noise_ = 0;
};

struct GraySoundnessOptions {
  std::size_t column_bits = 0, row_bits = 0;  ///< columns come first, the most significant bit first
  bool inverse = true;                        ///< every pattern is followed by its inverse
};

/// Gray code: white and black first where there are any, then the pattern pictures in order. Pattern and inverse must
/// add up to white and black, the stripes of each bit must be half as wide as those of the bit before, and where
/// stripes blur into each other the sum tells whether values are proportional to light. The sum of a pair also shows
/// the scene's own paint: where it is shifted along its own slope, the camera or the scene moved meanwhile.
class GraySoundness {
 public:
  GraySoundness(std::string camera, GraySoundnessOptions const& options)
      : camera_(std::move(camera)), options_(options) {}
  void set_white(cv::Mat const& picture) { white_ = samples_.take(picture); }
  void set_black(cv::Mat const& picture) { black_ = samples_.take(picture); }
  void add(cv::Mat const& picture);
  SoundnessFigures finish();

 private:
  struct Bit {
    double pattern_gain = SoundnessFigures::kNone;  ///< median of picture / white where it is wholly bright
    double inverse_gain = SoundnessFigures::kNone;
    double mismatch = 0;     ///< share of lit pixels whose sum is wrong
    double equal = 0;        ///< share of lit pixels that are equal in both
    double clear = 0;        ///< share of lit pixels that are wholly bright or dark
    double transitions = 0;  ///< changes a line
    std::array<double, 2> shift = {SoundnessFigures::kNone, SoundnessFigures::kNone};  ///< along rows, columns: pixels
    std::array<double, 2> shift_std = {SoundnessFigures::kNone, SoundnessFigures::kNone};
  };
  struct Blurred {
    float pattern, inverse, white, black;
  };
  void add_bit(std::vector<float> const& pattern, std::vector<float> const& inverse);
  void measure_motion(std::vector<float> const& pattern, std::vector<float> const& inverse, Bit& bit) const;

  std::string camera_;
  GraySoundnessOptions options_;
  LineSamples samples_;
  std::vector<float> white_, black_, pattern_;
  std::vector<float> spare_;  ///< memory of a picture that is done with
  std::vector<Bit> bits_;
  std::vector<Blurred> blurred_;
  std::size_t frames_ = 0;
};

/// The sentence about a response, or nothing where gamma is 1 within 0.3 or too uncertain.
std::string response_warning(std::string const& camera, double gamma, double std);

}  // namespace scanview
