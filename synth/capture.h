#pragma once
#include <opencv2/core/mat.hpp>
#include <vector>

#include "base/context.h"
#include "base/random.h"
#include "mesh/triangle_mesh.h"
#include "synth/capture_layout.h"
#include "synth/capture_options.h"
#include "synth/capture_scene.h"
#include "synth/projected_light.h"
#include "synth/sensor.h"

namespace scanview {

enum class CaptureSide { left = 0, right = 1 };

/// What one camera took of one pose of the object.
struct CapturePictures {
  std::vector<cv::Mat> frames;  ///< gray, 8 or 16 bits, one a light position (of Gray code, white and black last)
  cv::Mat3b color;              ///< 8-bit sRGB, the room's lights on
};

/// What is exactly true of one pose, in the ideal left camera's pixels.
struct CaptureTruth {
  cv::Mat1f depth;    ///< of the object; NaN elsewhere
  cv::Mat1b visible;  ///< 255: the point at the pixel's centre is seen by both cameras and lit by the lamp
};

/// An active-light scanner that exists in numbers only: two cameras with lenses, a lamp that sweeps a plane of light
/// or projects Gray code, an object on a turntable. Rays are cast through 4 x 4 places of every pixel (Embree), each
/// brings back the light of what it meets, from the beam (Gaussian across; falls off with distance and angle; blocked
/// by whatever is between) and from the room, and the sensor turns their mean into a value. So a pixel on an edge
/// mixes two surfaces, and a pixel of a slanted one sees the beam pass more slowly, as in a real picture.
///
/// Same model, options and seed: same bytes, for any number of threads. Some 5 million rays a second and core.
class CaptureRig {
 public:
  /// `model` must outlive this. Throws Error{usage} for bad options, Error{bad_input} for a model without extent.
  CaptureRig(TriangleMesh const& model, CaptureOptions const& options, Context& context);

  CaptureOptions const& options() const { return options_; }
  CaptureLayout const& layout() const { return layout_; }
  Eigen::Vector3d const& center() const { return centered_.center; }  ///< of the model, object coordinates
  ProjectedLight const& light() const { return light_; }
  CaptureScene const& scene() const { return scene_; }
  Sensor const& sensor() const { return sensor_; }
  LensCamera const& camera(CaptureSide side) const;
  Eigen::Isometry3d room_from_camera(CaptureSide side) const;
  /// What a white surface that faces the lamp at the target's distance gives in the beam's middle, in sensor fills.
  double exposure() const { return exposure_; }

  /// The pictures of view 0 .. views - 1; -1: of the stage alone.
  CapturePictures take(int view, CaptureSide side, Context& context) const;
  CaptureTruth truth(int view, Context& context) const;

 private:
  double find_exposure(Context& context) const;
  /// Light by way of one other surface, once a pixel: it varies little within one.
  void bounce(int view, SceneSamples const& samples, std::array<Eigen::Vector3d, kPacket> const& directions,
              CounterRandom const& random, float* frames) const;
  void take_row(int view, CaptureSide side, int y, CapturePictures& pictures) const;
  CaptureOptions options_;
  CenteredModel centered_;
  CaptureLayout layout_;
  ProjectedLight light_;
  CaptureScene scene_;
  Sensor sensor_;
  std::uint64_t seed_;
  std::array<std::vector<Eigen::Vector2d>, 2> corners_;  // a side: rays through the pixels' corners (x/z, y/z)
  double exposure_ = 1;
};

/// The exact depth of a model along every ray of a camera, NaN where there is none.
cv::Mat1f true_depth(TriangleMesh const& model, Eigen::Isometry3d const& object_from_camera, Camera const& camera,
                     Context& context);

}  // namespace scanview
