#pragma once
#include <filesystem>
#include <initializer_list>
#include <string>
#include <string_view>

#include "base/files.h"

namespace scanview {

// Fields of a JSON file that a person writes. Each throws Error{bad_input, path} naming the key that is unknown,
// missing, of the wrong kind or out of range. `key` is what the message calls the value.

/// Every key of the object is one of `known`. `where` is the object's own key; empty for the whole file.
void refuse_unknown_keys(Json const& json, std::initializer_list<std::string_view> known, std::string const& where,
                         std::filesystem::path const& path);
Json const& json_member(Json const& json, char const* key, std::filesystem::path const& path);
double json_finite(Json const& json, std::string const& key, std::filesystem::path const& path);
int json_integer(Json const& json, std::string const& key, int low, int high, std::filesystem::path const& path);
bool json_boolean(Json const& json, std::string const& key, std::filesystem::path const& path);
std::string json_text(Json const& json, std::string const& key, std::filesystem::path const& path);

}  // namespace scanview
