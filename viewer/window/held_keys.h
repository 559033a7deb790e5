#pragma once
#include <map>

#include "viewer/window/window_event.h"

namespace scanview {

/// Which keys are held and for how long, so that what they move moves with time, whatever a frame takes and however
/// often the keyboard repeats. Knows nothing of windows; a window that loses the keyboard releases its keys.
class HeldKeys {
 public:
  /// A key that is touched counts at least so long: also one that came and went during a slow frame.
  static constexpr double kTouchSeconds = 0.05;
  /// Takes the keys among the events; others change nothing.
  void feed(WindowEvent const& event);
  bool is_held(int key) const;
  bool any() const { return !keys_.empty(); }
  /// For how many seconds each key was held since the last call, until `now` (on the clock of WindowEvent::seconds). A
  /// key that was released is in the next answer for the last time.
  std::map<int, double> take(double now);

 private:
  struct Key {
    double from = 0;     ///< since when it has been held and not been taken
    double taken = 0;    ///< of this touch
    double waiting = 0;  ///< of this touch and earlier ones, not taken yet
    bool held = true;
  };
  std::map<int, Key> keys_;
};

}  // namespace scanview
