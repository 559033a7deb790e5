#include "mesh/mesh_obj.h"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <optional>
#include <string_view>

#include "mesh/mesh_builder.h"

namespace scanview {
namespace {

/// Words of a line, one after the other.
class Words {
 public:
  explicit Words(std::string_view line) : rest_(line) {}
  std::string_view next() {
    auto const start = rest_.find_first_not_of(" \t\r");
    if (start == std::string_view::npos) return {};
    rest_.remove_prefix(start);
    std::string_view const word = rest_.substr(0, std::min(rest_.find_first_of(" \t\r"), rest_.size()));
    rest_.remove_prefix(word.size());
    return word;
  }

 private:
  std::string_view rest_;
};

template <typename Number>
std::optional<Number> parse(std::string_view word) {
  if (!word.empty() && word.front() == '+') word.remove_prefix(1);
  Number value{};
  auto const [end, error] = std::from_chars(word.data(), word.data() + word.size(), value);
  if (error != std::errc() || end != word.data() + word.size()) return std::nullopt;
  return value;
}

}  // namespace

TriangleMesh mesh_from_obj(std::string text, std::filesystem::path const& path) {
  MeshBuilder builder(path);
  for (std::size_t at = text.find('\\'); at != std::string::npos; at = text.find('\\', at + 1)) {
    std::size_t const end = text.compare(at + 1, 2, "\r\n") == 0 ? at + 2 : at + 1;
    if (end < text.size() && text[end] == '\n') std::fill(text.begin() + at, text.begin() + end + 1, ' ');
  }
  std::vector<std::int64_t> polygon;
  std::size_t number = 0;
  for (std::string_view rest = text; !rest.empty();) {
    std::string_view const line = rest.substr(0, std::min(rest.find('\n'), rest.size()));
    rest.remove_prefix(std::min(line.size() + 1, rest.size()));
    ++number;
    Words words(line);
    std::string_view const keyword = words.next();
    auto const bad = [&](char const* what) { builder.fail(fmt::format("line {}: {}", number, what)); };
    if (keyword == "v") {
      double values[6];
      int count = 0;
      for (std::string_view word = words.next(); !word.empty() && count < 6; word = words.next()) {
        auto const value = parse<double>(word);
        if (!value) bad("a coordinate that is no number");
        values[count++] = *value;
      }
      if (count < 3) bad("a vertex with fewer than three coordinates");
      builder.add_vertex(values[0], values[1], values[2]);
      if (count == 6) {
        cv::Vec3b color;
        for (int c = 0; c < 3; ++c) {
          if (!(values[3 + c] >= 0 && values[3 + c] <= 1)) bad("a colour outside 0..1");
          color[2 - c] = uchar(std::lround(255 * values[3 + c]));
        }
        builder.add_color(color);
      }
    } else if (keyword == "f") {
      polygon.clear();
      for (std::string_view word = words.next(); !word.empty(); word = words.next()) {
        auto const index = parse<std::int64_t>(word.substr(0, std::min(word.find('/'), word.size())));
        if (!index || *index == 0) bad("a face with an index that is none");
        polygon.push_back(*index > 0 ? *index - 1 : std::int64_t(builder.mesh().vertices.size()) + *index);
      }
      builder.add_polygon(polygon);
    }
  }
  if (builder.mesh().vertices.empty()) builder.fail("no vertices: not a Wavefront OBJ file");
  return builder.take();
}

}  // namespace scanview
