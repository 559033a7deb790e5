#pragma once
#include <Eigen/Core>
#include <array>
#include <atomic>
#include <cstdint>
#include <string>
#include <vector>

#include "base/context.h"
#include "synth/ray_scene.h"
#include "synth/surface_paint.h"

namespace scanview {

/// How a surface is lit beyond what is always so.
struct SurfaceLightOptions {
  int directions = 96;   ///< that light comes from, all around; a multiple of 16
  float exposure = 1;    ///< 1: a white surface in the open that faces the lamp is just clipped
  float fill = 0;        ///< light by way of other surfaces: from a far one this share of what comes from the open
  float fill_reach = 1;  ///< a surface at this distance brings half of that, nearer ones less; model units
};

/// The light that leaves a model's surface, linear R G B in [0, 1], the same in all directions (diffuse), so that a
/// point looks the same from every camera: a soft lamp above, a bright sky, a dim ground, each direction blocked by
/// whatever the model holds before it (so hollows are darker). The light is fixed to the model (y up).
///
/// Corners whose triangles meet within 40° share a normal; sharper edges stay sharp. Only what was marked as seen is
/// lit, for it takes half as many rays a vertex as there are directions, and once only.
class SurfaceLight {
 public:
  /// `vertices` and `triangles` are those of `scene` and must outlive this; `colors` as in TriangleMesh, or empty for
  /// pale plaster.
  SurfaceLight(std::vector<Eigen::Vector3f> const& vertices, std::vector<Eigen::Vector3i> const& triangles,
               std::vector<cv::Vec3b> const& colors, SurfaceLightOptions const& options = {})
      : SurfaceLight(vertices, triangles, SurfacePaint(triangles, colors), options) {}
  SurfaceLight(std::vector<Eigen::Vector3f> const& vertices, std::vector<Eigen::Vector3i> const& triangles,
               SurfacePaint const& paint, SurfaceLightOptions const& options);

  /// Notes that a triangle is seen by a ray of this direction. May be called from several threads.
  void mark_seen(int triangle, Eigen::Vector3f const& direction);
  /// Whether all that such a ray shows is lit.
  bool is_lit(int triangle, Eigen::Vector3f const& direction) const;
  /// Lights all that was marked since the last call; what is lit stays as it is. The result is the same in whatever
  /// order and portions things are marked. `radius`: surfaces nearer than 0.002 of it do not shade each other.
  /// Progress under the name `stage`, if any.
  void light(RayScene const& scene, float radius, Context& context, std::string const& stage = {});
  /// Light that leaves towards the ray's origin; black where it was not lit.
  Eigen::Vector3f leaving(RayHit const& hit, Eigen::Vector3f const& direction) const;
  /// The smooth normal that the shading uses, unit, towards the ray's origin (zero on a degenerate triangle).
  Eigen::Vector3f normal(RayHit const& hit, Eigen::Vector3f const& direction) const;
  SurfacePaint const& paint() const { return paint_; }

 private:
  /// A vertex as seen by the triangles around it that share a smooth normal.
  struct Point {
    int vertex = 0;
    Eigen::Vector3f face_normal = Eigen::Vector3f::Zero();  // of the first of them, unit
    Eigen::Vector3f normal_sum = Eigen::Vector3f::Zero();   // weighted by area
    int next = -1;                                          // further points of the same vertex
  };
  enum Side { front = 0, back = 1 };  // counter-clockwise is front
  enum class State : std::uint8_t { unseen, seen, lit };
  Side side_seen(int triangle, Eigen::Vector3f const& direction) const;
  void gather_points();

  std::vector<Eigen::Vector3f> const& vertices_;
  std::vector<Eigen::Vector3i> const& triangles_;
  SurfacePaint paint_;
  SurfaceLightOptions options_;
  std::vector<Point> points_;
  std::vector<Eigen::Vector3i> corners_;                   // a triangle: its three points
  std::array<std::vector<std::atomic<State>>, 2> states_;  // a side: of each point
  std::vector<std::atomic<bool>> has_new_;                 // kChunk points each: some are marked and not lit
  std::array<std::vector<Eigen::Vector3f>, 2> light_;      // a side: of each point
};

}  // namespace scanview
