#pragma once
#include <string>
#include <vector>

#include "acquire/scan_set.h"
#include "base/context.h"
#include "mesh/triangle_mesh.h"
#include "synth/disturbed_pose.h"

namespace scanview {

/// Noise of the synthetic range camera, apart from the scene so that it can be turned off or swept.
struct SynthNoise {
  double depth_sigma = 0;  ///< of each depth along z, as a share of the object's radius
  double color_sigma = 0;  ///< of each 8-bit channel
};

struct SynthOptions {
  int views = 12;  ///< on a sphere around the object (Fibonacci spiral), or on a circle
  enum class Layout { sphere, circle } layout = Layout::sphere;
  double elevation_deg = 25;  ///< of a circle, -90 to 90; its first eye is in front (+z), the next ones towards +x
  int width = 640, height = 480;
  double distance = 4;      ///< of the eye from the centre, in radii of the object; below 1 it may be inside
  Disturbance disturbance;  ///< of every pose but the first
  SynthNoise noise;
  /// Throws Error{usage} naming the field and its range.
  void validate() const;
};

struct SynthResult {
  ScanSet set;                                ///< what a scanner would have given; unit mm
  std::vector<Eigen::Isometry3d> true_poses;  ///< object_from_camera
  std::vector<cv::Mat1f> true_depth;          ///< without noise; NaN where no surface is
  double radius = 0;                          ///< of the bounding sphere about set.center, mm
};

/// The share of the radius that every depth is uncertain by, besides the noise that was asked for: what a real
/// scanner's quantisation leaves. It keeps `sigma` above zero.
inline constexpr double kSynthDepthFloor = 1e-4;

/// A synthetic scanner: casts rays (Embree) at a model, shades it by its vertex colours (pale plaster where it has
/// none) and a light that is fixed to the object, so that a point has the same colour in all views, and adds noise.
/// Truth never comes from our own rasteriser.
///
/// Object coordinates are the model's, y up, one unit a mm. Every camera looks at the model's centre; all have the same
/// focal length, the longest with which the model stays within every picture (106° of view at most). A depth is where
/// the ray through the pixel's centre meets the plane of the first triangle it hits, exactly; the colour is the mean in
/// linear light of 4 × 4 rays in the pixel. Both sides of a triangle are seen, so the winding does not matter. `sigma`
/// is the noise plus kSynthDepthFloor; views are named 000, 001, ...
///
/// Throws Error{bad_input} for a model without any extent. Same seed, same bytes, for any number of threads.
/// 33 rays a pixel and about fifty for every vertex that is seen; some 5 to 10 million rays a second and core.
SynthResult synthesize(TriangleMesh const& model, SynthOptions const& options, Context& context);

/// Built-in procedural models, coloured per vertex, y up: "dog", "basket" and "statuette", objects of about 100 units
/// (mm) with concavities, thin parts and holes, finely enough for their colours to serve as texture; "gallery", rooms
/// to walk through in metres (gallery.h), of 100 000 triangles, and "church", an interior in metres (church.h), of 200
/// 000; "gallery:N" and "church:N" have about N. Throws Error{usage} for an unknown name or an N out of range.
TriangleMesh builtin_model(std::string const& name);
std::vector<std::string> builtin_model_names();
/// Whether builtin_model means the name: one of builtin_model_names, gallery:N or church:N.
bool is_builtin_model(std::string const& name);

}  // namespace scanview
