#pragma once
#include <Eigen/Geometry>
#include <cstdint>
#include <string>
#include <vector>

#include "synth/capture_layout.h"
#include "synth/capture_options.h"

namespace scanview {

/// Where the lamp's rays through a point lie: of a sweep, the frame at which the beam's middle is there (fractional;
/// `row` is unused); of Gray code, the projector's column and row (integers are the pixels' centres).
struct LightPoint {
  float column = 0, row = 0;
};

/// What the lamp throws on the scene in each frame, without distance, angle and shadow.
class ProjectedLight {
 public:
  ProjectedLight(CaptureLayout const& layout, CaptureOptions const& options, std::uint64_t seed);

  /// How many frames there are; those of Gray code end with white and black.
  int frames() const { return frames_; }
  /// The frame's file name without its ending: "0000" ..., "white", "black".
  std::string frame_name(int frame) const;
  /// How many of the frames carry the code (all but white and black).
  int code_frames() const;
  LightPoint at(Eigen::Vector3d const& p_room) const;
  /// Adds the light that a point gets in every frame, times `weight`, to frames[0 .. frames()): 1 is the beam's middle.
  void add(LightPoint const& point, float weight, float* frames) const;
  /// Standard deviation of the beam in steps (sweep).
  double beam_steps() const { return beam_steps_; }

 private:
  void make_gray_tables(LightOptions const& options);
  LightOptions::Pattern pattern_;
  bool rows_ = false;
  int frames_ = 0, width_ = 0, height_ = 0;
  Eigen::Isometry3d light_from_room_;
  double low_ = 0, step_ = 0, beam_steps_ = 0;  // sweep: angles in rad
  double focal_ = 0, center_ = 0;               // Gray code: projector pixels
  std::vector<float> offset_, gain_;            // of each frame: jitter in steps, flicker
  float reach_ = 0;                             // of the beam with its jitter, steps
  std::vector<std::vector<float>> columns_,
      row_tables_;  // a frame of Gray code: light along the projector, kFine a pixel
};

/// What each file holds where frames were lost, doubled or swapped: the index of the frame that was taken, for each
/// of `frames` files; `frames` itself is a position beyond the sweep, which lights nothing.
std::vector<int> frame_order(CaptureFaults const& faults, int frames, CaptureFaults::Side side);

}  // namespace scanview
