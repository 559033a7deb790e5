#pragma once
#include <filesystem>
#include <string>
#include <string_view>

namespace scanview {

bool is_gzip(std::string_view bytes);

/// The bytes that a gzip file holds, 2 GiB at most. Throws Error{bad_input, path}.
std::string unpack_gzip(std::string_view packed, std::filesystem::path const& path);

}  // namespace scanview
