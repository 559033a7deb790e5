#pragma once
#include <vector>

#include "base/html.h"
#include "calib/board_pictures.h"

namespace scanview {

/// The calibration in pictures: corners and residuals (enlarged) on every board, what part of the picture the corners
/// cover, the parameters with their deviations, boards that were rejected. Pictures are read again from their files.
ReportSection calibrate_section(Calibration const& calibration, std::vector<PicturePair> const& pairs);

}  // namespace scanview
