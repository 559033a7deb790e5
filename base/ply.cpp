#include "base/ply.h"

#include <fmt/format.h>

#include <algorithm>
#include <bit>
#include <charconv>
#include <cmath>
#include <cstring>
#include <optional>

#include "base/error.h"
#include "base/files.h"

// Format: Greg Turk, "The PLY polygon file format", 1994; type names of both generations (float, float32 ...).

namespace scanview {
namespace {

static_assert(std::endian::native == std::endian::little);

struct TypeName {
  std::string_view name;
  PlyType type;
};
constexpr TypeName kTypeNames[] = {
    {"char", PlyType::int8},      {"int8", PlyType::int8},       {"uchar", PlyType::uint8},
    {"uint8", PlyType::uint8},    {"short", PlyType::int16},     {"int16", PlyType::int16},
    {"ushort", PlyType::uint16},  {"uint16", PlyType::uint16},   {"int", PlyType::int32},
    {"int32", PlyType::int32},    {"uint", PlyType::uint32},     {"uint32", PlyType::uint32},
    {"float", PlyType::float32},  {"float32", PlyType::float32}, {"double", PlyType::float64},
    {"float64", PlyType::float64}};

std::size_t size_of(PlyType type) {
  switch (type) {
    case PlyType::int8:
    case PlyType::uint8:
      return 1;
    case PlyType::int16:
    case PlyType::uint16:
      return 2;
    case PlyType::float64:
      return 8;
    default:
      return 4;
  }
}

std::string_view name_of(PlyType type) {
  for (auto const& entry : kTypeNames)
    if (entry.type == type) return entry.name;
  return {};
}

bool is_integer(PlyType type) { return type != PlyType::float32 && type != PlyType::float64; }

/// Smallest and largest value of an integer type.
std::pair<double, double> range_of(PlyType type) {
  double const bits = 8.0 * static_cast<double>(size_of(type));
  bool const is_signed = type == PlyType::int8 || type == PlyType::int16 || type == PlyType::int32;
  return is_signed ? std::pair(-std::exp2(bits - 1), std::exp2(bits - 1) - 1) : std::pair(0.0, std::exp2(bits) - 1);
}

std::vector<std::string_view> split_words(std::string_view line) {
  std::vector<std::string_view> words;
  while (true) {
    auto const begin = line.find_first_not_of(" \t\r");
    if (begin == std::string_view::npos) return words;
    auto const end = std::min(line.find_first_of(" \t\r", begin), line.size());
    words.push_back(line.substr(begin, end - begin));
    line.remove_prefix(end);
  }
}

/// Hands out the values of the body one after the other.
class Body {
 public:
  Body(std::string_view bytes, PlyFormat format) : bytes_(bytes), format_(format) {}

  std::size_t left() const { return bytes_.size(); }

  /// The next value, or nothing where the bytes end or are no number of this type.
  std::optional<double> next(PlyType type) { return format_ == PlyFormat::ascii ? next_text(type) : next_binary(type); }

 private:
  std::optional<double> next_text(PlyType type) {
    auto const begin = bytes_.find_first_not_of(" \t\r\n");
    if (begin == std::string_view::npos) return {};
    bytes_.remove_prefix(begin);
    if (bytes_.front() == '+') bytes_.remove_prefix(1);
    double value = 0;
    auto const [end, error] = std::from_chars(bytes_.data(), bytes_.data() + bytes_.size(), value);
    if (error != std::errc()) return {};
    bytes_.remove_prefix(static_cast<std::size_t>(end - bytes_.data()));
    return type == PlyType::float32 ? static_cast<float>(value) : value;
  }

  template <typename T>
  double as(char const* raw) const {
    T value;
    std::memcpy(&value, raw, sizeof value);
    return static_cast<double>(value);
  }

  std::optional<double> next_binary(PlyType type) {
    std::size_t const size = size_of(type);
    if (bytes_.size() < size) return {};
    char raw[8];
    std::memcpy(raw, bytes_.data(), size);
    if (format_ == PlyFormat::binary_big_endian) std::reverse(raw, raw + size);
    bytes_.remove_prefix(size);
    switch (type) {
      case PlyType::int8:
        return as<std::int8_t>(raw);
      case PlyType::uint8:
        return as<std::uint8_t>(raw);
      case PlyType::int16:
        return as<std::int16_t>(raw);
      case PlyType::uint16:
        return as<std::uint16_t>(raw);
      case PlyType::int32:
        return as<std::int32_t>(raw);
      case PlyType::uint32:
        return as<std::uint32_t>(raw);
      case PlyType::float32:
        return as<float>(raw);
      case PlyType::float64:
        return as<double>(raw);
    }
    return {};
  }

  std::string_view bytes_;
  PlyFormat format_;
};

struct Header {
  PlyFile file;
  PlyFormat format = PlyFormat::ascii;
  std::size_t size = 0;  ///< bytes up to and including the line end of end_header
};

class HeaderParser {
 public:
  HeaderParser(std::string_view bytes, std::filesystem::path const& path) : bytes_(bytes), path_(path) {}

  Header parse() {
    if (next_line() != "ply") fail("is not a PLY file");
    bool has_format = false;
    while (true) {
      std::string_view const line = next_line();
      auto const words = split_words(line);
      if (words.empty()) continue;
      if (words[0] == "end_header") break;
      if (words[0] == "comment" || words[0] == "obj_info") {
        auto const text =
            line.substr(std::min(line.size(), static_cast<std::size_t>(words[0].end() - line.begin()) + 1));
        (words[0] == "comment" ? header_.file.comments : header_.file.obj_info).emplace_back(text);
      } else if (words[0] == "format" && words.size() == 3) {
        header_.format = format_named(words[1]);
        has_format = true;
      } else if (words[0] == "element" && words.size() == 3) {
        add_element(words[1], words[2]);
      } else if (words[0] == "property") {
        add_property(words);
      } else {
        fail(fmt::format("has an unknown header line '{}'", words[0]));
      }
    }
    if (!has_format) fail("has no format line");
    header_.size = at_;
    return std::move(header_);
  }

 private:
  [[noreturn]] void fail(std::string const& message) const { throw Error(ErrorCode::bad_input, path_, message); }

  std::string_view next_line() {
    auto const end = bytes_.find('\n', at_);
    if (end == std::string_view::npos) fail(at_ == 0 ? "is not a PLY file" : "has a header that does not end");
    auto line = bytes_.substr(at_, end - at_);
    at_ = end + 1;
    if (line.ends_with('\r')) line.remove_suffix(1);
    return line;
  }

  PlyFormat format_named(std::string_view name) const {
    if (name == "ascii") return PlyFormat::ascii;
    if (name == "binary_little_endian") return PlyFormat::binary_little_endian;
    if (name == "binary_big_endian") return PlyFormat::binary_big_endian;
    fail(fmt::format("has an unknown format '{}'", name));
  }

  PlyType type_named(std::string_view name) const {
    for (auto const& entry : kTypeNames)
      if (entry.name == name) return entry.type;
    fail(fmt::format("has an unknown property type '{}'", name));
  }

  void add_element(std::string_view name, std::string_view count) {
    PlyElement element;
    element.name = name;
    auto const [end, error] = std::from_chars(count.data(), count.data() + count.size(), element.rows);
    if (error != std::errc() || end != count.data() + count.size())
      fail(fmt::format("has a bad count of element '{}'", name));
    header_.file.elements.push_back(std::move(element));
  }

  void add_property(std::vector<std::string_view> const& words) {
    if (header_.file.elements.empty()) fail("has a property before any element");
    PlyProperty property;
    if (words.size() == 5 && words[1] == "list") {
      property.is_list = true;
      property.count_type = type_named(words[2]);
      if (!is_integer(property.count_type)) fail("has a list whose count is no integer");
      property.type = type_named(words[3]);
    } else if (words.size() == 3) {
      property.type = type_named(words[1]);
    } else {
      fail("has a property line that cannot be read");
    }
    property.name = words.back();
    header_.file.elements.back().properties.push_back(std::move(property));
  }

  std::string_view bytes_;
  std::filesystem::path const& path_;
  std::size_t at_ = 0;
  Header header_;
};

/// Fewest bytes a row can take: what the header promises is held against it before anything is allocated.
std::size_t least_row_size(PlyElement const& element, PlyFormat format) {
  std::size_t size = 0;
  for (auto const& property : element.properties)
    size += format == PlyFormat::ascii ? 2 : size_of(property.is_list ? property.count_type : property.type);
  return size;
}

void read_row(PlyElement& element, std::uint64_t row, Body& body, std::filesystem::path const& path) {
  auto const next = [&](PlyType type) {
    auto const value = body.next(type);
    if (!value)
      throw Error(
          ErrorCode::bad_input, path,
          fmt::format("ends, or holds no number, in row {} of {} of element '{}'", row, element.rows, element.name));
    return *value;
  };
  for (auto& property : element.properties) {
    if (!property.is_list) {
      property.values.push_back(next(property.type));
      continue;
    }
    double const count = next(property.count_type);
    if (count < 0 || count > static_cast<double>(body.left()) || count != std::floor(count))
      throw Error(
          ErrorCode::bad_input, path,
          fmt::format("promises a list of {} in row {} of element '{}', more than there is", count, row, element.name));
    for (std::uint64_t i = 0; i < static_cast<std::uint64_t>(count); ++i)
      property.values.push_back(next(property.type));
    property.offsets.push_back(property.values.size());
  }
}

template <typename T>
void append_raw(std::string& bytes, double value, PlyFormat format) {
  T const typed = static_cast<T>(value);
  char raw[sizeof(T)];
  std::memcpy(raw, &typed, sizeof(T));
  if (format == PlyFormat::binary_big_endian) std::reverse(raw, raw + sizeof(T));
  bytes.append(raw, sizeof(T));
}

void append_value(std::string& bytes, double value, PlyType type, PlyFormat format) {
  if (is_integer(type)) {
    auto const [low, high] = range_of(type);
    if (value < low || value > high || value != std::floor(value))
      throw std::logic_error("a value that its PLY property cannot hold");
  }
  if (format == PlyFormat::ascii) {
    if (is_integer(type))
      fmt::format_to(std::back_inserter(bytes), "{} ", static_cast<std::int64_t>(value));
    else if (type == PlyType::float32)
      fmt::format_to(std::back_inserter(bytes), "{} ", static_cast<float>(value));
    else
      fmt::format_to(std::back_inserter(bytes), "{} ", value);
    return;
  }
  switch (type) {
    case PlyType::int8:
      return append_raw<std::int8_t>(bytes, value, format);
    case PlyType::uint8:
      return append_raw<std::uint8_t>(bytes, value, format);
    case PlyType::int16:
      return append_raw<std::int16_t>(bytes, value, format);
    case PlyType::uint16:
      return append_raw<std::uint16_t>(bytes, value, format);
    case PlyType::int32:
      return append_raw<std::int32_t>(bytes, value, format);
    case PlyType::uint32:
      return append_raw<std::uint32_t>(bytes, value, format);
    case PlyType::float32:
      return append_raw<float>(bytes, value, format);
    case PlyType::float64:
      return append_raw<double>(bytes, value, format);
  }
}

}  // namespace

PlyProperty const* PlyElement::find(std::string_view property) const {
  auto const it = std::find_if(properties.begin(), properties.end(), [&](auto const& p) { return p.name == property; });
  return it == properties.end() ? nullptr : &*it;
}

PlyElement const* PlyFile::find(std::string_view element) const {
  auto const it = std::find_if(elements.begin(), elements.end(), [&](auto const& e) { return e.name == element; });
  return it == elements.end() ? nullptr : &*it;
}

PlyFile read_ply(std::filesystem::path const& path) { return parse_ply(read_file(path), path); }

PlyFile parse_ply(std::string_view bytes, std::filesystem::path const& path) {
  Header header = HeaderParser(bytes, path).parse();
  Body body(bytes.substr(header.size), header.format);
  for (auto& element : header.file.elements) {
    std::size_t const row_size = least_row_size(element, header.format);
    // A last ASCII number may end with the file instead of a separator.
    if (row_size == 0 ? element.rows > 0 : element.rows > (body.left() + 1) / row_size)
      throw Error(ErrorCode::bad_input, path,
                  fmt::format("promises {} rows of element '{}', more than its {} bytes can hold", element.rows,
                              element.name, bytes.size()));
    for (auto& property : element.properties) {
      property.values.reserve(element.rows);
      if (property.is_list) property.offsets.assign(1, 0);
    }
    for (std::uint64_t row = 0; row < element.rows; ++row) read_row(element, row, body, path);
  }
  return std::move(header.file);
}

std::string format_ply(PlyFile const& ply, PlyFormat format) {
  constexpr std::string_view kFormats[] = {"ascii", "binary_little_endian", "binary_big_endian"};
  std::string bytes = fmt::format("ply\nformat {} 1.0\n", kFormats[static_cast<int>(format)]);
  for (auto const& comment : ply.comments) bytes += "comment " + comment + "\n";
  for (auto const& info : ply.obj_info) bytes += "obj_info " + info + "\n";
  for (auto const& element : ply.elements) {
    bytes += fmt::format("element {} {}\n", element.name, element.rows);
    for (auto const& property : element.properties)
      bytes += property.is_list ? fmt::format("property list {} {} {}\n", name_of(property.count_type),
                                              name_of(property.type), property.name)
                                : fmt::format("property {} {}\n", name_of(property.type), property.name);
  }
  bytes += "end_header\n";
  for (auto const& element : ply.elements)
    for (std::uint64_t row = 0; row < element.rows; ++row) {
      for (auto const& property : element.properties) {
        if (!property.is_list) {
          append_value(bytes, property.values.at(row), property.type, format);
          continue;
        }
        auto const begin = property.offsets.at(row), end = property.offsets.at(row + 1);
        append_value(bytes, static_cast<double>(end - begin), property.count_type, format);
        for (auto i = begin; i < end; ++i) append_value(bytes, property.values.at(i), property.type, format);
      }
      if (format == PlyFormat::ascii && !element.properties.empty()) bytes.back() = '\n';
    }
  return bytes;
}

PlyProperty ply_scalar(std::string name, PlyType type, std::vector<double> values) {
  PlyProperty property;
  property.name = std::move(name);
  property.type = type;
  property.values = std::move(values);
  return property;
}

}  // namespace scanview
