#include "mesh/mesh_off.h"

#include <cmath>
#include <optional>

#include "mesh/byte_reader.h"
#include "mesh/model_builder.h"
#include "mesh/words.h"

// The Geometry Center, "Geomview Manual", §4.2.5 OFF files; the binary form: §4.1.4.

namespace scanview {
namespace {

struct Keyword {
  bool texture = false, color = false, normal = false, homogeneous = false, dimension = false;
};

std::optional<Keyword> parse_keyword(std::string_view word) {
  Keyword keyword;
  auto const take = [&word](std::string_view prefix) {
    bool const there = word.starts_with(prefix);
    if (there) word.remove_prefix(prefix.size());
    return there;
  };
  keyword.texture = take("ST");
  keyword.color = take("C");
  keyword.normal = take("N");
  keyword.homogeneous = take("4");
  keyword.dimension = take("n");
  if (word != "OFF") return std::nullopt;
  return keyword;
}

/// Lines that hold something besides comments.
class OffLines {
 public:
  explicit OffLines(std::string_view text) : lines_(text) {}
  std::optional<std::string_view> next() {
    while (auto const line = lines_.next()) {
      std::string_view const text = trimmed(line->substr(0, line->find('#')));
      if (!text.empty()) return text;
    }
    return std::nullopt;
  }
  std::size_t number() const { return lines_.number(); }
  std::string_view rest() const { return lines_.rest(); }

 private:
  Lines lines_;
};

/// Three or four components. Whole numbers count to 255, but 1 is the whole where none is larger.
class OffColor {
 public:
  void add(std::string_view word) {
    auto const value = parse_number<double>(word);
    if (!value) return;
    is_real_ = is_real_ || word.find_first_of(".eE") != std::string_view::npos;
    add(*value);
  }
  void add(double value) {
    if (count_ < 4) values_[count_] = value;
    ++count_;
  }
  void set_real() { is_real_ = true; }

  Light light() const { return count_ == 4 && values_[3] < whole() ? Light::passes : Light::stops; }
  std::optional<cv::Vec3b> color() const {
    if (count_ != 3 && count_ != 4) return std::nullopt;
    cv::Vec3b color;
    for (int c = 0; c < 3; ++c) {
      double const part = values_[c] / whole();
      if (!(part >= 0 && part <= 1)) return std::nullopt;
      color[2 - c] = uchar(std::lround(255 * part));
    }
    return color;
  }

 private:
  double whole() const {
    bool small = true;
    for (int i = 0; i < std::min(count_, 4); ++i) small = small && values_[i] <= 1;
    return is_real_ || (small && count_ == 4 && values_[3] == 1) ? 1 : 255;
  }

  double values_[4] = {};
  int count_ = 0;
  bool is_real_ = false;
};

class OffReader {
 public:
  OffReader(std::string_view bytes, std::filesystem::path const& path)
      : path_(path), builder_(path), lines_(bytes), words_({}) {}

  PolygonModel read() {
    auto line = lines_.next();
    if (!line) builder_.fail("is empty");
    words_ = Words(*line);
    Words first = words_;
    if (auto const keyword = parse_keyword(first.next())) {
      keyword_ = *keyword;
      words_ = first;
      if (first.next() == "BINARY") {
        read_binary();
        return finish();
      }
    }
    if (keyword_.dimension) check_dimension(next_count("the dimension"));
    std::int64_t const vertices = next_count("the count of vertices");
    std::int64_t const faces = next_count("the count of faces");
    next_count("the count of edges");
    check_counts(vertices, faces, 6, 2);
    for (std::int64_t v = 0; v < vertices; ++v) read_vertex();
    for (std::int64_t f = 0; f < faces; ++f) read_face();
    return finish();
  }

 private:
  void check_dimension(std::int64_t dimension) const {
    if (dimension != 3) builder_.fail(fmt::format("has vertices in {} dimensions", dimension));
  }
  void check_counts(std::int64_t vertices, std::int64_t faces, std::int64_t vertex_bytes,
                    std::int64_t face_bytes) const {
    auto const left = std::int64_t(lines_.rest().size());
    if (vertices < 0 || faces < 0 || vertices > left / vertex_bytes + 1 || faces > left / face_bytes + 1)
      builder_.fail(fmt::format("promises {} vertices and {} faces, more than there are", vertices, faces));
  }

  /// The next word, of the next line where this one has ended.
  std::string_view next_word() {
    std::string_view word = words_.next();
    while (word.empty()) {
      auto const line = lines_.next();
      if (!line) builder_.fail("is cut off");
      words_ = Words(*line);
      word = words_.next();
    }
    return word;
  }
  std::int64_t next_count(char const* what) {
    auto const value = parse_number<std::int64_t>(next_word());
    if (!value) builder_.fail(fmt::format("line {}: {} is no number", lines_.number(), what));
    return *value;
  }
  double next_coordinate() {
    auto const value = parse_number<double>(next_word());
    if (!value) builder_.fail(fmt::format("line {}: a coordinate that is no number", lines_.number()));
    return *value;
  }

  void add_vertex(double const (&p)[4], OffColor const& color) {
    double const scale = keyword_.homogeneous ? p[3] : 1;
    builder_.add_vertex(p[0] / scale, p[1] / scale, p[2] / scale, keyword_.color ? color.light() : Light::stops);
    if (auto const rgb = color.color(); rgb && keyword_.color) builder_.add_color(*rgb);
  }
  void read_vertex() {
    words_ = Words({});
    double p[4] = {};
    for (int i = 0; i < (keyword_.homogeneous ? 4 : 3); ++i) p[i] = next_coordinate();
    for (int i = 0; i < 3 && keyword_.normal; ++i) next_coordinate();
    OffColor color;
    if (keyword_.color) {
      int left = 0;
      for (Words rest = words_; !rest.next().empty();) ++left;
      if (keyword_.texture) left -= 2;
      for (int i = 0; i < left && i < 4; ++i) color.add(words_.next());
    }
    add_vertex(p, color);
  }

  void add_face(OffColor const& color) {
    if (corners_.size() < 3)
      ++left_out_;
    else
      builder_.add_polygon(corners_, color.light());
  }
  void read_face() {
    words_ = Words({});
    std::int64_t const count = next_count("the count of a face's vertices");
    if (count < 0) builder_.fail(fmt::format("line {}: a face of {} vertices", lines_.number(), count));
    corners_.clear();
    for (std::int64_t i = 0; i < count; ++i) corners_.push_back(next_count("a face's vertex"));
    OffColor color;
    for (std::string_view word = words_.next(); !word.empty(); word = words_.next()) color.add(word);
    add_face(color);
  }

  void read_binary() {
    ByteReader<std::endian::big> bytes(lines_.rest(), path_);
    if (keyword_.dimension) check_dimension(bytes.next<std::int32_t>());
    auto const vertices = bytes.next<std::int32_t>(), faces = bytes.next<std::int32_t>();
    bytes.next<std::int32_t>();
    check_counts(vertices, faces, 12, 8);
    auto const next_color = [&bytes](int components) {
      OffColor color;
      color.set_real();
      for (int i = 0; i < components; ++i) color.add(double(bytes.next<float>()));
      return color;
    };
    for (std::int32_t v = 0; v < vertices; ++v) {
      double p[4] = {};
      for (int i = 0; i < (keyword_.homogeneous ? 4 : 3); ++i) p[i] = bytes.next<float>();
      for (int i = 0; i < 3 && keyword_.normal; ++i) bytes.next<float>();
      add_vertex(p, next_color(keyword_.color ? 4 : 0));
      for (int i = 0; i < 2 && keyword_.texture; ++i) bytes.next<float>();
    }
    for (std::int32_t f = 0; f < faces; ++f) {
      auto const count = bytes.next<std::int32_t>();
      if (count < 0) builder_.fail(fmt::format("face {} has {} vertices", f, count));
      corners_.clear();
      for (std::int32_t i = 0; i < count; ++i) corners_.push_back(bytes.next<std::int32_t>());
      auto const components = bytes.next<std::int32_t>();
      if (components < 0 || components > 4)
        builder_.fail(fmt::format("face {} has a colour of {} parts", f, components));
      add_face(next_color(components));
    }
  }

  PolygonModel finish() {
    if (left_out_ > 0) builder_.note(fmt::format("{} faces of fewer than three vertices were left out", left_out_));
    return builder_.take();
  }

  std::filesystem::path const& path_;
  ModelBuilder builder_;
  OffLines lines_;
  Words words_;
  Keyword keyword_;
  std::vector<std::int64_t> corners_;
  std::size_t left_out_ = 0;
};

}  // namespace

bool is_off(std::string_view bytes) {
  auto const line = OffLines(bytes.substr(0, 4096)).next();
  return line && parse_keyword(Words(*line).next());
}

PolygonModel model_from_off(std::string_view bytes, std::filesystem::path const& path) {
  return OffReader(bytes, path).read();
}

}  // namespace scanview
