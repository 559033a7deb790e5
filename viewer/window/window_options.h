#pragma once
#include <filesystem>
#include <string>

namespace scanview {

/// What is the same for every window, whatever is looked at.
struct BasicWindowOptions {
  int width = 1024, height = 768;  ///< pixels
  std::string title = "scanview";
  /// Where P saves scanview-NNN.png and keyframes go as scanview-path-NNN.json, the first number that is free.
  std::filesystem::path pictures = ".";
  int frames = 0;  ///< more than 0: draws a full turn of so many frames as fast as it can, measures, and returns
  /// Throws Error{usage}.
  void validate() const;
};

/// Medians over the frames of BasicWindowOptions::frames, in full resolution.
struct FrameTimes {
  int width = 0, height = 0;      ///< of the picture: the window without panel and strip
  double frame_milliseconds = 0;  ///< rendering and showing, without the panel
  double panel_milliseconds = 0;  ///< the panel, and what falls due of the strip below
  double frames_per_second = 0;   ///< of both, and of swapping
};

}  // namespace scanview
