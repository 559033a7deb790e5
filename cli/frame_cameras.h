#pragma once
#include <filesystem>
#include <string>
#include <utility>
#include <vector>

#include "viewer/renderer.h"
#include "viewer/select/camera_path.h"

namespace CLI {
class App;
}

namespace scanview {

/// Where pictures of a set are taken from: exactly one of the first four.
struct FrameCameras {
  int orbit = 0;  ///< a full turn in so many pictures
  bool halfway = false;
  std::filesystem::path path;
  std::string like;
  std::string size = "800x600";
};

/// Their options, of which a command needs one.
void add_camera_options(CLI::App* verb, FrameCameras& cameras);
/// WIDTHxHEIGHT, 1 to 16384 each; throws Error{usage} otherwise.
std::pair<int, int> parse_picture_size(std::string const& text);
/// `radius`: of the set's object, since its views may be without depths. Throws as the paths of camera_path.h do.
std::vector<PathCamera> frame_cameras(FrameCameras const& cameras, ScanSet const& set, double radius);

/// Pictures in a folder, which is made where there is none; on request also as one film (animated PNG).
class FrameFolder {
 public:
  enum class Film { none, film };
  /// Throws Error{io}.
  FrameFolder(std::filesystem::path folder, Film film, int milliseconds);
  /// NAME.png; gives its file name.
  std::string write(std::string const& name, cv::Mat4b const& picture);
  /// film.png, where it is wanted.
  void finish();
  std::filesystem::path const& path() const { return folder_; }

 private:
  std::filesystem::path folder_;
  Film film_;
  int milliseconds_;
  std::vector<std::string> pictures_;
};

}  // namespace scanview
