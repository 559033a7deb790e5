#pragma once
#include <cstdint>
#include <filesystem>
#include <nlohmann/json.hpp>
#include <string>
#include <string_view>

namespace scanview {

using Json = nlohmann::ordered_json;

/// The whole file. Throws Error{bad_input} where it is missing or is no regular file, Error{io} where reading fails.
std::string read_file(std::filesystem::path const& path);

/// JSON text of a file; an error names file, line and column. Comments are not accepted.
Json read_json(std::filesystem::path const& path);

/// Writes a file whole or not at all: PATH.partial, checked, fsync, renamed over PATH. Throws Error{io} (disk full,
/// no permission) and leaves the old file as it was. An orphan of a killed run is overwritten by the next.
void write_file(std::filesystem::path const& path, std::string_view bytes);

/// Two-space indented, keys in insertion order. Refuses non-finite numbers (JSON has none) by throwing
/// std::logic_error.
void write_json(std::filesystem::path const& path, Json const& json);

/// The number, or null where it is not finite: not measured, or nothing to measure.
Json json_number(double value);

/// A folder that appears whole or not at all: write into `path()` (FINAL.partial), then `commit()` renames it to FINAL,
/// replacing a folder that was there. Without commit the destructor removes it.
class NewFolder {
 public:
  explicit NewFolder(std::filesystem::path final_path);
  ~NewFolder();
  NewFolder(NewFolder const&) = delete;
  NewFolder& operator=(NewFolder const&) = delete;
  std::filesystem::path const& path() const { return partial_; }
  void commit();

 private:
  std::filesystem::path final_, partial_;
  bool committed_ = false;
};

/// XXH3 (128 bits) in hexadecimal: of bytes, of a file's content.
std::string hash_bytes(std::string_view bytes);
std::string hash_file(std::filesystem::path const& path);

}  // namespace scanview
