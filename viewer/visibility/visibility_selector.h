#pragma once
#include <Eigen/Core>
#include <cstdint>
#include <span>
#include <vector>

#include "viewer/visibility/triangle_planes.h"
#include "viewer/visibility/visibility_field.h"

namespace scanview {

/// Triangles [first, first + count) of drawn_mesh(): indices [3 first, 3 (first + count)) of its index buffer.
struct IndexRange {
  std::uint32_t first = 0, count = 0;
  bool operator==(IndexRange const&) const = default;
};

/// Answers, for an eye, what of a model has to be drawn: the node of a scene graph that selects (Meruvia 2001, section
/// 5). Keeps its memory between calls: one for each thread.
class VisibilitySelector {
 public:
  /// `drawn` is drawn_mesh() of the field's patches; only its planes are kept. The field must outlive the selector.
  /// `facing`: of patches of which only the fronts are seen (or only the backs) leave out the triangles that turn their
  /// other side.
  /// Without it an answer depends only on the face the eye is in, and is kept.
  VisibilitySelector(VisibilityField const& field, TriangleMesh const& drawn, bool facing = true);

  /// Ascending, apart from each other; valid until the next call. Everything where the field knows nothing about the
  /// eye (nearer than its samples, at the centre, not finite). `eye`: in the model's coordinates.
  std::span<IndexRange const> select(Eigen::Vector3d const& eye);
  /// For an orthographic camera that looks along −direction.
  std::span<IndexRange const> select_from_afar(Eigen::Vector3d const& direction);

  std::size_t triangles() const { return triangles_; }  ///< of the last answer
  std::size_t patches() const { return patches_; }      ///< seen ones, of the last answer
  bool is_whole() const { return whole_; }              ///< nothing was known about the eye
  int tests() const { return tests_; }                  ///< to find the face

 private:
  std::span<IndexRange const> answer(VisibilityField::Query const& query, EyePoint const& eye);
  /// Patches in a row of which the same sides are seen: bit 0 the fronts, bit 1 the backs.
  struct Run {
    std::size_t begin = 0, end = 0;  ///< triangles
    std::uint64_t sides = 0;
  };
  void take(Run const& run, EyePoint const& eye);
  void collect_ranges();

  VisibilityField const* field_;
  bool facing_;
  TrianglePlanes planes_;
  std::vector<std::uint64_t> drawn_;  ///< a bit a triangle
  std::vector<IndexRange> ranges_;
  struct Kept {
    std::vector<IndexRange> ranges;
    std::size_t triangles = 0, patches = 0;
  };
  std::vector<Kept> kept_;  ///< by cell, without facing
  std::size_t triangles_ = 0, patches_ = 0;
  bool whole_ = false;
  int tests_ = 0;
};

}  // namespace scanview
