#pragma once
#include <fmt/format.h>

#include <cstdint>
#include <filesystem>
#include <span>
#include <string>
#include <utility>

#include "base/error.h"
#include "mesh/polygon_model.h"

namespace scanview {

enum class Light : std::uint8_t { stops, passes };

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

  void add_polygon(std::span<std::int64_t const> corners, Light light = Light::stops);
  /// Vertices in a row, each with the two before it a triangle, turned every other time. Triangles with a doubled
  /// vertex, by which strips are joined, are left out.
  void add_strip(std::span<std::int64_t const> corners, Light light = Light::stops);

  /// The triangles from this one on, seen from the other side.
  void turn_from(std::size_t first_triangle);

  PolygonModel take();

 private:
  void add_triangles(std::span<std::int64_t const> corners, std::span<Eigen::Vector3i const> triangles, Light light);

  std::filesystem::path const& path_;
  PolygonModel model_;
  std::int32_t polygon_count_ = 0;
  std::vector<std::uint8_t> passes_;  ///< a vertex; empty: nowhere
};

}  // namespace scanview
