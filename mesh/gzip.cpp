#include "mesh/gzip.h"

#include <archive.h>
#include <archive_entry.h>
#include <fmt/format.h>

#include <memory>

#include "base/error.h"

namespace scanview {
namespace {

constexpr std::size_t kMaxUnpacked = std::size_t{1} << 31;

struct ArchiveCloser {
  void operator()(struct archive* reader) const { archive_read_free(reader); }
};

}  // namespace

bool is_gzip(std::string_view bytes) { return bytes.starts_with("\x1f\x8b"); }

std::string unpack_gzip(std::string_view packed, std::filesystem::path const& path) {
  if (!is_gzip(packed)) throw Error(ErrorCode::bad_input, path, "not a gzip file");
  std::unique_ptr<struct archive, ArchiveCloser> const reader(archive_read_new());
  archive_read_support_filter_gzip(reader.get());
  archive_read_support_format_raw(reader.get());
  auto fail = [&] {
    char const* const text = archive_error_string(reader.get());
    throw Error(ErrorCode::bad_input, path, fmt::format("damaged gzip file: {}", text ? text : "unknown cause"));
  };
  struct archive_entry* entry = nullptr;
  if (archive_read_open_memory(reader.get(), packed.data(), packed.size()) != ARCHIVE_OK) fail();
  if (archive_read_next_header(reader.get(), &entry) != ARCHIVE_OK) fail();
  std::string bytes, block(1 << 16, '\0');
  while (true) {
    auto const got = archive_read_data(reader.get(), block.data(), block.size());
    if (got < 0) fail();
    if (got == 0) return bytes;
    if (bytes.size() + std::size_t(got) > kMaxUnpacked)
      throw Error(ErrorCode::bad_input, path, "unpacks to more than 2 GiB");
    bytes.append(block.data(), std::size_t(got));
  }
}

}  // namespace scanview
