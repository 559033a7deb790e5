#pragma once
#include <cstddef>
#include <functional>
#include <string>

#include "base/context.h"

namespace scanview {

/// Calls `work(i)` for i in [0, count), in parallel on at most `context.threads` threads (oneTBB), an item a task: for
/// items that take a millisecond or more (a view, a pair, a band of rows). Each i must write only what is its own, so
/// that the result does not depend on the number of threads. Stops at cancel; the error of the lowest i that failed is
/// rethrown. With a `stage` name it reports progress.
void for_each_index(Context& context, std::size_t count, std::function<void(std::size_t)> const& work,
                    std::string const& stage = {});

}  // namespace scanview
