#pragma once
#include <string>

#include "base/files.h"
#include "base/html.h"
#include "viewer/visibility/visibility_field.h"

namespace scanview {

/// What the papers show of a model (Meruvia 2001, figures 5 to 7; 2002, figures 4 to 7 and table 1).
struct VisibilityReport {
  ReportSection section;
  Json figures;
  std::string text;  ///< the tables, for a terminal
};

/// Culling rate and wrong pixels of eyes at 2 to 5 radii: with the options as given, against the exact limit (rays);
/// over the number of samples (id and patch, everything else as in the papers) and over the number of patches.
VisibilityReport visibility_report(PolygonModel const& model, std::string const& name, VisibilityOptions const& options,
                                   bool thorough, Context& context);

}  // namespace scanview
