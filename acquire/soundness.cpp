#include "acquire/soundness.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "base/error.h"
#include "base/median.h"

namespace scanview {
namespace {

constexpr double kMostMotion = 0.3;  // pixels: as much as a rig may be off its rows

}  // namespace

bool SoundnessFigures::moved() const { return motion_px > std::max(kMostMotion, 5 * motion_std_px); }

Json SoundnessFigures::to_json() const {
  return {{"frames", frames},
          {"lit_share", json_number(lit_share)},
          {"noise", json_number(noise)},
          {"saturated_share", json_number(saturated_share)},
          {"flicker", json_number(flicker)},
          {"ambient_scatter", json_number(ambient_scatter)},
          {"beam_steps", json_number(beam_steps)},
          {"step_scatter", json_number(step_scatter)},
          {"gamma", json_number(gamma)},
          {"gamma_std", json_number(gamma_std)},
          {"motion_px", json_number(motion_px)},
          {"motion_std_px", json_number(motion_std_px)},
          {"pair_mismatch", json_number(pair_mismatch)},
          {"doubled", doubled},
          {"missing", missing},
          {"out_of_order", out_of_order},
          {"warnings", warnings}};
}

std::vector<float> LineSamples::take(cv::Mat const& picture, std::vector<float> values) {
  if (picture.type() != CV_8UC1 && picture.type() != CV_16UC1)
    throw Error(ErrorCode::bad_input, {}, "a frame is not gray with 8 or 16 bits");
  if (lines_.empty()) {
    size_ = picture.size();
    std::size_t first = 0;
    for (bool const is_row : {true, false})
      for (int i = 0; i < std::min(kLines, is_row ? size_.height : size_.width); ++i) {
        auto const length = static_cast<std::size_t>(is_row ? size_.width : size_.height);
        lines_.push_back({first, length, is_row});
        first += length;
        if (!is_row) columns_.push_back((2 * i + 1) * size_.width / (2 * std::min(kLines, size_.width)));
      }
  }
  if (picture.size() != size_)
    throw Error(ErrorCode::bad_input, {},
                fmt::format("a frame has {}x{} pixels, those before it {}x{}", picture.cols, picture.rows, size_.width,
                            size_.height));
  int const rows = std::min(kLines, size_.height);
  values.resize(lines_.back().first + lines_.back().length);
  auto const copy = [&]<typename T>(T) {
    auto const scale = static_cast<float>(1.0 / std::numeric_limits<T>::max());
    resolution_ = static_cast<double>(scale);
    float* to = values.data();
    for (int i = 0; i < rows; ++i) {
      T const* const from = picture.ptr<T>((2 * i + 1) * size_.height / (2 * rows));
      for (int x = 0; x < size_.width; ++x) *to++ = scale * static_cast<float>(from[x]);
    }
    // All columns of a row at once, which touches every line of memory once.
    for (int y = 0; y < size_.height; ++y, ++to) {
      T const* const from = picture.ptr<T>(y);
      float* down = to;
      for (int const x : columns_) {
        *down = scale * static_cast<float>(from[x]);
        down += size_.height;
      }
    }
  };
  picture.depth() == CV_8U ? copy(std::uint8_t{}) : copy(std::uint16_t{});
  return values;
}

void reconcile(SoundnessFigures& left, SoundnessFigures& right) {
  auto const is_near = [](std::vector<std::size_t> const& frames, std::size_t frame) {
    return std::any_of(frames.begin(), frames.end(), [&](std::size_t f) { return f + 1 >= frame && f <= frame + 1; });
  };
  auto const take_back = [&](char const* what) {
    for (SoundnessFigures* figures : {&left, &right})
      std::erase_if(figures->warnings, [&](std::string const& w) { return w.find(what) != std::string::npos; });
  };
  auto const says = [](SoundnessFigures const& figures, char const* what) {
    return std::any_of(figures.warnings.begin(), figures.warnings.end(),
                       [&](std::string const& w) { return w.find(what) != std::string::npos; });
  };
  bool const both_miss = std::any_of(left.missing.begin(), left.missing.end(),
                                     [&](std::size_t frame) { return is_near(right.missing, frame); });
  if (!both_miss) {
    left.missing.clear();
    right.missing.clear();
    take_back(kMissingFrame);
  }
  if (!says(left, kUnevenSteps) || !says(right, kUnevenSteps)) take_back(kUnevenSteps);
}

std::string response_warning(std::string const& camera, double gamma, double std) {
  if (!std::isfinite(gamma) || !std::isfinite(std) || std::abs(gamma - 1) < std::max(0.3, 4 * std)) return {};
  return fmt::format(
      "{}: values are not proportional to light (gamma about {:.1f}), which shifts peaks and edges: switch off gamma "
      "and "
      "contrast curves in the camera, or record raw",
      camera, gamma);
}

}  // namespace scanview
