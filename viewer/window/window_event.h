#pragma once

namespace scanview {

/// One thing that a person did, in the order in which it was done. Positions are pixels of the window's framebuffer,
/// integers being centres, (0, 0) the top-left one's.
struct WindowEvent {
  enum class Kind { press, release, move, scroll, key, key_release, exposed } kind = Kind::exposed;
  double x = 0, y = 0;
  int button = 0;      ///< press, release: 0 left, 1 right, 2 middle
  int key = 0;         ///< key (again and again while it is held), key_release: GLFW's number; of letters and digits
                       ///< the capital's ASCII code
  bool shift = false;  ///< held
  double steps = 0;    ///< scroll: positive away from the person
  double seconds =
      0;  ///< the earliest moment it can have happened at: what came during a slow frame, the frame's start
};

/// A part of the framebuffer, in pixels from its top-left corner.
struct Viewport {
  int x = 0, y = 0, width = 0, height = 0;
  bool contains(double px, double py) const {
    return px >= x - 0.5 && py >= y - 0.5 && px < x + width - 0.5 && py < y + height - 0.5;
  }
};

}  // namespace scanview
