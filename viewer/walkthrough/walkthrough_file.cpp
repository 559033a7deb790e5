#include "viewer/walkthrough/walkthrough_file.h"

#include <fmt/format.h>

#include "acquire/json_vector.h"
#include "base/error.h"
#include "base/json_fields.h"

namespace scanview {
namespace {

namespace fs = std::filesystem;

constexpr int kFormat = 1, kMostTriangles = 1 << 28;
char const* const kFile = "walkthrough.json";

[[noreturn]] void bad(fs::path const& path, std::string const& what) { throw Error(ErrorCode::bad_input, path, what); }

double positive(Json const& json, char const* key, fs::path const& path) {
  double const value = json_finite(json_member(json, key, path), key, path);
  if (!(value > 0)) bad(path, fmt::format("{}: must be greater than 0", key));
  return value;
}

WalkthroughManifest::Node node_from(Json const& json, std::string const& where, fs::path const& path) {
  refuse_unknown_keys(json, {"name", "position", "triangles", "parallax_px", "levels"}, where, path);
  WalkthroughManifest::Node node;
  node.name = json_text(json_member(json, "name", path), where + ".name", path);
  node.position = vector_from_json(json_member(json, "position", path), where + ".position", path);
  node.triangles =
      std::size_t(json_integer(json_member(json, "triangles", path), where + ".triangles", 0, kMostTriangles, path));
  node.parallax_px = json_finite(json_member(json, "parallax_px", path), where + ".parallax_px", path);
  Json const& levels = json_member(json, "levels", path);
  if (!levels.is_array() || levels.empty()) bad(path, where + ".levels: must be a list of folders");
  for (Json const& level : levels) {
    std::string const folder = json_text(level, where + ".levels", path);
    fs::path const normal = fs::path(folder).lexically_normal();
    if (normal.is_absolute() || *normal.begin() == "..") bad(path, where + ".levels: must lie in the folder");
    node.levels.push_back(folder);
  }
  return node;
}

}  // namespace

bool is_walkthrough(fs::path const& folder) {
  std::error_code ignored;
  return fs::is_regular_file(folder / kFile, ignored);
}

WalkthroughManifest read_walkthrough(fs::path const& folder) {
  fs::path const path = folder / kFile;
  Json const json = read_json(path);
  refuse_unknown_keys(json, {"format", "unit", "walking_radius", "focal_length", "up", "walk", "nodes"}, "", path);
  if (json_integer(json_member(json, "format", path), "format", 0, 1 << 30, path) != kFormat)
    bad(path, "format: only 1 is known");
  WalkthroughManifest manifest;
  manifest.unit = unit_from_string(json_text(json_member(json, "unit", path), "unit", path), path);
  manifest.walking_radius = positive(json, "walking_radius", path);
  manifest.focal_length = positive(json, "focal_length", path);
  manifest.up = vector_from_json(json_member(json, "up", path), "up", path);
  if (!(manifest.up.norm() > 0)) bad(path, "up: must be a direction");
  manifest.up.normalize();
  if (json.contains("walk")) {
    Json const& walk = json["walk"];
    refuse_unknown_keys(walk, {"low", "high"}, "walk", path);
    manifest.walk = Eigen::AlignedBox3d(vector_from_json(json_member(walk, "low", path), "walk.low", path),
                                        vector_from_json(json_member(walk, "high", path), "walk.high", path));
    if (manifest.walk->isEmpty()) bad(path, "walk: low must not be above high");
  }
  Json const& nodes = json_member(json, "nodes", path);
  if (!nodes.is_array() || nodes.empty()) bad(path, "nodes: must be a list of nodes");
  for (std::size_t i = 0; i < nodes.size(); ++i)
    manifest.nodes.push_back(node_from(nodes[i], fmt::format("nodes[{}]", i), path));
  return manifest;
}

void write_walkthrough(fs::path const& folder, WalkthroughManifest const& manifest) {
  Json json;
  json["format"] = kFormat;
  json["unit"] = to_string(manifest.unit);
  json["walking_radius"] = manifest.walking_radius;
  json["focal_length"] = manifest.focal_length;
  json["up"] = vector_to_json(manifest.up);
  if (manifest.walk)
    json["walk"] = {{"low", vector_to_json(manifest.walk->min())}, {"high", vector_to_json(manifest.walk->max())}};
  json["nodes"] = Json::array();
  for (WalkthroughManifest::Node const& node : manifest.nodes)
    json["nodes"].push_back({{"name", node.name},
                             {"position", vector_to_json(node.position)},
                             {"triangles", node.triangles},
                             {"parallax_px", node.parallax_px},
                             {"levels", node.levels}});
  write_json(folder / kFile, json);
}

}  // namespace scanview
