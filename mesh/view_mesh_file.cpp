#include <fmt/format.h>

#include <cmath>

#include "base/error.h"
#include "base/files.h"
#include "base/image_file.h"
#include "mesh/mesh_ply.h"
#include "mesh/view_mesh.h"

namespace scanview {

void write_view_mesh(std::filesystem::path const& view_folder, ViewMesh const& view_mesh) {
  view_mesh.check();
  PlyFile ply = ply_from_mesh(view_mesh.mesh);
  ply.comments.push_back("camera coordinates: x right, y down, z forward; cos: of the angle between normal and ray");
  ply.elements[1].properties.push_back(
      ply_scalar("cos", PlyType::float32, {view_mesh.cos_phi.begin(), view_mesh.cos_phi.end()}));
  write_file(view_folder / "mesh.ply", format_ply(ply, PlyFormat::binary_little_endian));
  write_file(view_folder / "feather.png", encode_png(view_mesh.feather));
}

ViewMesh read_view_mesh(std::filesystem::path const& view_folder, Camera const& camera) {
  ViewMesh view_mesh;
  view_mesh.camera = camera;
  std::filesystem::path const mesh_path = view_folder / "mesh.ply", feather_path = view_folder / "feather.png";
  PlyFile const ply = read_ply(mesh_path);
  view_mesh.mesh = model_from_ply(ply, mesh_path).mesh;
  view_mesh.mesh.colors.clear();
  auto const bad = [](std::filesystem::path const& path, std::string const& what) {
    throw Error(ErrorCode::bad_input, path, what);
  };
  if (camera.is_perspective())
    for (std::size_t v = 0; v < view_mesh.mesh.vertices.size(); ++v)
      if (!(view_mesh.mesh.vertices[v].z() > 0)) bad(mesh_path, fmt::format("vertex {} is not before the camera", v));
  PlyElement const* const faces = ply.find("face");
  PlyProperty const* const cosines = faces ? faces->find("cos") : nullptr;
  if (!cosines || cosines->is_list) bad(mesh_path, "faces without 'cos'");
  if (cosines->values.size() != view_mesh.mesh.triangles.size()) bad(mesh_path, "faces that are not all triangles");
  for (double const cosine : cosines->values) {
    if (!(cosine >= -1 && cosine <= 1)) bad(mesh_path, "a 'cos' that is no cosine");
    view_mesh.cos_phi.push_back(float(cosine));
  }
  cv::Mat const feather = read_image(feather_path);
  if (feather.type() != CV_8UC1) bad(feather_path, "not an 8-bit gray picture");
  if (feather.cols != camera.width() || feather.rows != camera.height())
    bad(feather_path, fmt::format("{} x {} pixels, but the camera has {} x {}", feather.cols, feather.rows,
                                  camera.width(), camera.height()));
  view_mesh.feather = feather;
  return view_mesh;
}

}  // namespace scanview
