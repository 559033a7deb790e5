#pragma once
#include <Eigen/Core>
#include <filesystem>
#include <string>

#include "base/files.h"

namespace scanview {

/// [x, y, z]. Reading throws Error{bad_input, path} naming `key` where it is not three finite numbers.
Json vector_to_json(Eigen::Vector3d const& vector);
Eigen::Vector3d vector_from_json(Json const& json, std::string const& key, std::filesystem::path const& path);

}  // namespace scanview
