#include "base/image_file.h"

#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>

#include "base/error.h"
#include "base/files.h"
#include "base/gray_png.h"

namespace scanview {
namespace {

std::string encode(cv::Mat const& image, char const* extension, std::vector<int> const& parameters) {
  std::vector<unsigned char> bytes;
  if (image.empty() || !cv::imencode(extension, image, bytes, parameters))
    throw std::logic_error("an image that cannot be encoded reached a writer");
  return {bytes.begin(), bytes.end()};
}

/// The decoders fill the missing rows of a truncated file with gray and report success.
bool is_complete(std::string const& bytes) {
  if (is_png(bytes)) return is_whole_png(bytes);
  if (bytes.starts_with("\xff\xd8")) return bytes.rfind("\xff\xd9") != std::string::npos;
  return true;
}

}  // namespace

namespace {

cv::Mat decode(std::string const& bytes, std::filesystem::path const& path, int flags) {
  if (bytes.empty()) throw Error(ErrorCode::bad_input, path, "is empty");
  if (auto gray = decode_gray_png(bytes)) {
    if (gray->empty()) throw Error(ErrorCode::bad_input, path, "is truncated or damaged");
    return *std::move(gray);
  }
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

cv::Mat read_image(std::filesystem::path const& path) { return decode(read_file(path), path, cv::IMREAD_UNCHANGED); }

cv::Mat read_gray(std::filesystem::path const& path) {
  return decode(read_file(path), path, cv::IMREAD_GRAYSCALE | cv::IMREAD_ANYDEPTH);
}

cv::Mat3b read_color(std::filesystem::path const& path) { return decode_color(read_file(path), path); }

cv::Mat3b decode_color(std::string const& bytes, std::filesystem::path const& name_in_errors) {
  cv::Mat image = decode(bytes, name_in_errors, cv::IMREAD_UNCHANGED);
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
