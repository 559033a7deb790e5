#pragma once
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

 private:
  std::vector<PathCamera> cameras_;
};

}  // namespace scanview
