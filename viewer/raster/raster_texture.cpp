#include "viewer/raster/raster_texture.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "base/srgb.h"

namespace scanview {

RasterTexture raster_texture(PicturePyramid const& pyramid) {
  std::array<std::uint32_t, 256> root{};
  for (std::size_t i = 0; i < root.size(); ++i) {
    root[i] = static_cast<std::uint32_t>(std::lround(1023 * std::sqrt(linear_from_srgb8()[i])));
  }
  RasterTexture texture;
  for (auto const& picture : pyramid.levels) {
    texture.levels.push_back({texture.texels.size(), picture.cols, picture.rows});
    for (int y = 0; y < picture.rows; ++y) {
      for (int x = 0; x < picture.cols; ++x) {
        auto const& color = picture(y, x);
        texture.texels.push_back(root[color[2]] | root[color[1]] << 10 | root[color[0]] << 20);
      }
    }
  }
  cv::Mat1b const& feather = pyramid.feather;
  texture.feather.reserve(feather.total());
  for (int y = 0; y < feather.rows; ++y) {
    std::uint8_t const* const row = feather[y];
    std::uint8_t const* const below = feather[std::min(y + 1, feather.rows - 1)];
    for (int x = 0; x < feather.cols; ++x) {
      int const right = std::min(x + 1, feather.cols - 1);
      texture.feather.push_back(std::uint32_t{row[x]} | std::uint32_t{row[right]} << 8 | std::uint32_t{below[x]} << 16 |
                                std::uint32_t{below[right]} << 24);
    }
  }
  return texture;
}

}  // namespace scanview
