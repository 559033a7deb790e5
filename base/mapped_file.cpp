#include "base/mapped_file.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/mman.h>
#include <sys/stat.h>

#include <cerrno>
#include <cstring>

#include "base/error.h"
#include "base/file_descriptor.h"

namespace scanview {

MappedFile::MappedFile(std::filesystem::path const& path) {
  auto const fail = [&](ErrorCode code, char const* what) {
    throw Error(code, path, fmt::format("{}: {}", what, std::strerror(errno)));
  };
  FileDescriptor const fd(::open(path.c_str(), O_RDONLY | O_CLOEXEC));
  if (fd.get() < 0) fail(ErrorCode::bad_input, "cannot open");
  struct stat status {};
  if (::fstat(fd.get(), &status) != 0) fail(ErrorCode::io, "cannot stat");
  if (!S_ISREG(status.st_mode)) throw Error(ErrorCode::bad_input, path, "is not a file");
  size_ = static_cast<std::size_t>(status.st_size);
  if (size_ == 0) return;  // cannot be mapped
  void* const address = ::mmap(nullptr, size_, PROT_READ, MAP_PRIVATE, fd.get(), 0);
  if (address == MAP_FAILED) fail(ErrorCode::io, "cannot map");
  address_ = address;
}

MappedFile::~MappedFile() {
  if (address_ != nullptr) ::munmap(address_, size_);
}

}  // namespace scanview
