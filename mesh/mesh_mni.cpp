#include "mesh/mesh_mni.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "mesh/model_builder.h"
#include "mesh/words.h"

// David MacDonald's display tools: http://www.bic.mni.mcgill.ca/~david/FAQ/polygons_format.txt

namespace scanview {
namespace {

using Color = std::array<double, 4>;

class MniReader {
 public:
  MniReader(std::string_view text, std::filesystem::path const& path) : builder_(path), words_(text) {}

  PolygonModel read() {
    words_.next();
    for (int i = 0; i < 4; ++i) next<double>("the surface's reflection");
    double const opacity = next<double>("the opacity");
    std::int64_t const point_count = next_count("points", 6);
    std::vector<double> coordinates;
    for (std::int64_t i = 0; i < 3 * point_count; ++i) coordinates.push_back(next<double>("a coordinate"));
    for (std::int64_t i = 0; i < 3 * point_count; ++i) next<double>("a normal");
    std::int64_t const polygon_count = next_count("polygons", 1);
    enum { kOne, kPolygons, kPoints };
    auto const kind = next<int>("the kind of colours");
    if (kind != kOne && kind != kPolygons && kind != kPoints)
      builder_.fail(fmt::format("has colours of kind {}", kind));
    std::vector<Color> colors;
    for (std::int64_t i = 0; i < (kind == kOne ? 1 : kind == kPolygons ? polygon_count : point_count); ++i)
      for (double& part : colors.emplace_back()) part = next<double>("a colour");

    bool const all = opacity < 1 || (kind == kOne && colors[0][3] < 1);
    for (std::int64_t i = 0; i < point_count; ++i) {
      bool const passes = kind == kPoints && colors[i][3] < 1;
      builder_.add_vertex(coordinates[3 * i], coordinates[3 * i + 1], coordinates[3 * i + 2],
                          passes ? Light::passes : Light::stops);
      if (kind == kPoints) builder_.add_color(to_bgr(colors[i]));
    }
    std::vector<std::int64_t> ends = {0};
    for (std::int64_t i = 0; i < polygon_count; ++i) {
      ends.push_back(next<std::int64_t>("the end of a polygon"));
      if (ends[i + 1] < ends[i]) builder_.fail(fmt::format("polygon {} ends before it begins", i));
    }
    std::vector<std::int64_t> corners;
    for (std::int64_t i = 0; i < polygon_count; ++i) {
      corners.clear();
      for (std::int64_t k = ends[i]; k < ends[i + 1]; ++k) corners.push_back(next<std::int64_t>("an index"));
      bool const passes = all || (kind == kPolygons && colors[i][3] < 1);
      builder_.add_polygon(corners, passes ? Light::passes : Light::stops);
    }
    return builder_.take();
  }

 private:
  template <typename Number>
  Number next(char const* what) {
    std::string_view const word = words_.next();
    auto const value = parse_number<Number>(word);
    if (!value) builder_.fail(fmt::format("{} is {}", what, word.empty() ? "cut off" : "no number"));
    return *value;
  }
  /// Of things that take at least so many numbers each.
  std::int64_t next_count(char const* what, std::int64_t numbers) {
    auto const count = next<std::int64_t>(what);
    if (count < 0 || count > std::int64_t(words_.rest().size()) / (2 * numbers) + 1)
      builder_.fail(fmt::format("promises {} {}, more than there are", count, what));
    return count;
  }
  static cv::Vec3b to_bgr(Color const& color) {
    auto const byte = [](double part) { return part > 0 ? uchar(std::lround(255 * std::min(part, 1.0))) : uchar(0); };
    return {byte(color[2]), byte(color[1]), byte(color[0])};
  }

  ModelBuilder builder_;
  Words words_;
};

}  // namespace

bool is_mni_polygons(std::string_view bytes) {
  Words words(bytes.substr(0, 256));
  return words.next() == "P" && parse_number<double>(words.next());
}

PolygonModel model_from_mni_polygons(std::string_view text, std::filesystem::path const& path) {
  return MniReader(text, path).read();
}

}  // namespace scanview
