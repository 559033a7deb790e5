#include "synth/church_views.h"

#include <fmt/format.h>

#include <cmath>
#include <numbers>

#include "base/error.h"

namespace scanview {
namespace {

using Eigen::Vector3d;

/// Of a camera: turned from looking east, towards south and up.
struct Stand {
  Vector3d eye;
  double south_deg, up_deg;
};

Stand const kStands[kChurchReferences] = {
    {{3.5, 3.4, 0.8}, 0, 3},     {{16.3, 2.6, -0.9}, 0, 0},  {{9.7, 6.5, -4.5}, 14, -18}, {{9.7, 6.5, 4.5}, -14, -18},
    {{18.5, 5, 3.5}, -40, -25},  {{18.5, 5, -3.5}, 40, -25}, {{28.5, 4.5, 0.7}, 0, 8},    {{1.2, 6.5, -4.8}, 12, -14},
    {{24, 3.5, -2}, 65, 5},      {{13.5, 3, -2}, 75, 5},     {{13.5, 3, 2}, -75, 5},      {{24, 3.5, 2}, -65, 5},
    {{1.2, 6.5, 4.8}, -12, -14}, {{2, 3, 10}, 0, 5},         {{2, 3, -10}, 0, 5},         {{12, 4, 0}, 0, 80},
    {{26, 4, 0}, 0, 80},         {{5.5, 3, 0}, -60, 12},     {{5.5, 3, 0}, 60, 12},       {{20, 3, 10}, 0, 5},
    {{20, 3, -10}, 0, 5},        {{14, 7.5, 0}, 0, -80},     {{22, 7.5, 0}, 0, -80},      {{33.5, 3, 0.4}, 0, 5},
    {{36.5, 3.5, 4}, -50, 0},    {{36.5, 3.5, -4}, 50, 0},   {{37, 4, 0}, 0, 70},         {{38.5, 4, 1}, 180, 0},
    {{30, 6, -5}, 160, -15},     {{30, 6, 5}, -160, -15},    {{36, 3, 10}, 180, 5},       {{36, 3, -10}, 180, 5},
    {{15, 5, 5.5}, 180, -10},    {{15, 5, -5.5}, 180, -10},  {{-12, 6, 0}, 0, 3},         {{-18, 3, 5}, -10, 6}};

double radians(double degrees) { return degrees * std::numbers::pi / 180; }

Eigen::Isometry3d pose(Stand const& stand) {
  double const turn = radians(stand.south_deg), rise = radians(stand.up_deg);
  Vector3d const forward(std::cos(rise) * std::cos(turn), std::sin(rise), std::cos(rise) * std::sin(turn));
  Vector3d const right(-std::sin(turn), 0, std::cos(turn));
  Eigen::Isometry3d result = Eigen::Isometry3d::Identity();
  result.linear() << right, forward.cross(right), forward;
  result.translation() = stand.eye;
  return result;
}

}  // namespace

std::vector<ChurchReference> church_references(int count) {
  if (count < 1 || count > kChurchReferences)
    throw Error(ErrorCode::usage, {},
                fmt::format("{} pictures of the church: must be 1 to {}", count, kChurchReferences));
  constexpr int kSize = 512;
  constexpr double kFocal = kSize / 2.0, kMiddle = (kSize - 1) / 2.0;
  Camera const camera = Camera::perspective(kSize, kSize, kFocal, kFocal, kMiddle, kMiddle);
  std::vector<ChurchReference> references;
  references.reserve(static_cast<std::size_t>(count));
  for (int i = 0; i < count; ++i) references.push_back({camera, pose(kStands[i])});
  return references;
}

std::vector<Eigen::Isometry3d> church_path(int count) {
  if (count < 2)
    throw Error(ErrorCode::usage, {}, fmt::format("a path of {} poses through the church: must be 2 or more", count));
  constexpr double kFrom = 8.2, kTo = 27.0;
  std::vector<Eigen::Isometry3d> poses;
  poses.reserve(static_cast<std::size_t>(count));
  for (int i = 0; i < count; ++i) {
    double const at = static_cast<double>(i) / (count - 1), wave = 2 * std::numbers::pi * at;
    Stand const stand{{kFrom + at * (kTo - kFrom), 1.8 + 0.5 * (1 - std::cos(wave)), 0.35 * std::sin(wave)},
                      12 * std::sin(1.5 * wave),
                      4 * std::sin(wave)};
    poses.push_back(pose(stand));
  }
  return poses;
}

}  // namespace scanview
