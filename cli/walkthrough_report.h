#pragma once
#include <string>

#include "base/context.h"
#include "base/files.h"
#include "base/html.h"
#include "viewer/walkthrough/policy_figures.h"

namespace scanview {

/// What the paper shows of its experiment (Darsa 1998, figures 21 to 24): error by policy for each frame and on
/// average, and the time of a frame.
struct WalkthroughReport {
  ReportSection section;
  Json figures;
  std::string text;  ///< the table, for a terminal
};

WalkthroughReport walkthrough_report(WalkthroughRenderer& renderer, std::vector<ReferenceFrame> const& frames,
                                     int samples_side, Context& context);

}  // namespace scanview
