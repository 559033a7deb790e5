#include "mesh/file_beside.h"

#include <algorithm>
#include <string>

namespace scanview {

std::filesystem::path file_beside(std::filesystem::path const& model, std::string_view name) {
  namespace fs = std::filesystem;
  std::string text(name.substr(0, name.find('\0')));
  std::replace(text.begin(), text.end(), '\\', '/');
  fs::path const named = fs::path(text).lexically_normal();
  bool const inside =
      named.is_relative() && !named.empty() && text.find(':') == std::string::npos && *named.begin() != "..";
  return model.parent_path() / (inside ? named : named.filename());
}

}  // namespace scanview
