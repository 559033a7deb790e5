#include "base/files.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/stat.h>
#include <unistd.h>
#include <xxhash.h>

#include <cerrno>
#include <cmath>
#include <cstring>

#include "base/error.h"
#include "base/file_descriptor.h"

namespace scanview {
namespace fs = std::filesystem;
namespace {

[[noreturn]] void fail(ErrorCode code, fs::path const& path, std::string const& what) {
  throw Error(code, path, fmt::format("{}: {}", what, std::strerror(errno)));
}

void sync_folder(fs::path const& folder) {
  FileDescriptor const fd(::open(folder.empty() ? "." : folder.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC));
  // Some file systems cannot sync a folder; the rename is then as durable as they make it.
  if (fd.get() >= 0) (void)::fsync(fd.get());
}

void write_all(fs::path const& path, std::string_view bytes) {
  FileDescriptor fd(::open(path.c_str(), O_WRONLY | O_CREAT | O_TRUNC | O_CLOEXEC, 0644));
  if (fd.get() < 0) fail(ErrorCode::io, path, "cannot create");
  while (!bytes.empty()) {
    ssize_t const n = ::write(fd.get(), bytes.data(), bytes.size());
    if (n < 0 && errno == EINTR) continue;
    if (n <= 0) fail(ErrorCode::io, path, "cannot write");
    bytes.remove_prefix(static_cast<std::size_t>(n));
  }
  if (::fsync(fd.get()) != 0) fail(ErrorCode::io, path, "cannot write");
  if (fd.close() != 0) fail(ErrorCode::io, path, "cannot write");
}

void require_finite(Json const& json) {
  if (json.is_number_float() && !std::isfinite(json.get<double>()))
    throw std::logic_error("a number that is not finite reached a JSON writer");
  if (json.is_structured())
    for (auto const& child : json) require_finite(child);
}

}  // namespace

std::string read_file(fs::path const& path) {
  FileDescriptor const fd(::open(path.c_str(), O_RDONLY | O_CLOEXEC));
  if (fd.get() < 0) fail(ErrorCode::bad_input, path, "cannot open");
  struct stat status {};
  if (::fstat(fd.get(), &status) != 0) fail(ErrorCode::io, path, "cannot stat");
  if (!S_ISREG(status.st_mode)) throw Error(ErrorCode::bad_input, path, "is not a file");
  std::string bytes(static_cast<std::size_t>(status.st_size), '\0');
  std::size_t have = 0;
  while (have < bytes.size()) {
    ssize_t const n = ::read(fd.get(), bytes.data() + have, bytes.size() - have);
    if (n < 0 && errno == EINTR) continue;
    if (n < 0) fail(ErrorCode::io, path, "cannot read");
    if (n == 0) throw Error(ErrorCode::io, path, "shrank while it was read");
    have += static_cast<std::size_t>(n);
  }
  return bytes;
}

Json read_json(fs::path const& path) {
  std::string const text = read_file(path);
  try {
    return Json::parse(text);
  } catch (nlohmann::json::parse_error const& error) {
    std::size_t const at = std::min(error.byte, text.size());
    auto const line = 1 + std::count(text.begin(), text.begin() + static_cast<std::ptrdiff_t>(at), '\n');
    throw Error(ErrorCode::bad_input, path, fmt::format("not valid JSON at line {}", line));
  }
}

void write_file(fs::path const& path, std::string_view bytes) {
  fs::path partial = path;
  partial += ".partial";
  try {
    write_all(partial, bytes);
  } catch (Error const& error) {
    std::error_code ignored;
    fs::remove(partial, ignored);
    throw Error(error.code(), path, error.message());
  }
  if (::rename(partial.c_str(), path.c_str()) != 0) {
    int const why = errno;
    std::error_code ignored;
    fs::remove(partial, ignored);
    errno = why;
    fail(ErrorCode::io, path, "cannot rename into place");
  }
  sync_folder(path.parent_path());
}

void write_json(fs::path const& path, Json const& json) {
  require_finite(json);
  write_file(path, json.dump(2) + "\n");
}

Json json_number(double value) { return std::isfinite(value) ? Json(value) : Json(nullptr); }

NewFolder::NewFolder(fs::path final_path) : final_(std::move(final_path)) {
  if (!final_.has_filename()) final_ = final_.parent_path();  // "out/" means "out"
  partial_ = final_;
  partial_ += ".partial";
  std::error_code error;
  fs::remove_all(partial_, error);
  fs::create_directories(partial_, error);
  if (error) throw Error(ErrorCode::io, final_, "cannot create: " + error.message());
}

NewFolder::~NewFolder() {
  std::error_code ignored;
  if (!committed_) fs::remove_all(partial_, ignored);
}

void NewFolder::commit() {
  std::error_code error;
  fs::remove_all(final_, error);
  if (!error) fs::rename(partial_, final_, error);
  if (error) throw Error(ErrorCode::io, final_, "cannot put into place: " + error.message());
  committed_ = true;
  sync_folder(final_.parent_path());
}

std::string hash_bytes(std::string_view bytes) {
  XXH128_hash_t const hash = XXH3_128bits(bytes.data(), bytes.size());
  return fmt::format("{:016x}{:016x}", hash.high64, hash.low64);
}

std::string hash_file(fs::path const& path) { return hash_bytes(read_file(path)); }

}  // namespace scanview
