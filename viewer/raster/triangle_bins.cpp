#include "viewer/raster/triangle_bins.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "viewer/raster/kernels.h"

namespace scanview {
namespace {

constexpr std::size_t kVertexPart = 8192, kTrianglePart = 8192;
constexpr std::uint32_t kClipped = 1U << 31;

/// The rows of the transform, then nearness and light.
using ClipVertex = std::array<double, ScreenTransform::kRows + 4>;

ClipVertex between(ClipVertex const& a, ClipVertex const& b, double t) {
  ClipVertex v;
  for (std::size_t i = 0; i < v.size(); ++i) v[i] = a[i] + t * (b[i] - a[i]);
  return v;
}

/// Keeps the part of a convex polygon where `distance` is positive (Sutherland and Hodgman 1974).
template <typename Distance>
std::vector<ClipVertex> clipped_by(std::vector<ClipVertex> const& polygon, Distance const& distance) {
  std::vector<ClipVertex> result;
  for (std::size_t i = 0; i < polygon.size(); ++i) {
    ClipVertex const& a = polygon[i];
    ClipVertex const& b = polygon[(i + 1) % polygon.size()];
    double const at_a = distance(a), at_b = distance(b);
    if (at_a > 0) result.push_back(a);
    if ((at_a > 0) != (at_b > 0)) result.push_back(between(a, b, at_a / (at_a - at_b)));
  }
  return result;
}

ScreenVertex on_screen(ClipVertex const& v, bool perspective) {
  using Row = ScreenTransform::Row;
  double const inverse = perspective ? 1 / v[Row::w] : 1;
  auto const attribute = [&](int row) { return static_cast<float>(v[static_cast<std::size_t>(row)] * inverse); };
  return {static_cast<std::int32_t>(std::lround(256 * v[Row::u] * inverse)),
          static_cast<std::int32_t>(std::lround(256 * v[Row::v] * inverse)),
          {perspective ? static_cast<float>(inverse) : static_cast<float>(-v[Row::depth]), attribute(Row::s),
           attribute(Row::t), attribute(Row::texture_w), attribute(Row::kRows), attribute(Row::kRows + 1),
           attribute(Row::kRows + 2), attribute(Row::kRows + 3)}};
}

}  // namespace

RasterMesh raster_mesh(TriangleMesh const& mesh, std::vector<std::uint32_t> labels) {
  RasterMesh result;
  auto& arrays = result.vertices;
  arrays.count = mesh.vertices.size();
  constexpr std::size_t kPadding = 16;
  for (auto* const array : {&arrays.x, &arrays.y, &arrays.z}) array->assign(arrays.count + kPadding, 0.0F);
  for (std::size_t i = 0; i < arrays.count; ++i) {
    arrays.x[i] = mesh.vertices[i].x();
    arrays.y[i] = mesh.vertices[i].y();
    arrays.z[i] = mesh.vertices[i].z();
  }
  result.corners.reserve(3 * mesh.triangles.size());
  for (auto const& triangle : mesh.triangles) {
    for (int k = 0; k < 3; ++k) result.corners.push_back(triangle[k]);
  }
  result.labels = std::move(labels);
  return result;
}

void TriangleBins::begin(RasterMesh const& mesh, ScreenTransform const& transform, int width, int height,
                         Culling culling) {
  mesh_ = &mesh;
  transform_ = transform;
  culling_ = culling;
  width_ = width;
  height_ = height;
  tiles_x_ = (width + kTileWidth - 1) / kTileWidth;
  tiles_y_ = (height + kTileHeight - 1) / kTileHeight;
  vertices_.resize(mesh.vertices.count);
  parts_ = (mesh.labels.size() + kTrianglePart - 1) / kTrianglePart;
  if (part_.size() < parts_) part_.resize(parts_);
}

std::size_t TriangleBins::vertex_parts() const { return (vertices_.size() + kVertexPart - 1) / kVertexPart; }

void TriangleBins::transform(std::size_t part) {
  std::size_t const begin = part * kVertexPart, end = std::min(begin + kVertexPart, vertices_.size());
  transform_vertices(mesh_->vertices, transform_, begin, end, width_, height_, vertices_.data());
}

void TriangleBins::add(Part& part, ScreenVertex const& a, ScreenVertex const& b, ScreenVertex const& c,
                       std::uint32_t entry) const {
  int const left = std::max((std::min({a.x, b.x, c.x}) + 255) >> 8, 0);
  int const right = std::min(std::max({a.x, b.x, c.x}) >> 8, width_ - 1);
  if (left > right) return;
  int const top = std::max((std::min({a.y, b.y, c.y}) + 255) >> 8, 0);
  int const bottom = std::min(std::max({a.y, b.y, c.y}) >> 8, height_ - 1);
  for (int y = top / kTileHeight; y <= bottom / kTileHeight && top <= bottom; ++y) {
    for (int x = left / kTileWidth; x <= right / kTileWidth; ++x) {
      part.unsorted.emplace_back(static_cast<std::uint32_t>(y * tiles_x_ + x), entry);
    }
  }
}

void TriangleBins::clip(Part& part, std::size_t triangle) const {
  using Row = ScreenTransform::Row;
  VertexArrays const& points = mesh_->vertices;
  std::vector<ClipVertex> polygon;
  for (std::size_t k = 0; k < 3; ++k) {
    auto const i = static_cast<std::size_t>(mesh_->corners[3 * triangle + k]);
    ClipVertex v;
    for (std::size_t r = 0; r < ScreenTransform::kRows; ++r) {
      double const* const row = transform_.rows[r];
      v[r] = row[0] * points.x[i] + row[1] * points.y[i] + row[2] * points.z[i] + row[3];
    }
    for (std::size_t c = 0; c < 4; ++c) {
      double const value = vertices_[i].values[ScreenVertex::nearness + c];
      double const undivided = transform_.perspective ? value * v[Row::w] : value;
      v[Row::kRows + c] = std::isfinite(undivided) ? undivided : 1;  // of a corner in the eye's plane
    }
    polygon.push_back(v);
  }
  auto const corners = polygon;
  // Corners that stay lie where their other triangles have them, which single precision has placed.
  auto const place = [&](ClipVertex const& v) {
    for (std::size_t k = 0; k < 3; ++k) {
      ScreenVertex const& placed = vertices_[static_cast<std::size_t>(mesh_->corners[3 * triangle + k])];
      if (v == corners[k] && placed.x != kBeyond) return placed;
    }
    return on_screen(v, transform_.perspective);
  };
  double const near = transform_.near;
  if (transform_.perspective) polygon = clipped_by(polygon, [&](ClipVertex const& v) { return v[Row::w] - near; });
  polygon = clipped_by(polygon, [&](ClipVertex const& v) { return v[Row::u] + kGuardBand * v[Row::w]; });
  polygon = clipped_by(polygon, [&](ClipVertex const& v) { return (width_ + kGuardBand) * v[Row::w] - v[Row::u]; });
  polygon = clipped_by(polygon, [&](ClipVertex const& v) { return v[Row::v] + kGuardBand * v[Row::w]; });
  polygon = clipped_by(polygon, [&](ClipVertex const& v) { return (height_ + kGuardBand) * v[Row::w] - v[Row::v]; });
  for (std::size_t i = 2; i < polygon.size(); ++i) {
    Clipped clipped{{place(polygon[0]), place(polygon[i - 1]), place(polygon[i])}, mesh_->labels[triangle]};
    auto const entry = kClipped + static_cast<std::uint32_t>(part.clipped.size());
    auto& [a, b, c] = clipped.corners;
    std::int64_t const area2 = std::int64_t{b.x - a.x} * (c.y - a.y) - std::int64_t{b.y - a.y} * (c.x - a.x);
    if (area2 == 0 || (area2 > 0 && culling_ == Culling::back_faces)) continue;
    if (area2 < 0) std::swap(b, c);
    if (area2 > 0 && culling_ == Culling::backs_hide) clipped.label = 0;
    part.clipped.push_back(clipped);
    add(part, a, b, c, entry);
  }
}

void TriangleBins::bin(std::size_t index) {
  Part& part = part_[index];
  part.unsorted.clear();
  part.clipped.clear();
  std::size_t const end = std::min((index + 1) * kTrianglePart, mesh_->labels.size());
  for (std::size_t triangle = index * kTrianglePart; triangle < end; ++triangle) {
    std::int32_t const* const corner = &mesh_->corners[3 * triangle];
    ScreenVertex const& a = vertices_[static_cast<std::size_t>(corner[0])];
    ScreenVertex const& b = vertices_[static_cast<std::size_t>(corner[1])];
    ScreenVertex const& c = vertices_[static_cast<std::size_t>(corner[2])];
    if (a.x == kBeyond || b.x == kBeyond || c.x == kBeyond) {
      clip(part, triangle);
      continue;
    }
    // A face towards the camera runs counter-clockwise where y points up: negative here.
    std::int64_t const area2 = std::int64_t{b.x - a.x} * (c.y - a.y) - std::int64_t{b.y - a.y} * (c.x - a.x);
    if (area2 == 0 || (area2 > 0 && culling_ == Culling::back_faces)) continue;
    add(part, a, b, c, static_cast<std::uint32_t>(triangle));
  }
  // By tile, keeping the order.
  part.begins.assign(static_cast<std::size_t>(tiles_x_ * tiles_y_) + 1, 0);
  for (auto const& [tile, entry] : part.unsorted) ++part.begins[tile + 1];
  for (std::size_t i = 1; i < part.begins.size(); ++i) part.begins[i] += part.begins[i - 1];
  part.entries.resize(part.unsorted.size());
  auto next = part.begins;
  for (auto const& [tile, entry] : part.unsorted) part.entries[next[tile]++] = entry;
}

void TriangleBins::collect(std::size_t tile, std::vector<ScreenTriangle>& out) const {
  for (std::size_t p = 0; p < parts_; ++p) {
    Part const& part = part_[p];
    for (std::uint32_t i = part.begins[tile]; i < part.begins[tile + 1]; ++i) {
      std::uint32_t const entry = part.entries[i];
      if ((entry & kClipped) != 0) {
        Clipped const& clipped = part.clipped[entry - kClipped];
        out.push_back({{&clipped.corners[0], &clipped.corners[1], &clipped.corners[2]}, clipped.label});
        continue;
      }
      std::int32_t const* const corner = &mesh_->corners[3 * std::size_t{entry}];
      ScreenVertex const* const a = &vertices_[static_cast<std::size_t>(corner[0])];
      ScreenVertex const* b = &vertices_[static_cast<std::size_t>(corner[1])];
      ScreenVertex const* c = &vertices_[static_cast<std::size_t>(corner[2])];
      std::int64_t const area2 = std::int64_t{b->x - a->x} * (c->y - a->y) - std::int64_t{b->y - a->y} * (c->x - a->x);
      if (area2 < 0) std::swap(b, c);
      bool const is_hidden = area2 > 0 && culling_ == Culling::backs_hide;
      out.push_back({{a, b, c}, is_hidden ? 0 : mesh_->labels[entry]});
    }
  }
}

}  // namespace scanview
