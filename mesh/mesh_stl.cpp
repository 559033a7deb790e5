#include "mesh/mesh_stl.h"

#include <array>
#include <cctype>

#include "mesh/byte_reader.h"
#include "mesh/equal_vertices.h"
#include "mesh/model_builder.h"
#include "mesh/words.h"

namespace scanview {
namespace {

constexpr std::size_t kHeader = 80, kFacet = 50;

std::uint64_t promised_size(std::string_view bytes, std::filesystem::path const& path) {
  ByteReader<std::endian::little> reader(bytes.substr(std::min(kHeader, bytes.size())), path);
  return kHeader + sizeof(std::uint32_t) + std::uint64_t{kFacet} * reader.next<std::uint32_t>();
}

std::string lower(std::string_view word) {
  std::string result(word);
  for (char& c : result) c = char(std::tolower(static_cast<unsigned char>(c)));
  return result;
}

/// Text that begins as STL does, and no control characters in what a binary header is.
bool is_text(std::string_view bytes) {
  if (lower(Words(bytes.substr(0, 256)).next()) != "solid") return false;
  for (char const c : bytes.substr(0, kHeader + sizeof(std::uint32_t)))
    if (static_cast<unsigned char>(c) < ' ' && !std::isspace(static_cast<unsigned char>(c))) return false;
  return true;
}

PolygonModel from_binary(std::string_view bytes, std::filesystem::path const& path) {
  ModelBuilder builder(path);
  std::uint64_t const size = promised_size(bytes, path);
  if (size > bytes.size())
    builder.fail(fmt::format("promises {} facets, more than there are", (size - kHeader) / kFacet));
  if (size < bytes.size()) builder.note(fmt::format("{} bytes after the last facet were skipped", bytes.size() - size));
  ByteReader<std::endian::little> reader(bytes.substr(kHeader + sizeof(std::uint32_t)), path);
  for (std::uint64_t at = kHeader + sizeof(std::uint32_t); at < size; at += kFacet) {
    for (int i = 0; i < 3; ++i) reader.next<float>();  // the normal
    auto const first = std::int64_t(builder.vertex_count());
    for (int corner = 0; corner < 3; ++corner) {
      auto const x = reader.next<float>(), y = reader.next<float>(), z = reader.next<float>();
      builder.add_vertex(x, y, z);
    }
    builder.add_polygon(std::array{first, first + 1, first + 2});
    reader.next<std::uint16_t>();
  }
  return builder.take();
}

PolygonModel from_text(std::string_view text, std::filesystem::path const& path) {
  ModelBuilder builder(path);
  std::vector<std::int64_t> corners;
  enum class Place { outside, solid, facet } place = Place::outside;
  Lines lines(text);
  while (auto const line = lines.next()) {
    Words words(*line);
    std::string const keyword = lower(words.next());
    auto const bad = [&](char const* what) { builder.fail(fmt::format("line {}: {}", lines.number(), what)); };
    if (keyword == "vertex") {
      double p[3];
      for (double& coordinate : p) {
        auto const value = parse_number<double>(words.next());
        if (!value) bad("a coordinate that is no number");
        coordinate = *value;
      }
      if (place != Place::facet) bad("a vertex outside a facet");
      corners.push_back(std::int64_t(builder.vertex_count()));
      builder.add_vertex(p[0], p[1], p[2]);
    } else if (keyword == "facet") {
      if (place != Place::solid) bad("a facet where none may begin");
      place = Place::facet;
      corners.clear();
    } else if (keyword == "endfacet") {
      if (place != Place::facet) bad("the end of a facet that has not begun");
      builder.add_polygon(corners);
      place = Place::solid;
    } else if (keyword == "solid") {
      if (place != Place::outside) bad("a solid within another");
      place = Place::solid;
    } else if (keyword == "endsolid") {
      if (place != Place::solid) bad("the end of a solid that has not begun, or within a facet");
      place = Place::outside;
    } else if (!keyword.empty() && keyword != "outer" && keyword != "endloop") {
      bad("no keyword of STL");
    }
  }
  if (place != Place::outside) builder.fail("is cut off: the last solid does not end");
  return builder.take();
}

}  // namespace

bool is_binary_stl(std::string_view bytes) {
  return bytes.size() >= kHeader + sizeof(std::uint32_t) && promised_size(bytes, {}) == bytes.size();
}

PolygonModel model_from_stl(std::string_view bytes, std::filesystem::path const& path) {
  bool const text = !is_binary_stl(bytes) && is_text(bytes);
  return join_equal_vertices(text ? from_text(bytes, path) : from_binary(bytes, path));
}

}  // namespace scanview
