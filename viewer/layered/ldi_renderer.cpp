#include "viewer/layered/ldi_renderer.h"

#include <algorithm>
#include <chrono>
#include <cmath>

#include "base/error.h"

namespace scanview {
namespace {

double now() {
  return std::chrono::duration<double, std::milli>(std::chrono::steady_clock::now().time_since_epoch()).count();
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
  splats_ = gaps_ = uncovered_ = 0;
  until_px_ = 0;
  stages_.clear();
}

/// Pixels that stay go to the lasting canvas, those that finer ones will replace to the passing one; patches last.
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
  for (TraversedCell const& at : cells) lasting.push_back({at.cell, LdiKind::patch});
  traversed_.insert(traversed_.end(), cells.begin(), cells.end());
  splats_ += lasting_.draw(*tree_, lasting, {}, context_);
  has_passing_ = !passing.empty();
  if (has_passing_) {
    passing_.begin(camera_, object_from_camera_);
    splats_ += passing_.draw(*tree_, passing, {}, context_);
  }
}

bool LdiRenderer::refine() {
  double const start = now();
  TraversalOptions how;
  how.stamp_px = options.stamp_px;
  if (until_px_ == 0) {
    how.until_px = until_px_ = std::max(kFirstPx, options.stamp_px);
    draw(traverse(*tree_, camera_, object_from_camera_, how));
  } else if (!postponed_.empty()) {
    how.until_px = until_px_ = std::max(until_px_ / 2, options.stamp_px);
    for (TraversedCell& at : traversed_)
      if (at.postponed) at.postponed = false, at.descended = true;
    draw(traverse_below(*tree_, std::vector<TraversedCell>(postponed_), camera_, object_from_camera_, how));
  }
  stages_["draw"] += now() - start;
  return !postponed_.empty();
}

Frame LdiRenderer::picture() {
  double start = now();
  Frame frame;
  gaps_ = uncovered_ =
      lasting_.compose(has_passing_ ? &passing_ : nullptr, static_cast<float>(options.covered), frame, context_);
  stages_["compose"] += now() - start;
  start = now();
  fill_gaps(frame);
  stages_["fill"] += now() - start;
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
  draw(cells);
  stages_["draw"] = now() - start;
  return picture();
}

Frame LdiRenderer::render_within(double milliseconds, Camera const& camera,
                                 Eigen::Isometry3d const& object_from_camera) {
  double const start = now();
  begin(camera, object_from_camera);
  for (double last = start; refine();) {
    double const end = now(), step = end - last;
    last = end;
    // Steps of half the size take about four times as long.
    constexpr double kGrowth = 4;
    if (end - start + kGrowth * step > milliseconds) break;
  }
  return picture();
}

std::size_t LdiRenderer::count_gaps(Frame const& frame, cv::Mat1b& stencil) const {
  stencil.create(frame.color.size());
  auto const least = static_cast<uchar>(std::ceil(255 * options.covered));
  std::size_t count = 0;
  for (int y = 0; y < stencil.rows; ++y)
    for (int x = 0; x < stencil.cols; ++x) {
      bool const gap = frame.color(y, x)[3] < least;
      stencil(y, x) = gap ? 255 : 0;
      count += gap;
    }
  return count;
}

/// Two passes (§3.5): the picture is the first, its gaps the stencil. Cells above those that were drawn are taken level
/// by level, so that a gap is filled with the finest that reaches it.
void LdiRenderer::fill_gaps(Frame& frame) {
  if (gaps_ == 0 || options.gaps == LdiRenderOptions::Gaps::background) return;
  cv::Mat1b stencil;
  count_gaps(frame, stencil);
  std::map<int, std::vector<TraversedCell>> levels;
  for (TraversedCell const& at : traversed_)
    if (at.descended) levels[tree_->cells[static_cast<std::size_t>(at.cell)].key.level].push_back(at);
  for (auto& [level, cells] : levels) {
    std::stable_sort(cells.begin(), cells.end(),
                     [](TraversedCell const& a, TraversedCell const& b) { return a.distance < b.distance; });
    std::vector<CellPart> parts;
    for (TraversedCell const& at : cells) parts.push_back({at.cell, LdiKind::filtered});
    filling_.begin(camera_, object_from_camera_);
    splats_ += filling_.draw(*tree_, parts, stencil, context_);
    filling_.compose_into(stencil, frame, context_);
    uncovered_ = count_gaps(frame, stencil);
    if (uncovered_ == 0) return;
  }
}

}  // namespace scanview
