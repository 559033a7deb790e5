#include "tests/acquire/light_scene.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "base/image_file.h"
#include "base/random.h"

namespace scanview {
namespace {

using Eigen::Vector3d;

constexpr double kNever = std::numeric_limits<double>::infinity();
constexpr int kWidth = 96, kHeight = 72;

}  // namespace

double gray_stripe(double column, int bit) {
  auto const is_set = [&](double at) {
    auto const k = static_cast<unsigned>(std::max(at, 0.0));
    return static_cast<double>((k ^ (k >> 1)) >> bit & 1U);
  };
  constexpr double kHalf = 0.25;
  double const before = column - kHalf, after = column + kHalf, border = std::floor(after);
  if (border <= before) return is_set(column);
  double const share = (after - border) / (2 * kHalf);
  return (1 - share) * is_set(before) + share * is_set(after);
}

LightScene::LightScene() {
  auto const camera = [](double cx) {
    LensCamera lens_camera{Camera::perspective(kWidth, kHeight, 110, 110, cx, 35.2), {}};
    lens_camera.lens.k1 = -0.05;
    return lens_camera;
  };
  rig.left = camera(47.3);
  rig.right = camera(48.1);
  Eigen::Matrix3d const left_from_right = Eigen::AngleAxisd(-0.235, Vector3d::UnitY()).toRotationMatrix();
  rig.right_from_left.linear() = left_from_right.transpose();
  rig.right_from_left.translation() = -left_from_right.transpose() * Vector3d(120, 2, 5);
}

double LightScene::depth(Vector3d const& o, Vector3d const& d) const {
  // The plane z = 580 + 0.2 x + 0.1 y.
  double const fall = d.z() - 0.2 * d.x() - 0.1 * d.y();
  double t = (580 + 0.2 * o.x() + 0.1 * o.y() - o.z()) / fall;
  if (!(t > 1e-6)) t = kNever;
  if (shape == Shape::sphere) {
    Vector3d const from = o - Vector3d(0, 0, 500);
    double const a = d.squaredNorm(), b = d.dot(from), c = from.squaredNorm() - 110.0 * 110.0;
    if (b * b - a * c > 0) {
      double const near = (-b - std::sqrt(b * b - a * c)) / a;
      if (near > 1e-6) t = std::min(t, near);
    }
  } else if (shape == Shape::step) {
    double const board = (470 - o.z()) / d.z();
    Vector3d const p = o + board * d;
    if (board > 1e-6 && std::abs(p.x()) < 80 && std::abs(p.y()) < 70) t = std::min(t, board);
  }
  return t;
}

double LightScene::share(Vector3d const& p) const {
  Vector3d const d = p - light;
  return 0.5 + spread * ((along_rows ? d.y() : d.x()) / d.z() - middle);
}

bool LightScene::is_lit(Vector3d const& p) const { return depth(light, p - light) > 1 - 1e-6; }

cv::Mat1d LightScene::true_depth() const {
  Camera const& camera = rig.left.camera;
  cv::Mat1d result(camera.height(), camera.width());
  for (int y = 0; y < result.rows; ++y)
    for (int x = 0; x < result.cols; ++x) result(y, x) = depth(Vector3d::Zero(), camera.ray_direction(x, y));
  return result;
}

cv::Mat1b LightScene::smooth_part(int radius) const {
  Camera const& camera = rig.left.camera;
  cv::Mat1d const depths = true_depth();
  Vector3d const right_eye = rig.right_from_left.inverse().translation();
  // 0: not lit, not seen by the right camera, or out of its picture; else which surface.
  cv::Mat1b surface(depths.size(), std::uint8_t{0});
  for (int y = 0; y < depths.rows; ++y)
    for (int x = 0; x < depths.cols; ++x) {
      Vector3d const p = camera.unproject(x, y, depths(y, x));
      Eigen::Vector2d const other = rig.right.project(rig.right_from_left * p);
      bool const in_front = p.z() < 570 + 0.2 * p.x() + 0.1 * p.y();
      if (is_lit(p) && depth(right_eye, p - right_eye) > 1 - 1e-6 && other.x() > 2 && other.x() < kWidth - 3 &&
          other.y() > 2 && other.y() < kHeight - 3)
        surface(y, x) = in_front ? 2 : 1;
    }
  cv::Mat1b part(depths.size(), std::uint8_t{0});
  for (int y = radius; y + radius < part.rows; ++y)
    for (int x = radius; x + radius < part.cols; ++x) {
      bool same = surface(y, x) != 0;
      for (int dy = -radius; dy <= radius; ++dy)
        for (int dx = -radius; dx <= radius; ++dx) same = same && surface(y + dy, x + dx) == surface(y, x);
      part(y, x) = same;
    }
  return part;
}

LightPictures::LightPictures(LightScene const& scene, Side side, LightOptions const& options)
    : options_(options), stream_(side == Side::left ? 0 : 1'000'000) {
  LensCamera const& camera = scene.camera(side);
  size_ = {camera.camera.width(), camera.camera.height()};
  Eigen::Isometry3d const left_from_camera =
      side == Side::left ? Eigen::Isometry3d::Identity() : scene.rig.right_from_left.inverse();
  for (int y = 0; y < size_.height; ++y)
    for (int x = 0; x < size_.width; ++x) {
      auto& share = share_.emplace_back();
      auto& paint = paint_.emplace_back();
      for (std::size_t i = 0; i < kSamples; ++i) {
        double const offset = (static_cast<double>(i) + 0.5) / kSamples - 0.5;
        Vector3d const direction = left_from_camera.linear() * camera.ray({x + offset, y});
        Vector3d const eye = left_from_camera.translation();
        Vector3d const p = eye + scene.depth(eye, direction) * direction;
        share[i] = scene.is_lit(p) ? static_cast<float>(scene.share(p)) : kMissing;
        paint[i] = static_cast<float>(scene.paint(p));
      }
    }
}

cv::Mat LightPictures::picture(std::function<double(double)> const& light, int number) const {
  double const scale = options_.is_16_bit ? 257 : 1;
  cv::Mat1d values(size_);
  CounterRandom random(options_.noise.seed, stream_ + static_cast<std::uint64_t>(number));
  std::size_t pixel = 0;
  for (double& value : values) {
    double seen = 0;
    for (std::size_t i = 0; i < kSamples; ++i) {
      double const share = share_[pixel][i], beam = std::isnan(share) ? 0 : light(share);
      seen += paint_[pixel][i] * (options_.ambient + options_.height * beam) / kSamples;
    }
    double const sigma = std::sqrt(options_.noise.read * options_.noise.read + options_.noise.gain * seen);
    value = scale * (seen + sigma * random.normal());
    ++pixel;
  }
  cv::Mat result;
  values.convertTo(result, options_.is_16_bit ? CV_16U : CV_8U);
  return result;
}

cv::Mat LightPictures::sweep(int k) const {
  return picture(
      [&](double share) {
        double const u = (share * (options_.steps - 1) - k) / options_.beam;
        return std::abs(u) < 9 ? std::exp(-0.5 * u * u) : 0;
      },
      k);
}

cv::Mat LightPictures::gray(GrayFrame const& frame, int number) const {
  return picture(
      [&](double share) -> double {
        if (frame.kind != GrayFrame::Kind::bit) return frame.kind == GrayFrame::Kind::white ? 1 : 0;
        double const lit = gray_stripe(share * (1 << options_.bits), frame.bit);
        return frame.inverse ? 1 - lit : lit;
      },
      number);
}

Capture write_capture(std::filesystem::path const& folder, LightScene const& scene, LightOptions const& options,
                      GrayKind gray) {
  std::filesystem::create_directories(folder);
  write_stereo_rig(folder / "rig.yml", scene.rig);
  int const count = gray == GrayKind::none ? options.steps : options.bits * (gray == GrayKind::inverses ? 2 : 1);
  Json json = {{"pattern", gray == GrayKind::none ? "sweep" : "gray"},
               {"views", Json::array({"view_000"})},
               {"left", "left/{:02d}.png"},
               {"right", "right/{:02d}.png"},
               {"first", 0},
               {"last", count - 1},
               {"rig", "rig.yml"}};
  if (gray != GrayKind::none) json["bits"] = options.bits;
  if (gray == GrayKind::levels) {
    json["inverse"] = false;
    json["white"] = "{side}/white.png";
    json["black"] = "{side}/black.png";
  }
  write_json(folder / "capture.json", json);
  Capture const capture = read_capture(folder / "capture.json", folder);
  for (Side const side : kSides) {
    std::filesystem::create_directories(folder / "view_000" / to_string(side));
    LightPictures const pictures(scene, side, options);
    for (int k = 0; k < count; ++k)
      write_file(capture.frame_path("view_000", side, k),
                 encode_png(gray == GrayKind::none ? pictures.sweep(k)
                                                   : pictures.gray(capture.gray[static_cast<std::size_t>(k)], k)));
    if (gray != GrayKind::levels) continue;
    auto const s = static_cast<std::size_t>(side);
    write_file(capture.path_of("view_000", (*capture.white)[s]),
               encode_png(pictures.gray({GrayFrame::Kind::white}, 1000)));
    write_file(capture.path_of("view_000", (*capture.black)[s]),
               encode_png(pictures.gray({GrayFrame::Kind::black}, 1001)));
  }
  return capture;
}

DepthErrors depth_errors(RangeImage const& image, LightScene const& scene, cv::Mat1b const& part) {
  DepthErrors errors;
  cv::Mat1d const truth = scene.true_depth();
  std::size_t wrong = 0;
  double sum = 0;
  for (int y = 0; y < part.rows; ++y)
    for (int x = 0; x < part.cols; ++x) {
      if (part(y, x) == 0) continue;
      ++errors.pixels;
      if (!image.has_depth(x, y)) continue;
      ++errors.depths;
      double const u = (static_cast<double>(image.depth(y, x)) - truth(y, x)) / static_cast<double>(image.sigma(y, x));
      if (std::abs(u) > 5)
        ++wrong;
      else
        sum += u * u;
    }
  if (errors.depths == 0) return errors;
  errors.wrong = static_cast<double>(wrong) / static_cast<double>(errors.depths);
  errors.ratio = std::sqrt(sum / static_cast<double>(std::max<std::size_t>(errors.depths - wrong, 1)));
  return errors;
}

}  // namespace scanview
