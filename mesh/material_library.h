#pragma once
#include <filesystem>
#include <set>
#include <string>
#include <string_view>

namespace scanview {

/// Names of the materials that let light through, of the Wavefront material libraries of a model's `mtllib` line: `d`
/// below 1, or, without `d`, `Tr` above 0, or a `map_d`. The files are looked for in the model's folder and below it.
/// Throws Error{bad_input} where one is not there.
std::set<std::string> transparent_materials(std::string_view mtllib, std::filesystem::path const& model);

}  // namespace scanview
