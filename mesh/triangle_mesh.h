#pragma once
#include <Eigen/Core>
#include <filesystem>
#include <opencv2/core/mat.hpp>
#include <vector>

namespace scanview {

/// Triangles over shared vertices, counter-clockwise seen from outside. `colors` is empty or has one 8-bit sRGB colour
/// (BGR) a vertex.
struct TriangleMesh {
  std::vector<Eigen::Vector3f> vertices;
  std::vector<Eigen::Vector3i> triangles;
  std::vector<cv::Vec3b> colors;

  /// Throws std::logic_error where an index is out of range or a vertex is not finite.
  void check() const;
};

/// The triangles of a model in any format that `read_polygon_model` reads, wound as the file has them; no triangles is
/// no error. Throws Error{bad_input}; indices out of range and non-finite vertices are errors.
TriangleMesh read_triangle_mesh(std::filesystem::path const& path);
/// Binary little-endian PLY; whole or not at all.
void write_triangle_mesh(std::filesystem::path const& path, TriangleMesh const& mesh);

}  // namespace scanview
