#pragma once
#include <fmt/format.h>

#include <array>
#include <cstdint>
#include <filesystem>
#include <optional>
#include <span>
#include <string>
#include <utility>

#include "base/error.h"
#include "mesh/material_colors.h"
#include "mesh/polygon_model.h"

namespace scanview {

enum class Light : std::uint8_t { stops, passes };

/// What a file says of a surface.
struct ModelMaterial {
  std::optional<cv::Vec3b> color;  ///< 8-bit sRGB, B G R
  std::optional<ModelTexture> texture;
};

/// What is on a polygon: a material (-1: none), and where the corners lie in its picture (TextureCorners), one each, or
/// none.
struct PolygonPaint {
  std::int32_t material = -1;  ///< as ModelBuilder::add_material numbers them
  std::span<Eigen::Vector2f const> at = {};
};

/// Collects a model and checks what goes in; every failure is Error{bad_input} of the file.
class ModelBuilder {
 public:
  explicit ModelBuilder(std::filesystem::path const& path) : path_(path) {}

  [[noreturn]] void fail(std::string const& what) const { throw Error(ErrorCode::bad_input, path_, what); }
  void note(std::string text) { model_.notes.push_back(std::move(text)); }

  /// Light that passes at a vertex passes through every polygon with that corner.
  void add_vertex(double x, double y, double z, Light light = Light::stops) {
    Eigen::Vector3f const p = Eigen::Vector3d(x, y, z).cast<float>();
    if (!p.allFinite()) fail(fmt::format("vertex {} is not finite", vertex_count()));
    model_.mesh.vertices.push_back(p);
    if (light == Light::passes || !passes_.empty()) {
      passes_.resize(vertex_count() - 1, 0);
      passes_.push_back(light == Light::passes);
    }
  }
  /// Of the latest vertex. Colours of a part of the vertices are left out.
  void add_color(cv::Vec3b const& color) { model_.mesh.colors.push_back(color); }

  std::size_t vertex_count() const { return model_.mesh.vertices.size(); }
  std::size_t triangle_count() const { return model_.mesh.triangles.size(); }

  /// Materials are numbered from 0.
  std::int32_t add_material(ModelMaterial material);

  /// A polygon that has a texture, but not for every corner a place in it that is finite, goes without: that is noted.
  void add_polygon(std::span<std::int64_t const> corners, Light light = Light::stops, PolygonPaint const& paint = {});
  /// Of a list of corners, the triangle of three; `paint.at` is of the list.
  void add_triangle(std::span<std::int64_t const> list, std::array<std::size_t, 3> const& from, Light light,
                    PolygonPaint const& paint);
  /// Vertices in a row, each with the two before it a triangle, turned every other time. Triangles with a doubled
  /// vertex, by which strips are joined, are left out.
  void add_strip(std::span<std::int64_t const> corners, Light light = Light::stops, PolygonPaint const& paint = {});

  /// The triangles from this one on, seen from the other side.
  void turn_from(std::size_t first_triangle);

  PolygonModel take();
  /// With one vertex a position (`join_equal_vertices`).
  PolygonModel take_joined();

 private:
  void add_triangles(std::span<std::int64_t const> corners, std::span<Eigen::Vector3i const> triangles, Light light);
  void paint_triangles(std::size_t first_triangle, std::span<Eigen::Vector3i const> triangles, std::size_t corner_count,
                       PolygonPaint const& paint);
  std::int32_t texture_of(PolygonPaint const& paint, std::size_t corner_count);
  PolygonModel finished();

  std::filesystem::path const& path_;
  PolygonModel model_;
  std::int32_t polygon_count_ = 0;
  std::vector<std::uint8_t> passes_;  ///< a vertex; empty: nowhere
  MaterialColors colors_;
  std::vector<std::int32_t> textures_;  ///< of each material; -1: none
  std::size_t unplaced_ = 0;            ///< polygons of a textured material that go without
};

}  // namespace scanview
