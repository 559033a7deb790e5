#pragma once
#include <Eigen/Geometry>
#include <cstdint>
#include <limits>
#include <vector>

#include "viewer/raster/triangle_bins.h"
#include "viewer/visibility/sample_camera.h"
#include "viewer/visibility/triangle_planes.h"

namespace scanview {

/// What is seen in one picture: a bit a triangle and side.
struct SeenTriangles {
  std::vector<std::uint64_t> front, back;
};

/// What counts as seen.
enum class Seen {
  in_picture,  ///< what a pixel shows
  nearly       ///< also what a smaller pixel would show, or an eye near the camera (SampleCamera::movement)
};

/// Draws a mesh from many cameras and tells which triangles they see. One for each thread.
///
/// Nearly seen is Wonka's shrinking of occluders (Wonka, Wimmer and Schmalstieg 2000, section 4) in the picture: from
/// an eye moved by m, something at depth z that is hidden by something at depth y shifts against it by f m (1/y − 1/z)
/// pixels. A vertex is nearly seen if within so many pixels, and at least one, the picture shows nothing or something
/// no nearer than the vertex: no triangle is missed for being smaller than a pixel. Of triangles longer than eight
/// pixels points between their vertices are asked too.
///
/// Of a triangle that is nearly seen, a side counts that turns to the camera or might turn to an eye near it
/// (SampleCamera::turn): a back where the pixel that lets it through shows a back, a front where it shows a front or
/// nothing (of models turned inside out the other way round). So beyond the rim of a closed object, where there are
/// only backs that nobody sees, none counts.
class TriangleSampler {
 public:
  /// `bounds` hold the vertices; labels number the triangles. Mesh and planes must outlive the sampler.
  TriangleSampler(RasterMesh const& mesh, TrianglePlanes const& planes, Eigen::AlignedBox3d const& bounds);
  /// Valid until the next call. `nearly` costs about as much as the picture.
  SeenTriangles const& sample(SampleCamera const& camera, Seen what);
  /// Calls use(x, y, triangle) for each pixel of the last picture that shows one.
  template <typename Use>
  void for_each_pixel(Use const& use) const {
    for (int y = 0; y < height_; ++y) {
      for (int x = 0; x < width_; ++x) {
        if (keys_[pixel(x, y)] != kNothing) use(x, y, ids_[pixel(x, y)]);
      }
    }
  }

 private:
  static constexpr float kNothing = -std::numeric_limits<float>::infinity();
  std::size_t pixel(int x, int y) const {
    return static_cast<std::size_t>(y) * static_cast<std::size_t>(stride_) + static_cast<std::size_t>(x);
  }
  void draw(SampleCamera const& camera);
  void find_in_picture(EyePoint const& eye);
  void find_nearly_seen(EyePoint const& eye, double turn);
  void find_windows(std::vector<float> const& keys, std::size_t count);
  void list_unhidden_backs();
  void find_passing();
  std::size_t nearest_pixel(std::int32_t x, std::int32_t y) const;
  bool passes(std::int32_t x, std::int32_t y, float key) const;
  bool nearly_seen(std::size_t triangle) const;

  RasterMesh const* mesh_;
  TrianglePlanes const* planes_;
  Eigen::AlignedBox3d bounds_;
  int width_ = 0, height_ = 0, stride_ = 0;
  float parallax_ = 0;  ///< pixels a unit of the key
  std::vector<PlacedVertex> vertices_;
  std::vector<float> keys_;
  std::vector<std::uint32_t> ids_;
  std::vector<std::vector<float>> farthest_;   ///< least key within 1, 2, 4, ... pixels
  std::size_t windows_ = 0;                    ///< how many of them there are
  std::size_t current_windows_ = 0;            ///< how many are those of the picture
  std::vector<std::uint32_t> backs_;           ///< triangles that turn their back and may be seen
  std::vector<float> back_keys_, front_keys_;  ///< infinity where a pixel shows no back; where it shows one
  std::vector<std::uint32_t> edge_on_;         ///< scratch: triangles in the picture
  bool mostly_backs_ = false;                  ///< the picture shows more backs than fronts: a model turned inside out
  std::vector<std::uint8_t> passes_;           ///< a vertex
  SeenTriangles seen_;
};

}  // namespace scanview
