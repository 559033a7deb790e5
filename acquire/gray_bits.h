#pragma once
#include <optional>
#include <vector>

#include "acquire/code_image.h"

namespace scanview {

/// What has been seen of the bits of one Gray code, for every pixel: of d = pattern - inverse of each bit the sign,
/// which is the bit, and the least and greatest sizes. Sizes are as deep as the pictures, 8 or 16 bits.
struct GrayBits {
  cv::Mat1w word;         ///< the bits
  cv::Mat finest;         ///< size of d of bit 0
  cv::Mat weakest;        ///< the least size among the other bits,
  cv::Mat1b weakest_bit;  ///< whose it is,
  cv::Mat second;         ///< and the next to least
  cv::Mat largest;        ///< of all bits: the contrast

  /// A bit's pictures, each bit once. All have one size, and 8 or 16 bits.
  void add(int bit, cv::Mat const& pattern, cv::Mat const& inverse);
};

/// Standard deviation of d: `of_level[level]` of each pixel's brightness, which has 8 or 16 bits.
struct DifferenceNoise {
  cv::Mat level;
  std::vector<float> of_level;
};

/// Column of every pixel, whole, as the bits say; -1 where light or contrast are too little, -2 where bits contradict:
/// two are doubtful, or one that decides between columns which are not neighbours, or the column is `count` or more.
cv::Mat1i whole_codes(GrayBits const& bits, DifferenceNoise const& noise, std::optional<int> count);

/// The columns to a fraction (column k reaches from k to k + 1): between two neighbouring columns one bit alone
/// differs, and where its d passes zero, between two pixels, is their border; codes are interpolated between borders,
/// along the lines of the picture (or its columns, where the code changes more along those). Sigma is the noise of d
/// over its slope there, or what the borders' spacing scatters where that is more. A pixel without two borders of its
/// own column has the column's middle, with the sigma of a uniform distribution over it (1/sqrt(12)).
/// classes: object, no_light, several_peaks.
CodeImage border_codes(GrayBits const& bits, DifferenceNoise const& noise, std::optional<int> count);

}  // namespace scanview
