#include "mesh/patch_glb.h"

#include "base/srgb.h"
#include "mesh/glb_writer.h"

namespace scanview {

std::string encode_patch_glb(TriangleMesh const& mesh, std::vector<std::uint32_t> const& begins) {
  GlbWriter writer;
  std::vector<float> positions, colors;
  for (auto const& vertex : mesh.vertices) positions.insert(positions.end(), {vertex.x(), vertex.y(), vertex.z()});
  for (cv::Vec3b const& bgr : mesh.colors) {
    for (int c = 2; c >= 0; --c) colors.push_back(static_cast<float>(linear_from_srgb8()[bgr[c]]));  // glTF: linear
  }
  Json attributes{{"POSITION", writer.add_accessor(positions, 3, kFloat32, kVertices)}};
  if (!colors.empty()) attributes["COLOR_0"] = writer.add_accessor(colors, 3, kFloat32, kVertices);
  Json primitives = Json::array();
  for (std::size_t k = 0; k + 1 < begins.size(); ++k) {
    std::vector<std::uint32_t> indices;
    for (std::size_t i = begins[k]; i < begins[k + 1]; ++i) {
      for (int c = 0; c < 3; ++c) indices.push_back(static_cast<std::uint32_t>(mesh.triangles[i][c]));
    }
    if (indices.empty()) continue;
    primitives.push_back({{"attributes", attributes}, {"indices", writer.add_accessor(indices, 1, kUint32, kIndices)}});
  }
  writer.add("meshes", {{"primitives", primitives}});
  writer.add("nodes", {{"mesh", 0}});
  return writer.finish();
}

}  // namespace scanview
