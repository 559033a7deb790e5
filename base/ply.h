#pragma once
#include <cstdint>
#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

namespace scanview {

enum class PlyType { int8, uint8, int16, uint16, int32, uint32, float32, float64 };

/// One property of all rows of an element. A scalar has `rows` values. A list has `rows + 1` offsets into `values`.
struct PlyProperty {
  std::string name;
  PlyType type = PlyType::float32;
  bool is_list = false;
  PlyType count_type = PlyType::uint8;  ///< of a list
  std::vector<double> values;           ///< every PLY type is exact in a double
  std::vector<std::uint64_t> offsets;   ///< of a list: row r is values[offsets[r]] .. values[offsets[r + 1]]
};

struct PlyElement {
  std::string name;
  std::uint64_t rows = 0;
  std::vector<PlyProperty> properties;
  /// nullptr where there is none.
  PlyProperty const* find(std::string_view property) const;
};

enum class PlyFormat { ascii, binary_little_endian, binary_big_endian };

/// A polygon file (Turk 1994): elements of rows of properties, and the header's comments and obj_info lines.
struct PlyFile {
  std::vector<std::string> comments, obj_info;
  std::vector<PlyElement> elements;
  PlyElement const* find(std::string_view element) const;
};

/// Reads any PLY. Counts of the header are checked against the bytes that are there before anything is allocated: a
/// file of n bytes never takes more than a constant times n. Throws Error{bad_input} naming what is wrong.
PlyFile read_ply(std::filesystem::path const& path);
PlyFile parse_ply(std::string_view bytes, std::filesystem::path const& name_in_errors);

/// Bytes of the file; the values of integer properties must be integers in range. ASCII numbers round-trip.
std::string format_ply(PlyFile const& ply, PlyFormat format);

/// A vertex element with scalar properties and a face element are what most files are made of.
PlyProperty ply_scalar(std::string name, PlyType type, std::vector<double> values);

}  // namespace scanview
