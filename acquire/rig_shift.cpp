#include "acquire/rig_shift.h"

#include <fmt/format.h>

#include <Eigen/Dense>
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <optional>
#include <vector>

#include "acquire/range_image.h"
#include "base/error.h"
#include "base/median.h"
#include "base/parallel.h"

namespace scanview {
namespace {

constexpr int kHalf = 5;  // of the window
constexpr int kSide = 2 * kHalf + 1, kWindow = kSide * kSide;
constexpr float kWidest = 4 * kSide;  // columns that a window takes in the right picture: beyond, it is torn
constexpr int kFewest = 100;          // matched pixels in a window
constexpr double kLeastCorrelation = 0.85;
constexpr std::size_t kFewestPoints = 30;
constexpr double kLeastContrast = 3;  // RMS change from row to row, in levels of 8 bits

struct Place {
  double x = 0, y = 0, dy = 0;
};

struct Pictures {
  MappedPicture const &left, &right;
  std::function<float(int, int)> const& x_right;
};

// The rectified picture's value, bilinear; NaN where the camera sees nothing.
float value_at(MappedPicture const& mapped, int x, int y) {
  cv::Mat1b const& picture = mapped.picture;
  cv::Vec2f const place = mapped.map.at(x, y);
  auto const last_x = static_cast<float>(picture.cols - 1), last_y = static_cast<float>(picture.rows - 1);
  if (!(place[0] > -0.5F && place[1] > -0.5F && place[0] < last_x + 0.5F && place[1] < last_y + 0.5F)) return kMissing;
  float const u = std::clamp(place[0], 0.0F, last_x), v = std::clamp(place[1], 0.0F, last_y);
  int const i = std::min(static_cast<int>(u), picture.cols - 2), j = std::min(static_cast<int>(v), picture.rows - 2);
  float const part_u = u - static_cast<float>(i), part_v = v - static_cast<float>(j);
  auto const along = [&](std::uint8_t const* row) {
    return (1 - part_u) * static_cast<float>(row[i]) + part_u * static_cast<float>(row[i + 1]);
  };
  return (1 - part_v) * along(picture[j]) + part_v * along(picture[j + 1]);
}

// Whether the camera's own picture changes enough around a place, in any direction, to be looked at more closely.
bool may_have_contrast(MappedPicture const& left, int x, int y) {
  cv::Vec2f const place = left.map.at(x, y);
  cv::Rect const inner(kHalf, kHalf, left.picture.cols - 2 * kHalf - 1, left.picture.rows - 2 * kHalf - 1);
  if (!cv::Rect2f(inner).contains({place[0], place[1]})) return false;
  auto const u = static_cast<int>(place[0]), v = static_cast<int>(place[1]);
  int change = 0;
  for (int j = -kHalf; j <= kHalf; ++j) {
    std::uint8_t const *const row = left.picture[v + j] + u, *const below = left.picture[v + j + 1] + u;
    for (int i = -kHalf; i <= kHalf; ++i) {
      int const across = row[i + 1] - row[i], down = below[i] - row[i];
      change += across * across + down * down;
    }
  }
  return change >= kLeastContrast * kLeastContrast * kWindow;
}

std::optional<std::array<float, kWindow>> textured_window(MappedPicture const& left, int x, int y) {
  std::array<float, kWindow> values;
  auto next = values.begin();
  for (int j = -kHalf; j <= kHalf; ++j)
    for (int i = -kHalf; i <= kHalf; ++i) *next++ = value_at(left, x + i, y + j);
  double change = 0;
  for (std::size_t k = kSide; k < values.size(); ++k)
    change += std::pow(static_cast<double>(values[k] - values[k - kSide]), 2);
  if (!(std::sqrt(change / (kWindow - kSide)) >= kLeastContrast)) return std::nullopt;
  return values;
}

// A window's pixels: the left values, and the matched right ones so many rows further down.
struct Strip {
  std::array<float, kWindow> left{};
  std::vector<std::array<float, kWindow>> right;  // [shift + most]
  int count = 0;
};

std::optional<Strip> strip_at(Pictures const& p, std::array<float, kWindow> const& window, int x, int y, int most) {
  std::array<float, kWindow> columns;
  float first = std::numeric_limits<float>::infinity(), last = 0;
  auto next = columns.begin();
  for (int j = -kHalf; j <= kHalf; ++j)
    for (int i = -kHalf; i <= kHalf; ++i) {
      float& column = *next++ = p.x_right(x + i, y + j);
      if (!(column >= 0) || !(column < static_cast<float>(p.right.map.size().width - 1))) {
        column = kMissing;
        continue;
      }
      first = std::min(first, column);
      last = std::max(last, column);
    }
  if (!(last - first < kWidest)) return std::nullopt;
  // The part of the right picture that the columns lie in.
  int const left_edge = static_cast<int>(first), width = static_cast<int>(last) + 2 - left_edge;
  int const reach = kHalf + most;
  cv::Mat1f part(2 * reach + 1, width);
  for (int j = 0; j < part.rows; ++j)
    for (int i = 0; i < width; ++i) part(j, i) = value_at(p.right, left_edge + i, y - reach + j);
  Strip strip;
  strip.right.resize(static_cast<std::size_t>(2 * most + 1));
  for (int k = 0; k < kWindow; ++k) {
    float const column = columns[static_cast<std::size_t>(k)] - static_cast<float>(left_edge);
    if (std::isnan(column)) continue;
    auto const at = static_cast<int>(column);
    float const share = column - static_cast<float>(at);
    auto const n = static_cast<std::size_t>(strip.count++);
    strip.left[n] = window[static_cast<std::size_t>(k)];
    for (int shift = 0; shift <= 2 * most; ++shift) {
      float const* const row = part[k / kSide + shift];
      strip.right[static_cast<std::size_t>(shift)][n] = (1 - share) * row[at] + share * row[at + 1];
    }
  }
  if (strip.count < kFewest) return std::nullopt;
  return strip;
}

double correlation(float const* a, float const* b, int count) {
  double sa = 0, sb = 0, saa = 0, sbb = 0, sab = 0;
  for (int i = 0; i < count; ++i) {
    double const u = static_cast<double>(a[i]), v = static_cast<double>(b[i]);
    sa += u;
    sb += v;
    saa += u * u;
    sbb += v * v;
    sab += u * v;
  }
  double const n = count, va = saa - sa * sa / n, vb = sbb - sb * sb / n;
  return va > 0 && vb > 0 ? (sab - sa * sb / n) / std::sqrt(va * vb) : 0;
}

std::optional<double> shift_at(Pictures const& pictures, int x, int y, int most) {
  // What is cheap to rule out first.
  if (std::isnan(pictures.x_right(x, y)) || !may_have_contrast(pictures.left, x, y)) return std::nullopt;
  auto const window = textured_window(pictures.left, x, y);
  if (!window) return std::nullopt;
  auto const strip = strip_at(pictures, *window, x, y, most);
  if (!strip) return std::nullopt;
  int best = 0;
  double highest = -1;
  for (int k = 0; k <= 2 * most; ++k) {
    double const value =
        correlation(strip->left.data(), strip->right[static_cast<std::size_t>(k)].data(), strip->count);
    if (value > highest) {
      highest = value;
      best = k;
    }
  }
  if (highest < kLeastCorrelation || best == 0 || best == 2 * most) return std::nullopt;
  // left ≈ gain (right + δ d right / dy) + offset, linear in gain, gain δ, offset.
  auto const& middle = strip->right[static_cast<std::size_t>(best)];
  auto const& above = strip->right[static_cast<std::size_t>(best - 1)];
  auto const& below = strip->right[static_cast<std::size_t>(best + 1)];
  Eigen::Matrix3d normal = Eigen::Matrix3d::Zero();
  Eigen::Vector3d right_side = Eigen::Vector3d::Zero();
  for (int i = 0; i < strip->count; ++i) {
    auto const k = static_cast<std::size_t>(i);
    Eigen::Vector3d const row(static_cast<double>(middle[k]), 0.5 * static_cast<double>(below[k] - above[k]), 1);
    normal += row * row.transpose();
    right_side += row * static_cast<double>(strip->left[k]);
  }
  Eigen::Vector3d const solution = normal.ldlt().solve(right_side);
  double const step = solution[1] / solution[0];
  if (!solution.allFinite() || !(solution[0] > 0) || std::abs(step) > 1) return std::nullopt;
  return best - most + step;
}

}  // namespace

Json RigShift::to_json() const {
  return {{"points", points},
          {"median_px", json_number(median_px)},
          {"median_std_px", json_number(median_std_px)},
          {"offset_px", json_number(offset_px)},
          {"offset_std_px", json_number(offset_std_px)},
          {"tilt_px", json_number(tilt_px)},
          {"tilt_std_px", json_number(tilt_std_px)},
          {"stretch_px", json_number(stretch_px)},
          {"stretch_std_px", json_number(stretch_std_px)},
          {"rms_px", json_number(rms_px)},
          {"warning", warning}};
}

RigShift measure_rig_shift(MappedPicture const& left, MappedPicture const& right,
                           std::function<float(int x, int y)> const& x_right, Context& context, int most_px) {
  cv::Size const size = left.map.size();
  if (size.height != right.map.size().height)
    throw Error(ErrorCode::bad_input, {}, "the rectified pictures differ in their number of rows");
  if (most_px < 1) throw Error(ErrorCode::usage, {}, "most_px must be at least 1");
  Pictures const pictures{left, right, x_right};
  // Some five thousand places at most, whose windows do not overlap.
  double const area = static_cast<double>(size.height) * size.width;
  int const spacing = std::max(kSide, static_cast<int>(std::sqrt(area / 5000)));
  int const top = kHalf + most_px, rows = std::max(0, (size.height - 2 * top + spacing - 1) / spacing);
  std::vector<std::vector<Place>> found(static_cast<std::size_t>(rows));
  for_each_index(context, found.size(), [&](std::size_t r) {
    int const y = top + static_cast<int>(r) * spacing;
    for (int x = kHalf; x < size.width - kHalf; x += spacing)
      if (auto const dy = shift_at(pictures, x, y, most_px))
        found[r].push_back({(x - size.width / 2.0) / size.width, (y - size.height / 2.0) / size.height, *dy});
  });
  std::vector<Place> places;
  for (auto const& row : found) places.insert(places.end(), row.begin(), row.end());
  RigShift result;
  result.points = places.size();
  if (places.size() < kFewestPoints) return result;

  auto const count = static_cast<double>(places.size());
  std::vector<double> values;
  for (Place const& place : places) values.push_back(place.dy);
  result.median_px = median(values);
  result.median_std_px = 1.2533 * robust_deviation(std::move(values)) / std::sqrt(count);

  Eigen::Vector3d model(result.median_px, 0, 0);
  Eigen::Matrix3d covariance = Eigen::Matrix3d::Zero();
  for (int round = 0; round < 20; ++round) {
    std::vector<double> errors;
    for (Place const& place : places)
      errors.push_back(std::abs(place.dy - model.dot(Eigen::Vector3d(1, place.x, place.y))));
    double const scatter = std::max(1.4826 * median(errors), 1e-3);
    Eigen::Matrix3d information = Eigen::Matrix3d::Zero(), spread = Eigen::Matrix3d::Zero();
    Eigen::Vector3d right_side = Eigen::Vector3d::Zero();
    for (std::size_t i = 0; i < places.size(); ++i) {
      Eigen::Vector3d const row(1, places[i].x, places[i].y);
      double const weight = 1 / (1 + std::pow(errors[i] / (2 * scatter), 2));
      information += weight * row * row.transpose();
      spread += std::pow(weight * errors[i], 2) * row * row.transpose();
      right_side += weight * places[i].dy * row;
    }
    // Places in one row or column of the picture leave a slope open: it is drawn to 0.
    information += 1e-6 * count * Eigen::Matrix3d::Identity();
    model = information.ldlt().solve(right_side);
    Eigen::Matrix3d const inverse = information.inverse();
    covariance = inverse * spread * inverse;
  }
  result.offset_px = model[0];
  result.tilt_px = model[1];
  result.stretch_px = model[2];
  result.offset_std_px = std::sqrt(covariance(0, 0));
  result.tilt_std_px = std::sqrt(covariance(1, 1));
  result.stretch_std_px = std::sqrt(covariance(2, 2));
  double squares = 0;
  for (Place const& place : places) squares += std::pow(model.dot(Eigen::Vector3d(1, place.x, place.y)), 2);
  result.rms_px = std::sqrt(squares / count);

  double const significance =
      std::max({std::abs(result.offset_px) / result.offset_std_px, std::abs(result.tilt_px) / result.tilt_std_px,
                std::abs(result.stretch_px) / result.stretch_std_px});
  if (result.rms_px > 0.3 && significance > 5) {
    // What contributes most: a slope acts with its RMS over the picture, 1/√12.
    double const offset = std::abs(result.offset_px), tilt = std::abs(result.tilt_px) / std::sqrt(12.0),
                 stretch = std::abs(result.stretch_px) / std::sqrt(12.0);
    char const* const how = offset >= std::max(tilt, stretch) ? "a camera was turned up or down"
                            : tilt >= stretch                 ? "a camera was turned about its viewing axis"
                                                              : "a camera was turned to the side or refocused";
    result.warning = fmt::format(
        "matches lie {:.1f} px off their rows: {} since the calibration, or the calibration is wrong; calibrate again",
        result.rms_px, how);
  }
  return result;
}

void reconcile(RigShift& shift, SoundnessFigures const& left, SoundnessFigures const& right) {
  double const motion = (left.moved() ? left.motion_px : 0) + (right.moved() ? right.motion_px : 0);
  if (shift.warning.empty() || !(shift.rms_px <= motion)) return;
  shift.warning = fmt::format(
      "matches lie {:.1f} px off their rows, no more than the camera or the scene moved between the pictures: take the "
      "view again before the rig is doubted",
      shift.rms_px);
}

}  // namespace scanview
