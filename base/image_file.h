#pragma once
#include <filesystem>
#include <opencv2/core/mat.hpp>
#include <string>

namespace scanview {

/// A picture as it is in the file: 8 or 16 bits, 1, 3 or 4 channels, OpenCV's channel order (BGR). Throws
/// Error{bad_input} where the file is missing, truncated, or no picture; the library alone would return gray rows or an
/// empty image. Pictures of more than 2^28 pixels are refused.
cv::Mat read_image(std::filesystem::path const& path);

/// One channel of 8 or 16 bits; colour becomes luma. What a camera measures, for decoding.
cv::Mat read_gray(std::filesystem::path const& path);

/// 8-bit BGR of any picture: gray is repeated, alpha dropped, 16 bits divided by 257.
cv::Mat3b read_color(std::filesystem::path const& path);
/// The same from a file's bytes.
cv::Mat3b decode_color(std::string const& bytes, std::filesystem::path const& name_in_errors);

/// PNG or JPEG bytes; deterministic.
std::string encode_png(cv::Mat const& image);
std::string encode_jpeg(cv::Mat const& image, int quality = 90);

}  // namespace scanview
