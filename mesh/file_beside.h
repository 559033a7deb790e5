#pragma once
#include <filesystem>
#include <string_view>

namespace scanview {

/// The file that a model names: a relative path in the model's folder or below it; of any other path (absolute,
/// upwards, another system's) the last part, in the model's folder.
std::filesystem::path file_beside(std::filesystem::path const& model, std::string_view name);

}  // namespace scanview
