#pragma once
#include <Eigen/Core>
#include <array>
#include <cstddef>
#include <cstdint>
#include <opencv2/core/mat.hpp>
#include <vector>

namespace scanview {

/// How a picture goes on beyond its edges: over and over again; in the colour of its edge; over and over again, every
/// other time mirrored.
enum class TextureWrap : std::uint8_t { repeat, clamp, mirrored };

/// A picture that lies on triangles.
struct ModelTexture {
  cv::Mat3b picture;  ///< 8-bit sRGB, B G R; never empty, but perhaps one pixel: a plain colour
  TextureWrap wrap_u = TextureWrap::repeat, wrap_v = TextureWrap::repeat;
  Eigen::Vector3f factor = Eigen::Vector3f::Ones();  ///< multiplies the picture: linear R G B
};

/// Where the corners of a triangle lie in a picture: u to the right, v down, (0, 0) the outer corner of its first pixel
/// and (1, 1) that of its last, as glTF has them. (The first pixel's centre is at (½ / width, ½ / height).)
using TextureCorners = std::array<Eigen::Vector2f, 3>;

/// The pictures of a model and which of its triangles show them. All three are empty where there are none.
struct ModelTextures {
  std::vector<ModelTexture> textures;
  std::vector<std::int32_t> of_triangle;  ///< into `textures`; -1: none, the triangle shows its vertices' colours
  std::vector<TextureCorners> corners;    ///< of each triangle, finite; of no meaning where it has no texture

  bool on(std::size_t triangle) const { return !of_triangle.empty() && of_triangle[triangle] >= 0; }
  /// The triangles from this one on are now wound the other way: the second and third corner change places.
  void turn_from(std::size_t first_triangle);
  /// Throws std::logic_error where a size, an index, a coordinate or a picture is not as said above.
  void check(std::size_t triangle_count) const;
};

}  // namespace scanview
