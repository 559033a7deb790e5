#include "viewer/layered/ldi_file.h"

#define XXH_INLINE_ALL
#include <fmt/format.h>
#include <xxhash.h>

#include <algorithm>
#include <bit>
#include <cstddef>
#include <cstring>
#include <fstream>
#include <limits>

#include "acquire/json_vector.h"
#include "base/error.h"
#include "base/files.h"
#include "base/json_fields.h"
#include "base/mapped_file.h"
#include "viewer/layered/ldi_content.h"
#include "viewer/layered/ldi_key_order.h"
#include "viewer/layered/ldi_sums_coding.h"

// The file: a Prologue; a line of JSON (what the tree was made with and of); a CellRecord for each cell; zeros up to a
// multiple of 64; the cells' content as it is in memory; kLdiPadding zeros; the sums (ldi_sums_coding.h), or nothing.
// Numbers have their lowest byte first.

namespace scanview {
namespace {

namespace fs = std::filesystem;
static_assert(std::endian::native == std::endian::little);

constexpr std::string_view kMagic = "scanview ldi 1\n\n";
constexpr std::size_t kMagicName = 13;  // of it, what all versions have
constexpr std::size_t kAlignment = 64;

struct Prologue {
  char magic[16] = {};
  std::uint64_t hash = 0;  // of all that follows it, up to the content
  std::uint64_t text_bytes = 0, cells = 0, content_bytes = 0, sums_bytes = 0;
  std::uint64_t sums_hash = 0;

  std::uint64_t table() const { return sizeof(Prologue) + text_bytes; }
  std::uint64_t content() const;
  std::uint64_t sums() const { return content() + content_bytes + kLdiPadding; }
  std::uint64_t end() const { return sums() + sums_bytes; }
};
static_assert(sizeof(Prologue) == 64 && kMagic.size() == sizeof(Prologue::magic));
constexpr std::size_t kHashedFrom = offsetof(Prologue, text_bytes);

struct CellRecord {
  std::int32_t level = 0;
  std::uint32_t pixels = 0, blocks_of_kind[kLdiKinds] = {}, unused = 0;
  std::int64_t index[3] = {};
  std::uint64_t hash = 0;
};
static_assert(sizeof(CellRecord) == 56);

std::uint64_t Prologue::content() const {
  return (table() + cells * sizeof(CellRecord) + kAlignment - 1) / kAlignment * kAlignment;
}

[[noreturn]] void refuse(fs::path const& path, std::string const& what) {
  throw Error(ErrorCode::bad_input, path, what);
}

template <typename Record>
std::string_view bytes_of(Record const& record) {
  return {reinterpret_cast<char const*>(&record), sizeof record};
}

Json text_of(LdiTree const& tree) {
  LdiOptions const& o = tree.options;
  Json json{{"unit", to_string(tree.unit)},
            {"options",
             {{"resolution", o.resolution},
              {"coarseness", o.coarseness},
              {"smallest_feature", o.smallest_feature},
              {"merge_steps", o.merge_steps},
              {"depth_error", o.depth_error},
              {"covered", o.covered},
              {"normals", o.normals == LdiOptions::Normals::measured ? "measured" : "facing"}}},
            {"center", vector_to_json(tree.center)},
            {"radius", tree.radius},
            {"input_pixels", tree.input_pixels},
            {"input_bytes", tree.input_bytes},
            {"views", Json::array()}};
  for (View const& view : tree.views)
    json["views"].push_back({{"name", view.name},
                             {"camera", view.image.camera.to_json()},
                             {"object_from_camera", pose_to_json(*view.object_from_camera)},
                             {"gain", vector_to_json(view.gain)}});
  return json;
}

LdiOptions options_from(Json const& json, fs::path const& path) {
  refuse_unknown_keys(
      json, {"resolution", "coarseness", "smallest_feature", "merge_steps", "depth_error", "covered", "normals"},
      "options", path);
  auto const number = [&](char const* key) { return json_finite(json_member(json, key, path), key, path); };
  LdiOptions options;
  options.resolution = json_integer(json_member(json, "resolution", path), "resolution", kLdiLeastResolution,
                                    kLdiGreatestResolution, path);
  options.coarseness = number("coarseness");
  options.smallest_feature = number("smallest_feature");
  options.merge_steps = number("merge_steps");
  options.depth_error = number("depth_error");
  options.covered = number("covered");
  std::string const normals = json_text(json_member(json, "normals", path), "normals", path);
  if (normals != "measured" && normals != "facing") refuse(path, "'normals' is neither measured nor facing");
  options.normals = normals == "measured" ? LdiOptions::Normals::measured : LdiOptions::Normals::facing;
  try {
    options.validate();
  } catch (Error const& error) {
    refuse(path, error.message());
  }
  return options;
}

void read_text(Json const& json, LdiTree& tree, fs::path const& path) {
  refuse_unknown_keys(json, {"unit", "options", "center", "radius", "input_pixels", "input_bytes", "views"}, "", path);
  tree.unit = unit_from_string(json_text(json_member(json, "unit", path), "unit", path), path);
  tree.options = options_from(json_member(json, "options", path), path);
  tree.center = vector_from_json(json_member(json, "center", path), "center", path);
  tree.radius = json_finite(json_member(json, "radius", path), "radius", path);
  if (!(tree.radius > 0)) refuse(path, "'radius' is not above 0");
  auto const count = [&](char const* key) {
    Json const& value = json_member(json, key, path);
    if (!value.is_number_unsigned()) refuse(path, fmt::format("'{}' is no count", key));
    return value.get<std::uint64_t>();
  };
  tree.input_pixels = count("input_pixels");
  tree.input_bytes = count("input_bytes");
  Json const& views = json_member(json, "views", path);
  if (!views.is_array()) refuse(path, "'views' is no list");
  for (Json const& one : views) {
    refuse_unknown_keys(one, {"name", "camera", "object_from_camera", "gain"}, "views", path);
    View view;
    view.name = json_text(json_member(one, "name", path), "name", path);
    view.image.camera = Camera::from_json(json_member(one, "camera", path), path);
    view.object_from_camera = pose_from_json(json_member(one, "object_from_camera", path), path, "pose");
    view.gain = vector_from_json(json_member(one, "gain", path), "gain", path);
    if (!(view.gain.minCoeff() > 0)) refuse(path, fmt::format("gain of view {} is not positive", view.name));
    tree.views.push_back(std::move(view));
  }
}

void read_cells(std::span<std::byte const> table, std::uint64_t content_bytes, LdiTree& tree, fs::path const& path) {
  std::uint64_t offset = 0;
  tree.cells.resize(table.size() / sizeof(CellRecord));
  for (std::size_t i = 0; i < tree.cells.size(); ++i) {
    CellRecord record;
    std::memcpy(&record, table.data() + i * sizeof record, sizeof record);
    LdiCell& cell = tree.cells[i];
    cell.key = {record.level, {record.index[0], record.index[1], record.index[2]}};
    cell.pixels = record.pixels;
    std::copy_n(record.blocks_of_kind, kLdiKinds, cell.blocks_of_kind.begin());
    cell.hash = record.hash;
    cell.offset = offset;
    if (!is_ldi_key(cell.key) || record.unused != 0 || (cell.blocks() == 0) != (cell.pixels == 0) ||
        cell.blocks() > cell.pixels || LdiTree::content_bytes(cell) > content_bytes - offset)
      refuse(path, fmt::format("is damaged: cell {} cannot be", i));
    offset += LdiTree::content_bytes(cell);
  }
  if (offset != content_bytes) refuse(path, "is damaged: its cells do not add up to its content");
  if (!link_cells(tree.cells, tree.roots)) refuse(path, "is damaged: its cells are no tree");
}

/// Checks what describes the tree before anything is allocated. The tree's content is in the mapping.
Prologue open_ldi(std::span<std::byte const> bytes, LdiTree& tree, fs::path const& path) {
  Prologue prologue;
  if (bytes.size() < kMagic.size() || std::memcmp(bytes.data(), kMagic.data(), kMagic.size()) != 0)
    refuse(path, "not an LDI tree of this version");
  std::uint64_t const size = bytes.size();
  if (size < sizeof prologue) refuse(path, "is cut off");
  std::memcpy(&prologue, bytes.data(), sizeof prologue);
  if (prologue.text_bytes > size || prologue.cells > size / sizeof(CellRecord) || prologue.content_bytes > size ||
      prologue.sums_bytes > size || prologue.end() != size)
    refuse(path, "is cut off, or damaged in what describes it");
  if (XXH3_64bits(bytes.data() + kHashedFrom, prologue.content() - kHashedFrom) != prologue.hash)
    refuse(path, "is damaged in what describes it");
  if (prologue.cells == 0 || prologue.cells > std::uint64_t{std::numeric_limits<std::int32_t>::max()})
    refuse(path, "has no cells, or too many");
  char const* const text = reinterpret_cast<char const*>(bytes.data()) + sizeof prologue;
  try {
    read_text(Json::parse(text, text + prologue.text_bytes), tree, path);
  } catch (Json::exception const& error) {
    refuse(path, fmt::format("its header is wrong: {}", error.what()));
  }
  read_cells(bytes.subspan(prologue.table(), prologue.cells * sizeof(CellRecord)), prologue.content_bytes, tree, path);
  return prologue;
}

}  // namespace

void write_ldi(fs::path const& path, LdiTree const& tree, LdiBuilder const& builder, LdiKeep keep) {
  std::string const text = text_of(tree).dump() + '\n';
  std::string const sums = keep == LdiKeep::sums ? encode_sums(builder.sums()) : std::string();
  Prologue prologue;
  kMagic.copy(prologue.magic, kMagic.size());
  prologue.text_bytes = text.size();
  prologue.cells = tree.cells.size();
  prologue.content_bytes = tree.content.size();
  prologue.sums_bytes = sums.size();
  prologue.sums_hash = XXH3_64bits(sums.data(), sums.size());
  std::string bytes;
  bytes.reserve(prologue.end());
  bytes.append(bytes_of(prologue)).append(text);
  for (LdiCell const& cell : tree.cells) {
    CellRecord record;
    record.level = cell.key.level;
    record.pixels = cell.pixels;
    record.hash = cell.hash;
    std::copy(cell.blocks_of_kind.begin(), cell.blocks_of_kind.end(), record.blocks_of_kind);
    std::copy(cell.key.index.begin(), cell.key.index.end(), record.index);
    bytes.append(bytes_of(record));
  }
  bytes.resize(prologue.content());
  prologue.hash = XXH3_64bits(bytes.data() + kHashedFrom, bytes.size() - kHashedFrom);
  bytes.replace(0, sizeof prologue, bytes_of(prologue));
  bytes.append(reinterpret_cast<char const*>(tree.content.data()), tree.content.size());
  bytes.append(kLdiPadding, '\0').append(sums);
  write_file(path, bytes);
}

LdiTree read_ldi(fs::path const& path) {
  auto const file = std::make_shared<MappedFile>(path);
  LdiTree tree;
  tree.path = path;
  Prologue const prologue = open_ldi(file->bytes(), tree, path);
  tree.content = file->bytes().subspan(prologue.content(), prologue.content_bytes);
  tree.owner = file;
  tree.checked = std::make_shared<std::vector<std::uint8_t>>(tree.cells.size());
  return tree;
}

LdiBuilder read_ldi_builder(fs::path const& path) {
  MappedFile const file(path);
  LdiTree tree;
  Prologue const prologue = open_ldi(file.bytes(), tree, path);
  if (prologue.sums_bytes == 0) refuse(path, "was written without its sums: no image can be added to it");
  auto const* const sums = reinterpret_cast<char const*>(file.bytes().data()) + prologue.sums();
  if (XXH3_64bits(sums, prologue.sums_bytes) != prologue.sums_hash)
    refuse(path, "is damaged: its sums are not those that were written");
  LdiBuilder builder(tree.options);
  builder.resume(tree, decode_sums({sums, prologue.sums_bytes}, tree.options, path));
  return builder;
}

bool is_ldi(fs::path const& path) {
  char start[kMagicName] = {};
  std::ifstream file(path, std::ios::binary);
  return file.read(start, kMagicName) && kMagic.starts_with(std::string_view(start, kMagicName));
}

}  // namespace scanview
