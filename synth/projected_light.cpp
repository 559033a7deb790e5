#include "synth/projected_light.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <limits>

#include "base/random.h"

namespace scanview {
namespace {

constexpr int kFine = 16;                           // entries a projector pixel
constexpr float kBeamReach = 6;                     // sigmas: beyond, the beam brings less than 2e-8 of its middle
constexpr int kBeamEntries = 6 * 512;               // of the beam's table
constexpr std::uint64_t kFlickerItem = 0x6c616d70;  // keys the lamp's random numbers

/// exp(-x²/2) for x in [0, 6] by linear interpolation; off by less than 1e-6.
float beam_profile(float x) {
  static std::array<float, kBeamEntries + 2> const table = [] {
    std::array<float, kBeamEntries + 2> values{};
    for (std::size_t i = 0; i < values.size(); ++i) {
      double const at = static_cast<double>(i) * kBeamReach / kBeamEntries;
      values[i] = static_cast<float>(std::exp(-0.5 * at * at));
    }
    return values;
  }();
  float const at = x * (kBeamEntries / kBeamReach);
  int const i = static_cast<int>(at);
  if (i >= kBeamEntries) return 0;
  return table[i] + (at - static_cast<float>(i)) * (table[i + 1] - table[i]);
}

/// Stripes of one frame, softened by the projector's blur: light at (i + 0.5) / kFine - 0.5 projector pixels.
std::vector<float> softened(std::vector<bool> const& stripes, double blur) {
  int const size = static_cast<int>(stripes.size()) * kFine;
  int const reach = static_cast<int>(std::ceil(5 * blur * kFine));
  std::vector<double> kernel;
  double sum = 0;
  for (int k = -reach; k <= reach; ++k) {
    kernel.push_back(blur > 0 ? std::exp(-0.5 * std::pow(k / (blur * kFine), 2)) : 1.0);
    sum += kernel.back();
  }
  std::vector<float> table(static_cast<std::size_t>(size));
  for (int i = 0; i < size; ++i) {
    double value = 0;
    for (int k = -reach; k <= reach; ++k)
      if (i + k >= 0 && i + k < size && stripes[(i + k) / kFine]) value += kernel[k + reach];
    table[i] = static_cast<float>(value / sum);
  }
  return table;
}

/// Frames of one direction in the order of OpenCV's GrayCodePattern: most significant bit first, each followed by its
/// inverse.
std::vector<std::vector<float>> gray_frames(int size, double blur) {
  std::vector<std::vector<float>> tables;
  for (int bit = std::bit_width(static_cast<unsigned>(size - 1)) - 1; bit >= 0; --bit)
    for (bool const inverse : {false, true}) {
      std::vector<bool> stripes(static_cast<std::size_t>(size));
      for (int i = 0; i < size; ++i) stripes[i] = (((i ^ i >> 1) >> bit & 1) != 0) != inverse;
      tables.push_back(softened(stripes, blur));
    }
  return tables;
}

float look_up(std::vector<float> const& table, float pixel) {
  float const at = (pixel + 0.5f) * kFine - 0.5f;
  int const i = static_cast<int>(std::floor(at));
  float const share = at - static_cast<float>(i);
  auto const value = [&](int k) { return k >= 0 && k < static_cast<int>(table.size()) ? table[k] : 0.0f; };
  return (1 - share) * value(i) + share * value(i + 1);
}

}  // namespace

ProjectedLight::ProjectedLight(CaptureLayout const& layout, CaptureOptions const& options, std::uint64_t seed)
    : pattern_(options.light.pattern), light_from_room_(layout.room_from_light.inverse()) {
  LightOptions const& light = options.light;
  if (pattern_ == LightOptions::Pattern::gray) {
    make_gray_tables(light);
    // The projector's picture covers the sweep's angles and the object's height, its middle straight ahead.
    double const widest = std::max(std::tan(layout.sweep_high), -std::tan(layout.sweep_low));
    focal_ = std::min(0.5 * width_ / widest, 0.45 * height_ / layout.tallest);
    center_ = 0.5 * (width_ - 1);
  } else {
    double const sweep = layout.sweep_high - layout.sweep_low;
    frames_ = light.steps;
    low_ = layout.sweep_low;
    step_ = sweep / light.steps;
    double const beam = light.beam_mm > 0      ? light.beam_mm / layout.lamp_distance()
                        : light.beam_steps > 0 ? light.beam_steps * step_
                                               : 0.8 * sweep / 96;
    beam_steps_ = beam / step_;
  }
  float jitter = 0;
  for (int k = 0; k < frames_; ++k) {
    CounterRandom random(seed, kFlickerItem, static_cast<std::uint64_t>(k));
    gain_.push_back(static_cast<float>(std::max(0.0, 1 + options.faults.flicker * random.normal())));
    offset_.push_back(static_cast<float>(options.faults.jitter * random.normal()));
    jitter = std::max(jitter, std::abs(offset_.back()));
  }
  reach_ = kBeamReach * static_cast<float>(beam_steps_) + jitter;
}

void ProjectedLight::make_gray_tables(LightOptions const& options) {
  width_ = options.projector_width, height_ = options.projector_height, rows_ = options.rows;
  columns_ = gray_frames(width_, options.blur);
  if (rows_) row_tables_ = gray_frames(height_, options.blur);
  frames_ = static_cast<int>(columns_.size() + row_tables_.size()) + 2;
}

int ProjectedLight::code_frames() const { return pattern_ == LightOptions::Pattern::gray ? frames_ - 2 : frames_; }

std::string ProjectedLight::frame_name(int frame) const {
  if (frame < code_frames()) return fmt::format("{:04d}", frame);
  return frame == code_frames() ? "white" : "black";
}

LightPoint ProjectedLight::at(Eigen::Vector3d const& p_room) const {
  Eigen::Vector3d const p = light_from_room_ * p_room;
  if (pattern_ == LightOptions::Pattern::sweep)
    return {static_cast<float>((std::atan2(p.x(), p.z()) - low_) / step_ - 0.5), 0};
  return {static_cast<float>(center_ + focal_ * p.x() / p.z()),
          static_cast<float>(0.5 * (height_ - 1) + focal_ * p.y() / p.z())};
}

void ProjectedLight::add(LightPoint const& point, float weight, float* frames) const {
  if (pattern_ == LightOptions::Pattern::sweep) {
    auto const limited = [&](float value) {
      return static_cast<int>(std::clamp(value, -1.0f, static_cast<float>(frames_)));
    };
    int const first = std::max(limited(std::ceil(point.column - reach_)), 0);
    int const last = std::min(limited(std::floor(point.column + reach_)), frames_ - 1);
    float const scale = 1 / static_cast<float>(beam_steps_);
    for (int k = first; k <= last; ++k) {
      float const from_middle = std::abs(point.column - static_cast<float>(k) - offset_[k]);
      frames[k] += weight * gain_[k] * beam_profile(from_middle * scale);
    }
    return;
  }
  float const across = static_cast<float>(width_) - 0.5f, down = static_cast<float>(height_) - 0.5f;
  if (!(point.column > -0.5f && point.column < across && point.row > -0.5f && point.row < down)) return;
  std::size_t k = 0;
  for (auto const& table : columns_) frames[k] += weight * gain_[k] * look_up(table, point.column), ++k;
  for (auto const& table : row_tables_) frames[k] += weight * gain_[k] * look_up(table, point.row), ++k;
  frames[k] += weight * gain_[k];
}

std::vector<int> frame_order(CaptureFaults const& faults, int frames, CaptureFaults::Side side) {
  std::vector<int> order(static_cast<std::size_t>(frames));
  for (int k = 0; k < frames; ++k) order[k] = k;
  if (faults.side != CaptureFaults::Side::both && faults.side != side) return order;
  if (faults.drop >= 0 && faults.drop < frames) {
    order.erase(order.begin() + faults.drop);
    order.push_back(frames);
  }
  if (faults.repeat >= 0 && faults.repeat < frames) {
    order.insert(order.begin() + faults.repeat, order[faults.repeat]);
    order.pop_back();
  }
  if (faults.swap >= 0 && faults.swap + 1 < frames) std::swap(order[faults.swap], order[faults.swap + 1]);
  return order;
}

}  // namespace scanview
