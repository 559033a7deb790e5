#pragma once
#include <array>
#include <cstdint>
#include <filesystem>
#include <span>
#include <vector>

#include "base/ply.h"
#include "mesh/model_builder.h"

namespace scanview {

/// The pictures of a PLY file, which its comments name, and where its faces lie in them: by a list `texcoord` of each
/// face, two numbers a corner, and perhaps `texnumber`, the picture (both as MeshLab writes them); else by s and t, u
/// and v, or texture_u and texture_v of the vertices, in the first picture. v is up.
class PlyTextures {
 public:
  /// Reads the pictures; those that cannot be read are notes. All must outlive this.
  PlyTextures(PlyFile const& ply, std::filesystem::path const& path, ModelBuilder& builder);

  /// What is on a face, or on a strip; valid until the next call.
  PolygonPaint on_face(std::size_t row, std::span<std::int64_t const> corners);
  PolygonPaint on_corners(std::span<std::int64_t const> corners);

 private:
  std::vector<std::int32_t> materials_;  ///< the builder's number of each picture; empty: no textures
  std::array<PlyProperty const*, 2> of_vertex_{};
  PlyProperty const *of_face_ = nullptr, *number_ = nullptr;
  std::vector<Eigen::Vector2f> at_;
};

}  // namespace scanview
