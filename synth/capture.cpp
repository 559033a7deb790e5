#include "synth/capture.h"

#include <algorithm>
#include <cmath>

#include "base/parallel.h"
#include "base/random.h"
#include "base/srgb.h"
#include "synth/interreflection.h"
#include "synth/linear_color.h"

namespace scanview {
namespace {

using Eigen::Isometry3d;
using Eigen::Vector2d;
using Eigen::Vector3d;
using Eigen::Vector3f;

constexpr int kBandRows = 8;     // a task
constexpr int kSamplesSide = 4;  // rays a side of a pixel
static_assert(kSamplesSide * kSamplesSide == kPacket);
constexpr int kMeterSpacing = 6;          // pixels between the rays that meter the exposure
constexpr double kMeterQuantile = 0.998;  // a few brighter points may clip
constexpr float kNoDepth = std::numeric_limits<float>::quiet_NaN();

constexpr std::uint64_t kBounceItem = std::uint64_t{1} << 40;  // keys the directions of interreflection

/// Key of a picture's random numbers.
std::uint64_t picture_key(int view, CaptureSide side) {
  return 2 * static_cast<std::uint64_t>(view + 1) + static_cast<std::uint64_t>(side);
}

/// (x/z, y/z) of the ray through every pixel's corner, (height + 1) rows of (width + 1). Between them rays are
/// interpolated: a lens bends them by less than 1e-4 pixel within a pixel.
std::vector<Vector2d> corner_rays(LensCamera const& camera) {
  std::vector<Vector2d> rays;
  for (int y = 0; y <= camera.camera.height(); ++y)
    for (int x = 0; x <= camera.camera.width(); ++x) rays.push_back(camera.ray(Vector2d(x - 0.5, y - 0.5)).head<2>());
  return rays;
}

CaptureOptions checked(CaptureOptions const& options) {
  options.validate();
  return options;
}

TriangleMesh const& checked(TriangleMesh const& model) {
  model.check();
  return model;
}

void write_color(std::vector<Vector3f> const& linear, SensorOptions const& sensor, CounterRandom random,
                 cv::Vec3b* row) {
  double const full = sensor.full_scale_electrons;
  for (std::size_t x = 0; x < linear.size(); ++x)
    for (int c = 0; c < 3; ++c) {
      double value = linear[x][2 - c];
      if (full > 0) value += std::sqrt(value / full + std::pow(sensor.read_electrons / full, 2)) * random.normal();
      row[x][c] = cv::saturate_cast<uchar>(255 * srgb_from_linear(std::clamp(value, 0.0, 1.0)));
    }
}

}  // namespace

CaptureRig::CaptureRig(TriangleMesh const& model, CaptureOptions const& options, Context& context)
    : options_(checked(options)),
      centered_(centered(checked(model))),
      layout_(make_layout(centered_, options_)),
      light_(layout_, options_, context.seed),
      scene_(model, centered_, layout_, options_.scene, context),
      sensor_(options_.sensor),
      seed_(context.seed) {
  for (auto const side : {CaptureSide::left, CaptureSide::right})
    corners_[static_cast<int>(side)] = corner_rays(camera(side));
  exposure_ = find_exposure(context);
}

LensCamera const& CaptureRig::camera(CaptureSide side) const {
  return side == CaptureSide::left ? layout_.rig_in_use.left : layout_.rig_in_use.right;
}

Isometry3d CaptureRig::room_from_camera(CaptureSide side) const {
  return side == CaptureSide::left ? layout_.room_from_left : layout_.room_from_right();
}

double CaptureRig::find_exposure(Context& context) const {
  std::vector<std::vector<float>> brightness(static_cast<std::size_t>(2 * options_.views));
  for_each_index(context, brightness.size(), [&](std::size_t task) {
    auto const side = static_cast<CaptureSide>(task % 2);
    Isometry3d const pose = room_from_camera(side);
    std::array<Vector3d, kPacket> directions;
    int count = 0;
    auto const measure = [&] {
      for (int i = count; i < kPacket; ++i) directions[i] = directions[0];
      auto const samples = scene_.look(static_cast<int>(task / 2), pose.translation(), directions, light_);
      for (int i = 0; i < count; ++i)
        if (samples[i].is_object && samples[i].weight > 0)
          brightness[task].push_back(samples[i].weight +
                                     static_cast<float>(options_.scene.ambient) * luminance(samples[i].room));
      count = 0;
    };
    int const step = std::max(1, std::min({kMeterSpacing, options_.width / 40, options_.height / 40}));
    for (int y = 0; y < options_.height; y += step)
      for (int x = 0; x < options_.width; x += step) {
        directions[count++] =
            pose.linear() * corners_[static_cast<int>(side)][y * (options_.width + 1) + x].homogeneous();
        if (count == kPacket) measure();
      }
    if (count > 0) measure();
  });
  std::vector<float> all;
  for (auto const& part : brightness) all.insert(all.end(), part.begin(), part.end());
  double brightest = 1;
  if (!all.empty()) {
    auto const at = all.begin() + static_cast<std::ptrdiff_t>(kMeterQuantile * static_cast<double>(all.size() - 1));
    std::nth_element(all.begin(), at, all.end());
    brightest = *at;
  }
  return kPeakShare * options_.sensor.exposure / brightest;
}

CapturePictures CaptureRig::take(int view, CaptureSide side, Context& context) const {
  CapturePictures pictures;
  for (int k = 0; k < light_.frames(); ++k)
    pictures.frames.emplace_back(options_.height, options_.width, sensor_.type());
  pictures.color.create(options_.height, options_.width);
  for_each_index(context, static_cast<std::size_t>((options_.height + kBandRows - 1) / kBandRows),
                 [&](std::size_t band) {
                   int const first = static_cast<int>(band) * kBandRows;
                   for (int y = first; y < std::min(first + kBandRows, options_.height); ++y)
                     take_row(view, side, y, pictures);
                 });
  return pictures;
}

void CaptureRig::bounce(int view, SceneSamples const& samples, std::array<Vector3d, kPacket> const& directions,
                        CounterRandom const& random, float* frames) const {
  auto const first = std::find_if(samples.begin(), samples.end(), [](SceneSample const& s) { return s.is_object; });
  if (first == samples.end()) return;
  auto const count = std::count_if(first, samples.end(), [](SceneSample const& s) { return s.is_object; });
  double const weight = exposure_ * options_.scene.interreflection * static_cast<double>(count) / kPacket;
  add_interreflection(scene_, view, *first, directions[static_cast<std::size_t>(first - samples.begin())], light_,
                      static_cast<float>(options_.scene.gloss), static_cast<float>(weight), random, frames);
}

void CaptureRig::take_row(int view, CaptureSide side, int y, CapturePictures& pictures) const {
  int const width = options_.width, frames = light_.frames();
  Isometry3d const pose = room_from_camera(side);
  Vector2d const* const above = corners_[static_cast<int>(side)].data() + static_cast<std::ptrdiff_t>(y) * (width + 1);
  Vector2d const* const below = above + width + 1;
  // One more frame: a position beyond the sweep, which lights nothing.
  auto const size = static_cast<std::size_t>(width);
  std::vector<float> light(static_cast<std::size_t>(frames + 1) * size), pixel(static_cast<std::size_t>(frames + 1));
  std::vector<Vector3f> color(size);
  std::array<Vector3d, kPacket> directions;
  auto const stream = [&](int frame) {
    return CounterRandom(seed_, picture_key(view, side),
                         static_cast<std::uint64_t>(frame) * static_cast<std::uint64_t>(options_.height) +
                             static_cast<std::uint64_t>(y));
  };
  auto const per_sample = static_cast<float>(exposure_ / kPacket);
  for (int x = 0; x < width; ++x) {
    for (int i = 0; i < kPacket; ++i) {
      double const u = (i % kSamplesSide + 0.5) / kSamplesSide, v = (i / kSamplesSide + 0.5) / kSamplesSide;
      Vector2d const ray =
          (1 - v) * ((1 - u) * above[x] + u * above[x + 1]) + v * ((1 - u) * below[x] + u * below[x + 1]);
      directions[i] = pose.linear() * ray.homogeneous();
    }
    auto const samples = scene_.look(view, pose.translation(), directions, light_);
    std::fill(pixel.begin(), pixel.end(), 0.0f);
    Vector3f room = Vector3f::Zero();
    for (auto const& sample : samples) {
      room += sample.room / kPacket;
      if (sample.weight + sample.gloss > 0)
        light_.add(sample.light, per_sample * (sample.weight + sample.gloss), pixel.data());
    }
    if (options_.scene.interreflection > 0)
      bounce(view, samples, directions,
             CounterRandom(seed_, kBounceItem + picture_key(view, side), static_cast<std::uint64_t>(y) * size + x),
             pixel.data());
    color[x] = room;
    auto const always = static_cast<float>(exposure_ * options_.scene.ambient) * luminance(room);
    for (int k = 0; k <= frames; ++k) light[static_cast<std::size_t>(k) * size + x] = pixel[k] + always;
  }
  auto const order = frame_order(options_.faults, frames,
                                 side == CaptureSide::left ? CaptureFaults::Side::left : CaptureFaults::Side::right);
  for (int file = 0; file < frames; ++file)
    sensor_.expose(light.data() + static_cast<std::size_t>(order[file]) * size, width, stream(order[file]),
                   pictures.frames[file].ptr(y));
  write_color(color, options_.sensor, stream(frames + 1), pictures.color[y]);
}

CaptureTruth CaptureRig::truth(int view, Context& context) const {
  Camera const camera = ideal_left_camera(layout_.rig_in_use);
  CaptureTruth truth{cv::Mat1f(camera.height(), camera.width(), kNoDepth),
                     cv::Mat1b(camera.height(), camera.width(), uchar{0})};
  Isometry3d const left = layout_.room_from_left, right_from_room = layout_.room_from_right().inverse();
  Vector3d const right_eye = layout_.room_from_right().translation(), lamp = layout_.room_from_light.translation();
  auto const is_in_picture = [](LensCamera const& lens_camera, Vector3d const& p) {
    return p.z() > 0 && lens_camera.camera.contains(lens_camera.project(p));
  };
  for_each_index(context, static_cast<std::size_t>(camera.height()), [&](std::size_t row) {
    int const y = static_cast<int>(row);
    for (int x = 0; x < camera.width(); ++x) {
      Vector3d const ray = camera.ray_direction(x, y);
      auto const hit = scene_.meet(view, left.translation(), left.linear() * ray);
      if (std::isnan(hit.distance)) continue;
      truth.depth(y, x) = static_cast<float>(hit.distance);  // the ray has z = 1
      bool const seen = is_in_picture(layout_.rig_in_use.left, hit.distance * ray) &&
                        is_in_picture(layout_.rig_in_use.right, right_from_room * hit.point) &&
                        scene_.is_open_to(view, hit, right_eye) && scene_.is_open_to(view, hit, lamp);
      truth.visible(y, x) = seen ? 255 : 0;
    }
  });
  return truth;
}

cv::Mat1f true_depth(TriangleMesh const& model, Isometry3d const& object_from_camera, Camera const& camera,
                     Context& context) {
  CenteredModel const object = centered(checked(model));
  RayScene const scene(object.vertices, model.triangles);
  cv::Mat1f depth(camera.height(), camera.width(), kNoDepth);
  for_each_index(context, static_cast<std::size_t>(camera.height()), [&](std::size_t row) {
    int const y = static_cast<int>(row);
    for (int x = 0; x < camera.width(); ++x) {
      Vector3d const origin = object_from_camera * camera.ray_origin(x, y) - object.center;
      Vector3d const direction = object_from_camera.linear() * camera.ray_direction(x, y);
      RayHit const hit = scene.first_hit(origin.cast<float>(), direction.cast<float>());
      if (hit.triangle >= 0)
        depth(y, x) = static_cast<float>(exact_distance(object, model.triangles[hit.triangle], hit, origin, direction));
    }
  });
  return depth;
}

}  // namespace scanview
