#include "synth/gallery.h"

#include <fmt/format.h>

#include <array>
#include <cmath>
#include <numbers>
#include <vector>

#include "base/error.h"
#include "synth/gallery_plan.h"
#include "synth/patch_writer.h"

namespace scanview {
namespace {

std::size_t count_triangles(double edge) {
  PatchWriter writer(edge);
  write_gallery(writer);
  return writer.triangles();
}

double distance(std::size_t count, std::size_t wanted) {
  return std::abs(static_cast<double>(count) - static_cast<double>(wanted));
}

}  // namespace

TriangleMesh make_gallery(std::size_t polygons) {
  if (polygons < kGalleryLeast || polygons > kGalleryMost)
    throw Error(ErrorCode::usage, {},
                fmt::format("a gallery of {} polygons: must be {} to {}", polygons, kGalleryLeast, kGalleryMost));
  double fine = 1e-3, coarse = 4, best = fine;
  std::size_t best_count = 0;
  for (int i = 0; i < 40; ++i) {
    double const edge = std::sqrt(fine * coarse);
    std::size_t const count = count_triangles(edge);
    if (best_count == 0 || distance(count, polygons) < distance(best_count, polygons)) {
      best = edge;
      best_count = count;
    }
    (count > polygons ? fine : coarse) = edge;
  }
  PatchWriter counter(best);
  write_gallery(counter);
  TriangleMesh mesh;
  mesh.triangles.reserve(counter.triangles());
  mesh.vertices.reserve(counter.vertices());
  mesh.colors.reserve(counter.vertices());
  PatchWriter writer(best, &mesh);
  write_gallery(writer);
  return mesh;
}

}  // namespace scanview
