#include "viewer/visibility/visibility_file.h"

#include <fmt/format.h>

#include <cmath>
#include <limits>

#include "base/error.h"
#include "base/files.h"
#include "viewer/visibility/bit_coding.h"
#include "viewer/visibility/sampled_rows.h"

namespace scanview {
namespace fs = std::filesystem;
namespace {

constexpr std::string_view kMagic = "scanview visibility 1\n";
constexpr std::size_t kHashLength = 32;

Json to_json(Eigen::Vector3d const& v) { return Json::array({v.x(), v.y(), v.z()}); }

/// JSON knows no infinity: an orthographic shell is null.
Json shells_to_json(std::vector<double> const& shells) {
  Json json = Json::array();
  for (double const shell : shells) json.push_back(json_number(shell));
  return json;
}

Json lookup_to_json(VisibilityField const& field) {
  if (auto const* sphere = std::get_if<SphereLookup>(&field.lookup)) {
    Json json{{"kind", "sphere"},
              {"shells", shells_to_json(sphere->shells)},
              {"opposite", sphere->opposite},
              {"rows_are_cells", sphere->rows_are_cells}};
    if (sphere->sphere.is_octahedron()) {
      json["octahedron"] = sphere->sphere.directions().size();
    } else {
      for (auto const& direction : sphere->sphere.directions()) json["directions"].push_back(to_json(direction));
    }
    return json;
  }
  if (auto const* path = std::get_if<PathLookup>(&field.lookup)) {
    Json json{{"kind", "path"}, {"stretch", path->stretch}, {"eyes", Json::array()}};
    for (auto const& eye : path->eyes) json["eyes"].push_back(to_json(eye));
    return json;
  }
  auto const& grid = std::get<GridLookup>(field.lookup);
  return {{"kind", "grid"},
          {"low", to_json(grid.box.min())},
          {"high", to_json(grid.box.max())},
          {"cells", Json::array({grid.cells.x(), grid.cells.y(), grid.cells.z()})}};
}

/// Reads what to_json wrote; throws nlohmann's exceptions and std::runtime_error.
Eigen::Vector3d vector_of(Json const& json) {
  if (!json.is_array() || json.size() != 3) throw std::runtime_error("a vector has three numbers");
  Eigen::Vector3d const v(json[0].get<double>(), json[1].get<double>(), json[2].get<double>());
  if (!v.allFinite()) throw std::runtime_error("a vector is not finite");
  return v;
}

/// Its rows.
std::size_t lookup_from_json(Json const& json, VisibilityField& field) {
  std::string const kind = json.at("kind").get<std::string>();
  if (kind == "sphere") {
    SphereLookup lookup;
    for (Json const& shell : json.at("shells"))
      lookup.shells.push_back(shell.is_null() ? std::numeric_limits<double>::infinity() : shell.get<double>());
    for (std::size_t i = 0; i < lookup.shells.size(); ++i) {
      if (!(lookup.shells[i] > (i > 0 ? lookup.shells[i - 1] : 0)))
        throw std::runtime_error("distances of samples do not ascend");
    }
    if (lookup.shells.empty()) throw std::runtime_error("no distances of samples");
    lookup.opposite = json.at("opposite").get<bool>();
    lookup.rows_are_cells = json.at("rows_are_cells").get<bool>();
    if (json.contains("octahedron")) {
      lookup.sphere = SampleSphere::octahedron(SampleSphere::octahedron_level(json["octahedron"].get<std::size_t>()));
    } else {
      std::vector<Eigen::Vector3d> directions;
      for (Json const& direction : json.at("directions")) directions.push_back(vector_of(direction));
      lookup.sphere = SampleSphere::hull(directions);
      if (lookup.sphere.directions().size() != directions.size()) throw std::runtime_error("directions coincide");
    }
    std::size_t const rows = lookup.shells.size() *
                             (lookup.rows_are_cells ? lookup.sphere.faces().size() : lookup.sphere.directions().size());
    field.lookup = std::move(lookup);
    return rows;
  }
  if (kind == "path") {
    PathLookup lookup;
    lookup.stretch = json.at("stretch").get<std::size_t>();
    if (lookup.stretch == 0) throw std::runtime_error("stretches of no frames");
    for (Json const& eye : json.at("eyes")) lookup.eyes.push_back(vector_of(eye));
    std::size_t const rows = (lookup.eyes.size() + lookup.stretch - 1) / lookup.stretch;
    field.lookup = std::move(lookup);
    return rows;
  }
  if (kind != "grid") throw std::runtime_error("an unknown kind of lookup");
  GridLookup lookup;
  lookup.box = Eigen::AlignedBox3d(vector_of(json.at("low")), vector_of(json.at("high")));
  if (lookup.box.isEmpty()) throw std::runtime_error("an empty grid");
  std::size_t rows = 1;
  for (int k = 0; k < 3; ++k) {
    lookup.cells[k] = json.at("cells").at(static_cast<std::size_t>(k)).get<int>();
    if (lookup.cells[k] < 1 || lookup.cells[k] > 1024) throw std::runtime_error("a grid of 1 to 1024 cells a side");
    rows *= static_cast<std::size_t>(lookup.cells[k]);
  }
  field.lookup = lookup;
  return rows;
}

std::vector<RowPlace> row_places(VisibilityField const& field, std::size_t rows) {
  std::vector<RowPlace> places(rows);
  auto const index = [](std::size_t i) { return static_cast<std::int32_t>(i); };
  if (auto const* lookup = std::get_if<SphereLookup>(&field.lookup)) {
    SampleSphere const& sphere = lookup->sphere;
    bool const cells = lookup->rows_are_cells;
    std::size_t const a_shell = cells ? sphere.faces().size() : sphere.directions().size();
    for (std::size_t row = 0; row < rows; ++row) {
      std::size_t const at = row % a_shell, first = row - at;
      if (row >= a_shell) places[row].twin = index(row - a_shell);
      Eigen::Vector3d direction = Eigen::Vector3d::Zero();
      for (std::size_t k = 0; k < 4; ++k) {
        // Faces follow each other as they were cut: the last few lie beside it.
        std::int64_t const other = cells ? static_cast<std::int64_t>(at) - static_cast<std::int64_t>(k) - 1
                                         : std::int64_t{sphere.between()[at][k]};
        if (other >= 0) places[row].beside[k] = index(first + static_cast<std::size_t>(other));
      }
      if (cells) {
        for (int k = 0; k < 3; ++k) direction += sphere.directions()[static_cast<std::size_t>(sphere.faces()[at][k])];
        direction.normalize();
      } else {
        direction = sphere.directions()[at];
      }
      double const distance = lookup->shells[row / a_shell];
      places[row].eye << (std::isfinite(distance) ? distance : 1) * direction, std::isfinite(distance) ? 1 : 0;
    }
  } else if (auto const* path = std::get_if<PathLookup>(&field.lookup)) {
    for (std::size_t row = 0; row < rows; ++row) {
      if (row > 0) places[row].beside[0] = index(row - 1);
      places[row].eye << (path->eyes[row * path->stretch] - field.center) / field.radius, 1;
    }
  } else {
    Eigen::Vector3i const cells = std::get<GridLookup>(field.lookup).cells;
    auto const across = static_cast<std::size_t>(cells.x()), layer = across * static_cast<std::size_t>(cells.y());
    for (std::size_t row = 0; row < rows; ++row) {
      if (row % across > 0) places[row].beside[0] = index(row - 1);
      if (row % layer >= across) places[row].beside[2] = index(row - across);
      if (row >= layer) places[row].twin = index(row - layer);
    }
  }
  return places;
}

std::string hash_bits(BitRows const& rows) {
  std::string hash;
  for (std::size_t row = 0; row < rows.rows(); ++row) {
    auto const words = rows.row(row);
    hash = hash_bytes(hash + std::string(reinterpret_cast<char const*>(words.data()), words.size_bytes()));
  }
  return hash;
}

std::vector<PatchPlace> patch_places(VisibilityField const& field, TriangleMesh const& mesh) {
  std::vector<PatchPlace> places(field.patches.count());
  for (std::size_t p = 0; p < places.size(); ++p) {
    double corners = 0;
    for (std::size_t i = field.patches.begins[p]; i < field.patches.begins[p + 1]; ++i) {
      Eigen::Vector3i const& triangle = mesh.triangles[field.patches.triangles[i]];
      auto const corner = [&](int k) -> Eigen::Vector3d {
        auto const v = mesh.vertices[static_cast<std::size_t>(triangle[k])].cast<double>();
        return (v - field.center) / field.radius;
      };
      places[p].normal += (corner(1) - corner(0)).cross(corner(2) - corner(0));
      for (int k = 0; k < 3; ++k) places[p].center += corner(k);
      corners += 3;
    }
    places[p].center /= std::max(corners, 1.0);
    double const length = places[p].normal.norm();
    if (length > 0) places[p].normal /= length;
  }
  return places;
}

}  // namespace

std::string format_visibility(VisibilityField const& field, TriangleMesh const& mesh) {
  Json header{{"method", field.method == VisibilityMethod::id ? "id" : "patch"},
              {"fine_patches_asked", field.fine_patches_asked},
              {"fine_patches", field.fine_begins.back()},
              {"patches", field.patches.count()},
              {"model", field.model_hash},
              {"center", to_json(field.center)},
              {"radius", field.radius},
              {"bits", hash_bits(field.rows)},
              {"lookup", lookup_to_json(field)}};
  std::string bytes(kMagic);
  std::vector<bool> begins(field.fine_begins.back());
  for (std::size_t k = 0; k + 1 < field.fine_begins.size(); ++k) begins[field.fine_begins[k]] = true;
  std::string const flags = encode_flags(begins);
  header["patch_bytes"] = flags.size();
  bytes += header.dump() + '\n' + flags;
  bytes += encode_bits(field.rows, row_places(field, field.rows.rows()), patch_places(field, mesh));
  return bytes + hash_bytes(bytes);
}

void write_visibility(fs::path const& path, VisibilityField const& field, TriangleMesh const& mesh) {
  write_file(path, format_visibility(field, mesh));
}

VisibilityField read_visibility(fs::path const& path, PolygonModel const& model) {
  return parse_visibility(read_file(path), model, path);
}

VisibilityField parse_visibility(std::string_view bytes, PolygonModel const& model, fs::path const& path) {
  auto const fail = [&](std::string const& text) { throw Error(ErrorCode::bad_input, path, text); };
  if (!bytes.starts_with(kMagic)) fail("not a visibility file of this version");
  if (bytes.size() < kMagic.size() + kHashLength ||
      hash_bytes(bytes.substr(0, bytes.size() - kHashLength)) != bytes.substr(bytes.size() - kHashLength))
    fail("damaged or cut off");
  std::string_view const rest = bytes.substr(kMagic.size(), bytes.size() - kMagic.size() - kHashLength);
  std::size_t const line = rest.find('\n');
  if (line == std::string_view::npos) fail("has no header");
  VisibilityField field;
  std::size_t rows = 0, patches = 0, fine_patches = 0, patch_bytes = 0;
  std::string bits_hash;
  try {
    Json const header = Json::parse(rest.substr(0, line));
    field.model_hash = header.at("model").get<std::string>();
    field.method = header.at("method").get<std::string>() == "id" ? VisibilityMethod::id : VisibilityMethod::patch;
    field.fine_patches_asked = header.at("fine_patches_asked").get<std::size_t>();
    fine_patches = header.at("fine_patches").get<std::size_t>();
    patch_bytes = header.at("patch_bytes").get<std::size_t>();
    patches = header.at("patches").get<std::size_t>();
    bits_hash = header.at("bits").get<std::string>();
    field.center = vector_of(header.at("center"));
    field.radius = header.at("radius").get<double>();
    if (!(field.radius > 0)) throw std::runtime_error("a radius above 0");
    rows = lookup_from_json(header.at("lookup"), field);
  } catch (std::exception const& error) {
    fail(fmt::format("its header is wrong: {}", error.what()));
  }
  if (field.model_hash != model_hash(model.mesh)) fail("was made for another model");
  Patches fine = model_patches(model, field.method, field.fine_patches_asked).fine;
  std::string_view const coded = rest.substr(line + 1);
  if (fine.count() != fine_patches || patch_bytes > coded.size())
    fail("was made with other patches of this model: build it again");
  std::vector<bool> const begins = decode_flags(coded.substr(0, patch_bytes), fine_patches, path);
  for (std::uint32_t p = 0; p < begins.size(); ++p) {
    if (begins[p]) field.fine_begins.push_back(p);
  }
  field.fine_begins.push_back(static_cast<std::uint32_t>(fine_patches));
  if (field.fine_begins.size() != patches + 1 || field.fine_begins.front() != 0) fail("its patches do not add up");
  field.patches = coarser_patches(std::move(fine), field.fine_begins);
  field.rows = decode_bits(coded.substr(patch_bytes), row_places(field, rows), patch_places(field, model.mesh), path);
  if (hash_bits(field.rows) != bits_hash) fail("its bits were coded by a version that computes differently");
  return field;
}

}  // namespace scanview
