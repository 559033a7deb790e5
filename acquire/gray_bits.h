#pragma once
#include <optional>

#include "acquire/code_image.h"

namespace scanview {

/// What has been seen of the bits of one Gray code, for every pixel: d = pattern - inverse of each bit, of which the
/// sign is the bit. Differences of 16-bit pictures are halved, so that all fit 16 bits.
struct GrayBits {
  cv::Mat1w word;                  ///< the bits
  cv::Mat1s finest;                ///< d of bit 0
  cv::Mat1s weakest, weakest_bit;  ///< the d of least size among the other bits, and which
  cv::Mat1s second;                ///< the next to least size among the other bits
  cv::Mat1s largest;               ///< the largest size: the contrast

  void create(cv::Size size);
  void add(int bit, cv::Mat1s const& d);
  /// One row of it, `d` as long as the row; after create().
  void add_row(int bit, int y, std::int16_t const* d);
};

/// Column of every pixel, whole, as the bits say; -1 where light or contrast are too little, -2 where bits contradict:
/// two are doubtful, or one that decides between columns which are not neighbours, or the column is `count` or more.
cv::Mat1i whole_codes(GrayBits const& bits, cv::Mat1f const& noise_of_d, std::optional<int> count);

/// The columns to a fraction (column k reaches from k to k + 1): between two neighbouring columns one bit alone
/// differs, and where its d passes zero, between two pixels, is their border; codes are interpolated between borders,
/// along the lines of the picture (or its columns, where the code changes more along those). Sigma is the noise of d
/// over its slope there, or what the borders' spacing scatters where that is more. A pixel without two borders of its
/// own column has the column's middle, with the sigma of a uniform distribution over it (1/sqrt(12)).
/// classes: object, no_light, several_peaks. `noise_of_d`: standard deviation of d at each pixel.
CodeImage border_codes(GrayBits const& bits, cv::Mat1f const& noise_of_d, std::optional<int> count);

}  // namespace scanview
