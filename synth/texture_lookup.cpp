#include "synth/texture_lookup.h"

#include <algorithm>
#include <cmath>

#include "synth/linear_color.h"

namespace scanview {
namespace {

using Eigen::Vector3f;

/// Two neighbouring pixels of a row or column, and how far on the way to the second.
struct Between {
  int first, second;
  float share;
};

int pixel_at(int at, int size, TextureWrap wrap) {
  if (wrap == TextureWrap::clamp) return std::clamp(at, 0, size - 1);
  int const period = wrap == TextureWrap::mirrored ? 2 * size : size, rest = (at + period) % period;
  return rest < size ? rest : period - 1 - rest;
}

Between between(float at, int size, TextureWrap wrap) {
  // Brought near the picture first, so that no integer is too small for it.
  float const near = wrap == TextureWrap::clamp      ? std::clamp(at, 0.0f, 1.0f)
                     : wrap == TextureWrap::mirrored ? at - 2 * std::floor(at / 2)
                                                     : at - std::floor(at);
  float const place = near * static_cast<float>(size) - 0.5f, below = std::floor(place);
  int const pixel = static_cast<int>(below);
  return {pixel_at(pixel, size, wrap), pixel_at(pixel + 1, size, wrap), place - below};
}

}  // namespace

Vector3f texture_color(ModelTexture const& texture, Eigen::Vector2f const& at) {
  Between const x = between(at.x(), texture.picture.cols, texture.wrap_u);
  Between const y = between(at.y(), texture.picture.rows, texture.wrap_v);
  auto const row = [&](int line) -> Vector3f {
    cv::Vec3b const* const pixels = texture.picture[line];
    return (1 - x.share) * linear_from_bgr(pixels[x.first]) + x.share * linear_from_bgr(pixels[x.second]);
  };
  return texture.factor.cwiseProduct((1 - y.share) * row(y.first) + y.share * row(y.second));
}

}  // namespace scanview
