#include "base/json_fields.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "base/error.h"

namespace scanview {
namespace {

[[noreturn]] void fail(std::filesystem::path const& path, std::string const& message) {
  throw Error(ErrorCode::bad_input, path, message);
}

}  // namespace

void refuse_unknown_keys(Json const& json, std::initializer_list<std::string_view> known, std::string const& where,
                         std::filesystem::path const& path) {
  if (!json.is_object())
    fail(path, where.empty() ? "the file is no JSON object" : fmt::format("'{}' is no JSON object", where));
  std::string unknown;
  for (auto const& [key, value] : json.items())
    if (std::find(known.begin(), known.end(), key) == known.end())
      unknown += fmt::format("{}'{}'", unknown.empty() ? "" : ", ", key);
  if (!unknown.empty())
    fail(path, where.empty() ? "unknown key " + unknown : fmt::format("unknown key {} in '{}'", unknown, where));
}

Json const& json_member(Json const& json, char const* key, std::filesystem::path const& path) {
  auto const found = json.find(key);
  if (found == json.end()) fail(path, fmt::format("'{}' is missing", key));
  return *found;
}

double json_finite(Json const& json, std::string const& key, std::filesystem::path const& path) {
  if (!json.is_number() || !std::isfinite(json.get<double>())) fail(path, fmt::format("'{}' is no finite number", key));
  return json.get<double>();
}

int json_integer(Json const& json, std::string const& key, int low, int high, std::filesystem::path const& path) {
  if (!json.is_number_integer() || json.get<double>() < low || json.get<double>() > high)
    fail(path, fmt::format("'{}' is no integer in {} .. {}", key, low, high));
  return json.get<int>();
}

bool json_boolean(Json const& json, std::string const& key, std::filesystem::path const& path) {
  if (!json.is_boolean()) fail(path, fmt::format("'{}' is neither true nor false", key));
  return json.get<bool>();
}

std::string json_text(Json const& json, std::string const& key, std::filesystem::path const& path) {
  if (!json.is_string()) fail(path, fmt::format("'{}' is no text", key));
  return json.get<std::string>();
}

}  // namespace scanview
