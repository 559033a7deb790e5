#pragma once
#include <deque>
#include <memory>

#include "acquire/code_image.h"
#include "acquire/pixel_noise.h"
#include "base/context.h"

namespace scanview {

/// What the decoder of a swept beam measured besides the codes.
struct SweepFigures {
  PixelNoise noise;
  double beam_sigma = 0;  ///< median width (standard deviation) of the beam over time, in light steps; 0: nothing lit
};

/// Space-time decoder (Curless and Levoy 1995): each pixel's brightness over time has a peak as the beam passes, and
/// its moment, to a fraction of a step, is the pixel's code. Frames come in order and are not kept: a pixel keeps its
/// brightest value, the 2 kReach + 1 values around it, and the brightest one away from there (a second peak).
///
/// The peak is fitted by a + b exp(-(t - t0)² / (2 w²)) with all four unknown, by maximum likelihood under the camera's
/// noise, which is itself estimated from the residuals. Sigma of the code is that of t0 from the information matrix.
/// Values at full scale do not count. A value away from the peak that is more than `kSecondPeak` times as high above
/// the ambient light, or a fit whose residuals noise does not explain, makes it several_peaks.
class SpaceTimeDecoder {
 public:
  static constexpr int kReach = 5;
  SpaceTimeDecoder();
  ~SpaceTimeDecoder();
  void add(cv::Mat const& frame);
  CodeImage finish(Context& context);
  SweepFigures const& figures() const { return figures_; }

 private:
  struct State;
  template <class T>
  struct TypedState;
  std::unique_ptr<State> state_;
  SweepFigures figures_;
};

/// Stripe decoder (Pulli 1997): in each frame the middle of the bright stripe along every line of the picture (centroid
/// of what is above half its height), whose code is the frame's number; between the stripes of two successive frames on
/// one surface the code is linear. `centres` tells the pixels that a stripe's middle is in: the method's own.
class StripeDecoder {
 public:
  void add(cv::Mat const& frame);
  CodeImage finish();
  cv::Mat1b const& centres() const { return centres_; }

 private:
  struct Stripe {
    float x, sigma;
    int frame;
  };
  void find_stripes(int frame, cv::Mat1f const& light);
  void process(int frame);

  std::deque<cv::Mat1f> recent_;
  int frames_ = 0;
  std::vector<std::vector<Stripe>> rows_;
  cv::Mat1f brightest_, least_;
  NoiseFit fit_{255};
  PixelNoise noise_;
  cv::Mat1b centres_;
};

}  // namespace scanview
