#include "viewer/window/file_watch.h"

#include "acquire/scan_set_file.h"

namespace scanview {
namespace fs = std::filesystem;

FileWatch::FileWatch(std::vector<fs::path> files) : files_(std::move(files)), known_(look()), last_(known_) {}

FileWatch::State FileWatch::look() const {
  State state;
  for (auto const& file : files_) {
    std::error_code error;
    auto const time = fs::last_write_time(file, error);
    if (error) {
      state.emplace_back(-1, 0);
      continue;
    }
    auto const size = fs::file_size(file, error);
    state.emplace_back(time.time_since_epoch().count(), error ? 0 : size);
  }
  return state;
}

bool FileWatch::changed() {
  State now = look();
  bool const settled = now == last_;
  last_ = std::move(now);
  if (!settled || last_ == known_) return false;
  known_ = last_;
  return true;
}

std::vector<fs::path> watched_files(fs::path const& folder, ScanSet const& set) {
  std::vector<fs::path> files;
  if (folder.empty()) return files;
  files.push_back(folder / "scanset.json");
  for (auto const& view : set.views) files.push_back(folder / view_folder(view.name) / "mesh.ply");
  return files;
}

}  // namespace scanview
