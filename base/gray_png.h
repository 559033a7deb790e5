#pragma once
#include <opencv2/core/mat.hpp>
#include <optional>
#include <string>

namespace scanview {

/// The picture of a PNG file's bytes where it is the kind that scanners write by the thousand: gray, 8 or 16 bits, not
/// interlaced. Nothing for every other kind (colour, palettes, fewer bits): those are OpenCV's. An empty matrix where
/// the bytes are damaged: a checksum (CRC-32 of every chunk, Adler-32 of the pixels), a length or a filter is wrong.
///
/// Reading is most of the time that decoding a capture takes, and this takes some 0.6 of libpng's: libdeflate
/// decompresses a whole picture at once.
std::optional<cv::Mat> decode_gray_png(std::string const& bytes);

/// Whether the bytes begin as a PNG file does.
bool is_png(std::string const& bytes);
/// Every chunk with its checksum, up to IEND (PNG specification, section 5). Damage is found here and not by libpng,
/// which would print about it.
bool is_whole_png(std::string const& bytes);

}  // namespace scanview
