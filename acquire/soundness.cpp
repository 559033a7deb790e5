#include "acquire/soundness.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "base/error.h"
#include "base/median.h"

namespace scanview {
namespace {

// The beam's width in light, from its width in values under the response value = light^(1 / gamma): the value's half
// height is another height of the light.
double light_width(PeakSample const& peak, double gamma) {
  double const base = std::pow(peak.ambient, gamma), top = std::pow(peak.ambient + peak.amplitude, gamma);
  double const half = std::pow(peak.ambient + peak.amplitude / 2, gamma);
  return peak.width * std::sqrt(std::log(2.0) / std::log((top - base) / (half - base)));
}

}  // namespace

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
          {"pair_mismatch", json_number(pair_mismatch)},
          {"doubled", doubled},
          {"missing", missing},
          {"out_of_order", out_of_order},
          {"warnings", warnings}};
}

std::vector<float> LineSamples::take(cv::Mat const& picture) {
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
      }
  }
  if (picture.size() != size_)
    throw Error(ErrorCode::bad_input, {},
                fmt::format("a frame has {}x{} pixels, those before it {}x{}", picture.cols, picture.rows, size_.width,
                            size_.height));
  int const rows = std::min(kLines, size_.height), columns = std::min(kLines, size_.width);
  std::vector<float> values(lines_.back().first + lines_.back().length);
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
      for (int i = 0; i < columns; ++i)
        to[i * size_.height] = scale * static_cast<float>(from[(2 * i + 1) * size_.width / (2 * columns)]);
    }
  };
  picture.depth() == CV_8U ? copy(std::uint8_t{}) : copy(std::uint16_t{});
  return values;
}

ResponseFit fit_response(std::vector<PeakSample> const& peaks) {
  std::vector<PeakSample> usable;
  for (PeakSample const& peak : peaks)
    if (peak.amplitude > 0 && peak.ambient >= 0 && peak.width > 0 && std::isfinite(peak.amplitude + peak.width))
      usable.push_back(peak);
  if (usable.size() < 100) return {};
  // Least absolute slope against the predictor that gamma acts by: the width's logarithm must not depend on the height
  // above the ambient light. Medians of the lower and the upper third decide, so that outliers do not.
  std::sort(usable.begin(), usable.end(),
            [](PeakSample const& a, PeakSample const& b) { return a.amplitude * b.ambient < b.amplitude * a.ambient; });
  auto const third = static_cast<std::ptrdiff_t>(usable.size() / 3);
  auto const logs = [&](std::ptrdiff_t first, std::ptrdiff_t last, double gamma) {
    std::vector<double> values;
    for (auto i = first; i < last; ++i)
      values.push_back(std::log(light_width(usable[static_cast<std::size_t>(i)], gamma)));
    return values;
  };
  auto const count = static_cast<std::ptrdiff_t>(usable.size());
  auto const difference = [&](double gamma) {
    return median(logs(count - third, count, gamma)) - median(logs(0, third, gamma));
  };
  // A larger gamma narrows high peaks more than low ones: the difference falls.
  double low = 0.25, high = 5;
  double const slope = (difference(1.25) - difference(0.8)) / 0.45;
  if (!(slope < -1e-3)) return {};
  for (int step = 0; step < 40; ++step) (difference((low + high) / 2) > 0 ? low : high) = (low + high) / 2;
  ResponseFit fit;
  fit.gamma = (low + high) / 2;
  double const scatter = robust_deviation(logs(0, count, fit.gamma));
  double const error = 1.2533 * scatter * std::sqrt(2.0 / static_cast<double>(third));
  double const slope_there =
      (difference(fit.gamma * 1.1) - difference(fit.gamma / 1.1)) / (fit.gamma * (1.1 - 1 / 1.1));
  double const std = error / std::max(1e-9, std::abs(slope_there));
  if (std < 0.5) fit.std = std;
  return fit;
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
