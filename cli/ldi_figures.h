#pragma once
#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "base/context.h"
#include "base/files.h"
#include "viewer/layered/ldi_builder.h"
#include "viewer/layered/ldi_renderer.h"
#include "viewer/walkthrough/policy_figures.h"

namespace scanview {

/// A tree and what made it.
struct BuiltLdi {
  LdiBuilder builder;
  std::shared_ptr<LdiTree const> tree;
  double seconds = 0;  ///< for both steps
};
BuiltLdi build_ldi(std::vector<View> const& views, Unit unit, LdiOptions const& options, Context& context);

/// cells, bytes, input_bytes, pixels, levels: the keys of --report that describe a tree.
Json ldi_size(LdiTree const& tree);

/// Of pictures against references; NaN without references.
struct PictureQuality {
  double psnr = 0;         ///< dB, mean of the pictures'; what was not drawn is black
  double psnr_common = 0;  ///< the same where both a tree (its gaps not filled) and warping drew
  double coverage = 0;     ///< share of the reference's pixels that were drawn (without references: of all)
};

/// What a tree of so many reference images costs and gives (Chang 1998, charts 1 to 3), beside warping them all.
struct LdiFigures {
  int images = 0;
  Json size;  ///< ldi_size()
  double build_seconds = 0;
  // Of each frame of the path; times with gaps filled, the faster of two.
  std::vector<double> milliseconds, cells_traversed, splats;
  PictureQuality open, filled;  ///< gaps left, and filled; psnr_common is of `open`
  PictureQuality warped;
  double warped_milliseconds = 0;  ///< median
  Json to_json() const;
};

/// Times along the path, quality against the references (where there are none: coverage along the path). The time to
/// build is not known here.
LdiFigures measure_ldi(std::shared_ptr<LdiTree const> const& built, std::vector<View> const& views,
                       std::vector<PathCamera> const& path, std::vector<ReferenceFrame> const& references,
                       LdiRenderOptions const& options, Context& context);

/// On one colour, where a frame is transparent.
cv::Mat3b on_background(cv::Mat4b const& picture, cv::Vec3b const& background);

}  // namespace scanview
