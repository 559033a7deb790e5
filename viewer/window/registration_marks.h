#pragma once
#include <Eigen/Core>
#include <filesystem>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "base/files.h"

namespace scanview {

/// Points of the object that a person found in two views or more, for `register --init FILE` (register/marks.h). The
/// same name in two views is the same point; names that the viewer gives are "1", "2", ...
class RegistrationMarks {
 public:
  struct Mark {
    std::string name;
    Eigen::Vector2d pixel;
  };

  /// A mark of that name in the view moves there.
  void set(std::string const& view, std::string const& name, Eigen::Vector2d const& pixel);
  /// The one set last in this view. False where it has none.
  bool remove_last(std::string const& view);
  /// In the order in which they were set.
  std::vector<Mark> const& of(std::string const& view) const;
  bool has(std::string const& view, std::string const& name) const;
  bool empty() const;

  /// The lowest number from 1 that this view has no mark of.
  int next_number(std::string const& view) const;
  /// Views that register cannot place yet, in this order: from the first one on, each must share three marks with the
  /// views placed before it. (Whether the three lie on a line is for register to say.)
  std::vector<std::string> unplaced(std::vector<std::string> const& views) const;

  /// {"marks": {"VIEW": {"POINT": [u, v], ...}, ...}}, pixels to a hundredth.
  Json to_json() const;
  /// Throws Error{bad_input, path} where it is none.
  static RegistrationMarks from_json(Json const& json, std::filesystem::path const& path);

 private:
  std::map<std::string, std::vector<Mark>> views_;
};

}  // namespace scanview
