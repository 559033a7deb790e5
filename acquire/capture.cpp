#include "acquire/capture.h"

#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <set>

#include "acquire/rgbd_manifest.h"
#include "base/error.h"
#include "base/json_fields.h"

namespace scanview {
namespace {

namespace fs = std::filesystem;
constexpr int kMostFrames = 100'000;
constexpr int kMostBits = 16;  // a code is kept in 16 bits

[[noreturn]] void fail(fs::path const& path, std::string const& message) {
  throw Error(ErrorCode::bad_input, path, message);
}

std::optional<std::string> optional_text(Json const& json, char const* key, fs::path const& path) {
  auto const found = json.find(key);
  if (found == json.end() || found->is_null()) return {};
  return json_text(*found, key, path);
}

std::optional<int> optional_integer(Json const& json, char const* key, int low, int high, fs::path const& path) {
  auto const found = json.find(key);
  if (found == json.end() || found->is_null()) return {};
  return json_integer(*found, key, low, high, path);
}

std::vector<std::string> view_folders(Json const& json, fs::path const& path) {
  if (!json.is_array() || json.empty()) fail(path, "'views' is no list of folders");
  std::vector<std::string> views;
  bool const is_range = json.size() == 3 && json[0].is_string() && json[1].is_number() && json[2].is_number();
  if (is_range) {
    int const first = json_integer(json[1], "views", 0, kMostFrames, path);
    int const last = json_integer(json[2], "views", first, kMostFrames, path);
    for (int i = first; i <= last; ++i) views.push_back(format_index(json_text(json[0], "views", path), i, path));
  } else {
    for (auto const& view : json) views.push_back(json_text(view, "views", path));
  }
  if (std::set<std::string>(views.begin(), views.end()).size() != views.size()) fail(path, "'views' names one twice");
  return views;
}

/// "{side}/white.png", or [left, right].
std::optional<std::array<std::string, 2>> per_side(Json const& json, char const* key, fs::path const& path) {
  auto const found = json.find(key);
  if (found == json.end() || found->is_null()) return {};
  if (found->is_array()) {
    if (found->size() != 2) fail(path, fmt::format("'{}' is not [left, right]", key));
    return std::array{json_text((*found)[0], key, path), json_text((*found)[1], key, path)};
  }
  std::string const pattern = json_text(*found, key, path);
  auto const at = pattern.find("{side}");
  if (at == std::string::npos) fail(path, fmt::format("'{}' has no {{side}} and is not [left, right]", key));
  std::array<std::string, 2> files = {pattern, pattern};
  for (Side const side : kSides) files[static_cast<std::size_t>(side)].replace(at, 6, to_string(side));
  return files;
}

/// OpenCV's GrayCodePattern: columns, most significant bit first, each as (pattern, inverse).
void append_bits(std::vector<GrayFrame>& frames, int bits, bool is_row, bool with_inverse) {
  for (int bit = bits - 1; bit >= 0; --bit) {
    frames.push_back({GrayFrame::Kind::bit, bit, is_row, false});
    if (with_inverse) frames.push_back({GrayFrame::Kind::bit, bit, is_row, true});
  }
}

/// "c10", "c10i", "r3", "white", "black", "skip".
GrayFrame parse_frame(std::string const& name, fs::path const& path) {
  if (name == "white") return {GrayFrame::Kind::white};
  if (name == "black") return {GrayFrame::Kind::black};
  if (name == "skip") return {};
  GrayFrame frame{GrayFrame::Kind::bit, -1, name.starts_with('r'), name.ends_with('i')};
  char const* const end = name.data() + name.size() - (frame.inverse ? 1 : 0);
  bool good = name.size() >= 2 && (name[0] == 'c' || name[0] == 'r');
  if (good) {
    auto const [stop, error] = std::from_chars(name.data() + 1, end, frame.bit);
    good = error == std::errc() && stop == end && frame.bit >= 0 && frame.bit < kMostBits;
  }
  if (!good)
    fail(path,
         fmt::format("'order': '{}' is none of white, black, skip, c<bit>, r<bit>, with i for the inverse", name));
  return frame;
}

void read_gray(Capture& capture, Json const& json) {
  fs::path const& path = capture.file;
  bool const with_inverse = !json.contains("inverse") || json_boolean(json["inverse"], "inverse", path);
  Json const order = json.contains("order") ? json["order"] : Json("opencv");
  int const count = capture.last - capture.first + 1;
  auto const rows_first = optional_integer(json, "rows_first", 0, kMostFrames, path);
  if (order.is_array()) {
    capture.in_opencv_order = false;
    for (auto const& entry : order) capture.gray.push_back(parse_frame(json_text(entry, "order", path), path));
    if (static_cast<int>(capture.gray.size()) != count)
      fail(path, fmt::format("'order' names {} pictures, 'first' to 'last' are {}", capture.gray.size(), count));
    if (rows_first) fail(path, "'rows_first' belongs to OpenCV's order: name the rows in 'order' instead");
  } else {
    if (json_text(order, "order", path) != "opencv") fail(path, "'order' is neither \"opencv\" nor a list");
    capture.bits = json_integer(json_member(json, "bits", path), "bits", 1, kMostBits, path);
    int const expected = capture.bits * (with_inverse ? 2 : 1);
    if (count != expected)
      fail(path, fmt::format("'first' to 'last' are {} pictures, but {} bits {} make {}", count, capture.bits,
                             with_inverse ? "with inverses" : "without inverses", expected));
    append_bits(capture.gray, capture.bits, false, with_inverse);
    if (rows_first) {
      if (*rows_first != capture.last + 1) fail(path, "'rows_first' is not the picture after 'last'");
      int const row_bits = optional_integer(json, "row_bits", 1, kMostBits, path).value_or(capture.bits);
      append_bits(capture.gray, row_bits, true, with_inverse);
    }
  }
  capture.bits = capture.row_bits = 0;
  std::set<std::tuple<bool, int, bool>> seen;
  for (auto const& frame : capture.gray) {
    if (frame.kind != GrayFrame::Kind::bit) continue;
    int& bits = frame.is_row ? capture.row_bits : capture.bits;
    bits = std::max(bits, frame.bit + 1);
    if (!seen.emplace(frame.is_row, frame.bit, frame.inverse).second)
      fail(path, fmt::format("'order' has {} bit {} twice", frame.is_row ? "row" : "column", frame.bit));
  }
  bool const has_levels = (capture.white && capture.black) ||
                          (std::any_of(capture.gray.begin(), capture.gray.end(),
                                       [](auto const& f) { return f.kind == GrayFrame::Kind::white; }) &&
                           std::any_of(capture.gray.begin(), capture.gray.end(),
                                       [](auto const& f) { return f.kind == GrayFrame::Kind::black; }));
  for (bool const is_row : {false, true})
    for (int bit = 0; bit < (is_row ? capture.row_bits : capture.bits); ++bit) {
      if (!seen.contains({is_row, bit, false}))
        fail(path, fmt::format("{} bit {} has no picture", is_row ? "row" : "column", bit));
      if (!seen.contains({is_row, bit, true}) && !has_levels)
        fail(path, fmt::format("{} bit {} has no inverse, and there are no white and black pictures to compare with",
                               is_row ? "row" : "column", bit));
    }
  if (capture.bits == 0) fail(path, "there are no column bits");
  capture.projector_columns = optional_integer(json, "projector_columns", 1, 1 << kMostBits, path);
  capture.projector_rows = optional_integer(json, "projector_rows", 1, 1 << kMostBits, path);
}

/// Keys that say nothing where they stand, or something else than another one says.
void refuse_contradictions(Capture const& capture, Json const& json) {
  fs::path const& path = capture.file;
  auto const has = [&](char const* key) { return json.contains(key) && !json[key].is_null(); };
  if (capture.pattern == Capture::Pattern::sweep) {
    for (char const* key :
         {"bits", "row_bits", "rows_first", "inverse", "order", "projector_columns", "projector_rows"})
      if (has(key)) fail(path, fmt::format("'{}' belongs to pattern \"gray\"", key));
    return;
  }
  if (has("row_bits") && capture.in_opencv_order && !has("rows_first"))
    fail(path, "'row_bits' without 'rows_first': which picture is the first of rows?");
  for (auto const& [key, bits] : {std::pair{"bits", capture.bits}, {"row_bits", capture.row_bits}})
    if (auto const stated = optional_integer(json, key, 1, kMostBits, path); stated && *stated != bits)
      fail(path, fmt::format("'{}' is {}, but 'order' has {}", key, *stated, bits));
}

Eigen::Vector3d read_backdrop(Json const& json, fs::path const& path) {
  std::string const text = json_text(json, "backdrop", path);
  unsigned value = 0;
  auto const [stop, error] =
      std::from_chars(text.data() + std::min<std::size_t>(1, text.size()), text.data() + text.size(), value, 16);
  if (text.size() != 7 || text[0] != '#' || error != std::errc() || stop != text.data() + 7)
    fail(path, "'backdrop' is no colour like \"#3050a0\"");
  return {static_cast<double>(value >> 16), static_cast<double>(value >> 8 & 255), static_cast<double>(value & 255)};
}

}  // namespace

char const* to_string(Side side) { return side == Side::left ? "left" : "right"; }

bool Capture::has_inverses() const {
  return std::any_of(gray.begin(), gray.end(), [](GrayFrame const& frame) { return frame.inverse; });
}

fs::path Capture::path_of(std::string const& view, std::string const& name) const { return folder / view / name; }

fs::path Capture::frame_path(std::string const& view, Side side, int k) const {
  return path_of(view, format_index(frames[static_cast<std::size_t>(side)], first + k, file));
}

std::vector<std::string> Capture::view_names() const {
  std::vector<std::string> names;
  for (std::size_t i = 0; i < views.size(); ++i) {
    std::string const base = fs::path(views[i]).filename().string();
    std::size_t digits = base.size();
    while (digits > 0 && std::isdigit(static_cast<unsigned char>(base[digits - 1]))) --digits;
    names.push_back(digits < base.size() ? base.substr(digits) : fmt::format("{:03d}", i));
  }
  if (std::set<std::string>(names.begin(), names.end()).size() != names.size())
    for (std::size_t i = 0; i < names.size(); ++i) names[i] = fmt::format("{:03d}", i);
  return names;
}

Capture read_capture(fs::path const& file, fs::path const& folder) {
  Json const json = read_json(file);
  refuse_unknown_keys(json,
                      {"pattern",
                       "views",
                       "left",
                       "right",
                       "first",
                       "last",
                       "white",
                       "black",
                       "color",
                       "bits",
                       "row_bits",
                       "rows_first",
                       "inverse",
                       "order",
                       "rig",
                       "intrinsics",
                       "empty",
                       "backdrop",
                       "projector_columns",
                       "projector_rows"},
                      "", file);
  Capture capture;
  capture.file = file;
  capture.folder = folder;
  std::string const pattern = json_text(json_member(json, "pattern", file), "pattern", file);
  if (pattern != "sweep" && pattern != "gray") fail(file, "'pattern' is neither \"sweep\" nor \"gray\"");
  capture.pattern = pattern == "sweep" ? Capture::Pattern::sweep : Capture::Pattern::gray;
  capture.views = view_folders(json_member(json, "views", file), file);
  for (Side const side : kSides) {
    std::string& frames = capture.frames[static_cast<std::size_t>(side)];
    frames = json_text(json_member(json, to_string(side), file), to_string(side), file);
    format_index(frames, 0, file);
  }
  capture.first = json_integer(json_member(json, "first", file), "first", 0, kMostFrames, file);
  capture.last = json_integer(json_member(json, "last", file), "last", 0, kMostFrames, file);
  if (capture.last < capture.first)
    fail(file, fmt::format("'last' ({}) is less than 'first' ({})", capture.last, capture.first));
  capture.white = per_side(json, "white", file);
  capture.black = per_side(json, "black", file);
  capture.color = optional_text(json, "color", file);
  capture.rig = optional_text(json, "rig", file);
  capture.empty = optional_text(json, "empty", file);
  if (json.contains("backdrop") && !json["backdrop"].is_null())
    capture.backdrop = read_backdrop(json["backdrop"], file);
  if (json.contains("intrinsics") && !json["intrinsics"].is_null()) {
    Json const& k = json["intrinsics"];
    if (k.contains("left") || k.contains("right")) {
      refuse_unknown_keys(k, {"left", "right"}, "intrinsics", file);
      capture.intrinsics = {lens_camera_from_json(json_member(k, "left", file), "intrinsics.left", file),
                            lens_camera_from_json(json_member(k, "right", file), "intrinsics.right", file)};
    } else {
      LensCamera const one = lens_camera_from_json(k, "intrinsics", file);
      capture.intrinsics = {one, one};
    }
  }
  if (capture.pattern == Capture::Pattern::gray) read_gray(capture, json);
  refuse_contradictions(capture, json);
  if (capture.pattern == Capture::Pattern::sweep && capture.frame_count() < 4)
    fail(file, fmt::format("a sweep of {} light positions has no peaks to find: at least 4", capture.frame_count()));
  return capture;
}

bool is_capture(fs::path const& folder) {
  std::error_code error;
  return fs::is_regular_file(folder / "capture.json", error);
}

}  // namespace scanview
