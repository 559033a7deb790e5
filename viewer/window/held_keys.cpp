#include "viewer/window/held_keys.h"

#include <algorithm>

namespace scanview {

void HeldKeys::feed(WindowEvent const& event) {
  auto const known = keys_.find(event.key);
  if (event.kind == WindowEvent::Kind::key) {
    if (known == keys_.end()) {
      keys_[event.key].from = event.seconds;
    } else if (!known->second.held) {
      known->second.from = event.seconds;
      known->second.taken = 0;
      known->second.held = true;
    }
  } else if (event.kind == WindowEvent::Kind::key_release && known != keys_.end() && known->second.held) {
    Key& key = known->second;
    double const seconds = std::max(0.0, event.seconds - key.from);
    key.waiting += std::max(seconds, kTouchSeconds - key.taken);
    key.held = false;
  }
}

bool HeldKeys::is_held(int key) const {
  auto const known = keys_.find(key);
  return known != keys_.end() && known->second.held;
}

std::map<int, double> HeldKeys::take(double now) {
  std::map<int, double> seconds;
  for (auto it = keys_.begin(); it != keys_.end();) {
    Key& key = it->second;
    double& sum = seconds[it->first];
    sum = key.waiting;
    key.waiting = 0;
    if (key.held) {
      double const since = std::max(0.0, now - key.from);
      sum += since;
      key.taken += since;
      key.from = std::max(key.from, now);
      ++it;
    } else {
      it = keys_.erase(it);
    }
  }
  return seconds;
}

}  // namespace scanview
