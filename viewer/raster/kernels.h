#pragma once
#include "viewer/raster/raster_types.h"

namespace scanview {

// The inner loops, in the instruction set that the processor has (Highway, chosen at run time). All sets compute the
// same bits: no fused multiply-add, no approximate reciprocals.

/// Vertices [begin, end); begin a multiple of 16. Rounds to 1/256 pixel.
void transform_vertices(VertexArrays const& vertices, ScreenTransform const& transform, std::size_t begin,
                        std::size_t end, int width, int height, ScreenVertex* out);

/// Draws triangles into a tile: pixels whose centre is inside (top-left rule), nearer than what is there; of equal
/// depths the first stays.
void draw_textured(ScreenTriangle const* triangles, std::size_t count, TileArea const& area,
                   TextureTarget const& target);
void draw_ids(ScreenTriangle const* triangles, std::size_t count, TileArea const& area, IdTarget const& target);

/// All vertices of a mesh for draw_mesh_ids(), in a picture of at most kIdPicture pixels a side. False, and nothing of
/// use in `out`, where one is behind the near plane or more than kIdMargin pixels outside: then TriangleBins clip.
bool place_vertices(VertexArrays const& vertices, ScreenTransform const& transform, int width, int height,
                    PlacedVertex* out);
/// Draws the triangles of a mesh that turn their front to the camera, without tiles, each under its number; the same
/// pixels as draw_ids(). For pictures that are drawn side by side, of many small triangles.
void draw_mesh_fronts(PlacedVertex const* vertices, std::int32_t const* corners, std::size_t count,
                      TileArea const& area, IdTarget const& target);
/// The same for the listed triangles, whichever side they turn, their keys less by `behind`: on the outline, where a
/// front and a back meet, rounding must not decide. False where no pixel changed.
bool draw_mesh_ids(PlacedVertex const* vertices, std::int32_t const* corners, std::uint32_t const* list,
                   std::size_t count, float behind, TileArea const& area, IdTarget const& target);

/// A layer of a tile for the compositor.
struct ComposedLayer {
  TextureTarget samples;
  RasterTexture const* texture = nullptr;
  float* quality = nullptr;   ///< scratch: w_cos · w_feather of each sample, 0 where there is none
  float* fairness = nullptr;  ///< scratch: how far the sample counts where its view only fills
  float gain[3] = {1, 1, 1};  ///< R, G, B
  float hue[3] = {1, 1, 1};
  float weight = 0, fill = 0;
  float fill_rank = 0;                 ///< `fill` where it is decided what hides what
  bool cosine = true, feather = true;  ///< whether they count in the weight
  bool backs_hide = false;             ///< a sample without cosine is none (Culling::backs_hide)
  /// Texel (s w, t w, w) of the point that pixel (x, y) of the picture shows at depth z:
  /// z · along (x, y, 1) + at (x, y, 1).
  float along[3][3] = {}, at[3][3] = {};
};
/// How layers are mixed: SoftZ, as single precision with finite numbers.
struct Composition {
  float threshold = 0, ramp = 0;  ///< ramp: 1 / (half a threshold)
  /// The threshold grows with the depth z of the nearest sample: + growth z + parallax z². Both 0: `ramp` holds.
  float growth = 0, parallax = 0;
  float reliability_ratio = 0.1F;
  float good_enough = 0, good_at_zero = 0, good_quality = 0, fair_feather = 0, least_weight = 0;
  float always = 0;  ///< views that fill count at least so much
  bool nearest = false;
  int squarings = 0;    ///< of the quality, before it counts in the mixture: quality^(2^squarings)
  bool winner = false;  ///< of the samples that would be mixed only the one that counts most
  bool agree = false;   ///< samples are taken where the mean depth lies, instead of on each layer's own surface
  int show = 0;
  bool perspective = true;
};
/// Quality and fairness of the layer's samples.
void measure_quality(ComposedLayer const& layer, Composition const& how, TileArea const& area);
/// Mixes layers into the picture: BGRA bytes and depth, rows `color_stride` and `depth_stride` elements apart, starting
/// at the tile's first pixel.
void compose_layers(ComposedLayer const* layers, std::size_t count, Composition const& how, TileArea const& area,
                    std::uint32_t* color, std::size_t color_stride, float* depth, std::size_t depth_stride);

/// The instruction sets this processor can run, by name, and a way to allow only one of them (tests): "" for all.
std::vector<char const*> kernel_targets();
void use_kernel_target(char const* name);

}  // namespace scanview
