#include "base/animated_png.h"

#include <libdeflate.h>

#include <cstdint>
#include <stdexcept>
#include <string_view>

#include "base/gray_png.h"

namespace scanview {
namespace {

std::string big_endian(std::uint32_t value, int bytes = 4) {
  std::string text;
  for (int i = bytes - 1; i >= 0; --i) text.push_back(static_cast<char>(value >> (8 * i) & 255));
  return text;
}

std::string chunk(std::string const& type, std::string const& data) {
  std::string const checked = type + data;
  return big_endian(static_cast<std::uint32_t>(data.size())) + checked +
         big_endian(libdeflate_crc32(0, checked.data(), checked.size()));
}

struct Parts {
  std::string header;             ///< IHDR's data
  std::vector<std::string> data;  ///< of each IDAT
};

Parts parts_of(std::string const& png) {
  if (!is_whole_png(png)) throw std::logic_error("animated_png: a frame is no PNG file");
  Parts parts;
  for (std::size_t at = 8; at + 12 <= png.size();) {
    std::uint32_t length = 0;
    for (std::size_t i = 0; i < 4; ++i) length = length << 8 | static_cast<std::uint8_t>(png[at + i]);
    std::string_view const type(&png[at + 4], 4);
    if (type == "IHDR") parts.header = png.substr(at + 8, length);
    if (type == "IDAT") parts.data.push_back(png.substr(at + 8, length));
    at += 12 + length;
  }
  return parts;
}

}  // namespace

std::string animated_png(std::vector<std::string> const& frames, int milliseconds) {
  if (frames.empty()) throw std::logic_error("animated_png: no frames");
  std::string film = frames.front().substr(0, 8);
  std::string header;
  std::uint32_t sequence = 0;
  for (auto const& frame : frames) {
    Parts const parts = parts_of(frame);
    if (&frame == &frames.front()) {
      header = parts.header;
      film += chunk("IHDR", header);
      film += chunk("acTL", big_endian(static_cast<std::uint32_t>(frames.size())) + big_endian(0));
    } else if (parts.header != header) {
      throw std::logic_error("animated_png: frames of different size or kind");
    }
    // Sequence number, size, place (0, 0), delay as a fraction of a second, keep nothing of the last frame, replace it.
    film += chunk("fcTL", big_endian(sequence++) + header.substr(0, 8) + big_endian(0) + big_endian(0) +
                              big_endian(static_cast<std::uint32_t>(milliseconds), 2) + big_endian(1000, 2) +
                              std::string(2, '\0'));
    for (auto const& data : parts.data) {
      film += &frame == &frames.front() ? chunk("IDAT", data) : chunk("fdAT", big_endian(sequence++) + data);
    }
  }
  return film + chunk("IEND", {});
}

}  // namespace scanview
