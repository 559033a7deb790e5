#include <archive.h>
#include <archive_entry.h>
#include <fmt/format.h>

#include <algorithm>
#include <cctype>
#include <memory>
#include <utility>

#include "base/error.h"
#include "base/files.h"
#include "mesh/mesh_obj.h"
#include "mesh/mesh_ply.h"
#include "mesh/triangle_mesh.h"

namespace scanview {
namespace {

namespace fs = std::filesystem;

constexpr std::size_t kMaxUnpacked = std::size_t{1} << 31;

struct ArchiveCloser {
  void operator()(struct archive* reader) const { archive_read_free(reader); }
};

std::string unpack_gzip(fs::path const& path, std::string const& packed) {
  if (!packed.starts_with("\x1f\x8b")) throw Error(ErrorCode::bad_input, path, "not a gzip file");
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

}  // namespace

TriangleMesh read_triangle_mesh(fs::path const& path) {
  std::string ending = path.extension().string();
  fs::path const inner = ending == ".gz" ? path.stem() : path;
  std::string kind = inner.extension().string();
  std::transform(kind.begin(), kind.end(), kind.begin(), [](unsigned char c) { return std::tolower(c); });
  if (kind != ".ply" && kind != ".obj")
    throw Error(ErrorCode::bad_input, path, "not a mesh we read: .ply, .obj, .ply.gz, .obj.gz");
  std::string bytes = read_file(path);
  if (ending == ".gz") bytes = unpack_gzip(path, bytes);
  return kind == ".ply" ? mesh_from_ply(parse_ply(bytes, path), path) : mesh_from_obj(std::move(bytes), path);
}

void write_triangle_mesh(fs::path const& path, TriangleMesh const& mesh) {
  mesh.check();
  write_file(path, format_ply(ply_from_mesh(mesh), PlyFormat::binary_little_endian));
}

}  // namespace scanview
