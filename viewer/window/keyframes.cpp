#include "viewer/window/keyframes.h"

#include <fmt/format.h>

namespace scanview {

Json Keyframes::to_json() const {
  Json json = {{"format", 1}, {"keyframes", Json::array()}, {"between", between}};
  for (auto const& key : cameras_) {
    json["keyframes"].push_back(
        {{"camera", key.camera.to_json()}, {"object_from_camera", pose_to_json(key.object_from_camera)}});
  }
  return json;
}

void Keyframes::save(std::filesystem::path const& folder) {
  save_as(file_.empty() ? first_free(folder, "scanview-path-", ".json") : file_);
}

void Keyframes::save_as(std::filesystem::path const& file) {
  write_json(file, to_json());
  file_ = file;
}

std::filesystem::path first_free(std::filesystem::path const& folder, std::string const& begin,
                                 std::string const& end) {
  for (int number = 0;; ++number) {
    auto path = folder / fmt::format("{}{:03}{}", begin, number, end);
    if (!std::filesystem::exists(path)) return path;
  }
}

}  // namespace scanview
