#pragma once
#include <atomic>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <mutex>
#include <string>
#include <vector>

namespace scanview {

/// What a long computation needs from whoever called it, and what it gives back while it runs: threads, seed, log,
/// progress and cancelling. A default-made Context is silent, uses all processors and cannot be cancelled.
/// All members may be called from several threads; callbacks are called one at a time.
class Context {
 public:
  std::uint64_t seed = 1;                              ///< of every random choice (see random.h)
  int threads = 0;                                     ///< at most so many; 0: all processors
  std::atomic<bool> const* cancelled = nullptr;        ///< set by the caller to stop the work
  std::function<void(std::string const&)> on_log;      ///< one line of information, without newline
  std::function<void(std::string const&)> on_warning;  ///< one line that a person should read
  /// Progress of a stage: done of total steps, done never falls.
  std::function<void(std::string const& stage, std::size_t done, std::size_t total)> on_progress;

  void log(std::string const& line);
  /// Also remembered, for the `warnings[]` of the report. Call it in a fixed order (outside parallel loops).
  void warn(std::string const& line);
  void progress(std::string const& stage, std::size_t done, std::size_t total);
  /// Throws Error{interrupted} once the caller has asked to stop.
  void check_cancelled() const;
  std::vector<std::string> warnings() const;

 private:
  mutable std::mutex mutex_;
  std::vector<std::string> warnings_;
};

}  // namespace scanview
