#include "acquire/archive.h"

#include <archive.h>
#include <archive_entry.h>

#include <algorithm>
#include <array>
#include <cctype>
#include <memory>

#include "base/error.h"

namespace scanview {
namespace {

struct ReaderCloser {
  void operator()(struct archive* reader) const { archive_read_free(reader); }
};

}  // namespace

bool is_archive(std::filesystem::path const& path) {
  std::string name = path.filename().string();
  std::transform(name.begin(), name.end(), name.begin(), [](unsigned char c) { return std::tolower(c); });
  constexpr std::array endings{".tar", ".tar.gz", ".tgz", ".tar.xz", ".txz", ".tar.bz2", ".tar.zst", ".zip"};
  return std::any_of(endings.begin(), endings.end(), [&](char const* ending) { return name.ends_with(ending); });
}

std::map<std::string, std::string> read_archive(std::filesystem::path const& path,
                                                std::function<bool(std::string const&)> const& wanted,
                                                std::size_t limit) {
  std::unique_ptr<struct archive, ReaderCloser> const reader(archive_read_new());
  archive_read_support_filter_all(reader.get());
  archive_read_support_format_tar(reader.get());
  archive_read_support_format_zip(reader.get());
  auto const fail = [&](std::string const& what) { throw Error(ErrorCode::bad_input, path, what); };
  auto const cause = [&] {
    char const* const text = archive_error_string(reader.get());
    return std::string(text != nullptr ? text : "unknown cause");
  };
  if (archive_read_open_filename(reader.get(), path.c_str(), 1 << 16) != ARCHIVE_OK)
    fail("not an archive that can be read: " + cause());
  std::map<std::string, std::string> files;
  std::size_t total = 0;
  std::string block(1 << 16, '\0');
  while (true) {
    struct archive_entry* entry = nullptr;
    int const status = archive_read_next_header(reader.get(), &entry);
    if (status == ARCHIVE_EOF) break;
    if (status != ARCHIVE_OK && status != ARCHIVE_WARN) fail("damaged archive: " + cause());
    char const* const name = archive_entry_pathname(entry);
    if (name == nullptr || archive_entry_filetype(entry) != AE_IFREG || !wanted(name)) continue;
    std::string& bytes = files[name];
    bytes.clear();
    // Counted while unpacking: a header's size is only a promise.
    while (true) {
      auto const got = archive_read_data(reader.get(), block.data(), block.size());
      if (got < 0) fail("damaged archive at '" + std::string(name) + "': " + cause());
      if (got == 0) break;
      total += static_cast<std::size_t>(got);
      if (total > limit) fail("the archive unpacks to more than " + std::to_string(limit >> 20) + " MiB");
      bytes.append(block.data(), static_cast<std::size_t>(got));
    }
  }
  return files;
}

}  // namespace scanview
