#include <array>
#include <cstddef>
#include <cstdint>
#include <string>

#include "base/error.h"
#include "mesh/inward_winding.h"
#include "mesh/polygon_model.h"

// The first byte chooses the ending.
extern "C" int LLVMFuzzerTestOneInput(std::uint8_t const* data, std::size_t size) {
  constexpr std::array kNames = {"fuzz", "fuzz.ply", "fuzz.obj", "fuzz.off", "fuzz.stl", "fuzz.gltf", "fuzz.obj.gz"};
  if (size == 0) return 0;
  try {
    auto const model = scanview::parse_polygon_model({reinterpret_cast<char const*>(data) + 1, size - 1},
                                                     kNames[data[0] % kNames.size()]);
    model.mesh.check();
    model.textures.check(model.mesh.triangles.size());
    (void)scanview::is_wound_inwards(model.mesh);
  } catch (scanview::Error const&) {
    // Refusing is one of the two right answers.
  }
  return 0;
}
