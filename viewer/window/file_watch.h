#pragma once
#include <cstdint>
#include <filesystem>
#include <utility>
#include <vector>

#include "acquire/scan_set.h"

namespace scanview {

/// Notices that files were written, came or went: by their time and size.
class FileWatch {
 public:
  FileWatch() = default;
  explicit FileWatch(std::vector<std::filesystem::path> files);
  /// True once after a change, as soon as two calls in a row have found the same: a stage that is still writing one
  /// view after the other is left to finish. Never throws: a file that cannot be looked at counts as missing.
  bool changed();

 private:
  using State = std::vector<std::pair<std::int64_t, std::uintmax_t>>;
  State look() const;
  std::vector<std::filesystem::path> files_;
  State known_, last_;
};

/// What the viewer reads of a set's folder at once: scanset.json and every view's mesh.ply.
std::vector<std::filesystem::path> watched_files(std::filesystem::path const& folder, ScanSet const& set);

}  // namespace scanview
