#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <stdexcept>

#include "base/image_file.h"
#include "mesh/glb_writer.h"
#include "mesh/textured_mesh.h"
#include "mesh/view_mesh.h"

namespace scanview {
namespace {

/// Mean cosine of the triangles around each vertex of the mesh, weighted by their areas, at the vertices of the split
/// one.
std::vector<float> cosines_at_vertices(Camera const& camera, TriangleMesh const& mesh) {
  std::vector<Eigen::Vector3d> normals(mesh.vertices.size(), Eigen::Vector3d::Zero());
  for (Eigen::Vector3i const& t : mesh.triangles) {
    Eigen::Vector3d const a = mesh.vertices[t[0]].cast<double>();
    Eigen::Vector3d const normal =
        (mesh.vertices[t[1]].cast<double>() - a).cross(mesh.vertices[t[2]].cast<double>() - a);
    for (int i = 0; i < 3; ++i) normals[t[i]] += normal;
  }
  std::vector<float> cosines;
  for (std::size_t v = 0; v < normals.size(); ++v) {
    Eigen::Vector3d const p(mesh.vertices[v].cast<double>());
    Eigen::Vector3d const ray = camera.is_perspective() ? p : Eigen::Vector3d(0, 0, 1);
    double const size = normals[v].norm() * ray.norm();
    cosines.push_back(size > 0 ? float(std::clamp(-normals[v].dot(ray) / size, 0.0, 1.0)) : 0.0f);
  }
  return cosines;
}

int add_mesh(GlbWriter& writer, ViewMesh const& view_mesh, View const& view, double greatest_gain) {
  Camera const& camera = view_mesh.camera;
  TexturedMesh const textured = textured_mesh(view_mesh, view);
  TriangleMesh const& mesh = textured.mesh;
  std::vector<float> positions, texture, feather;
  for (Eigen::Vector2f const& st : textured.plain) texture.insert(texture.end(), {st.x(), st.y()});
  for (Eigen::Vector3f const& vertex : mesh.vertices) {
    Eigen::Vector2d const pixel = camera.project(vertex.cast<double>());
    positions.insert(positions.end(), {vertex.x(), vertex.y(), vertex.z()});
    int const x = std::clamp(int(std::lround(pixel.x())), 0, camera.width() - 1);
    int const y = std::clamp(int(std::lround(pixel.y())), 0, camera.height() - 1);
    feather.push_back(float(view_mesh.feather(y, x)) / 255.0f);
  }
  std::vector<std::uint32_t> indices;
  for (Eigen::Vector3i const& t : mesh.triangles)
    for (int i = 0; i < 3; ++i) indices.push_back(std::uint32_t(t[i]));

  Json material = {{"name", view.name},
                   {"pbrMetallicRoughness", {{"metallicFactor", 0}, {"roughnessFactor", 1}}},
                   {"extensions", {{"KHR_materials_unlit", Json::object()}}}};
  Json& surface = material["pbrMetallicRoughness"];
  surface["baseColorFactor"] = {view.gain[0] / greatest_gain, view.gain[1] / greatest_gain,
                                view.gain[2] / greatest_gain, 1.0};
  if (!textured.picture.empty()) {
    int const picture =
        writer.add("images", {{"name", view.name},
                              {"mimeType", "image/jpeg"},
                              {"bufferView", writer.add_buffer_view(encode_jpeg(textured.picture, 92))}});
    surface["baseColorTexture"] = {{"index", writer.add("textures", {{"sampler", 0}, {"source", picture}})}};
  }
  Json const primitive = {{"attributes",
                           {{"POSITION", writer.add_accessor(positions, 3, kFloat32, kVertices)},
                            {"TEXCOORD_0", writer.add_accessor(texture, 2, kFloat32, kVertices)},
                            {"_COS", writer.add_accessor(cosines_at_vertices(camera, mesh), 1, kFloat32, kVertices)},
                            {"_FEATHER", writer.add_accessor(feather, 1, kFloat32, kVertices)}}},
                          {"indices", writer.add_accessor(indices, 1, kUint32, kIndices)},
                          {"material", writer.add("materials", material)}};
  return writer.add("meshes", {{"name", view.name}, {"primitives", Json::array({primitive})}});
}

}  // namespace

std::string encode_glb(std::vector<ViewMesh const*> const& meshes, ScanSet const& set,
                       std::vector<std::size_t> const& view_indices) {
  if (meshes.size() != view_indices.size()) throw std::logic_error("encode_glb: as many meshes as views are needed");
  double greatest_gain = 1;  // glTF's factors end at 1
  for (std::size_t const v : view_indices) greatest_gain = std::max(greatest_gain, set.views.at(v).gain.maxCoeff());
  double const meters = set.unit == Unit::mm ? 0.001 : 1.0;
  GlbWriter writer;
  int const root = writer.add(
      "nodes",
      {{"name", "scanview"}, {"matrix", GlbWriter::matrix(Eigen::Vector4d(meters, -meters, -meters, 1).asDiagonal())}});
  for (std::size_t i = 0; i < meshes.size(); ++i) {
    View const& view = set.views.at(view_indices[i]);
    Json node = {{"name", view.name}};
    if (view.object_from_camera) node["matrix"] = GlbWriter::matrix(view.object_from_camera->matrix());
    if (!meshes[i]->mesh.triangles.empty()) node["mesh"] = add_mesh(writer, *meshes[i], view, greatest_gain);
    int const child = writer.add("nodes", std::move(node));
    writer.item("nodes", root)["children"].push_back(child);
  }
  return writer.finish();
}

}  // namespace scanview
