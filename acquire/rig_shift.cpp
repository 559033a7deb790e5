#include "acquire/rig_shift.h"

#include <fmt/format.h>

#include <Eigen/Dense>
#include <algorithm>
#include <array>
#include <cmath>
#include <optional>
#include <vector>

#include "base/error.h"
#include "base/median.h"
#include "base/parallel.h"

namespace scanview {
namespace {

constexpr int kHalf = 5;  // of the window
constexpr int kWindow = (2 * kHalf + 1) * (2 * kHalf + 1);
constexpr int kFewest = 100;  // matched pixels in a window
constexpr double kLeastCorrelation = 0.85;
constexpr std::size_t kFewestPoints = 30;
constexpr double kLeastContrast = 3.0 / 255;  // RMS change from row to row, of full scale

struct Place {
  double x = 0, y = 0, dy = 0;
};

struct Pictures {
  cv::Mat1f left, right;  // shares of full scale
  cv::Mat1f const& x_right;
};

// A window's pixels: the left values, and the matched right ones so many rows further down.
struct Strip {
  std::array<float, kWindow> left{};
  std::vector<std::array<float, kWindow>> right;  // [shift + most]
  int count = 0;
};

std::optional<Strip> strip_at(Pictures const& p, int x, int y, int most) {
  Strip strip;
  strip.right.resize(static_cast<std::size_t>(2 * most + 1));
  for (int j = -kHalf; j <= kHalf; ++j)
    for (int i = -kHalf; i <= kHalf; ++i) {
      float const column = p.x_right(y + j, x + i);
      if (!(column >= 0) || !(column < static_cast<float>(p.right.cols - 1))) continue;
      auto const k = static_cast<std::size_t>(strip.count++);
      auto const at = static_cast<int>(column);
      float const part = column - static_cast<float>(at);
      strip.left[k] = p.left(y + j, x + i);
      for (int shift = -most; shift <= most; ++shift) {
        float const* const row = p.right[y + j + shift];
        strip.right[static_cast<std::size_t>(shift + most)][k] = (1 - part) * row[at] + part * row[at + 1];
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
  // Enough change from row to row in the left picture, before the costly part.
  double change = 0;
  for (int j = -kHalf; j < kHalf; ++j)
    for (int i = -kHalf; i <= kHalf; ++i)
      change += std::pow(static_cast<double>(pictures.left(y + j + 1, x + i) - pictures.left(y + j, x + i)), 2);
  if (std::sqrt(change / (kWindow - (2 * kHalf + 1))) < kLeastContrast) return std::nullopt;
  auto const strip = strip_at(pictures, x, y, most);
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

cv::Mat1f shares(cv::Mat const& picture, char const* side) {
  if (picture.type() != CV_8UC1 && picture.type() != CV_16UC1)
    throw Error(ErrorCode::bad_input, {}, fmt::format("the {} picture is not gray with 8 or 16 bits", side));
  cv::Mat1f result;
  picture.convertTo(result, CV_32F, picture.depth() == CV_8U ? 1.0 / 255 : 1.0 / 65535);
  return result;
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

RigShift measure_rig_shift(cv::Mat const& left, cv::Mat const& right, cv::Mat1f const& x_right, Context& context,
                           int most_px) {
  if (left.size() != x_right.size())
    throw Error(ErrorCode::bad_input, {}, "the matches are not of the left picture's size");
  if (left.rows != right.rows)
    throw Error(ErrorCode::bad_input, {}, "the rectified pictures differ in their number of rows");
  if (most_px < 1) throw Error(ErrorCode::usage, {}, "most_px must be at least 1");
  Pictures const pictures{shares(left, "left"), shares(right, "right"), x_right};
  // Some five thousand places at most, whose windows do not overlap.
  double const area = static_cast<double>(left.rows) * left.cols;
  int const spacing = std::max(2 * kHalf + 1, static_cast<int>(std::sqrt(area / 5000)));
  int const top = kHalf + most_px, rows = std::max(0, (left.rows - 2 * top + spacing - 1) / spacing);
  std::vector<std::vector<Place>> found(static_cast<std::size_t>(rows));
  for_each_index(context, found.size(), [&](std::size_t r) {
    int const y = top + static_cast<int>(r) * spacing;
    for (int x = kHalf; x < left.cols - kHalf; x += spacing)
      if (auto const dy = shift_at(pictures, x, y, most_px))
        found[r].push_back({(x - left.cols / 2.0) / left.cols, (y - left.rows / 2.0) / left.rows, *dy});
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
