#pragma once
#include <vector>

#include "viewer/window/window_event.h"

namespace scanview {

/// What a pointer's presses, moves and releases amount to. Events may come singly or several at once after a slow
/// frame: the same gestures follow. One button counts at a time, the first that was pressed.
struct Gesture {
  enum class Kind { drag, click, double_click, scroll } kind = Kind::click;
  double x = 0, y = 0;    ///< where: of a click its press
  double dx = 0, dy = 0;  ///< drag: since the last one, pixels
  bool pan = false;       ///< drag: with another button than the left, or shift
  double steps = 0;       ///< scroll
};

class PointerGestures {
 public:
  /// A press that ends within kClickPixels of where it began is a click (left button only); any other is a drag, which
  /// begins with the whole way from its press. A second click within kDoubleSeconds and kClickPixels of a first is a
  /// double click; a third is a first again.
  static constexpr double kClickPixels = 4, kDoubleSeconds = 0.4;
  std::vector<Gesture> feed(WindowEvent const& event);
  bool held() const { return held_; }

 private:
  bool held_ = false, dragging_ = false;
  int button_ = 0;
  double press_x_ = 0, press_y_ = 0, press_seconds_ = 0, x_ = 0, y_ = 0;
  bool clicked_ = false;  ///< a click that a second one may make double
  double click_x_ = 0, click_y_ = 0, click_seconds_ = 0;
};

}  // namespace scanview
