#include "mesh/mesh_freesurfer.h"

#include <algorithm>
#include <array>

#include "mesh/byte_reader.h"
#include "mesh/model_builder.h"

namespace scanview {
namespace {

constexpr std::string_view kTriangles = "\xff\xff\xfe", kQuadrangles = "\xff\xff\xff", kNewQuadrangles = "\xff\xff\xfd";

}  // namespace

bool is_freesurfer_surface(std::string_view bytes) {
  return bytes.starts_with(kTriangles) || bytes.starts_with(kQuadrangles) || bytes.starts_with(kNewQuadrangles);
}

PolygonModel model_from_freesurfer(std::string_view bytes, std::filesystem::path const& path) {
  ModelBuilder builder(path);
  if (!bytes.starts_with(kTriangles))
    builder.fail("a FreeSurfer surface of quadrangles: only those of triangles are read");
  bytes.remove_prefix(std::min(bytes.find('\n'), bytes.size() - 1) + 1);
  if (bytes.starts_with('\n')) bytes.remove_prefix(1);
  ByteReader<std::endian::big> reader(bytes, path);
  auto const vertices = reader.next<std::int32_t>(), triangles = reader.next<std::int32_t>();
  constexpr std::int64_t kRow = 12;
  if (vertices < 0 || triangles < 0 || (std::int64_t(vertices) + triangles) * kRow > std::int64_t(reader.left()))
    builder.fail(fmt::format("promises {} vertices and {} triangles, more than there are", vertices, triangles));
  for (std::int32_t v = 0; v < vertices; ++v) {
    auto const x = reader.next<float>(), y = reader.next<float>(), z = reader.next<float>();
    builder.add_vertex(x, y, z);
  }
  for (std::int32_t t = 0; t < triangles; ++t) {
    std::array<std::int64_t, 3> corners;
    for (std::int64_t& corner : corners) corner = reader.next<std::int32_t>();
    builder.add_polygon(corners);
  }
  return builder.take();
}

}  // namespace scanview
