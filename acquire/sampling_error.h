#pragma once
#include "acquire/scan_set.h"

namespace scanview {

/// The set's sampling error as its depths say it: RMS and 95th percentile of sigma over all of them (thinned to about a
/// million). NaN where there are none.
ErrorPart sampling_error(ScanSet const& set);

}  // namespace scanview
