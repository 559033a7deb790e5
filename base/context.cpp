#include "base/context.h"

#include "base/error.h"

namespace scanview {

void Context::log(std::string const& line) {
  std::lock_guard lock(mutex_);
  if (on_log) on_log(line);
}

void Context::warn(std::string const& line) {
  std::lock_guard lock(mutex_);
  warnings_.push_back(line);
  if (on_warning) on_warning(line);
}

void Context::progress(std::string const& stage, std::size_t done, std::size_t total) {
  std::lock_guard lock(mutex_);
  if (on_progress) on_progress(stage, done, total);
}

void Context::check_cancelled() const {
  if (cancelled && cancelled->load(std::memory_order_relaxed))
    throw Error(ErrorCode::interrupted, {}, "interrupted; run again to resume");
}

std::vector<std::string> Context::warnings() const {
  std::lock_guard lock(mutex_);
  return warnings_;
}

}  // namespace scanview
