#include "synth/assembly.h"

#include <algorithm>

#include "base/parallel.h"
#include "synth/distance_field.h"
#include "synth/isosurface.h"
#include "synth/paint.h"

namespace scanview {
namespace {

using Eigen::Vector3f;

constexpr std::size_t kChunk = 1 << 13;  // vertices a task

struct Nearest {
  float distance = 1e9f;
  std::size_t solid = 0;
};

Nearest nearest_solid(std::vector<Solid> const& solids, Vector3f const& p) {
  Nearest nearest;
  for (std::size_t i = 0; i < solids.size(); ++i) {
    if (sphere_distance(p, solids[i].center, solids[i].radius) > nearest.distance) continue;
    float const d = solids[i].distance(p);
    if (d < nearest.distance) nearest = {d, i};
  }
  return nearest;
}

}  // namespace

TriangleMesh make_assembly(std::vector<Solid> const& solids, Eigen::AlignedBox3f const& box, float spacing, float slack,
                           Context& context) {
  TriangleMesh mesh =
      polygonise([&](Vector3f const& p) { return nearest_solid(solids, p).distance; }, box, spacing, slack, context);
  mesh.colors.resize(mesh.vertices.size());
  for_each_index(context, (mesh.vertices.size() + kChunk - 1) / kChunk, [&](std::size_t chunk) {
    std::size_t const end = std::min(mesh.vertices.size(), (chunk + 1) * kChunk);
    for (std::size_t i = chunk * kChunk; i < end; ++i) {
      Vector3f const& p = mesh.vertices[i];
      mesh.colors[i] = bgr_from_paint(solids[nearest_solid(solids, p).solid].paint(p));
    }
  });
  return mesh;
}

}  // namespace scanview
