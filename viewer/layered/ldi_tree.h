#pragma once
#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "acquire/scan_set.h"
#include "viewer/layered/ldi_lattice.h"
#include "viewer/layered/ldi_pixels.h"

namespace scanview {

/// What an LDI tree is built with; part of the tree, since images that are added later must be treated alike.
struct LdiOptions {
  int resolution = 64;  ///< N: grid points a side of a cell's LDI, 1 to 256
  /// A stamp of size S goes to the level with the greatest step P ≤ S · coarseness. 1: nothing is lost; 0.25 to 4.
  double coarseness = 1;
  /// d of ldi_height_bound(): grids are no finer than its power of two rounded down (0: as fine as the images).
  double smallest_feature = 0;
  /// Depths of one grid point that differ by less are one surface: in steps, "slightly smaller than the spacing"
  /// (Chang 1998, §3.1); and in units, what images may differ by (ErrorBudget::threshold), whichever is more.
  double merge_steps = 0.9;
  double depth_error = 0;
  /// Where children cover less of a grid point, what was splatted there without filter is a patch: it fills what they
  /// leave open. 0 is the paper's rule: it is merged with what is filtered.
  double covered = 0.5;
  enum class Normals { measured, facing } normals = Normals::measured;  ///< StampOptions

  void validate() const;  ///< Throws Error{usage} naming the field and its range.
  /// Depths of that level's pixels that differ by less are one surface.
  double merge_distance(int level) const { return std::max(merge_steps * ldi_step(level), depth_error); }
  /// Depth bins of a level are 2^bin_shift steps deep: as deep as the images are uncertain. Noise does not fill bin
  /// after bin.
  int bin_shift(int level) const;
  double step_limit() const;  ///< the finest step by smallest_feature; 0: none
  bool operator==(LdiOptions const&) const = default;
};

/// One cell of the octree with its LDI.
struct LdiCell {
  LdiCellKey key;
  std::array<std::int32_t, 8> children;  ///< −1: none; child i: high half of axis k where bit k of i is set
  std::uint32_t pixels = 0;
  std::array<std::uint32_t, kLdiKinds> blocks_of_kind{};  ///< kind after kind
  std::size_t blocks() const { return std::size_t{blocks_of_kind[0]} + blocks_of_kind[1] + blocks_of_kind[2]; }
  std::uint64_t offset = 0;  ///< of its content within the tree's
  std::uint64_t hash = 0;    ///< XXH3 of its content
  bool has_children() const;
};

/// An octree with an LDI in each cell (Chang, Bishop, Lastra 1998): of every surface the pixels of the finest image
/// that shows it, and filtered copies of them upwards. Its content is in memory or in a file that is mapped, of which
/// only what is drawn is read.
class LdiTree {
 public:
  LdiOptions options;
  Unit unit = Unit::m;
  /// Reference views without their images, for camera paths; center and radius: of the scene's object.
  std::vector<View> views;
  Eigen::Vector3d center{0, 0, 0};
  double radius = 0;
  std::uint64_t input_pixels = 0;   ///< with depth, of all views
  std::uint64_t input_bytes = 0;    ///< of the views' colours and depths
  std::vector<LdiCell> cells;       ///< parents before children; sorted
  std::vector<std::int32_t> roots;  ///< cells without parents, all of one level: the root's children, at most 8

  /// A cell's blocks and pixels. From a file, a cell is checked when it is first asked for: throws Error{bad_input}
  /// where it is damaged. Thread-safe.
  std::span<LdiBlock const> blocks(LdiCell const& cell) const;
  LdiPixels pixels(LdiCell const& cell) const;
  static std::uint64_t content_bytes(LdiCell const& cell);

  std::size_t pixel_count() const;
  std::size_t bytes() const;  ///< of cells, blocks and pixels: what rendering needs
  Eigen::AlignedBox3d box(LdiCell const& cell) const;
  /// Sets center and radius: the median of the pixels of the coarsest level that has any, and the distance of 99 %
  /// of them.
  void place_object();

  /// The content's bytes, of all cells one after the other, and who owns them.
  std::span<std::byte const> content;
  std::shared_ptr<void const> owner;
  std::filesystem::path path;  ///< of the file, where there is one

  /// Whether cells were checked, a byte each; empty: nothing to check.
  std::shared_ptr<std::vector<std::uint8_t>> checked;
};

}  // namespace scanview
