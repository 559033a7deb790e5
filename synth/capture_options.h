#pragma once
#include <string>
#include <vector>

namespace scanview {

/// The light that a capture projects.
struct LightOptions {
  enum class Pattern { sweep, gray } pattern = Pattern::sweep;
  int steps = 96;  ///< light positions of a sweep
  /// Standard deviation of the beam across, mm at the object's centre. 0: `beam_steps` decides, and where that is 0
  /// too, 0.8 / 96 of the sweep's length: the lamp stays the same when it makes more or fewer steps.
  double beam_mm = 0;
  double beam_steps = 0;                               ///< the same in steps
  int projector_width = 1024, projector_height = 768;  ///< of Gray code
  bool rows = false;                                   ///< Gray code of the rows as well, after the columns
  double blur = 0.5;                                   ///< of a projector pixel, standard deviation, projector pixels
};

/// Where the scene departs from diffuse surfaces in one light.
struct SceneOptions {
  double ambient = 0.05;       ///< light that is always there, as a share of what the beam brings at its brightest
  double gloss = 0;            ///< share of light that a glossy lobe sends back (Blinn-Phong, normalised)
  double gloss_exponent = 60;  ///< of the lobe: large is narrow
  double interreflection = 0;  ///< 1: the light's first bounce between surfaces as physics has it; 0: none
  bool stage = true;           ///< a turntable and a backdrop are there
  std::string backdrop = "#3050a0";  ///< the paint of both, sRGB
};

/// The cameras' sensors. A pixel collects electrons in proportion to its light; they vary by the square root of their
/// number (shot noise, taken as normal) and by the read noise; the sum is cut at 0 and at full scale and rounded.
struct SensorOptions {
  double full_scale_electrons = 10000;  ///< at the largest value; 0: no noise
  double read_electrons = 10;
  int bits = 8;         ///< 8 or 16
  double gamma = 1;     ///< value = light^(1 / gamma); 1: linear
  double exposure = 1;  ///< 1: the brightest diffuse surface peaks at kPeakShare of full scale; 2: twice as much
};
inline constexpr double kPeakShare = 0.85;

/// What may go wrong while a capture is taken.
struct CaptureFaults {
  enum class Side { both, left, right } side = Side::both;  ///< whose frames are dropped, doubled, swapped
  int drop = -1;             ///< this frame is lost: later ones move up, the sweep's next position comes last
  int repeat = -1;           ///< this frame comes twice: later ones move down, the last is lost
  int swap = -1;             ///< this frame and the next change places
  double flicker = 0;        ///< standard deviation of the lamp's brightness from frame to frame, as a share
  double jitter = 0;         ///< standard deviation of the beam's position, steps
  double rig_moved_deg = 0;  ///< the right camera was turned by so much after it had been calibrated
};

struct CaptureOptions {
  int views = 12;  ///< up to 5: around; more: a sixth each tilted towards and away from the cameras, the others around
  int width = 640, height = 480;
  double baseline_deg = 22;  ///< angle between the cameras as seen from the object
  int boards = 12;           ///< pairs of pictures of a chessboard
  LightOptions light;
  SceneOptions scene;
  SensorOptions sensor;
  CaptureFaults faults;
  /// Throws Error{usage} naming the field and its range.
  void validate() const;
};

}  // namespace scanview
