#include "mesh/model_pictures.h"

#include "base/files.h"
#include "base/image_file.h"
#include "mesh/file_beside.h"

namespace scanview {

cv::Mat3b ModelPictures::named(std::string const& name, std::function<std::string()> const& bytes) {
  auto const [place, is_new] = known_.try_emplace(name);
  if (!is_new) return place->second;
  auto const note = [&](std::string const& why) {
    builder_.note(fmt::format("texture '{}' was left out: {}", name, why));
  };
  try {
    place->second = decode_color(bytes(), name);
  } catch (Error const& error) {
    note(error.message());
  } catch (Json::exception const& error) {
    note(error.what());
  }
  return place->second;
}

cv::Mat3b ModelPictures::beside(std::filesystem::path const& model, std::string_view file) {
  return named(std::string(file), [&] { return read_file(file_beside(model, file)); });
}

}  // namespace scanview
