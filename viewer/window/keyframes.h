#pragma once
#include <filesystem>
#include <string>
#include <vector>

#include "base/files.h"
#include "viewer/select/camera_path.h"

namespace scanview {

/// Cameras that a person chose one after the other, for `render --path` (read_camera_path).
class Keyframes {
 public:
  void add(PathCamera const& camera) { cameras_.push_back(camera); }
  void remove_last() {
    if (!cameras_.empty()) cameras_.pop_back();
  }
  std::size_t size() const { return cameras_.size(); }
  /// Frames from one keyframe to the next, at least 1.
  int between = 24;
  /// What read_camera_path reads; with no keyframe it would refuse it.
  Json to_json() const;
  /// Writes them to scanview-path-NNN.json in the folder, the first number that is free, and to the same file from then
  /// on. Throws Error{io}.
  void save(std::filesystem::path const& folder);
  /// Writes them to that file now, and by save() from then on. Throws Error{io}.
  void save_as(std::filesystem::path const& file);
  std::filesystem::path const& file() const { return file_; }  ///< empty before the first save

 private:
  std::vector<PathCamera> cameras_;
  std::filesystem::path file_;
};

/// FOLDER/beginNNNend with the first number, from 000, that no file has.
std::filesystem::path first_free(std::filesystem::path const& folder, std::string const& begin, std::string const& end);

}  // namespace scanview
