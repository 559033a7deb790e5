#include "mesh/model_textures.h"

#include <algorithm>
#include <stdexcept>
#include <utility>

namespace scanview {

void ModelTextures::turn_from(std::size_t first_triangle) {
  for (std::size_t t = first_triangle; t < corners.size(); ++t) std::swap(corners[t][1], corners[t][2]);
}

void ModelTextures::check(std::size_t triangle_count) const {
  auto const require = [](bool good, char const* what) {
    if (!good) throw std::logic_error(what);
  };
  if (of_triangle.empty() && corners.empty()) return;
  require(of_triangle.size() == triangle_count && corners.size() == triangle_count,
          "textures of a model of another number of triangles");
  for (ModelTexture const& texture : textures)
    require(!texture.picture.empty() && texture.factor.allFinite(), "a texture without a picture");
  for (std::size_t t = 0; t < triangle_count; ++t) {
    require(of_triangle[t] < static_cast<std::int64_t>(textures.size()), "a triangle with a texture that is not there");
    require(of_triangle[t] < 0 || std::all_of(corners[t].begin(), corners[t].end(),
                                              [](Eigen::Vector2f const& at) { return at.allFinite(); }),
            "a texture coordinate that is not finite");
  }
}

}  // namespace scanview
