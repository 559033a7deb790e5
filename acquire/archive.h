#pragma once
#include <filesystem>
#include <functional>
#include <map>
#include <string>

namespace scanview {

/// Whether the file's name says that it is an archive: .tar, .tar.gz, .tgz, .tar.xz, .txz, .tar.bz2, .tar.zst, .zip.
bool is_archive(std::filesystem::path const& path);

/// The regular files of an archive (tar, zip; gzip, xz, bzip2, zstd) whose names `wanted` accepts: name within the
/// archive -> bytes. Nothing is written to disk, so a hostile name can do no harm. Throws Error{bad_input} where the
/// archive is damaged, or where what it would unpack to is more than `limit` bytes.
std::map<std::string, std::string> read_archive(std::filesystem::path const& path,
                                                std::function<bool(std::string const&)> const& wanted,
                                                std::size_t limit = std::size_t{1} << 31);

}  // namespace scanview
