#pragma once
#include <algorithm>
#include <bit>
#include <cstddef>
#include <cstring>
#include <filesystem>
#include <string_view>

#include "base/error.h"

namespace scanview {

/// Numbers from bytes, one after the other. Throws Error{bad_input, path} where they end.
template <std::endian kOrder>
class ByteReader {
 public:
  ByteReader(std::string_view bytes, std::filesystem::path const& path) : rest_(bytes), path_(path) {}

  template <typename Number>
  Number next() {
    char raw[sizeof(Number)];
    std::memcpy(raw, take(sizeof raw).data(), sizeof raw);
    if (kOrder != std::endian::native) std::reverse(raw, raw + sizeof raw);
    Number value;
    std::memcpy(&value, raw, sizeof raw);
    return value;
  }
  std::string_view take(std::size_t count) {
    if (rest_.size() < count) throw Error(ErrorCode::bad_input, path_, "is cut off");
    std::string_view const bytes = rest_.substr(0, count);
    rest_.remove_prefix(count);
    return bytes;
  }
  std::size_t left() const { return rest_.size(); }

 private:
  std::string_view rest_;
  std::filesystem::path const& path_;
};

}  // namespace scanview
