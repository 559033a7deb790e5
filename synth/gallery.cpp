#include "synth/gallery.h"

#include <fmt/format.h>

#include "base/error.h"
#include "synth/gallery_plan.h"
#include "synth/patch_writer.h"

namespace scanview {

TriangleMesh make_gallery(std::size_t polygons) {
  if (polygons < kGalleryLeast || polygons > kGalleryMost)
    throw Error(ErrorCode::usage, {},
                fmt::format("a gallery of {} polygons: must be {} to {}", polygons, kGalleryLeast, kGalleryMost));
  return mesh_of_about(polygons, write_gallery);
}

}  // namespace scanview
