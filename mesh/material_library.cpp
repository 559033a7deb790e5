#include "mesh/material_library.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <system_error>
#include <utility>

#include "base/files.h"
#include "mesh/file_beside.h"
#include "mesh/words.h"

// Format: Wavefront, "Appendix B2: Materials (.mtl)", of the Advanced Visualizer manual.

namespace scanview {
namespace {

namespace fs = std::filesystem;

/// Of one to three numbers; green and blue are as red where they are not said.
std::optional<cv::Vec3b> color_of(Words words) {
  cv::Vec3b color;
  std::optional<double> value;
  for (int c = 2; c >= 0; --c) {
    auto const next = parse_number<double>(words.next());
    if (next || !value) value = next;
    if (!value || std::isnan(*value)) return std::nullopt;
    color[c] = uchar(std::lround(255 * std::clamp(*value, 0.0, 1.0)));
  }
  return color;
}

/// How many words follow an option of a map. Of those that take up to three numbers, -1; of what is no option, nothing.
std::optional<int> argument_count(std::string_view word) {
  if (word == "-mm") return 2;
  constexpr std::array<std::string_view, 3> kNumbers = {"-o", "-s", "-t"};
  if (std::find(kNumbers.begin(), kNumbers.end(), word) != kNumbers.end()) return -1;
  constexpr std::array<std::string_view, 9> kOne = {"-blendu", "-blendv",  "-bm",     "-boost", "-cc",
                                                    "-clamp",  "-imfchan", "-texres", "-type"};
  return std::find(kOne.begin(), kOne.end(), word) != kOne.end() ? std::optional(1) : std::nullopt;
}

/// Options, and then a name, which may hold spaces.
MaterialMap map_of(Words words) {
  MaterialMap map;
  while (true) {
    std::string_view const before = words.rest(), option = words.next();
    auto const count = argument_count(option);
    if (!count) {
      map.file = trimmed(before);
      return map;
    }
    for (int k = 0; *count < 0 ? k < 3 : k < *count; ++k) {
      Words const start = words;
      std::string_view const argument = words.next();
      auto const number = parse_number<float>(argument);
      if (*count < 0 && !number) {
        words = start;
        break;
      }
      if (option == "-clamp" && argument == "on") map.wrap = TextureWrap::clamp;
      if (option == "-s" && k < 2) map.scale[k] = *number;
      if (option == "-o" && k < 2) map.offset[k] = *number;
    }
  }
}

void append_materials(std::string_view text, std::vector<LibraryMaterial>& materials) {
  LibraryMaterial material;
  std::optional<double> dissolve, transparency;
  bool has_map = false;
  auto const finish = [&] {
    if (has_map || (dissolve ? *dissolve < 1 : transparency && *transparency > 0)) material.light = Light::passes;
    materials.push_back(std::exchange(material, {}));
    dissolve = transparency = std::nullopt;
    has_map = false;
  };
  Lines lines(text);
  while (auto const line = lines.next()) {
    Words words(*line);
    std::string_view const keyword = words.next();
    if (keyword == "newmtl") {
      finish();
      material.name = trimmed(words.rest());
    } else if (keyword == "d" || keyword == "Tr") {
      std::string_view word = words.next();
      if (word == "-halo") word = words.next();
      (keyword == "d" ? dissolve : transparency) = parse_number<double>(word);
    } else if (keyword == "map_d") {
      has_map = true;
    } else if (keyword == "Kd") {
      material.color = color_of(words);
    } else if (keyword == "map_Kd") {
      material.map = map_of(words);
    }
  }
  finish();
}

}  // namespace

std::vector<LibraryMaterial> read_material_libraries(std::string_view mtllib, fs::path const& model) {
  std::vector<LibraryMaterial> materials;
  std::error_code ignored;
  fs::path const whole = file_beside(model, mtllib);  // names may hold spaces, and spaces lie between names
  if (mtllib.find(' ') == std::string_view::npos || fs::is_regular_file(whole, ignored)) {
    append_materials(read_file(whole), materials);
    return materials;
  }
  Words words(mtllib);
  for (std::string_view word = words.next(); !word.empty(); word = words.next())
    append_materials(read_file(file_beside(model, word)), materials);
  return materials;
}

}  // namespace scanview
