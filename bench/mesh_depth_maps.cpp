#include "bench/mesh_depth_maps.h"

#include <algorithm>
#include <cmath>
#include <opencv2/core.hpp>

#include "acquire/archive.h"
#include "base/error.h"
#include "base/median.h"
#include "base/ply.h"
#include "base/random.h"

namespace scanview {
namespace {

constexpr double kMillimetres = 1000;  // a metre
constexpr float kHoleDepth = 5;

cv::Mat3d read_first_scan(std::filesystem::path const& archive) {
  auto const files = read_archive(archive, [](std::string const& name) { return name.ends_with("/bun000.ply"); });
  if (files.empty()) throw Error(ErrorCode::bad_input, archive, "has no bun000.ply");
  PlyFile const ply = parse_ply(files.begin()->second, archive);
  PlyElement const& vertex = *ply.find("vertex");
  PlyProperty const& cells = *ply.find("range_grid")->find("vertex_indices");
  constexpr int kRows = 400, kColumns = 512;
  cv::Mat3d points(kRows, kColumns, cv::Vec3d::all(std::nan("")));
  for (int i = 0; i < kRows * kColumns; ++i) {
    if (cells.offsets[i] == cells.offsets[i + 1]) continue;
    auto const v = static_cast<std::size_t>(cells.values[cells.offsets[i]]);
    points(i / kColumns, i % kColumns) =
        kMillimetres * cv::Vec3d(vertex.find("x")->values[v], vertex.find("y")->values[v], vertex.find("z")->values[v]);
  }
  return points;
}

}  // namespace

DepthMap bunny_depth_map(std::filesystem::path const& data) {
  cv::Mat3d const points = read_first_scan(data / "bunny_range.tar.xz");
  cv::Rect box;
  std::vector<double> steps;
  float lowest = INFINITY;
  for (int y = 0; y < points.rows; ++y)
    for (int x = 0; x < points.cols; ++x) {
      if (!std::isfinite(points(y, x)[0])) continue;
      box = box.empty() ? cv::Rect(x, y, 1, 1) : box | cv::Rect(x, y, 1, 1);
      lowest = std::min(lowest, static_cast<float>(points(y, x)[2]));
      if (x + 1 < points.cols && std::isfinite(points(y, x + 1)[0]))
        steps.push_back(points(y, x + 1)[0] - points(y, x)[0]);
    }
  DepthMap map;
  map.name = "bunny";
  map.spacing = std::abs(median(steps));
  map.sigma = 0.1;
  map.height = cv::Mat1f(box.size(), lowest - kHoleDepth);
  map.valid = cv::Mat1b::zeros(box.size());
  for (int y = 0; y < box.height; ++y)
    for (int x = 0; x < box.width; ++x) {
      cv::Vec3d const p = points(box.y + y, box.x + x);
      if (!std::isfinite(p[0])) continue;
      map.height(y, x) = static_cast<float>(p[2]);
      map.valid(y, x) = 255;
    }
  return map;
}

DepthMap synthetic_depth_map(int size, double noise) {
  DepthMap map;
  map.name = "synthetic";
  map.height.create(size, size);
  map.valid = cv::Mat1b(size, size, static_cast<uchar>(255));
  map.surface.create(size, size);
  if (noise > 0) map.sigma = noise;
  double const scale = size / 1024.0;
  for (int row = 0; row < size; ++row)
    for (int column = 0; column < size; ++column) {
      double const x = column / scale, y = row / scale;
      double z = 10 * std::sin(x / 90) * std::cos(y / 70) + 0.02 * x;
      int surface = 0;
      double const sphere = (x - 300) * (x - 300) + (y - 330) * (y - 330);
      if (sphere < 180 * 180) z = 40 + std::sqrt(180 * 180 - sphere), surface = 1;
      double const u = (x - 720) * std::cos(.3) + (y - 300) * std::sin(.3);
      double const v = -(x - 720) * std::sin(.3) + (y - 300) * std::cos(.3);
      if (std::abs(u) < 140 && std::abs(v) < 90) z = 120 + 0.2 * (x - 720), surface = 2;
      double const cone = (x - 300) * (x - 300) + (y - 780) * (y - 780);
      if (cone < 150 * 150) z = 140 - 0.8 * std::sqrt(cone), surface = 3;
      if (std::abs(x - 750) < 170 && std::abs(y - 760) < 120)
        z = 60 + 8 * std::sin(x / 17) * std::sin(y / 23), surface = 4;
      if (noise > 0) z += noise * CounterRandom(1, std::uint64_t(row) << 32 | std::uint32_t(column)).normal();
      map.height(row, column) = static_cast<float>(scale * z);
      map.surface(row, column) = surface;
    }
  return map;
}

RangeImage to_range_image(DepthMap const& map, bool everywhere) {
  RangeImage image =
      empty_range_image(Camera::orthographic(map.height.cols, map.height.rows, map.spacing, map.spacing, 0, 0));
  double highest = 0;
  cv::minMaxLoc(map.height, nullptr, &highest);
  for (int y = 0; y < map.height.rows; ++y)
    for (int x = 0; x < map.height.cols; ++x) {
      if (!everywhere && !map.valid(y, x)) continue;
      image.depth(y, x) = static_cast<float>(highest) - map.height(y, x);
      image.sigma(y, x) = static_cast<float>(map.sigma);
      image.classes(y, x) = static_cast<std::uint8_t>(PixelClass::object);
    }
  return image;
}

cv::Mat1b away_from_steps(DepthMap const& map) {
  cv::Mat1b away = map.valid.clone();
  auto const jump = [&](cv::Point a, cv::Point b) {
    if (map.valid(a) != map.valid(b)) return true;
    if (!map.surface.empty()) return map.surface(a) != map.surface(b);
    return std::abs(map.height(a) - map.height(b)) > 5 * map.spacing;
  };
  for (int y = 0; y < away.rows; ++y)
    for (int x = 0; x < away.cols; ++x)
      for (cv::Point const step : {cv::Point(1, 0), cv::Point(0, 1)}) {
        cv::Point const here(x, y), there = here + step;
        if (there.x >= away.cols || there.y >= away.rows || !jump(here, there)) continue;
        away(here) = away(there) = 0;
      }
  return away;
}

}  // namespace scanview
