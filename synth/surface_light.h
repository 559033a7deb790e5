#pragma once
#include <Eigen/Core>
#include <array>
#include <atomic>
#include <vector>

#include "base/context.h"
#include "mesh/triangle_mesh.h"
#include "synth/ray_scene.h"

namespace scanview {

/// The light that leaves a model's surface, linear R G B in [0, 1], the same in all directions (diffuse), so that a
/// point looks the same from every camera: a soft lamp above, a bright sky, a dim ground, each direction blocked by
/// whatever the model holds before it (so hollows are darker). The light is fixed to the model (y up).
///
/// Corners whose triangles meet within 40° share a normal; sharper edges stay sharp. Only what was marked as seen is
/// lit, for it takes some fifty rays a vertex.
class SurfaceLight {
 public:
  /// `vertices` and `triangles` are those of `scene` and must outlive this; `colors` as in TriangleMesh, or empty for
  /// pale plaster.
  SurfaceLight(std::vector<Eigen::Vector3f> const& vertices, std::vector<Eigen::Vector3i> const& triangles,
               std::vector<cv::Vec3b> const& colors);

  /// Notes that a triangle is seen by a ray of this direction. May be called from several threads.
  void mark_seen(int triangle, Eigen::Vector3f const& direction);
  /// Lights all that is marked.
  void light(RayScene const& scene, float radius, Context& context);
  /// Light that leaves towards the ray's origin; black where it was not lit.
  Eigen::Vector3f leaving(RayHit const& hit, Eigen::Vector3f const& direction) const;
  /// The smooth normal that the shading uses, unit, towards the ray's origin (zero on a degenerate triangle).
  Eigen::Vector3f normal(RayHit const& hit, Eigen::Vector3f const& direction) const;
  /// The share of light that the surface sends back, linear R G B.
  Eigen::Vector3f albedo(RayHit const& hit) const;

 private:
  /// A vertex as seen by the triangles around it that share a smooth normal.
  struct Point {
    int vertex = 0;
    Eigen::Vector3f face_normal = Eigen::Vector3f::Zero();  // of the first of them, unit
    Eigen::Vector3f normal_sum = Eigen::Vector3f::Zero();   // weighted by area
    int next = -1;                                          // further points of the same vertex
  };
  enum Side { front = 0, back = 1 };  // counter-clockwise is front
  Side side_seen(int triangle, Eigen::Vector3f const& direction) const;
  void gather_points();

  std::vector<Eigen::Vector3f> const& vertices_;
  std::vector<Eigen::Vector3i> const& triangles_;
  std::vector<cv::Vec3b> const& colors_;
  std::vector<Point> points_;
  std::vector<Eigen::Vector3i> corners_;                // a triangle: its three points
  std::array<std::vector<std::atomic<bool>>, 2> seen_;  // a side: which points
  std::array<std::vector<Eigen::Vector3f>, 2> light_;   // a side: of each point
};

}  // namespace scanview
