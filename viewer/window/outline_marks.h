#pragma once
#include <map>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "mesh/mesh_marks.h"

namespace scanview {

/// What a polygon tells `mesh --marks` (MeshMarks).
enum class OutlineKind { keep, remove, cut };
std::string to_string(OutlineKind kind);  ///< "keep", "remove", "cut": the file's words

/// Polygons and lines that a person draws over views, one at a time.
class OutlineMarks {
 public:
  struct Outline {
    OutlineKind kind;
    MeshMarks::Polygon corners;
  };

  /// A further corner of the one being drawn. A corner in another view begins there anew.
  void add_corner(std::string const& view, Eigen::Vector2d const& pixel);
  /// Ends it. Where it has too few corners (three; a cut: two) nothing changes, and why is returned; otherwise "".
  std::string close(OutlineKind kind);
  /// The last corner of the one being drawn in this view, else this view's last outline. False where there is neither.
  bool remove_last(std::string const& view);

  /// Empty where none is being drawn in this view.
  MeshMarks::Polygon open(std::string const& view) const;
  std::vector<Outline> const& of(std::string const& view) const;  ///< closed, in their order
  bool empty() const;                                             ///< none is closed

  /// What mesh_marks_from_json reads: all that are closed. Pixels to a hundredth.
  Json to_json() const;
  /// Throws what mesh_marks_from_json does.
  static OutlineMarks from_json(Json const& json, std::filesystem::path const& path);

 private:
  std::string drawn_in_;
  MeshMarks::Polygon drawn_;
  std::map<std::string, std::vector<Outline>> views_;
};

}  // namespace scanview
