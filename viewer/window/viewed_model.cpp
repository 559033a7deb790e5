#include "viewer/window/viewed_model.h"

#include <tbb/parallel_for.h>
#include <tbb/task_arena.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <limits>
#include <numbers>
#include <utility>

#include "base/error.h"
#include "base/srgb.h"
#include "viewer/raster/encode_table.h"
#include "viewer/raster/id_buffer.h"
#include "viewer/view_based/view_transform.h"
#include "viewer/window/line_drawing.h"

namespace scanview {
namespace {

constexpr float kNothing = -std::numeric_limits<float>::infinity();
constexpr double kCreaseAngle = std::numbers::pi / 3;

/// Linear light.
std::vector<Eigen::Vector3f> albedo_of(TriangleMesh const& mesh) {
  if (mesh.colors.empty()) return {Eigen::Vector3f::Constant(0.6F)};
  auto const& linear = linear_from_srgb8();
  std::vector<Eigen::Vector3f> albedo;
  albedo.reserve(mesh.triangles.size());
  for (auto const& triangle : mesh.triangles) {
    Eigen::Vector3d sum = Eigen::Vector3d::Zero();
    for (int k = 0; k < 3; ++k) {
      cv::Vec3b const& color = mesh.colors[static_cast<std::size_t>(triangle[k])];
      sum += Eigen::Vector3d(linear[color[2]], linear[color[1]], linear[color[0]]);
    }
    albedo.push_back((sum / 3).cast<float>());
  }
  return albedo;
}

cv::Vec4b encode(Eigen::Vector3f const& rgb, float alpha) {
  auto const& table = encode_table();
  auto const byte = [&](float linear) {
    float const root = std::sqrt(std::clamp(linear, 0.0F, 1.0F));
    return static_cast<std::uint8_t>(table[static_cast<std::size_t>(std::lround(root * kEncodeSteps))]);
  };
  return {byte(rgb.z()), byte(rgb.y()), byte(rgb.x()), static_cast<std::uint8_t>(std::lround(255 * alpha))};
}

std::vector<std::uint8_t> transparent_in_order(PolygonModel const& model, VisibilityField const* field) {
  if (model.transparent.empty() || field == nullptr) return model.transparent;
  std::vector<std::uint8_t> in_order;
  for (std::uint32_t const triangle : field->patches.triangles) in_order.push_back(model.transparent[triangle]);
  return in_order;
}

}  // namespace

ViewedModel::ViewedModel(PolygonModel model, std::optional<VisibilityField> field, int threads)
    : field_(std::move(field)),
      polygons_(model.polygon_count()),
      transparent_(transparent_in_order(model, this->field())),
      threads_(threads) {
  drawn_ = field_ ? drawn_mesh(model.mesh, field_->patches) : std::move(model.mesh);
  for (auto const& triangle : drawn_.triangles) {
    for (int k = 0; k < 3; ++k) bounds_.extend(drawn_.vertices[static_cast<std::size_t>(triangle[k])].cast<double>());
  }
  if (bounds_.isEmpty() || !(bounds_.diagonal().norm() > 0))
    throw Error(ErrorCode::bad_input, {}, "the model has no extent: nothing to be seen");
  center_ = field_ ? field_->center : Eigen::Vector3d(bounds_.center());
  radius_ = field_ ? field_->radius : 0.5 * bounds_.diagonal().norm();
  planes_.emplace(drawn_, center_, radius_);
  albedo_ = albedo_of(drawn_);
  is_chosen_.resize(drawn_.triangles.size());
  opaque_.mesh = raster_mesh(drawn_, std::vector<std::uint32_t>(drawn_.triangles.size()));
  if (std::find(transparent_.begin(), transparent_.end(), 1) != transparent_.end()) {
    clear_.mesh.vertices = opaque_.mesh.vertices;
  } else {
    transparent_.clear();
  }
}

std::span<IndexRange const> ViewedModel::choose(ModelLook const& look, Eigen::Vector3d const& eye) {
  figures_ = {};
  if (!field_ || !look.visibility) {
    ranges_.assign(1, {0, static_cast<std::uint32_t>(drawn_.triangles.size())});
    collected_ = false;
  } else {
    auto& selector = look.facing ? facing_ : all_sides_;
    if (!selector) selector.emplace(*field_, drawn_, look.facing);
    auto const start = std::chrono::steady_clock::now();
    std::span<IndexRange const> const chosen = selector->select(eye);
    figures_.select_microseconds =
        std::chrono::duration<double, std::micro>(std::chrono::steady_clock::now() - start).count();
    figures_.patches = selector->patches();
    figures_.is_whole = selector->is_whole();
    // A frozen eye chooses the same again.
    collected_ = collected_ && std::equal(chosen.begin(), chosen.end(), ranges_.begin(), ranges_.end());
    if (!collected_) ranges_.assign(chosen.begin(), chosen.end());
  }
  figures_.ranges = ranges_.size();
  for (IndexRange const& range : ranges_) figures_.triangles += range.count;
  return ranges_;
}

void ViewedModel::collect(std::span<IndexRange const> ranges, bool all) {
  if (collected_ && collected_all_ == all) return;
  collected_ = true;
  collected_all_ = all;
  std::fill(is_chosen_.begin(), is_chosen_.end(), std::uint8_t{0});
  for (IndexRange const& range : ranges) std::fill_n(is_chosen_.begin() + range.first, range.count, std::uint8_t{1});
  for (Layer* const layer : {&opaque_, &clear_}) {
    layer->mesh.corners.clear();
    layer->mesh.labels.clear();
  }
  IndexRange const whole{0, static_cast<std::uint32_t>(drawn_.triangles.size())};
  for (IndexRange const& range : all ? std::span(&whole, 1) : ranges) {
    for (std::uint32_t i = range.first; i < range.first + range.count; ++i) {
      RasterMesh& mesh = (transparent_.empty() || transparent_[i] == 0 ? opaque_ : clear_).mesh;
      for (int k = 0; k < 3; ++k) mesh.corners.push_back(drawn_.triangles[i][k]);
      mesh.labels.push_back(i);
    }
  }
}

void ViewedModel::draw(Layer& layer) {
  Camera const& camera = shown_.camera;
  auto const pixels = static_cast<std::size_t>(camera.width()) * static_cast<std::size_t>(camera.height());
  layer.keys.assign(pixels, kNothing);
  layer.ids.resize(pixels);
  DepthRange range;
  if (layer.mesh.labels.empty() ||
      !depth_range(bounds_, shown_.object_from_camera.inverse(), camera.is_perspective(), range))
    return;
  draw_keyed_ids(layer.mesh, camera, shown_.object_from_camera, range, Culling::none,
                 {layer.keys.data(), layer.ids.data(), camera.width()});
}

void ViewedModel::find_depths() {
  cv::Mat1f& depth = shown_.frame.depth;
  depth.create(shown_.camera.height(), shown_.camera.width());
  bool const perspective = shown_.camera.is_perspective();
  std::transform(opaque_.keys.begin(), opaque_.keys.end(), depth.begin(), [&](float key) {
    return key == kNothing ? std::numeric_limits<float>::quiet_NaN() : perspective ? 1 / key : -key;
  });
}

Eigen::Vector3f ViewedModel::color(std::uint32_t triangle, EyePoint const& eye, Eigen::Vector3f const& to_light) const {
  Eigen::Vector3f const normal(planes_->x[triangle], planes_->y[triangle], planes_->z[triangle]);
  bool const front = planes_->height(triangle, eye) >= 0;
  float const lambert = std::max(0.0F, (front ? 1.0F : -1.0F) * normal.dot(to_light));
  Eigen::Vector3f rgb = (0.08F + 0.92F * lambert) * albedo_[albedo_.size() == 1 ? 0 : triangle];
  if (!front) rgb = rgb.cwiseProduct(Eigen::Vector3f(0.9F, 0.35F, 0.25F));
  // Faint, whatever the light: what is left out.
  if (is_chosen_[triangle] == 0) rgb = 0.2F * rgb + Eigen::Vector3f(0.05F, 0.07F, 0.12F);
  return rgb;
}

void ViewedModel::shade(ModelLook const& look) {
  Camera const& camera = shown_.camera;
  cv::Mat4b& picture = shown_.frame.color;
  picture.create(camera.height(), camera.width());
  EyePoint const eye = planes_->eye(SampleCamera{camera, shown_.object_from_camera});
  Eigen::Vector3f const to_light =
      (shown_.object_from_camera.linear() * Eigen::Vector3d(-0.3, -0.45, -1).normalized()).cast<float>();
  constexpr float kOpacity = 0.35F;
  bool const is_clear = !transparent_.empty() && !look.lines;
  tbb::parallel_for(0, picture.rows, [&](int y) {
    cv::Vec4b* const row = picture[y];
    for (int x = 0; x < picture.cols; ++x) {
      auto const at =
          static_cast<std::size_t>(y) * static_cast<std::size_t>(picture.cols) + static_cast<std::size_t>(x);
      bool const there = opaque_.keys[at] != kNothing;
      if (look.lines) {
        row[x] =
            there && is_chosen_[opaque_.ids[at]] == 0 ? cv::Vec4b(235, 225, 215, 255) : cv::Vec4b(255, 255, 255, 255);
        continue;
      }
      Eigen::Vector3f const under = there ? color(opaque_.ids[at], eye, to_light) : Eigen::Vector3f::Zero();
      if (!is_clear || !(clear_.keys[at] > opaque_.keys[at])) {
        row[x] = there ? encode(under, 1) : cv::Vec4b(0, 0, 0, 0);
        continue;
      }
      Eigen::Vector3f const over = color(clear_.ids[at], eye, to_light);
      row[x] = there ? encode(kOpacity * over + (1 - kOpacity) * under, 1) : encode(over, kOpacity);
    }
  });
}

ShownFrame const& ViewedModel::render(Camera const& camera, Eigen::Isometry3d const& object_from_camera,
                                      ModelLook const& look, Eigen::Vector3d const& choosing_eye) {
  shown_.camera = camera;
  shown_.object_from_camera = object_from_camera;
  // A picture that somebody still holds is not drawn over.
  shown_.frame = {};
  std::span<IndexRange const> const ranges = choose(look, choosing_eye);
  collect(ranges, look.culled);
  tbb::task_arena arena(threads_ > 0 ? threads_ : tbb::task_arena::automatic);
  arena.execute([&] {
    draw(opaque_);
    if (!transparent_.empty()) draw(clear_);
    find_depths();
    shade(look);
  });
  if (look.lines) {
    if (!features_) features_.emplace(drawn_, kCreaseAngle);
    auto const lines = features_->lines(object_from_camera.translation(), ranges);
    figures_.lines = lines.size();
    draw_seen_lines(shown_.frame.color, shown_.frame.depth, camera, object_from_camera, drawn_.vertices, lines);
  }
  return shown_;
}

}  // namespace scanview
