#pragma once
#include <cstddef>
#include <functional>
#include <opencv2/core/mat.hpp>

#include "base/context.h"

namespace scanview {

/// Reads frames ahead, several at once, and hands them on one by one in their order: `use(i, read(i))` for i in
/// [0, count). At most two more frames than threads are in memory besides what `use` keeps, however many there are.
/// The error of the first frame that failed is rethrown. Stops at cancel.
void stream_frames(Context& context, std::size_t count, std::function<cv::Mat(std::size_t)> const& read,
                   std::function<void(std::size_t, cv::Mat const&)> const& use);

}  // namespace scanview
