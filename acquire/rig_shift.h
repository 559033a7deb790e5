#pragma once
#include <functional>
#include <limits>
#include <opencv2/core/mat.hpp>
#include <string>

#include "acquire/rectification.h"
#include "acquire/soundness.h"
#include "base/context.h"
#include "base/files.h"

namespace scanview {

/// How far matches of two rectified pictures lie off their rows: the trace of a rig that moved since its calibration.
/// Over the left picture the offset is dy = offset + tilt (x - middle) / width + stretch (y - middle) / height.
struct RigShift {
  static constexpr double kNone = std::numeric_limits<double>::quiet_NaN();
  std::size_t points = 0;                             ///< textured places measured
  double median_px = kNone, median_std_px = kNone;    ///< right row minus left row
  double offset_px = kNone, offset_std_px = kNone;    ///< a turn up or down (pitch)
  double tilt_px = kNone, tilt_std_px = kNone;        ///< a turn about the viewing axis (roll)
  double stretch_px = kNone, stretch_std_px = kNone;  ///< a change of focal length or of the turn to the side
  double rms_px = kNone;                              ///< of the fitted dy over the points
  std::string warning;                                ///< a sentence where rms_px is above 0.3 and significant

  Json to_json() const;
};

/// A camera's picture, and where the pixels of its rectified one lie in it.
struct MappedPicture {
  cv::Mat1b const& picture;
  PictureMap const& map;
};

/// Measures it from texture: where the left picture has detail, the matched strip of the right one is shifted by rows
/// until it fits (normalised correlation over `most_px` rows up and down, then a least squares step), so neither gain
/// nor offset of brightness matters. `x_right(x, y)` is the column of the rectified right picture that shows that pixel
/// of the rectified left one, NaN where unknown; it is called from several threads. Only windows are looked at, some
/// thousand at most, which takes milliseconds whatever the pictures' size. Fewer than 30 places give points and NaN.
/// Throws Error{bad_input} where the rectified pictures differ in their number of rows.
RigShift measure_rig_shift(MappedPicture const& left, MappedPicture const& right,
                           std::function<float(int x, int y)> const& x_right, Context& context, int most_px = 4);

/// What the motion of a Gray capture explains is not blamed on the rig: texture comes from its first pictures, codes
/// from the later ones, so that each camera's motion moves matches off their rows by as much.
void reconcile(RigShift& shift, SoundnessFigures const& left, SoundnessFigures const& right);

}  // namespace scanview
