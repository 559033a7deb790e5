#pragma once
#include <vector>

#include "acquire/capture.h"
#include "acquire/gray_bits.h"
#include "acquire/pixel_noise.h"

namespace scanview {

/// Decodes one camera's Gray-code pictures as they come in; keeps some six numbers a pixel, however many pictures there
/// are (a pattern is kept until its inverse comes).
///
/// A bit is the sign of d = pattern - inverse, or pattern - (white + black) / 2 where there is no inverse; gray_bits.h
/// says how bits become codes. The camera's noise is measured on the way: all pairs have the same sum but for noise.
class GrayDecoder {
 public:
  explicit GrayDecoder(Capture const& capture);
  /// A picture of the sequence, in any order; white and black as well, where there are such.
  void add(GrayFrame const& what, cv::Mat const& picture);
  CodeImage finish();
  /// Whole projector rows where the capture has row bits, negative where undecided; empty otherwise. After finish().
  cv::Mat1i const& rows() const { return row_codes_; }
  PixelNoise noise() const { return noise_; }

 private:
  struct Pending {
    GrayFrame what;
    cv::Mat picture;
  };
  void add_pair(GrayFrame const& what, cv::Mat const& pattern, cv::Mat const& inverse);
  void sample_noise(cv::Mat const& pattern, cv::Mat const& inverse);
  std::vector<float> noise_of_differences() const;

  Capture const& capture_;
  cv::Mat white_, black_;
  GrayBits columns_, rows_;
  std::vector<Pending> pending_;
  cv::Mat1f last_sum_;           // of a pair, on every eighth row
  std::optional<NoiseFit> fit_;  // from what pairs' sums differ by
  cv::Mat level_, brightest_;    // mean and greater of the pair of the coarsest bit
  int level_bit_ = -1;           // which; -1: a row's
  PixelNoise noise_;
  cv::Mat1i row_codes_;
  bool is_16_bit_ = false;
};

}  // namespace scanview
