#pragma once
#include <cstddef>
#include <cstdint>
#include <vector>

// What the rasteriser's kernels work on. They are compiled once for each instruction set (Highway), and so include
// neither Eigen nor OpenCV: inline functions of theirs compiled for one processor must not be linked for another.

namespace scanview {

/// A vertex on the screen. x, y: 1/256 pixel, the centre of pixel (0, 0) at 0; kBeyond in x: behind the near plane or
/// outside the guard band, so that its triangles must be clipped. What is linear on the screen: key, by which depths
/// are compared, nearer is greater: 1/z (perspective) or −z (orthographic); and, divided by z where the camera is a
/// perspective one, s, t, w: homogeneous texture coordinates in texels; nearness: how close the view's camera comes to
/// seeing the point from this side; red, green, blue: the light there, as a share of what the view's camera saw.
struct ScreenVertex {
  std::int32_t x, y;
  enum Value { key, s, t, w, nearness, red, green, blue, kValues };
  float values[kValues];
};
inline constexpr std::int32_t kBeyond = INT32_MIN;

/// A vertex of a picture that is drawn whole (draw_mesh_ids); fields as in ScreenVertex.
struct PlacedVertex {
  std::int32_t x, y;
  float values[1];
};
/// Such a picture's longest side in pixels, and how far outside of it vertices may lie: edge functions fit 32 bits,
/// 2 · 256 (kIdPicture + 2 kIdMargin) (kIdPicture + kIdMargin) < 2^31.
inline constexpr int kIdPicture = 1024, kIdMargin = 128;

/// Rows of the map from source coordinates (x, y, z, 1): position on the screen u w, v w, w (pixels, centre of pixel
/// (0, 0) at 0), homogeneous texture coordinates s w', t w', w' (texels), and the point in the camera's coordinates, of
/// which depth is z.
struct ScreenTransform {
  enum Row { u, v, w, s, t, texture_w, x_camera, y_camera, depth, kRows };
  double rows[kRows][4] = {};
  bool perspective = true;  ///< whether w is the depth (else 1)
  double near = 0;          ///< perspective: nothing nearer is drawn
  /// Where the view's camera stands, in this camera's coordinates; `source_far`: infinitely far in that direction.
  float source[3] = {};
  bool source_far = false;
  float angle_scale = 0;  ///< nearness = 1 / (1 + angle_scale θ²)
  bool lit = false;       ///< whether there is a light (CameraLight), and the mesh has normals
  float camera_from_source[3][3] = {};
  float light[8][3] = {};  ///< CameraLight::coefficients
};

/// Vertices of a mesh a component an array, padded so that whole vectors can be read.
struct VertexArrays {
  std::size_t count = 0;
  std::vector<float> x, y, z;
  std::vector<float> normal[3], light[3];  ///< VertexLight; or empty
  std::vector<float> quality;              ///< nearness is multiplied by it; or empty
};

/// Triangles wider or higher than this many pixels beyond the picture are clipped (guard band); pictures are drawn in
/// blocks of at most kBlock pixels: with both, edge functions fit 32 bits within a tile.
inline constexpr int kGuardBand = 2048, kBlock = 4096;
inline constexpr int kTileWidth = 128, kTileHeight = 32;
/// A row of a tile's buffers: vectors may start at any pixel.
inline constexpr int kTileStride = kTileWidth + 16;

/// A triangle ready to be drawn, clockwise on the screen (y down).
struct ScreenTriangle {
  ScreenVertex const* corners[3];
  std::uint32_t label = 0;  ///< TextureTarget: 16 bits of cos φ; IdTarget: the identifier
};

/// The part of the picture that a tile's buffers hold; [left, right) and [top, bottom) of the picture.
struct TileArea {
  int left = 0, top = 0, right = 0, bottom = 0;
};

/// One view's samples in a tile: `key` 0 or less (perspective) or −infinity where nothing was drawn. s, t: texels.
/// packed: cos φ in the upper 16 bits; bit 15: on an edge of a wireframe; below: level of detail in 1/2048.
struct TextureTarget {
  float* key;
  float* s;
  float* t;
  std::uint32_t* packed;
  std::uint32_t* light;  ///< red, green, blue in 10 bits each (red lowest), 1023: twice as much; only if `lit`
  float largest_lod = 0;
  bool wireframe = false;
  bool lit = false;
  bool perspective = true;
};
struct IdTarget {
  float* key;
  std::uint32_t* id;
  int stride = kTileStride;
};

/// A view's picture as the compositor samples it. Texels hold the square roots of linear light in 10 bits a channel
/// (R lowest): four or more steps to one of 8-bit sRGB, decoded by a multiplication. feather: of each texel the 8-bit
/// values of itself and its neighbours to the right, below, and below to the right (lowest byte first).
struct TextureLevel {
  std::size_t offset = 0;
  int width = 0, height = 0;
};
struct RasterTexture {
  std::vector<TextureLevel> levels;
  std::vector<std::uint32_t> texels;
  std::vector<std::uint32_t> feather;  ///< of level 0
};

}  // namespace scanview
