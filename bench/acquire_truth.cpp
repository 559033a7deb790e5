#include "bench/acquire_truth.h"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <opencv2/imgproc.hpp>

#include "acquire/rectification.h"
#include "base/parallel.h"
#include "synth/linear_color.h"

namespace scanview {
namespace {

using Eigen::Vector3d;

constexpr int kSide = 4;  // rays a side of a pixel
static_assert(kSide * kSide == kPacket);
constexpr double kStep = 4;           // pixel widths of depth between neighbours: a surface seen under 76°, or a step
constexpr double kBend = 1;           // pixel widths: second difference of depth over kAround pixels
constexpr double kPaintChange = 0.2;  // of the greater reflectance, between neighbours
constexpr double kBeamReach = 6;      // widths
constexpr float kNone = std::numeric_limits<float>::quiet_NaN();

cv::Mat1b around(cv::Mat1b const& mask) {
  cv::Mat1b result;
  cv::dilate(mask, result, cv::Mat1b::ones(2 * kAround + 1, 2 * kAround + 1));
  return result;
}

/// Whether the surface is one smooth piece about a pixel, and all of it seen and lit.
bool is_even(CaptureTruth const& truth, cv::Mat1b const& steps, Camera const& camera, int x, int y) {
  if (x < kAround || y < kAround || x + kAround >= steps.cols || y + kAround >= steps.rows) return false;
  double const z = truth.depth(y, x), most = kBend * camera.pixel_size(z);
  for (int dy = -kAround; dy <= kAround; ++dy)
    for (int dx = -kAround; dx <= kAround; ++dx) {
      if (truth.visible(y + dy, x + dx) == 0 || steps(y + dy, x + dx) != 0) return false;
      double const bend = truth.depth(y + dy, x + dx) + truth.depth(y - dy, x - dx) - 2 * z;
      if (!(std::abs(bend) <= most)) return false;
    }
  return true;
}

double center_code(CaptureRig const& rig, int view, CaptureSide side, cv::Vec2i const& pixel) {
  Eigen::Isometry3d const pose = rig.room_from_camera(side);
  Vector3d const ray = pose.linear() * rig.camera(side).ray({pixel[0], pixel[1]});
  auto const hit = rig.scene().meet(view, pose.translation(), ray);
  return std::isnan(hit.distance) ? std::numeric_limits<double>::quiet_NaN() : rig.light().at(hit.point).column;
}

}  // namespace

TrueSignal true_signal(CaptureRig const& rig, int view, CaptureSide side, int x, int y) {
  Eigen::Isometry3d const pose = rig.room_from_camera(side);
  std::array<Vector3d, kPacket> directions;
  for (int i = 0; i < kPacket; ++i)
    directions[static_cast<std::size_t>(i)] =
        pose.linear() *
        rig.camera(side).ray({x - 0.5 + (i % kSide + 0.5) / kSide, y - 0.5 + (i / kSide + 0.5) / kSide});
  SceneSamples const samples = rig.scene().look(view, pose.translation(), directions, rig.light());
  TrueSignal signal;
  signal.is_whole = true;
  double weight = 0, sum = 0, square = 0, room = 0;
  int objects = 0;
  for (auto const& s : samples) {
    double const w = s.weight + s.gloss, t = s.light.column;
    signal.is_whole = signal.is_whole && s.is_object && w > 0;
    weight += w, sum += w * t;
    room += luminance(s.room);
    if (s.is_object) signal.albedo += s.albedo, ++objects;
  }
  if (objects > 0) signal.albedo /= objects;
  double const levels = rig.sensor().largest() * rig.exposure() / kPacket;
  signal.ambient = levels * rig.options().scene.ambient * room;
  if (weight <= 0) return signal;
  signal.time = sum / weight;
  for (auto const& s : samples) square += (s.weight + s.gloss) * std::pow(s.light.column - signal.time, 2);
  double const beam = rig.light().beam_steps();
  signal.width = std::sqrt(beam * beam + square / weight);
  signal.height = levels * weight * beam / signal.width;
  return signal;
}

double time_bound(TrueSignal const& signal, SensorOptions const& sensor, int frames) {
  double const top = sensor.bits == 16 ? 65535 : 255, full = sensor.full_scale_electrons;
  double const gain = full > 0 ? top / full : 0, read = gain * sensor.read_electrons;
  auto const variance = [&](double level) { return read * read + gain * level + 1.0 / 12; };
  Eigen::Matrix4d information = Eigen::Matrix4d::Zero();
  int const first = std::clamp(static_cast<int>(std::ceil(signal.time - kBeamReach * signal.width)), 0, frames - 1);
  int const last = std::clamp(static_cast<int>(std::floor(signal.time + kBeamReach * signal.width)), 0, frames - 1);
  for (int k = first; k <= last; ++k) {
    double const u = (k - signal.time) / signal.width, e = std::exp(-0.5 * u * u), slope = signal.height / signal.width;
    Eigen::Vector4d const row(1, e, slope * e * u, slope * e * u * u);
    information += row * row.transpose() / variance(signal.ambient + signal.height * e);
  }
  information(0, 0) += (frames - (last - first + 1)) / variance(signal.ambient);
  return std::sqrt(information.inverse()(2, 2));
}

TrueView true_view(CaptureRig const& rig, int view, Context& context) {
  CaptureTruth const truth = rig.truth(view, context);
  Camera const camera = ideal_left_camera(rig.layout().rig_in_use);
  Rectification const rectified = rectify(rig.layout().rig_in_use);
  Eigen::Isometry3d const right_from_left = rig.layout().rig_in_use.right_from_left;
  Eigen::Isometry3d const room_from_right = rig.room_from_camera(CaptureSide::right);
  cv::Size const size = truth.depth.size();
  TrueView result{truth.depth, truth.visible, {}, {}, cv::Mat1b(size, uchar{0}), cv::Mat1f(size, kNone), {}, {}, {},
                  {}};
  for (std::size_t s = 0; s < 2; ++s) {
    result.pixel[s] = cv::Mat2i(size, cv::Vec2i(0, 0));
    for (auto* maps : {&result.code_bound, &result.code_light, &result.code_center})
      (*maps)[s] = cv::Mat1f(size, kNone);
  }
  cv::Mat1f albedo(size, kNone);
  auto const rows = static_cast<std::size_t>(size.height);
  auto const raw = [](LensCamera const& lens, Vector3d const& p) {
    Eigen::Vector2d const at = lens.project(p);
    return cv::Vec2i(static_cast<int>(std::lround(at.x())), static_cast<int>(std::lround(at.y())));
  };
  for_each_index(context, rows, [&](std::size_t row) {
    int const y = static_cast<int>(row);
    for (int x = 0; x < size.width; ++x) {
      if (std::isnan(truth.depth(y, x))) continue;
      cv::Vec2i const at = raw(rig.camera(CaptureSide::left), camera.unproject(x, y, truth.depth(y, x)));
      TrueSignal const signal = true_signal(rig, view, CaptureSide::left, at[0], at[1]);
      albedo(y, x) = static_cast<float>(signal.albedo);
    }
  });
  cv::Mat1b steps(size, uchar{0}), paint(size, uchar{0});
  for (int y = 0; y < size.height; ++y)
    for (int x = 0; x < size.width; ++x)
      for (auto const& [u, v] : {std::pair{x + 1, y}, std::pair{x, y + 1}}) {
        if (u >= size.width || v >= size.height) continue;
        double const a = truth.depth(y, x), b = truth.depth(v, u);
        if (std::isnan(a) && std::isnan(b)) continue;
        if (!(std::abs(a - b) <= kStep * camera.pixel_size(std::min(a, b)))) steps(y, x) = steps(v, u) = 255;
        double const p = albedo(y, x), q = albedo(v, u);
        if (std::abs(p - q) > kPaintChange * std::max(p, q)) paint(y, x) = paint(v, u) = 255;
      }
  result.near_paint = around(paint);
  result.near_edge = around(steps) | result.near_paint;
  for_each_index(context, rows, [&](std::size_t row) {
    int const y = static_cast<int>(row);
    for (int x = 0; x < size.width; ++x) {
      if (truth.visible(y, x) == 0 || !is_even(truth, steps, camera, x, y)) continue;
      double const z = truth.depth(y, x);
      auto const point = [&](int u, int v) { return right_from_left * camera.unproject(u, v, truth.depth(v, u)); };
      Vector3d const p = rectified.rectified_from_right * point(x, y);
      Vector3d const normal =
          rectified.rectified_from_right * (point(x + 1, y) - point(x - 1, y)).cross(point(x, y + 1) - point(x, y - 1));
      std::array<cv::Vec2i, 2> const at = {raw(rig.camera(CaptureSide::left), camera.unproject(x, y, z)),
                                           raw(rig.camera(CaptureSide::right), point(x, y))};
      std::array<double, 2> bound = {0, 0};
      bool is_whole = true;
      for (std::size_t s = 0; s < 2; ++s) {
        auto const side = static_cast<CaptureSide>(s);
        TrueSignal const signal = true_signal(rig, view, side, at[s][0], at[s][1]);
        bound[s] = time_bound(signal, rig.options().sensor, rig.light().frames());
        is_whole = is_whole && signal.is_whole;
        result.pixel[s](y, x) = at[s];
        result.code_bound[s](y, x) = static_cast<float>(bound[s]);
        result.code_light[s](y, x) = static_cast<float>(signal.time);
        result.code_center[s](y, x) = static_cast<float>(center_code(rig, view, side, at[s]));
      }
      if (!is_whole) continue;
      auto const code_at = [&](double pixels) {
        Vector3d const ray = p / p.z() + Vector3d(pixels / rectified.right.fx(), 0, 0);
        Vector3d const there = ray * (normal.dot(p) / normal.dot(ray));
        return rig.light().at(room_from_right * (rectified.rectified_from_right.transpose() * there)).column;
      };
      double const slope = std::abs(code_at(0.5) - code_at(-0.5));
      double const sigma =
          z * p.z() / (rectified.right.fx() * rectified.baseline) * std::hypot(bound[0], bound[1]) / slope;
      if (!std::isfinite(sigma)) continue;
      result.bound(y, x) = static_cast<float>(sigma);
      result.is_even(y, x) = 255;
    }
  });
  return result;
}

}  // namespace scanview
