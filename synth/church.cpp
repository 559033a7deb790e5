#include "synth/church.h"

#include <fmt/format.h>

#include "base/error.h"
#include "synth/church_plan.h"
#include "synth/patch_writer.h"

namespace scanview {

TriangleMesh make_church(std::size_t polygons) {
  if (polygons < kChurchLeast || polygons > kChurchMost)
    throw Error(ErrorCode::usage, {},
                fmt::format("a church of {} polygons: must be {} to {}", polygons, kChurchLeast, kChurchMost));
  return mesh_of_about(polygons, [](PatchWriter& writer) {
    write_church_building(writer);
    write_church_furniture(writer);
  });
}

}  // namespace scanview
