#pragma once
#include <string>
#include <vector>

#include "base/context.h"
#include "base/files.h"
#include "base/html.h"
#include "cli/ldi_source.h"
#include "viewer/layered/ldi_renderer.h"

namespace scanview {

struct LdiReportOptions {
  LdiOptions build;
  LdiRenderOptions draw;
  std::vector<int> images;    ///< numbers of reference images, ascending; empty: those of the paper that there are
  int frames = 40;            ///< of the path
  int width = 0, height = 0;  ///< of a frame; 0: as large as the images
};

/// What the paper shows of its experiment (Chang 1998, charts 1 to 3, figures 7 to 11), for a tree of each number of
/// images, beside warping all of them.
struct LdiReport {
  ReportSection section;
  Json figures;
  std::string text;  ///< the table, for a terminal
};

/// Throws Error{usage} for numbers of images that the source does not have.
LdiReport ldi_report(LdiSource& source, LdiReportOptions const& options, Context& context);

}  // namespace scanview
