#include "viewer/walkthrough/gap_interpolation.h"

#include <algorithm>
#include <cmath>
#include <vector>

#include "base/srgb.h"

namespace scanview {
namespace {

/// Linear light B G R and depth; depth 0: nothing.
using Level = cv::Mat4f;

constexpr float kBehind = 0.5F;  ///< of the farthest: what is nearer does not count

Level full_level(Frame const& frame) {
  auto const& linear = linear_from_srgb8();
  Level level(frame.color.size(), cv::Vec4f(0, 0, 0, 0));
  for (int y = 0; y < level.rows; ++y)
    for (int x = 0; x < level.cols; ++x) {
      cv::Vec4b const& from = frame.color(y, x);
      if (from[3] == 0) continue;
      level(y, x) = {float(linear[from[0]]), float(linear[from[1]]), float(linear[from[2]]), frame.depth(y, x)};
    }
  return level;
}

Level half_of(Level const& fine) {
  Level level((fine.rows + 1) / 2, (fine.cols + 1) / 2, cv::Vec4f(0, 0, 0, 0));
  for (int y = 0; y < level.rows; ++y)
    for (int x = 0; x < level.cols; ++x) {
      float farthest = 0;
      auto const for_each = [&](auto const& act) {
        for (int v = 2 * y; v < std::min(2 * y + 2, fine.rows); ++v)
          for (int u = 2 * x; u < std::min(2 * x + 2, fine.cols); ++u) act(fine(v, u));
      };
      for_each([&](cv::Vec4f const& p) { farthest = std::max(farthest, p[3]); });
      if (!(farthest > 0)) continue;
      cv::Vec4f sum(0, 0, 0, 0);
      int count = 0;
      for_each([&](cv::Vec4f const& p) {
        if (p[3] < kBehind * farthest) return;
        sum += p;
        ++count;
      });
      level(y, x) = sum / float(count);
    }
  return level;
}

void fill_from(Level const& coarse, Level& fine) {
  for (int y = 0; y < fine.rows; ++y)
    for (int x = 0; x < fine.cols; ++x) {
      if (fine(y, x)[3] > 0) continue;
      float const cx = std::clamp(0.5F * float(x) - 0.25F, 0.0F, float(coarse.cols - 1));
      float const cy = std::clamp(0.5F * float(y) - 0.25F, 0.0F, float(coarse.rows - 1));
      int const left = int(cx), top = int(cy), right = std::min(left + 1, coarse.cols - 1),
                bottom = std::min(top + 1, coarse.rows - 1);
      float const u = cx - float(left), v = cy - float(top);
      cv::Vec4f const around[4] = {coarse(top, left), coarse(top, right), coarse(bottom, left), coarse(bottom, right)};
      float const share[4] = {(1 - v) * (1 - u), (1 - v) * u, v * (1 - u), v * u};
      float farthest = 0, total = 0;
      for (int i = 0; i < 4; ++i)
        if (share[i] > 0) farthest = std::max(farthest, around[i][3]);
      cv::Vec4f sum(0, 0, 0, 0);
      for (int i = 0; i < 4; ++i) {
        if (around[i][3] < kBehind * farthest) continue;
        sum += share[i] * around[i];
        total += share[i];
      }
      fine(y, x) = sum / total;
    }
}

}  // namespace

void interpolate_gaps(Frame& frame) {
  std::vector<Level> levels = {full_level(frame)};
  while (levels.back().rows > 1 || levels.back().cols > 1) levels.push_back(half_of(levels.back()));
  if (!(levels.back()(0, 0)[3] > 0)) return;
  for (std::size_t i = levels.size() - 1; i > 0; --i) fill_from(levels[i], levels[i - 1]);
  for (int y = 0; y < frame.color.rows; ++y)
    for (int x = 0; x < frame.color.cols; ++x) {
      if (frame.color(y, x)[3] != 0) continue;
      cv::Vec4f const& from = levels.front()(y, x);
      for (int c = 0; c < 3; ++c) frame.color(y, x)[c] = cv::saturate_cast<uchar>(255 * srgb_from_linear(from[c]));
      frame.color(y, x)[3] = 255;
      frame.depth(y, x) = from[3];
    }
}

}  // namespace scanview
