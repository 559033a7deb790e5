#pragma once
#include <Eigen/Geometry>
#include <optional>
#include <string>

#include "acquire/captured_node.h"
#include "base/context.h"
#include "mesh/polygon_model.h"
#include "synth/linear_color.h"
#include "synth/ray_scene.h"
#include "synth/surface_light.h"

namespace scanview {

struct ModelCameraOptions {
  /// baked: a diffuse light with shadows that is fixed to the model (SurfaceLight); painted: its colours and textures
  /// as they are.
  enum class Light { baked, painted } light = Light::baked;
  int samples_side = 4;                ///< rays a side of a pixel for colour, 1 to 64
  std::string background = kSkyColor;  ///< of what no ray meets, sRGB
  /// Of baked light; the defaults are for rooms. Here fill_reach is a share of the model's radius.
  SurfaceLightOptions surface = {.directions = 384, .exposure = 1.6f, .fill = 0.6f, .fill_reach = 0.1f};
  /// Throws Error{usage} naming the field and its range.
  void validate() const;
};

/// A model made ready once for ray-traced pictures from anywhere: a point has the same colour in all of them. Light is
/// computed when a picture first shows a surface, and kept; pictures do not depend on the order in which they are taken
/// or on the number of threads.
///
/// Some 10 million rays a second and core; light takes half of `directions` rays for every vertex that is seen, which
/// of fine models takes longer than the pictures. One call of capture or picture at a time.
class ModelCamera {
 public:
  /// With the model's textures; light that passes through triangles is stopped. Throws Error{usage} for bad options,
  /// Error{bad_input} for a model without triangles or extent.
  ModelCamera(PolygonModel model, ModelCameraOptions const& options, Context& context);
  ModelCamera(TriangleMesh model, ModelCameraOptions const& options, Context& context);
  ModelCamera(ModelCamera const&) = delete;
  ModelCamera& operator=(ModelCamera const&) = delete;

  /// What a perspective camera sees, exactly. A depth is where the ray through the pixel's centre meets the plane of
  /// the first triangle it hits, in double precision of the model's vertices; which triangle that is, is decided in
  /// single precision. sigma is a millionth of the depth, for that single precision. The colour is the mean in linear
  /// light of samples_side² rays; a pixel whose centre ray meets nothing is `background` and has the sky's colour.
  /// Throws Error{usage} for an orthographic camera.
  RangeImage capture(Camera const& camera, Eigen::Isometry3d const& scene_from_camera, Context& context);

  /// The colours alone. They are those of capture, but also where the centre ray meets nothing the mean of all rays.
  cv::Mat3b picture(Camera const& camera, Eigen::Isometry3d const& scene_from_camera, Context& context);

  /// The share of all directions (608, even) in which the first thing met is a triangle's back: above a half, the
  /// position is inside an object.
  double share_of_backs(Eigen::Vector3d const& position) const;
  /// The distance to the nearest surface in any of these directions; infinite where there is none.
  double clearance(Eigen::Vector3d const& position) const;

 private:
  struct Surroundings {
    double share_of_backs, clearance;
  };
  Surroundings look_around(Eigen::Vector3d const& position) const;
  double depth(RayHit const& hit, Eigen::Vector3d const& eye, Eigen::Vector3d const& direction,
               Eigen::Vector3d const& forward) const;
  Eigen::Vector3d corner(int triangle, int which) const;

  TriangleMesh mesh_;  // about origin_
  ModelTextures textures_;
  ModelCameraOptions options_;
  Eigen::Vector3d origin_;
  std::optional<RayScene> scene_;
  SurfacePaint paint_;
  std::optional<SurfaceLight> light_;  // none: painted
  float light_radius_ = 0;
  Eigen::Vector3f background_;
};

/// The six sides of a cube about a position, each of size x size pixels (captured_node.h). Throws Error{bad_input} that
/// names the position where it is inside an object.
CapturedNode capture_node(ModelCamera& camera, Eigen::Vector3d const& position, int size, std::string const& name,
                          Context& context);

}  // namespace scanview
