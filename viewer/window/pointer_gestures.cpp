#include "viewer/window/pointer_gestures.h"

#include <cmath>

namespace scanview {

std::vector<Gesture> PointerGestures::feed(WindowEvent const& event) {
  using Kind = WindowEvent::Kind;
  std::vector<Gesture> gestures;
  auto const drag_to_pointer = [&] {
    if (!held_) return;
    dragging_ = dragging_ || std::hypot(event.x - press_x_, event.y - press_y_) > kClickPixels;
    if (!dragging_ || (event.x == x_ && event.y == y_)) return;
    gestures.push_back(
        {Gesture::Kind::drag, event.x, event.y, event.x - x_, event.y - y_, button_ != 0 || event.shift, 0});
    x_ = event.x;
    y_ = event.y;
  };
  if (event.kind == Kind::scroll) {
    gestures.push_back({Gesture::Kind::scroll, event.x, event.y, 0, 0, false, event.steps});
  } else if (event.kind == Kind::press && !held_) {
    held_ = true;
    dragging_ = false;
    button_ = event.button;
    press_x_ = x_ = event.x;
    press_y_ = y_ = event.y;
    press_seconds_ = event.seconds;
  } else if (event.kind == Kind::move) {
    drag_to_pointer();
  } else if (event.kind == Kind::release && held_ && event.button == button_) {
    drag_to_pointer();
    held_ = false;
    if (dragging_ || button_ != 0) {
      clicked_ = false;
      return gestures;
    }
    bool const second = clicked_ && press_seconds_ - click_seconds_ <= kDoubleSeconds &&
                        std::hypot(press_x_ - click_x_, press_y_ - click_y_) <= kClickPixels;
    gestures.push_back(
        {second ? Gesture::Kind::double_click : Gesture::Kind::click, press_x_, press_y_, 0, 0, false, 0});
    clicked_ = !second;
    click_x_ = press_x_;
    click_y_ = press_y_;
    click_seconds_ = press_seconds_;
  }
  return gestures;
}

}  // namespace scanview
