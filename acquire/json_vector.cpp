#include "acquire/json_vector.h"

#include "base/error.h"
#include "base/json_fields.h"

namespace scanview {

Json vector_to_json(Eigen::Vector3d const& vector) { return Json::array({vector.x(), vector.y(), vector.z()}); }

Eigen::Vector3d vector_from_json(Json const& json, std::string const& key, std::filesystem::path const& path) {
  if (!json.is_array() || json.size() != 3) throw Error(ErrorCode::bad_input, path, key + ": must be three numbers");
  Eigen::Vector3d vector;
  for (int i = 0; i < 3; ++i) vector[i] = json_finite(json[std::size_t(i)], key, path);
  return vector;
}

}  // namespace scanview
