#pragma once
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "acquire/capture.h"
#include "acquire/code_image.h"
#include "acquire/scan_set.h"
#include "base/context.h"
#include "base/files.h"

namespace scanview {

struct AcquireOptions {
  enum class Decoder { space_time, stripe } decoder = Decoder::space_time;  ///< of a sweep
  std::filesystem::path rig;  ///< instead of the capture's own; relative to where the program runs
  bool refine_focal = false;  ///< without a rig: also the focal length of both cameras (see relative_pose.h)
  bool use_rows = true;       ///< row bits, where there are some, check matches
  double row_tolerance = 2;   ///< a match whose rows differ by more is inconsistent
  double min_depth = 0;       ///< depths outside are dropped, in the rig's unit
  double max_depth = std::numeric_limits<double>::infinity();
  bool remove_background = true;     ///< by the empty scene and the backdrop's colour, where the capture has them
  double backdrop_tolerance = 0.06;  ///< distance of a colour's chromaticity (r, g) from the backdrop's
  /// Throws Error{usage} naming the field and its range.
  void validate() const;
};

/// What was measured of one view. Pairs are left and right.
struct AcquiredView {
  std::string name;
  std::size_t depths = 0;              ///< after background removal
  std::size_t decodable = 0;           ///< left pixels with a code
  std::size_t ambiguous = 0;           ///< of them with several partners that may be right
  std::size_t background_removed = 0;  ///< pixels that had a depth
  double sheet_scatter = 0;            ///< of matches about the light's geometry, in codes; 0: it could not be told
  std::size_t row_pairs = 0;           ///< matches of which both cameras know the projector's row,
  std::size_t row_off_2 = 0, row_off_4 = 0;   ///< and of them those whose rows differ by more than 2, by more than 4
  double sigma_median = 0;                    ///< in the set's unit
  double angle_deg = 0;                       ///< median angle at which the two rays meet
  std::array<double, 2> beam_sigma = {0, 0};  ///< in light steps (sweep)
  std::array<double, 2> noise_read = {0, 0}, noise_gain = {0, 0};  ///< variance of a pixel: read + gain · value
  Json soundness;                                                  ///< left, right, rig: soundness.h, rig_shift.h
  std::vector<std::string> warnings;                               ///< whole sentences
};

struct AcquireResult {
  ScanSet set;
  StereoRig rig;
  Json relative_pose;  ///< where the rig came from the light alone: relative_pose.h; else null
  std::vector<AcquiredView> views;
  std::vector<std::filesystem::path> files_read;  ///< everything that decided the result, for hashes
};

/// A capture becomes views with depth, sigma and colour, all in the ideal left camera (as the left one, its lens
/// distortion removed). Views are worked on at once; frames stream, so memory does not grow with their number.
/// Throws Error{bad_input} naming the picture that is missing, damaged or of another size, and Error{no_solution} where
/// the geometry allows no depth (cameras in line, light along the epipolar lines).
AcquireResult acquire(Capture const& capture, AcquireOptions const& options, Context& context);

}  // namespace scanview
