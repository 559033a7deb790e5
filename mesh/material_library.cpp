#include "mesh/material_library.h"

#include <optional>
#include <system_error>

#include "base/files.h"
#include "mesh/file_beside.h"
#include "mesh/words.h"

namespace scanview {
namespace {

namespace fs = std::filesystem;

void add_transparent(std::string_view text, std::set<std::string>& names) {
  std::string name;
  std::optional<double> dissolve, transparency;
  bool has_map = false;
  auto const finish = [&] {
    if (has_map || (dissolve ? *dissolve < 1 : transparency && *transparency > 0)) names.insert(name);
    dissolve = transparency = std::nullopt;
    has_map = false;
  };
  Lines lines(text);
  while (auto const line = lines.next()) {
    Words words(*line);
    std::string_view const keyword = words.next();
    if (keyword == "newmtl") {
      finish();
      name = trimmed(words.rest());
    } else if (keyword == "d" || keyword == "Tr") {
      std::string_view word = words.next();
      if (word == "-halo") word = words.next();
      (keyword == "d" ? dissolve : transparency) = parse_number<double>(word);
    } else if (keyword == "map_d") {
      has_map = true;
    }
  }
  finish();
}

}  // namespace

std::set<std::string> transparent_materials(std::string_view mtllib, fs::path const& model) {
  std::set<std::string> names;
  std::error_code ignored;
  fs::path const whole = file_beside(model, mtllib);  // names may hold spaces, and spaces lie between names
  if (mtllib.find(' ') == std::string_view::npos || fs::is_regular_file(whole, ignored)) {
    add_transparent(read_file(whole), names);
    return names;
  }
  Words words(mtllib);
  for (std::string_view word = words.next(); !word.empty(); word = words.next())
    add_transparent(read_file(file_beside(model, word)), names);
  return names;
}

}  // namespace scanview
