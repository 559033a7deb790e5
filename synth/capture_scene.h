#pragma once
#include <Eigen/Geometry>
#include <array>
#include <limits>
#include <memory>
#include <vector>

#include "base/context.h"
#include "mesh/triangle_mesh.h"
#include "synth/capture_layout.h"
#include "synth/contact_shade.h"
#include "synth/projected_light.h"
#include "synth/ray_scene.h"
#include "synth/surface_light.h"

namespace scanview {

/// What a camera's ray meets. `weight` is the light that goes back along the ray while the lamp's beam is on the point,
/// relative to a white surface that faces the lamp at the target's distance; 0 in its shadow.
struct SceneSample {
  bool is_object = false;
  LightPoint light;
  Eigen::Vector3d point = Eigen::Vector3d::Zero();   ///< room
  Eigen::Vector3d normal = Eigen::Vector3d::Zero();  ///< of the triangle, unit, towards the eye; zero: nothing was met
  float albedo = 0;                                  ///< luminance of the diffuse reflectance
  float weight = 0;                                  ///< diffuse
  float gloss = 0;                                   ///< the glossy lobe's, on the same scale
  Eigen::Vector3f room = Eigen::Vector3f::Zero();    ///< with the room's lights on, linear R G B
};
using SceneSamples = std::array<SceneSample, kPacket>;

/// The object in one of its poses, on the stage or alone, or the stage alone; cameras and lamp at their places.
/// All queries may be called from several threads at once.
class CaptureScene {
 public:
  /// All references must outlive this. Lights the whole model: some fifty rays a vertex.
  CaptureScene(TriangleMesh const& model, CenteredModel const& centered, CaptureLayout const& layout,
               SceneOptions const& options, Context& context);

  /// What each of a pixel's rays meets; `view` < 0: the empty scene. Directions of any length, in the room.
  SceneSamples look(int view, Eigen::Vector3d const& eye, std::array<Eigen::Vector3d, kPacket> const& directions,
                    ProjectedLight const& light) const;

  /// Where a ray meets the object alone.
  struct ObjectPoint {
    double distance = std::numeric_limits<double>::quiet_NaN();  ///< in lengths of the direction, exact; NaN: nowhere
    Eigen::Vector3d point = Eigen::Vector3d::Zero();             ///< room
    Eigen::Vector3d normal = Eigen::Vector3d::Zero();            ///< of the triangle, unit, towards the eye
  };
  ObjectPoint meet(int view, Eigen::Vector3d const& eye, Eigen::Vector3d const& direction) const;
  /// Whether the triangle faces a place and nothing of the object is between.
  bool is_open_to(int view, ObjectPoint const& point, Eigen::Vector3d const& place) const;

  /// How far from a surface rays start that must not meet it again, mm.
  double off_surface() const;

 private:
  Eigen::Vector3f face_normal(int triangle) const;
  void look_at_object(SceneSample& sample, RayHit const& hit, Eigen::Vector3d const& direction, int view) const;
  void look_at_stage(SceneSample& sample, RayHit const& hit, Eigen::Vector3d const& direction, int view) const;
  /// Takes the lamp's light from what lies in its shadow.
  void cast_shadows(int view, SceneSamples& samples) const;
  TriangleMesh const& model_;
  CenteredModel const& centered_;
  CaptureLayout const& layout_;
  SceneOptions options_;
  RayScene object_;
  SurfaceLight surface_;
  std::unique_ptr<RayScene> stage_;  // none: without one
  Eigen::Vector3f paint_;
  Eigen::Vector3d lamp_;
  double lamp_distance_ = 1;
  std::vector<Eigen::Isometry3d> model_from_room_;  // of each view, about the model's centre
  std::vector<ContactShade> contact_;               // of each view, where there is a stage
};

}  // namespace scanview
