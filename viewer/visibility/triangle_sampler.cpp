#include "viewer/visibility/triangle_sampler.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <limits>

#include "viewer/raster/id_buffer.h"
#include "viewer/raster/kernels.h"
#include "viewer/view_based/view_transform.h"
#include "viewer/visibility/visibility_kernels.h"

namespace scanview {
namespace {

/// Beside a row, so that vectors may be read beyond it.
constexpr int kPadding = 16;
/// The widest window has a radius of 2^(kWindows - 1) pixels: more parallax than that is seen by another sample.
constexpr std::size_t kWindows = 6;
/// Without parallax windows only tell which small triangles behind are hidden.
constexpr std::size_t kStillWindows = 4;
/// Triangles longer than this many pixels are asked between their vertices too; a side in at most kMostSteps steps.
constexpr int kLongPx = 8, kMostSteps = 32;

void add(std::vector<std::uint64_t>& bits, std::size_t i) { bits[i / 64] |= std::uint64_t{1} << (i % 64); }

/// The distance of the ball's far side, in radii: heights above a plane are at most so many times their cosine.
float farthest_point(EyePoint const& eye) { return std::sqrt(eye.x * eye.x + eye.y * eye.y + eye.z * eye.z) + eye.w; }

}  // namespace

TriangleSampler::TriangleSampler(RasterMesh const& mesh, TrianglePlanes const& planes,
                                 Eigen::AlignedBox3d const& bounds)
    : mesh_(&mesh), planes_(&planes), bounds_(bounds), vertices_(mesh.vertices.count), passes_(mesh.vertices.count) {}

void TriangleSampler::draw(SampleCamera const& sample) {
  Camera const& camera = sample.camera;
  width_ = camera.width();
  height_ = camera.height();
  stride_ = width_ + kPadding;
  auto const pixels = static_cast<std::size_t>(stride_) * static_cast<std::size_t>(height_);
  keys_.assign(pixels, kNothing);
  current_windows_ = 0;
  ids_.resize(pixels);
  parallax_ = static_cast<float>(std::max(camera.fx(), camera.fy()) * sample.movement);
  Eigen::Isometry3d const camera_from_object = sample.object_from_camera.inverse();
  DepthRange range;
  if (!depth_range(bounds_, camera_from_object, camera.is_perspective(), range)) {
    for (auto& vertex : vertices_) vertex = {kBeyond, 0, {kNothing}};
    return;
  }
  ScreenTransform const transform = screen_transform(camera, camera_from_object, range);
  if (std::max(width_, height_) <= kIdPicture &&
      place_vertices(mesh_->vertices, transform, width_, height_, vertices_.data())) {
    TileArea const area{0, 0, width_, height_};
    IdTarget const target{keys_.data(), ids_.data(), stride_};
    draw_mesh_fronts(vertices_.data(), mesh_->corners.data(), mesh_->corners.size() / 3, area, target);
    find_windows(keys_, kStillWindows);
    list_unhidden_backs();
    // Some roundings of the largest key.
    float largest = 0;
    for (PlacedVertex const& v : vertices_) largest = std::max(largest, std::abs(v.values[0]));
    if (draw_mesh_ids(vertices_.data(), mesh_->corners.data(), backs_.data(), backs_.size(), 4e-6F * largest, area,
                      target))
      current_windows_ = 0;
    return;
  }
  // A camera inside the model, or a picture too large to be drawn whole.
  draw_keyed_ids(*mesh_, camera, sample.object_from_camera, range, Culling::none, {keys_.data(), ids_.data(), stride_});
  for (std::size_t i = 0; i < mesh_->vertices.count; ++i) {
    Eigen::Vector3d const p =
        camera_from_object * Eigen::Vector3d(mesh_->vertices.x[i], mesh_->vertices.y[i], mesh_->vertices.z[i]);
    bool const front = !camera.is_perspective() || p.z() > range.near;
    Eigen::Vector2d const pixel = front ? camera.project(p) : Eigen::Vector2d(-1, -1);
    bool const inside = front && (pixel.array() >= 0).all() && pixel.x() <= width_ - 1 && pixel.y() <= height_ - 1;
    vertices_[i] = {inside ? static_cast<std::int32_t>(std::lround(256 * pixel.x())) : kBeyond,
                    inside ? static_cast<std::int32_t>(std::lround(256 * pixel.y())) : 0,
                    {static_cast<float>(camera.is_perspective() ? 1 / p.z() : -p.z())}};
  }
}

void TriangleSampler::find_windows(std::vector<float> const& keys, std::size_t count) {
  farthest_.resize(kWindows);
  PictureSize const size{width_, height_, stride_};
  for (std::size_t k = &keys == &keys_ ? current_windows_ : 0; k < count; ++k) {
    farthest_[k].resize(keys.size());
    // Four windows of half the radius make one.
    float const* const from = k == 0 ? keys.data() : farthest_[k - 1].data();
    window_minimum(from, size, k == 0 ? 1 : 1 << (k - 1), k == 0, farthest_[k].data());
  }
  windows_ = count;
  current_windows_ = &keys == &keys_ ? count : 0;
}

void TriangleSampler::list_unhidden_backs() {
  backs_.clear();
  std::size_t const count = mesh_->corners.size() / 3;
  for (std::size_t i = 0; i < count; ++i) {
    std::int32_t const* const corner = &mesh_->corners[3 * i];
    PlacedVertex const& a = vertices_[static_cast<std::size_t>(corner[0])];
    PlacedVertex const& b = vertices_[static_cast<std::size_t>(corner[1])];
    PlacedVertex const& c = vertices_[static_cast<std::size_t>(corner[2])];
    if (std::int64_t{b.x - a.x} * (c.y - a.y) <= std::int64_t{b.y - a.y} * (c.x - a.x)) continue;
    // A window around the first corner that holds the triangle.
    std::int32_t const reach = std::max(std::max(std::abs(b.x - a.x), std::abs(c.x - a.x)),
                                        std::max(std::abs(b.y - a.y), std::abs(c.y - a.y)));
    auto const k = static_cast<std::size_t>(std::bit_width(static_cast<std::uint32_t>(reach + 255) >> 8));
    float const nearest = std::max(std::max(a.values[0], b.values[0]), c.values[0]);
    if (k >= windows_ || farthest_[k][nearest_pixel(a.x, a.y)] <= nearest)
      backs_.push_back(static_cast<std::uint32_t>(i));
  }
}

/// Which vertices are no nearer than what a pixel within their parallax shows.
void TriangleSampler::find_passing() {
  for (std::size_t i = 0; i < vertices_.size(); ++i) {
    PlacedVertex const& v = vertices_[i];
    passes_[i] = v.x != kBeyond && passes(v.x, v.y, v.values[0]);
  }
}

std::size_t TriangleSampler::nearest_pixel(std::int32_t x, std::int32_t y) const {
  return pixel(std::clamp((x + 128) >> 8, 0, width_ - 1), std::clamp((y + 128) >> 8, 0, height_ - 1));
}

bool TriangleSampler::passes(std::int32_t x, std::int32_t y, float key) const {
  std::size_t const at = nearest_pixel(x, y);
  if (farthest_[0][at] <= key) return true;
  float const shift = parallax_ * (keys_[at] - key);
  if (!(shift > 1)) return false;
  int const k = std::min(static_cast<int>(std::bit_width(static_cast<std::uint32_t>(std::min(shift, 1e6F) - 1e-6F))),
                         static_cast<int>(windows_) - 1);
  return farthest_[static_cast<std::size_t>(k)][at] <= key;
}

bool TriangleSampler::nearly_seen(std::size_t triangle) const {
  std::int32_t const* const corner = &mesh_->corners[3 * triangle];
  auto const a = static_cast<std::size_t>(corner[0]), b = static_cast<std::size_t>(corner[1]),
             c = static_cast<std::size_t>(corner[2]);
  if ((passes_[a] | passes_[b] | passes_[c]) != 0) return true;
  PlacedVertex const &va = vertices_[a], &vb = vertices_[b], &vc = vertices_[c];
  if (va.x == kBeyond || vb.x == kBeyond || vc.x == kBeyond) return false;
  std::int32_t const extent = std::max(std::max({va.x, vb.x, vc.x}) - std::min({va.x, vb.x, vc.x}),
                                       std::max({va.y, vb.y, vc.y}) - std::min({va.y, vb.y, vc.y}));
  int const steps = std::min(extent / (256 * kLongPx) + 1, kMostSteps);
  if (steps == 1) return false;
  for (int p = 0; p <= steps; ++p) {
    for (int q = 0; p + q <= steps; ++q) {
      auto const mix = [&](auto of_a, auto of_b, auto of_c) {  // linear on the screen
        using Number = decltype(of_a);
        return (of_a * static_cast<Number>(steps - p - q) + of_b * static_cast<Number>(p) +
                of_c * static_cast<Number>(q)) /
               static_cast<Number>(steps);
      };
      if (passes(mix(va.x, vb.x, vc.x), mix(va.y, vb.y, vc.y), mix(va.values[0], vb.values[0], vc.values[0])))
        return true;
    }
  }
  return false;
}

void TriangleSampler::find_in_picture(EyePoint const& eye) {
  // Nearly edge-on, the rasteriser's rounding decides which side a pixel shows: there it is the side that the rest of
  // the picture shows.
  constexpr float kEdgeOn = 0.02F;
  // A height is a cosine times the distance: of a wall right before the eye both are small.
  float const radius = static_cast<float>(planes_->radius);
  std::uint32_t last = ~std::uint32_t{0};
  std::size_t fronts = 0, backs = 0;
  edge_on_.clear();
  for_each_pixel([&](int x, int y, std::uint32_t triangle) {
    if (triangle == last) return;
    last = triangle;
    float const edge_on = kEdgeOn * (eye.w > 0 ? 1 / (keys_[pixel(x, y)] * radius) : 1);
    float const height = planes_->height(triangle, eye);
    if (height > edge_on) {
      ++fronts;
      add(seen_.front, triangle);
    } else if (height < -edge_on) {
      ++backs;
      add(seen_.back, triangle);
    } else {
      edge_on_.push_back(triangle);
    }
  });
  mostly_backs_ = backs > fronts;
  for (std::uint32_t const triangle : edge_on_) add(mostly_backs_ ? seen_.back : seen_.front, triangle);
}

void TriangleSampler::find_nearly_seen(EyePoint const& eye, double turn) {
  float const edge_on = static_cast<float>(std::sin(std::min(turn, 1.5))) * farthest_point(eye);
  std::size_t const count = mesh_->corners.size() / 3, wanted = parallax_ > 0 ? kWindows : 1;
  // Before fronts are added to: what shows a back in the picture.
  bool shows_backs = false;
  for (std::uint64_t const bits : seen_.back) shows_backs |= bits != 0;
  if (shows_backs) {
    // Beyond the rim is what turns the side that is seen mostly.
    float const nothing = std::numeric_limits<float>::infinity();
    back_keys_.assign(keys_.size(), nothing);
    front_keys_ = keys_;
    if (mostly_backs_) {
      std::swap(front_keys_, back_keys_);
      for_each_pixel([&](int x, int y, std::uint32_t) { back_keys_[pixel(x, y)] = nothing; });
      for_each_pixel([&](int x, int y, std::uint32_t) { front_keys_[pixel(x, y)] = keys_[pixel(x, y)]; });
    }
    for_each_pixel([&](int x, int y, std::uint32_t triangle) {
      if ((seen_.back[triangle / 64] >> (triangle % 64) & 1) != 0)
        std::swap(front_keys_[pixel(x, y)], back_keys_[pixel(x, y)]);
    });
    find_windows(back_keys_, wanted);
    find_passing();
    for (std::size_t i = 0; i < count; ++i) {
      if (planes_->height(i, eye) <= edge_on && nearly_seen(i)) add(seen_.back, i);
    }
    find_windows(front_keys_, wanted);
  } else {
    find_windows(keys_, wanted);
  }
  find_passing();
  for (std::size_t i = 0; i < count; ++i) {
    if (planes_->height(i, eye) >= -edge_on && nearly_seen(i)) add(seen_.front, i);
  }
}

SeenTriangles const& TriangleSampler::sample(SampleCamera const& camera, Seen what) {
  std::size_t const words = (mesh_->corners.size() / 3 + 63) / 64;
  seen_.front.assign(words, 0);
  seen_.back.assign(words, 0);
  draw(camera);
  EyePoint const eye = planes_->eye(camera);
  find_in_picture(eye);
  if (what == Seen::nearly) {
    find_nearly_seen(eye, camera.turn);
  }
  return seen_;
}

}  // namespace scanview
