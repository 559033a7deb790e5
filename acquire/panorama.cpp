#include "acquire/panorama.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numbers>
#include <optional>
#include <set>

#include "acquire/depth_noise.h"
#include "acquire/import_build.h"
#include "acquire/scan_set_file.h"
#include "base/error.h"
#include "base/image_file.h"
#include "base/json_fields.h"
#include "base/parallel.h"
#include "base/srgb.h"

namespace scanview {
namespace {

namespace fs = std::filesystem;
using Eigen::Vector2d;
using Eigen::Vector3d;
using std::numbers::pi;

constexpr float kSky = std::numeric_limits<float>::infinity();

[[noreturn]] void fail(fs::path const& path, std::string const& message) {
  throw Error(ErrorCode::bad_input, path, message);
}

/// Pixel coordinates and directions of an equirectangular picture, 2:1.
struct Sphere {
  int width, height;
  explicit Sphere(cv::Size size) : width(size.width), height(size.height) {}

  Vector3d direction(double u, double v) const {
    double const a = 2 * pi * ((u + 0.5) / width - 0.5), b = pi * (0.5 - (v + 0.5) / height);
    return {std::cos(b) * std::sin(a), std::sin(b), -std::cos(b) * std::cos(a)};
  }
  Vector2d pixel(Vector3d const& direction) const {
    double const a = std::atan2(direction.x(), -direction.z());
    double const b = std::atan2(direction.y(), std::hypot(direction.x(), direction.z()));
    return {width * (a / (2 * pi) + 0.5) - 0.5, height * (0.5 - b / pi) - 0.5};
  }
  /// Columns wrap around; a row beyond a pole is the one before it, half a turn away.
  cv::Point wrapped(int x, int y) const {
    if (y < 0 || y >= height) {
      y = y < 0 ? -1 - y : 2 * height - 1 - y;
      x += width / 2;
    }
    return {(x % width + width) % width, y};
  }
};

/// Colour in linear light between four pixels.
Vector3d linear_color(cv::Mat3b const& picture, Vector2d const& pixel) {
  Sphere const sphere(picture.size());
  auto const& linear = linear_from_srgb8();
  int const x = static_cast<int>(std::floor(pixel.x())), y = static_cast<int>(std::floor(pixel.y()));
  double const fx = pixel.x() - x, fy = pixel.y() - y;
  Vector3d sum = Vector3d::Zero();
  for (int corner = 0; corner < 4; ++corner) {
    int const dx = corner & 1, dy = corner >> 1;
    cv::Vec3b const& c = picture(sphere.wrapped(x + dx, y + dy));
    sum += (dx ? fx : 1 - fx) * (dy ? fy : 1 - fy) * Vector3d(linear[c[0]], linear[c[1]], linear[c[2]]);
  }
  return sum;
}

cv::Vec3b encoded(Vector3d const& linear) {
  cv::Vec3b color;
  for (int c = 0; c < 3; ++c) color[c] = cv::saturate_cast<std::uint8_t>(255 * srgb_from_linear(linear[c]));
  return color;
}

/// Ray lengths of a panorama, and which neighbours are of one surface.
class Rays {
 public:
  explicit Rays(Panorama const& panorama)
      : rays_(panorama.ray),
        sphere_(panorama.ray.size()),
        noise_{.quantum = panorama.quantum},
        pixels_(Camera::perspective(sphere_.width, sphere_.height, sphere_.width / (2 * pi), sphere_.width / (2 * pi),
                                    0, 0)) {}

  /// The ray length along a direction (unit): NaN or infinite where the nearest sample is.
  double along(Vector3d const& direction) const {
    Vector2d const pixel = sphere_.pixel(direction);
    cv::Point const nearest(static_cast<int>(std::lround(pixel.x())), static_cast<int>(std::lround(pixel.y())));
    double const length = at(nearest);
    if (!std::isfinite(length)) return length;
    // The nearest sample with its neighbours on the pixel's side comes first. A row is no great circle: between two
    // samples it is beside the triangles' common edge, up to a quarter of a row at a pole.
    int const dx = pixel.x() >= nearest.x ? 1 : -1, dy = pixel.y() >= nearest.y ? 1 : -1;
    cv::Point const beside(dx, 0), above(0, dy);
    Meeting best{length, -0.3};
    for (auto const& [b, c] :
         {std::pair(beside, above), std::pair(beside, beside + above), std::pair(above, above + beside),
          std::pair(beside, -above), std::pair(-beside, above)}) {
      if (auto const met = meet({nearest, nearest + b, nearest + c}, direction); met && met->within > best.within)
        best = *met;
      if (best.within > -1e-6) break;
    }
    return best.length;
  }

  double sigma(double length) const { return std::max(noise_.sigma(length), 1e-6 * length); }

 private:
  double at(cv::Point p) const { return rays_(sphere_.wrapped(p.x, p.y)); }

  /// Whether 1 / r at p goes on from its neighbours on either side as on a plane: it bends by a quarter of its step at
  /// most, where a step between surfaces bends by all of it.
  bool goes_on(cv::Point p, cv::Point step) const {
    double const s = 1 / at(p), before = 1 / at(p - step), after = 1 / at(p + step);
    double const rounding = 6 * sigma(at(p)) * s * s;
    return std::abs(before - 2 * s + after) <= 0.25 * std::abs(after - before) / 2 + rounding;
  }

  bool joined(cv::Point a, cv::Point b) const {
    double const ra = at(a), rb = at(b);
    if (!std::isfinite(ra) || !std::isfinite(rb)) return false;
    cv::Point const step = b - a;
    double const pixels = std::hypot(step.x, step.y);
    if (std::abs(ra - rb) <= largest_step(pixels_, std::min(ra, rb), sigma(ra), sigma(rb), pixels)) return true;
    return goes_on(a, step) && goes_on(b, step);
  }

  /// Where a direction meets the plane of three samples: how far away, and the least of its weights, negative outside
  /// their triangle.
  struct Meeting {
    double length, within;
  };

  /// Nothing where the three are not of one surface.
  std::optional<Meeting> meet(std::array<cv::Point, 3> const& corners, Vector3d const& direction) const {
    Eigen::Matrix3d directions;
    Vector3d inverse;
    for (int i = 0; i < 3; ++i) {
      if (!joined(corners[i], corners[(i + 1) % 3])) return std::nullopt;
      cv::Point const p = sphere_.wrapped(corners[i].x, corners[i].y);
      directions.col(i) = sphere_.direction(p.x, p.y);
      inverse[i] = 1 / at(corners[i]);
    }
    Vector3d const weights = directions.inverse() * direction;
    double const met = weights.dot(inverse);
    if (!(met > 0.5 * inverse.minCoeff())) return std::nullopt;  // outside of the triangle, towards its horizon
    return Meeting{1 / met, weights.minCoeff()};
  }

  cv::Mat1f const& rays_;
  Sphere sphere_;
  DepthNoise noise_;
  Camera pixels_;
};

std::vector<int> values(Json const& json, char const* key, std::vector<int> otherwise, fs::path const& path) {
  if (!json.contains(key)) return otherwise;
  if (!json[key].is_array()) fail(path, fmt::format("'{}' is no list", key));
  std::vector<int> list;
  for (auto const& value : json[key]) list.push_back(json_integer(value, key, 0, 65535, path));
  return list;
}

bool is_exr(fs::path const& path) { return path.extension() == ".exr" || path.extension() == ".EXR"; }

PanoramaFiles files_from_json(Json const& json, std::size_t index, fs::path const& path) {
  refuse_unknown_keys(json, {"name", "color", "depth", "depth_unit", "missing", "sky", "scene_from_panorama"}, "nodes",
                      path);
  PanoramaFiles files;
  files.name = json.contains("name") ? json_text(json["name"], "name", path) : fmt::format("{:03d}", index);
  if (safe_view_name(files.name) != files.name)
    fail(path, fmt::format("'name' {} has characters besides letters, digits, '_', '-', '.'", files.name));
  files.color = path.parent_path() / json_text(json_member(json, "color", path), "color", path);
  files.depth = path.parent_path() / json_text(json_member(json, "depth", path), "depth", path);
  files.depth_unit = is_exr(files.depth) ? 1 : 0.001;
  if (json.contains("depth_unit")) files.depth_unit = json_finite(json["depth_unit"], "depth_unit", path);
  if (!(files.depth_unit >= 1e-9 && files.depth_unit <= 1e9)) fail(path, "'depth_unit' is not in 1e-9 .. 1e9");
  if (is_exr(files.depth) && (json.contains("missing") || json.contains("sky")))
    fail(path, "'missing' and 'sky' are values of 16 bits; EXR has NaN and infinity");
  files.missing = values(json, "missing", files.missing, path);
  files.sky = values(json, "sky", files.sky, path);
  if (json.contains("scene_from_panorama"))
    files.scene_from_panorama = pose_from_json(json["scene_from_panorama"], path, "'scene_from_panorama'");
  return files;
}

void require_two_to_one(cv::Size size, fs::path const& path) {
  if (size.width != 2 * size.height || size.height < 2)
    fail(path, fmt::format("the picture is {}x{}: a panorama is twice as wide as high", size.width, size.height));
}

cv::Mat1f read_rays(PanoramaFiles const& files) {
  cv::Mat1f rays;
  if (is_exr(files.depth)) {
    rays = read_depth_exr(files.depth);
    for (float& ray : rays) {
      ray *= static_cast<float>(files.depth_unit);
      if (!(ray > 0)) ray = kMissing;
    }
    return rays;
  }
  cv::Mat const stored = read_image(files.depth);
  if (stored.type() != CV_16UC1) fail(files.depth, "a depth picture has one channel of 16 bits");
  std::vector<float> meaning(65536);
  for (std::size_t value = 0; value < meaning.size(); ++value)
    meaning[value] = static_cast<float>(static_cast<double>(value) * files.depth_unit);
  meaning[0] = kMissing;  // no surface is where the eye is
  for (int const value : files.sky) meaning[static_cast<std::size_t>(value)] = kSky;
  for (int const value : files.missing) meaning[static_cast<std::size_t>(value)] = kMissing;
  rays.create(stored.size());
  for (int y = 0; y < rays.rows; ++y)
    for (int x = 0; x < rays.cols; ++x) rays(y, x) = meaning[stored.at<std::uint16_t>(y, x)];
  return rays;
}

}  // namespace

RangeImage resample_panorama(Panorama const& panorama, Eigen::Matrix3d const& scene_from_panorama, int side, int size) {
  RangeImage image = empty_range_image(cube_side_camera(size));
  Eigen::Matrix3d const panorama_from_camera =
      scene_from_panorama.transpose() * scene_from_cube_side(side, Vector3d::Zero()).linear();
  Rays const rays(panorama);
  Sphere const colors(panorama.color.size());
  int const samples = std::clamp(static_cast<int>(std::ceil(2 * colors.width / (pi * size))), 2, 32);
  for (int y = 0; y < size; ++y)
    for (int x = 0; x < size; ++x) {
      Vector3d sum = Vector3d::Zero();
      for (int i = 0; i < samples * samples; ++i) {
        double const u = x - 0.5 + (i % samples + 0.5) / samples, v = y - 0.5 + (i / samples + 0.5) / samples;
        sum += linear_color(panorama.color, colors.pixel(panorama_from_camera * image.camera.ray_direction(u, v)));
      }
      image.color(y, x) = encoded(sum / (samples * samples));
      Vector3d const ray = image.camera.ray_direction(x, y);
      double const length = rays.along(panorama_from_camera * ray.normalized());
      if (std::isnan(length)) continue;
      if (std::isinf(length)) {
        image.classes(y, x) = static_cast<std::uint8_t>(PixelClass::background);
        continue;
      }
      image.depth(y, x) = static_cast<float>(length / ray.norm());
      image.sigma(y, x) = static_cast<float>(rays.sigma(length) / ray.norm());
      image.classes(y, x) = static_cast<std::uint8_t>(PixelClass::object);
    }
  return image;
}

PanoramaReader::PanoramaReader(fs::path const& path) {
  fs::path const manifest = fs::is_directory(path) ? path / "panoramas.json" : path;
  Json const json = read_json(manifest);
  refuse_unknown_keys(json, {"format", "unit", "nodes"}, "", manifest);
  json_integer(json_member(json, "format", manifest), "format", 1, 1, manifest);
  unit_ = unit_from_string(json_text(json_member(json, "unit", manifest), "unit", manifest), manifest);
  Json const& nodes = json_member(json, "nodes", manifest);
  if (!nodes.is_array() || nodes.empty()) fail(manifest, "'nodes' is no list of at least one node");
  std::set<std::string> names;
  for (auto const& node : nodes) {
    panoramas_.push_back(files_from_json(node, panoramas_.size(), manifest));
    std::string const& name = panoramas_.back().name;
    if (!names.insert(name).second) fail(manifest, fmt::format("two nodes have the 'name' {}", name));
  }
}

CapturedNode PanoramaReader::read(std::size_t node, int size, Context& context) const {
  PanoramaFiles const& files = panoramas_.at(node);
  Panorama panorama;
  panorama.color = read_color(files.color);
  require_two_to_one(panorama.color.size(), files.color);
  panorama.ray = read_rays(files);
  require_two_to_one(panorama.ray.size(), files.depth);
  panorama.quantum = is_exr(files.depth) ? 0 : files.depth_unit;
  int const pixels = size == 0 ? panorama.color.cols / 4 : size;
  CapturedNode result;
  result.name = files.name;
  result.position = files.scene_from_panorama.translation();
  result.sides.resize(kCubeSides);
  for_each_index(context, kCubeSides, [&](std::size_t i) {
    int const side = static_cast<int>(i);
    result.sides[i].name = cube_side_name(side);
    result.sides[i].image = resample_panorama(panorama, files.scene_from_panorama.linear(), side, pixels);
    result.sides[i].object_from_camera = scene_from_cube_side(side, result.position);
  });
  result.check();
  return result;
}

}  // namespace scanview
