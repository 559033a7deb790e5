#include "base/gray_png.h"

#include <libdeflate.h>

#include <algorithm>
#include <cstdint>
#include <cstdlib>
#include <cstring>
#include <memory>
#include <string_view>
#include <vector>

namespace scanview {
namespace {

constexpr std::string_view kMagic("\x89PNG\r\n\x1a\n", 8);
constexpr std::size_t kAround = 12;       // length, type and checksum of a chunk
constexpr std::size_t kHeader = 13;       // bytes of IHDR
constexpr std::size_t kMostRatio = 1032;  // of deflate: a header that promises more is wrong
constexpr std::size_t kMostPixels = 1 << 28;

struct FreeDecompressor {
  void operator()(libdeflate_decompressor* d) const { libdeflate_free_decompressor(d); }
};

unsigned char const* bytes_at(std::string const& bytes, std::size_t at) {
  return reinterpret_cast<unsigned char const*>(bytes.data() + at);
}

std::uint32_t big_endian(unsigned char const* p) {
  return static_cast<std::uint32_t>(p[0]) << 24 | static_cast<std::uint32_t>(p[1]) << 16 |
         static_cast<std::uint32_t>(p[2]) << 8 | static_cast<std::uint32_t>(p[3]);
}

/// Calls use(type, data, length) for every chunk up to IEND; false where one is cut off or its checksum is wrong.
template <class Use>
bool for_each_chunk(std::string const& bytes, Use const& use) {
  std::size_t at = kMagic.size();
  while (bytes.size() >= at + kAround) {
    std::size_t const length = big_endian(bytes_at(bytes, at));
    if (length > bytes.size() - at - kAround) return false;
    auto const* const typed = bytes_at(bytes, at + 4);
    if (libdeflate_crc32(0, typed, length + 4) != big_endian(bytes_at(bytes, at + 8 + length))) return false;
    std::string_view const type(bytes.data() + at + 4, 4);
    use(type, typed + 4, length);
    if (type == "IEND") return true;
    at += kAround + length;
  }
  return false;
}

std::uint8_t paeth(int a, int b, int c) {
  int const pa = std::abs(b - c), pb = std::abs(a - c), pc = std::abs(a + b - 2 * c);
  return static_cast<std::uint8_t>(pa <= pb && pa <= pc ? a : pb <= pc ? b : c);
}

/// Undoes a line's filter (PNG specification, section 9) into `out`; `above` is the line before. `Size`: bytes a pixel.
/// The bytes before a line are 0.
template <std::size_t Size>
bool unfilter(int filter, std::uint8_t const* line, std::uint8_t const* above, std::uint8_t* out, std::size_t length) {
  std::uint8_t left[Size] = {}, corner[Size] = {};  // kept in registers: each byte waits for the one before it
  switch (filter) {
    case 0:
      std::memcpy(out, line, length);
      return true;
    case 1:
      for (std::size_t i = 0; i < length; i += Size)
        for (std::size_t k = 0; k < Size; ++k) out[i + k] = left[k] = static_cast<std::uint8_t>(line[i + k] + left[k]);
      return true;
    case 2:
      for (std::size_t i = 0; i < length; ++i) out[i] = static_cast<std::uint8_t>(line[i] + above[i]);
      return true;
    case 3:
      for (std::size_t i = 0; i < length; i += Size)
        for (std::size_t k = 0; k < Size; ++k)
          out[i + k] = left[k] = static_cast<std::uint8_t>(line[i + k] + (left[k] + above[i + k]) / 2);
      return true;
    case 4:
      for (std::size_t i = 0; i < length; i += Size)
        for (std::size_t k = 0; k < Size; ++k) {
          std::uint8_t const b = above[i + k];
          out[i + k] = left[k] = static_cast<std::uint8_t>(line[i + k] + paeth(left[k], b, corner[k]));
          corner[k] = b;
        }
      return true;
    default:
      return false;
  }
}

}  // namespace

bool is_png(std::string const& bytes) { return std::string_view(bytes).starts_with(kMagic); }

bool is_whole_png(std::string const& bytes) {
  return for_each_chunk(bytes, [](std::string_view, unsigned char const*, std::size_t) {});
}

std::optional<cv::Mat> decode_gray_png(std::string const& bytes) {
  std::size_t const first = kMagic.size();
  if (!is_png(bytes) || bytes.size() < first + kAround + kHeader || bytes.compare(first + 4, 4, "IHDR") != 0) return {};
  auto const* const header = bytes_at(bytes, first + 8);
  std::size_t const width = big_endian(header), height = big_endian(header + 4);
  int const bits = header[8], color = header[9], interlaced = header[12];
  if (color != 0 || interlaced != 0 || (bits != 8 && bits != 16)) return {};

  // Kept from picture to picture: fresh memory costs as much as a third of the decoding.
  thread_local std::vector<std::uint8_t> packed, lines;
  packed.clear();
  bool has_transparency = false;
  bool const whole = for_each_chunk(bytes, [&](std::string_view type, unsigned char const* data, std::size_t length) {
    if (type == "IDAT") packed.insert(packed.end(), data, data + length);
    has_transparency |= type == "tRNS";
  });
  if (!whole) return cv::Mat();
  if (has_transparency) return {};
  std::size_t const size = bits / 8, line = width * size, filtered = height * (line + 1);
  if (width == 0 || height == 0 || width > kMostPixels / height || filtered / kMostRatio > packed.size())
    return cv::Mat();

  thread_local std::unique_ptr<libdeflate_decompressor, FreeDecompressor> const decompressor(
      libdeflate_alloc_decompressor());
  if (lines.size() < filtered) lines.resize(filtered);
  if (libdeflate_zlib_decompress(decompressor.get(), packed.data(), packed.size(), lines.data(), filtered, nullptr) !=
      LIBDEFLATE_SUCCESS)
    return cv::Mat();
  cv::Mat image(static_cast<int>(height), static_cast<int>(width), bits == 8 ? CV_8U : CV_16U);
  std::vector<std::uint8_t> const nothing(line, 0);
  std::uint8_t const* above = nothing.data();
  for (std::size_t y = 0; y < height; ++y) {
    std::uint8_t const* const from = lines.data() + y * (line + 1);
    auto* const out = image.ptr<std::uint8_t>(static_cast<int>(y));
    bool const known =
        bits == 8 ? unfilter<1>(from[0], from + 1, above, out, line) : unfilter<2>(from[0], from + 1, above, out, line);
    if (!known) return cv::Mat();
    above = out;
  }
  if (bits == 16)  // the file's bytes are big-endian; swapped at the end, since filters work on the file's
    for (int y = 0; y < image.rows; ++y) {
      auto* const row = image.ptr<std::uint16_t>(y);
      for (int x = 0; x < image.cols; ++x) {
        auto const* const b = reinterpret_cast<std::uint8_t const*>(row + x);
        row[x] = static_cast<std::uint16_t>(b[0] << 8 | b[1]);
      }
    }
  return image;
}

}  // namespace scanview
