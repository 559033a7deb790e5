#pragma once
#include <array>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "calib/stereo_rig.h"

namespace scanview {

enum class Side { left = 0, right = 1 };
inline constexpr std::array kSides = {Side::left, Side::right};
char const* to_string(Side side);  ///< "left", "right"

/// What one picture of a Gray-code sequence shows.
struct GrayFrame {
  enum class Kind { bit, white, black, skip } kind = Kind::skip;
  int bit = 0;           ///< 0 is the finest
  bool is_row = false;   ///< of the projector's row, not its column
  bool inverse = false;  ///< dark and bright exchanged
};

/// capture.json (DESIGN, "On disk"): which picture is what. Paths are relative to the folder of the file.
struct Capture {
  enum class Pattern { sweep, gray };
  Pattern pattern = Pattern::sweep;
  std::filesystem::path folder;
  std::filesystem::path file;  ///< capture.json itself, for messages
  std::vector<std::string> views;
  std::array<std::string, 2> frames;  ///< of left and right: "left/{:04d}.png"
  int first = 0, last = 0;
  std::vector<GrayFrame> gray;  ///< what the frames first .. last (and rows) show; gray only
  int bits = 0, row_bits = 0;   ///< gray only
  bool in_opencv_order = true;  ///< columns, then rows, the most significant bit first, pattern before inverse
  std::optional<int> projector_columns, projector_rows;  ///< codes beyond are no codes
  std::optional<std::array<std::string, 2>> white, black;
  std::optional<std::string> color;
  std::optional<std::string> rig;
  std::optional<std::array<LensCamera, 2>> intrinsics;  ///< where there is no rig
  std::optional<std::string> empty;                     ///< a view without the object
  std::optional<Eigen::Vector3d> backdrop;              ///< R, G, B, 0 to 255

  bool has_inverses() const;
  int frame_count() const { return pattern == Pattern::gray ? static_cast<int>(gray.size()) : last - first + 1; }
  /// The picture of a view ("view_000", or `*empty`), k counted from 0.
  std::filesystem::path frame_path(std::string const& view, Side side, int k) const;
  std::filesystem::path path_of(std::string const& view, std::string const& name) const;
  /// A name for each view, safe as a folder of a scan set: the number at its end, or its own.
  std::vector<std::string> view_names() const;
};

/// Reads FOLDER/capture.json, or the file itself (`folder` is then where the pictures are). Unknown, missing and
/// contradicting keys throw Error{bad_input} naming them; whether pictures exist is not looked at here.
Capture read_capture(std::filesystem::path const& file, std::filesystem::path const& folder);

/// Whether a folder holds a capture.json.
bool is_capture(std::filesystem::path const& folder);

}  // namespace scanview
