#pragma once
#include <fmt/format.h>

#include <cstdint>
#include <filesystem>

#include "base/error.h"
#include "mesh/triangle_mesh.h"

namespace scanview {

/// Collects a mesh and checks what goes in.
class MeshBuilder {
 public:
  explicit MeshBuilder(std::filesystem::path const& path) : path_(path) {}

  [[noreturn]] void fail(std::string const& what) const { throw Error(ErrorCode::bad_input, path_, what); }

  void add_vertex(double x, double y, double z) {
    Eigen::Vector3f const p = Eigen::Vector3d(x, y, z).cast<float>();
    if (!p.allFinite()) fail(fmt::format("vertex {} is not finite", mesh_.vertices.size()));
    mesh_.vertices.push_back(p);
  }
  void add_color(cv::Vec3b const& color) { mesh_.colors.push_back(color); }

  void add_triangle(std::int64_t a, std::int64_t b, std::int64_t c) {
    for (std::int64_t const index : {a, b, c})
      if (index < 0 || index >= std::int64_t(mesh_.vertices.size()))
        fail(fmt::format("a face names vertex {}, but there are {}", index, mesh_.vertices.size()));
    mesh_.triangles.emplace_back(int(a), int(b), int(c));
  }
  /// A fan, exact for convex polygons.
  template <typename Indices>
  void add_polygon(Indices const& indices) {
    if (indices.size() < 3) fail(fmt::format("a face of {} vertices", indices.size()));
    for (std::size_t k = 1; k + 1 < indices.size(); ++k) add_triangle(indices[0], indices[k], indices[k + 1]);
  }

  TriangleMesh const& mesh() const { return mesh_; }
  TriangleMesh take() {
    if (mesh_.vertices.size() > std::size_t(INT32_MAX)) fail("more vertices than 2^31");
    if (mesh_.colors.size() != mesh_.vertices.size()) mesh_.colors.clear();
    return std::move(mesh_);
  }

 private:
  std::filesystem::path const& path_;
  TriangleMesh mesh_;
};

}  // namespace scanview
