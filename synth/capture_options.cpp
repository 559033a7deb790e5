#include "synth/capture_options.h"

#include "base/error.h"
#include "synth/linear_color.h"

namespace scanview {
namespace {

void require(bool good, char const* what) {
  if (!good) throw Error(ErrorCode::usage, {}, what);
}

bool within(double value, double low, double high) { return value >= low && value <= high; }

}  // namespace

void CaptureOptions::validate() const {
  require(within(views, 1, 1000), "views: must be 1 to 1000");
  require(within(width, 16, 8192), "width: must be 16 to 8192");
  require(within(height, 16, 8192), "height: must be 16 to 8192");
  require(within(baseline_deg, 0.1, 90), "baseline_deg: must be 0.1 to 90");
  require(within(boards, 0, 1000), "boards: must be 0 to 1000");
  require(within(light.steps, 3, 4096), "light.steps: must be 3 to 4096");
  require(within(light.beam_mm, 0, 1e6), "light.beam_mm: must be 0 (default) to 1000000");
  require(within(light.beam_steps, 0, 1000), "light.beam_steps: must be 0 (default) to 1000");
  require(within(light.projector_width, 2, 16384), "light.projector_width: must be 2 to 16384");
  require(within(light.projector_height, 2, 16384), "light.projector_height: must be 2 to 16384");
  require(within(light.blur, 0, 100), "light.blur: must be 0 to 100 projector pixels");
  require(within(scene.ambient, 0, 10), "scene.ambient: must be 0 to 10");
  require(within(scene.gloss, 0, 1), "scene.gloss: must be 0 to 1");
  require(within(scene.gloss_exponent, 1, 1e5), "scene.gloss_exponent: must be 1 to 100000");
  require(within(scene.interreflection, 0, 10), "scene.interreflection: must be 0 to 10");
  linear_from_hex(scene.backdrop);
  require(within(sensor.full_scale_electrons, 0, 1e9), "sensor.full_scale_electrons: must be 0 (no noise) to 1e9");
  require(within(sensor.read_electrons, 0, 1e6), "sensor.read_electrons: must be 0 to 1e6");
  require(sensor.bits == 8 || sensor.bits == 16, "sensor.bits: must be 8 or 16");
  require(within(sensor.gamma, 0.1, 10), "sensor.gamma: must be 0.1 to 10");
  require(within(sensor.exposure, 1e-4, 1e4), "sensor.exposure: must be 0.0001 to 10000");
  require(within(faults.flicker, 0, 1), "faults.flicker: must be 0 to 1");
  require(within(faults.jitter, 0, 100), "faults.jitter: must be 0 to 100 steps");
  require(within(faults.rig_moved_deg, 0, 45), "faults.rig_moved_deg: must be 0 to 45");
  bool const frame_faults = faults.drop >= 0 || faults.repeat >= 0 || faults.swap >= 0 || faults.jitter > 0;
  require(!frame_faults || light.pattern == LightOptions::Pattern::sweep,
          "faults: lost, doubled or swapped frames and jitter belong to a sweep");
  require(faults.drop < light.steps && faults.repeat < light.steps && faults.swap < light.steps - 1,
          "faults: no such frame");
}

}  // namespace scanview
