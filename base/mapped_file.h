#pragma once
#include <cstddef>
#include <filesystem>
#include <span>

namespace scanview {

/// The bytes of a file where they lie: opening costs the same whatever its size, and a page is read when it is first
/// touched. They begin at an address that is a multiple of the page's size. A file that is replaced (write_file) lives
/// on for who has mapped it; one that is cut off in place meanwhile ends the program when what is gone is touched.
class MappedFile {
 public:
  /// Throws Error{bad_input} where it is missing or is no regular file, Error{io} where it cannot be mapped. An empty
  /// file has no bytes.
  explicit MappedFile(std::filesystem::path const& path);
  ~MappedFile();
  MappedFile(MappedFile const&) = delete;
  MappedFile& operator=(MappedFile const&) = delete;
  std::span<std::byte const> bytes() const { return {static_cast<std::byte const*>(address_), size_}; }

 private:
  void* address_ = nullptr;
  std::size_t size_ = 0;
};

}  // namespace scanview
