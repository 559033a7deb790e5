#include "viewer/layered/ldi_renderer.h"

#include <algorithm>
#include <atomic>
#include <chrono>
#include <cmath>
#include <opencv2/core.hpp>
#include <utility>

#include "base/error.h"
#include "base/parallel.h"

namespace scanview {
namespace {

double now() {
  return std::chrono::duration<double, std::milli>(std::chrono::steady_clock::now().time_since_epoch()).count();
}

/// Of a pixel that is no gap.
std::uint32_t least_alpha(LdiRenderOptions const& options) {
  return static_cast<std::uint32_t>(std::ceil(255 * options.covered));
}

}  // namespace

void LdiRenderOptions::validate() const {
  if (!(stamp_px >= 0.25 && stamp_px <= 64)) throw Error(ErrorCode::usage, {}, "stamp_px: must be 0.25 to 64");
  if (!(covered > 0 && covered <= 1)) throw Error(ErrorCode::usage, {}, "covered: must be above 0, at most 1");
}

LdiRenderer::LdiRenderer(std::shared_ptr<LdiTree const> tree, LdiRenderOptions const& render_options, int threads)
    : options(render_options), tree_(std::move(tree)) {
  options.validate();
  context_.threads = threads;
}

void LdiRenderer::begin(Camera const& camera, Eigen::Isometry3d const& object_from_camera) {
  options.validate();
  camera_ = camera;
  object_from_camera_ = object_from_camera;
  lasting_.begin(camera, object_from_camera);
  has_passing_ = false;
  traversed_.clear();
  postponed_.clear();
  splats_ = filling_splats_ = gaps_ = uncovered_ = 0;
  damaged_.clear();
  until_px_ = 0;
  steps_ = 0;
  is_complete_ = is_rough_ = false;
  stages_.clear();
}

std::size_t LdiRenderer::draw_on(SplatCanvas& canvas, std::vector<CellPart> const& parts, cv::Mat1b const& stencil) {
  std::size_t const splats = canvas.draw(*tree_, parts, stencil, context_);
  damaged_.insert(canvas.damaged().begin(), canvas.damaged().end());
  return splats;
}

/// Pixels that stay go to the lasting canvas, those that finer ones will replace to the passing one; patches when all
/// else has been drawn.
void LdiRenderer::draw(std::vector<TraversedCell> const& cells) {
  std::vector<CellPart> lasting, passing;
  postponed_.clear();
  for (TraversedCell const& at : cells) {
    lasting.push_back({at.cell, LdiKind::unfiltered});
    if (at.postponed) {
      postponed_.push_back(at);
      passing.push_back({at.cell, LdiKind::filtered});
    } else if (!at.descended) {
      lasting.push_back({at.cell, LdiKind::filtered});
    }
  }
  traversed_.insert(traversed_.end(), cells.begin(), cells.end());
  is_rough_ = false;
  is_complete_ = postponed_.empty();
  if (is_complete_)
    for (TraversedCell const& at : traversed_) lasting.push_back({at.cell, LdiKind::patch});
  splats_ += draw_on(lasting_, lasting, {});
  has_passing_ = !passing.empty();
  if (has_passing_) {
    passing_.begin(camera_, object_from_camera_);
    splats_ += draw_on(passing_, passing, {});
  }
}

bool LdiRenderer::refine() {
  if (is_complete_) return false;
  double const start = now();
  bool const blended = options.splats == LdiRenderOptions::Splats::blended;
  TraversalOptions how;
  how.stamp_px = options.stamp_px;
  if (steps_ == 0 || !blended) {
    if (steps_ == 0) how.stamp_px = std::max(kFirstPx, options.stamp_px);
    rough_ = draw_squares(traverse(*tree_, camera_, object_from_camera_, how));
    is_complete_ = steps_ > 0;
  } else {
    refine_blended(how);
  }
  stages_["draw"] += now() - start;
  step_milliseconds_.resize(std::max(step_milliseconds_.size(), static_cast<std::size_t>(steps_ + 1)));
  step_milliseconds_[static_cast<std::size_t>(steps_++)] = now() - start;
  return !is_complete_;
}

void LdiRenderer::refine_blended(TraversalOptions how) {
  if (steps_ == 1) {
    traversed_.clear();
    splats_ = 0;
    how.until_px = until_px_ = std::max(kFirstPx, options.stamp_px);
    draw(traverse(*tree_, camera_, object_from_camera_, how));
    return;
  }
  how.until_px = until_px_ = std::max(until_px_ / 2, options.stamp_px);
  for (TraversedCell& at : traversed_)
    if (at.postponed) at.postponed = false, at.descended = true;
  draw(traverse_below(*tree_, std::vector<TraversedCell>(postponed_), camera_, object_from_camera_, how));
}

Frame LdiRenderer::picture() {
  // A caller may paint on what it got: asked again, squares are drawn again.
  if (is_rough_ && rough_.color.empty()) rough_ = draw_squares(std::vector<TraversedCell>(traversed_));
  if (is_rough_) return std::exchange(rough_, {});
  double const begun = now();
  double start = begun;
  Frame frame;
  filling_splats_ = 0;
  gaps_ = uncovered_ = lasting_.compose(has_passing_ ? &passing_ : nullptr, least_alpha(options), frame, context_);
  stages_["compose"] += now() - start;
  start = now();
  fill_gaps(frame);
  stages_["fill"] += now() - start;
  finish_milliseconds_ = now() - begun;
  return frame;
}

Frame LdiRenderer::render(Camera const& camera, Eigen::Isometry3d const& object_from_camera) {
  begin(camera, object_from_camera);
  double start = now();
  TraversalOptions how;
  how.stamp_px = options.stamp_px;
  auto const cells = traverse(*tree_, camera_, object_from_camera_, how);
  stages_["traverse"] = now() - start;
  start = now();
  if (options.splats == LdiRenderOptions::Splats::squares) {
    Frame frame = draw_squares(cells);
    rough_ = {};
    is_complete_ = true;
    stages_["draw"] = now() - start;
    return frame;
  }
  draw(cells);
  stages_["draw"] = now() - start;
  return picture();
}

Frame LdiRenderer::draw_squares(std::vector<TraversedCell> const& cells) {
  std::vector<CellPart> parts;
  for (TraversedCell const& at : cells) {
    parts.push_back({at.cell, LdiKind::unfiltered});
    if (!at.descended) parts.push_back({at.cell, LdiKind::filtered});
    parts.push_back({at.cell, LdiKind::patch});
  }
  traversed_ = cells;
  is_rough_ = true;
  filling_splats_ = 0;
  Frame frame;
  splats_ = squares_.draw(*tree_, parts, camera_, object_from_camera_, frame, context_);
  damaged_ = squares_.damaged();
  gaps_ = uncovered_ = frame.color.total() - static_cast<std::size_t>(cv::countNonZero(frame.depth == frame.depth));
  return frame;
}

Frame LdiRenderer::render_within(double milliseconds, Camera const& camera,
                                 Eigen::Isometry3d const& object_from_camera) {
  double const start = now();
  begin(camera, object_from_camera);
  bool more = refine();
  double const first = now() - start;
  while (more && now() - start + next_step_milliseconds(first) <= milliseconds) more = refine();
  return picture();
}

/// What the next step will take, with finishing the picture after it.
double LdiRenderer::next_step_milliseconds(double first) const {
  std::size_t const next = static_cast<std::size_t>(steps_);
  // Of a first picture in steps nothing is known but how long squares take: blended splats take about eight times as
  // long.
  constexpr double kBlended = 8;
  return next < step_milliseconds_.size() ? step_milliseconds_[next] + finish_milliseconds_ : kBlended * first;
}

/// Columns of a row in which the picture's canvases may hold something.
std::pair<int, int> LdiRenderer::touched(int y) const {
  auto const lasting = lasting_.touched(y);
  if (!has_passing_) return lasting;
  auto const passing = passing_.touched(y);
  if (passing.first == passing.second) return lasting;
  if (lasting.first == lasting.second) return passing;
  return {std::min(lasting.first, passing.first), std::max(lasting.second, passing.second)};
}

/// Marks the gaps where something was drawn around (elsewhere there is nothing to fill them with); returns how many
/// there are.
std::size_t LdiRenderer::find_gaps(Frame const& frame, cv::Mat1b& stencil) {
  stencil.create(frame.color.size());
  std::uint32_t const least = least_alpha(options);
  std::atomic<std::size_t> gaps = 0;
  for_each_rows(stencil.rows, [&](int y) {
    auto const [left, right] = touched(y);
    std::fill(stencil[y], stencil[y] + stencil.cols, uchar{0});
    std::size_t count = static_cast<std::size_t>(stencil.cols - (right - left));
    for (int x = left; x < right; ++x) {
      bool const gap = frame.color(y, x)[3] < least;
      stencil(y, x) = gap ? 255 : 0;
      count += gap;
    }
    gaps += count;
  });
  return gaps;
}

/// Pixels that are covered in part and have no gap around them are within a surface, not on an outline: whole.
void LdiRenderer::close_seams(cv::Mat1b const& stencil, Frame& frame) {
  for_each_rows(stencil.rows, [&](int y) {
    auto const [left, right] = touched(y);
    for (int x = left; x < right; ++x) {
      cv::Vec4b& pixel = frame.color(y, x);
      if (pixel[3] == 255 || stencil(y, x) != 0) continue;
      bool near_gap = false;
      for (int j = std::max(0, y - 1); j <= std::min(stencil.rows - 1, y + 1); ++j)
        for (int i = std::max(0, x - 1); i <= std::min(stencil.cols - 1, x + 1); ++i)
          near_gap = near_gap || stencil(j, i) != 0;
      if (!near_gap) pixel[3] = 255;
    }
  });
}

void LdiRenderer::for_each_rows(int rows, std::function<void(int)> const& work) {
  constexpr int kBand = 64;
  for_each_index(context_, static_cast<std::size_t>((rows + kBand - 1) / kBand), [&](std::size_t band) {
    for (int y = static_cast<int>(band) * kBand; y < std::min(rows, static_cast<int>(band + 1) * kBand); ++y) work(y);
  });
}

/// Two passes (§3.5): the picture is the first, its gaps the stencil. Cells above those that were drawn are taken level
/// by level, so that a gap is filled with the finest that reaches it.
void LdiRenderer::fill_gaps(Frame& frame) {
  if (options.gaps == LdiRenderOptions::Gaps::background) return;
  cv::Mat1b stencil;
  find_gaps(frame, stencil);
  std::map<int, std::vector<CellPart>> levels;
  for (TraversedCell const& at : traversed_)
    if (at.descended)
      levels[tree_->cells[static_cast<std::size_t>(at.cell)].key.level].push_back({at.cell, LdiKind::filtered});
  for (auto const& [level, parts] : levels) {
    if (uncovered_ == 0) break;
    filling_.begin(camera_, object_from_camera_);
    filling_splats_ += draw_on(filling_, parts, stencil);
    filling_.fill_beneath(stencil, frame, context_);
    uncovered_ = find_gaps(frame, stencil);
  }
  close_seams(stencil, frame);
}

}  // namespace scanview
