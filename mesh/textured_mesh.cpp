#include "mesh/textured_mesh.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "base/image_file.h"
#include "mesh/padded_texture.h"
#include "mesh/texture_split.h"

namespace scanview {

cv::Rect covered_rectangle(ViewMesh const& view_mesh, int margin) {
  cv::Rect box;
  for (int y = 0; y < view_mesh.feather.rows; ++y)
    for (int x = 0; x < view_mesh.feather.cols; ++x)
      if (view_mesh.feather(y, x) > 0) box = box.empty() ? cv::Rect(x, y, 1, 1) : box | cv::Rect(x, y, 1, 1);
  if (box.empty()) return {};
  box = {box.x - margin, box.y - margin, box.width + 2 * margin, box.height + 2 * margin};
  return box & cv::Rect({0, 0}, view_mesh.feather.size());
}

TexturedMesh textured_mesh(ViewMesh const& view_mesh, View const& view) {
  constexpr double kHalfTexel = 0.5;
  constexpr int kMargin = 8;  // texels, a block of a JPEG: smaller pictures of the texture still end outside the object
  TexturedMesh result;
  result.mesh = split_for_plain_texture(view_mesh.camera, view_mesh.mesh, kHalfTexel);
  cv::Rect box({0, 0}, view_mesh.feather.size());
  if (!view.image.color.empty()) {
    if (cv::Rect const covered = covered_rectangle(view_mesh, kMargin); !covered.empty()) box = covered;
    result.picture = padded_texture(view.image, view_mesh)(box).clone();
  }
  for (Eigen::Vector3f const& vertex : result.mesh.vertices) {
    Eigen::Vector2d const pixel = view_mesh.camera.project(vertex.cast<double>());
    result.plain.emplace_back(float((pixel.x() + 0.5 - box.x) / box.width),
                              float((pixel.y() + 0.5 - box.y) / box.height));
  }
  return result;
}

ObjFiles encode_obj(ViewMesh const& view_mesh, View const& view) {
  TexturedMesh const textured = textured_mesh(view_mesh, view);
  Eigen::Isometry3d const pose = view.object_from_camera.value_or(Eigen::Isometry3d::Identity());
  ObjFiles files;
  auto out = std::back_inserter(files.obj);
  fmt::format_to(out, "# scanview, view {}\n", view.name);
  if (!textured.picture.empty()) fmt::format_to(out, "mtllib {0}.mtl\nusemtl {0}\n", view.name);
  for (Eigen::Vector3f const& vertex : textured.mesh.vertices) {
    Eigen::Vector3f const p = (pose * vertex.cast<double>()).cast<float>();
    fmt::format_to(out, "v {} {} {}\n", p.x(), p.y(), p.z());
  }
  for (Eigen::Vector2f const& st : textured.plain) fmt::format_to(out, "vt {} {}\n", st.x(), 1 - st.y());
  for (Eigen::Vector3i const& t : textured.mesh.triangles)
    fmt::format_to(out, "f {0}/{0} {1}/{1} {2}/{2}\n", t[0] + 1, t[1] + 1, t[2] + 1);
  if (textured.picture.empty()) return files;
  files.mtl =
      fmt::format("newmtl {0}\nKa 1 1 1\nKd 1 1 1\nKs 0 0 0\nillum 0\nmap_Ka {0}.jpg\nmap_Kd {0}.jpg\n", view.name);
  files.jpeg = encode_jpeg(textured.picture, 92);
  return files;
}

}  // namespace scanview
