#pragma once
#include <string>
#include <vector>

#include "acquire/scan_set.h"
#include "base/context.h"
#include "mesh/triangle_mesh.h"

namespace scanview {

/// Noise of the synthetic range camera, apart from the scene so that it can be turned off or swept.
struct SynthNoise {
  double depth_sigma = 0;        ///< of each depth along z, as a share of the object's radius
  double color_sigma = 0;        ///< of each 8-bit channel
};

struct SynthOptions {
  int views = 12;                 ///< on a sphere around the object (Fibonacci spiral), or on a circle
  enum class Layout { sphere, circle } layout = Layout::sphere;
  double elevation_deg = 25;      ///< of a circle
  int width = 640, height = 480;
  double distance = 4;            ///< of the eye from the centre, in radii of the object
  double disturb_deg = 0;         ///< every pose but the first is turned by so much about a random axis through the centre
  double disturb_share = 0;       ///< and moved by this share of the object's size in a random direction
  SynthNoise noise;
  void validate() const;
};

struct SynthResult {
  ScanSet set;                                      ///< what a scanner would have given; unit mm
  std::vector<Eigen::Isometry3d> true_poses;        ///< object_from_camera
  std::vector<cv::Mat1f> true_depth;                ///< without noise
};

/// A synthetic scanner: casts a ray a pixel (Embree) at a model, shades it by vertex colours and a fixed diffuse light, adds noise.
/// Truth never comes from our own rasteriser. Same seed, same bytes.
SynthResult synthesize(TriangleMesh const& model, SynthOptions const& options, Context& context);

/// Built-in procedural objects, coloured per vertex, finely enough to serve as texture: "statuette" (concavities, thin
/// parts, a hole; about 100 mm tall, y up). Throws Error{usage} for an unknown name.
TriangleMesh builtin_model(std::string const& name);
std::vector<std::string> builtin_model_names();

}  // namespace scanview
