#include "base/image_file.h"

#include <zlib.h>

#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>

#include "base/error.h"
#include "base/files.h"

namespace scanview {
namespace {

std::string encode(cv::Mat const& image, char const* extension, std::vector<int> const& parameters) {
  std::vector<unsigned char> bytes;
  if (image.empty() || !cv::imencode(extension, image, bytes, parameters))
    throw std::logic_error("an image that cannot be encoded reached a writer");
  return {bytes.begin(), bytes.end()};
}

bool starts_with(std::string const& bytes, std::string_view magic) {
  return bytes.compare(0, magic.size(), magic) == 0;
}

std::uint32_t big_endian(std::string const& bytes, std::size_t at) {
  std::uint32_t value = 0;
  for (std::size_t k = 0; k < 4; ++k) value = value << 8 | static_cast<unsigned char>(bytes[at + k]);
  return value;
}

/// Every chunk with its checksum, up to IEND (PNG specification, section 5). Damage is found here and not by libpng,
/// which would print about it.
bool is_whole_png(std::string const& bytes) {
  constexpr std::size_t kAround = 12;  // length, type, checksum
  std::size_t at = 8;
  while (bytes.size() - at >= kAround) {
    std::size_t const length = big_endian(bytes, at);
    if (length > bytes.size() - at - kAround) return false;
    auto const* typed = reinterpret_cast<unsigned char const*>(bytes.data() + at + 4);
    if (::crc32(0, typed, static_cast<uInt>(length + 4)) != big_endian(bytes, at + 8 + length)) return false;
    if (bytes.compare(at + 4, 4, "IEND") == 0) return true;
    at += kAround + length;
  }
  return false;
}

/// The decoders fill the missing rows of a truncated file with gray and report success.
bool is_complete(std::string const& bytes) {
  if (starts_with(bytes, "\x89PNG\r\n\x1a\n")) return is_whole_png(bytes);
  if (starts_with(bytes, "\xff\xd8")) return bytes.rfind("\xff\xd9") != std::string::npos;
  return true;
}

}  // namespace

namespace {

cv::Mat decode_file(std::filesystem::path const& path, int flags) {
  std::string const bytes = read_file(path);
  if (bytes.empty()) throw Error(ErrorCode::bad_input, path, "is empty");
  if (!is_complete(bytes)) throw Error(ErrorCode::bad_input, path, "is truncated or damaged");
  cv::Mat image;
  try {
    cv::Mat const raw(1, static_cast<int>(bytes.size()), CV_8U, const_cast<char*>(bytes.data()));
    image = cv::imdecode(raw, flags);
  } catch (cv::Exception const&) {
    // Reported below, like every other file that cannot be decoded.
  }
  if (image.empty()) throw Error(ErrorCode::bad_input, path, "is not a picture that can be read");
  if (image.total() > (std::size_t{1} << 28)) throw Error(ErrorCode::bad_input, path, "has more than 2^28 pixels");
  if (image.depth() != CV_8U && image.depth() != CV_16U)
    throw Error(ErrorCode::bad_input, path, "is neither an 8-bit nor a 16-bit picture");
  return image;
}

}  // namespace

cv::Mat read_image(std::filesystem::path const& path) { return decode_file(path, cv::IMREAD_UNCHANGED); }

cv::Mat read_gray(std::filesystem::path const& path) {
  return decode_file(path, cv::IMREAD_GRAYSCALE | cv::IMREAD_ANYDEPTH);
}

cv::Mat3b read_color(std::filesystem::path const& path) {
  cv::Mat image = read_image(path);
  if (image.depth() == CV_16U) image.convertTo(image, CV_8U, 1.0 / 257.0);
  if (image.channels() == 1) cv::cvtColor(image, image, cv::COLOR_GRAY2BGR);
  if (image.channels() == 4) cv::cvtColor(image, image, cv::COLOR_BGRA2BGR);
  return image;
}

std::string encode_png(cv::Mat const& image) { return encode(image, ".png", {cv::IMWRITE_PNG_COMPRESSION, 6}); }

std::string encode_jpeg(cv::Mat const& image, int quality) {
  return encode(image, ".jpg", {cv::IMWRITE_JPEG_QUALITY, quality});
}

}  // namespace scanview
