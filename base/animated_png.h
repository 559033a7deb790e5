#pragma once
#include <string>
#include <vector>

namespace scanview {

/// A film of PNG pictures (APNG, W3C PNG third edition): plays wherever PNG is shown, for ever, `milliseconds` a frame.
/// The frames are whole PNG files of one size and kind, at least one (std::logic_error otherwise).
std::string animated_png(std::vector<std::string> const& frames, int milliseconds);

}  // namespace scanview
