#include <algorithm>

#include "acquire/archive.h"
#include "acquire/import.h"
#include "acquire/rgbd_layout.h"

namespace scanview {

std::string guess_import_kind(std::filesystem::path const& path) {
  namespace fs = std::filesystem;
  std::error_code ignored;
  if (fs::is_regular_file(path, ignored)) {
    if (path.extension() == ".conf" || is_archive(path)) return "stanford";
    if (path.filename() == "transforms.json") return "nerfstudio";
    if (path.extension() == ".json" && path.filename() != "scanset.json" && path.filename() != "capture.json")
      return "rgbd";
    return {};
  }
  if (!fs::is_directory(path, ignored)) return {};
  if (fs::exists(path / "rgbd.json")) return "rgbd";
  if (fs::exists(path / "scanset.json") || fs::exists(path / "capture.json")) return {};
  if (fs::exists(path / "transforms.json")) return "nerfstudio";
  for (char const* folder : {".", "sparse", "sparse/0"})
    if (fs::exists(path / folder / "cameras.txt") && fs::exists(path / folder / "images.txt")) return "colmap";
  if (recognise_rgbd_layout(path)) return "rgbd";
  for (fs::directory_iterator it(path, ignored), end; !ignored && it != end; it.increment(ignored))
    if (it->path().extension() == ".conf") return "stanford";
  return {};
}

}  // namespace scanview
