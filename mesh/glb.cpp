#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <stdexcept>

#include "base/image_file.h"
#include "mesh/textured_mesh.h"
#include "mesh/view_mesh.h"

// Khronos, "glTF 2.0 Specification": §4.4 binary container, §3.6.2 accessors; KHR_materials_unlit.

namespace scanview {
namespace {

enum ComponentType { kUint32 = 5125, kFloat32 = 5126 };
enum BufferTarget { kVertices = 34962, kIndices = 34963 };

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

class GlbWriter {
 public:
  GlbWriter() {
    json_["asset"] = {{"version", "2.0"}, {"generator", "scanview"}};
    json_["extensionsUsed"] = {"KHR_materials_unlit"};
    json_["scene"] = 0;
    json_["scenes"] = Json::array({Json{{"nodes", {0}}}});
    for (char const* key :
         {"nodes", "meshes", "materials", "textures", "images", "samplers", "accessors", "bufferViews"})
      json_[key] = Json::array();
    constexpr int kLinear = 9729, kClampToEdge = 33071;
    json_["samplers"].push_back(
        {{"magFilter", kLinear}, {"minFilter", kLinear}, {"wrapS", kClampToEdge}, {"wrapT", kClampToEdge}});
  }

  /// Column by column, as glTF wants it.
  static Json matrix(Eigen::Matrix4d const& m) {
    Json result = Json::array();
    for (int i = 0; i < 16; ++i) result.push_back(m(i % 4, i / 4));
    return result;
  }

  int add(char const* list, Json item) {
    json_[list].push_back(std::move(item));
    return int(json_[list].size()) - 1;
  }
  Json& item(char const* list, int index) { return json_[list][index]; }

  int add_buffer_view(std::string_view bytes) {
    bytes_.resize((bytes_.size() + 3) / 4 * 4, '\0');
    Json const view = {{"buffer", 0}, {"byteOffset", bytes_.size()}, {"byteLength", bytes.size()}};
    bytes_.append(bytes);
    return add("bufferViews", view);
  }

  /// `components` numbers an element, one after the other.
  template <typename Number>
  int add_accessor(std::vector<Number> const& numbers, int components, ComponentType type, BufferTarget target) {
    constexpr char const* names[] = {"", "SCALAR", "VEC2", "VEC3"};
    int const view = add_buffer_view({reinterpret_cast<char const*>(numbers.data()), numbers.size() * sizeof(Number)});
    item("bufferViews", view)["target"] = int(target);
    Json least = Json::array(), greatest = Json::array();
    for (int c = 0; c < components; ++c) {
      Number low = numbers[c], high = numbers[c];
      for (std::size_t i = c; i < numbers.size(); i += components) {
        low = std::min(low, numbers[i]);
        high = std::max(high, numbers[i]);
      }
      least.push_back(low);
      greatest.push_back(high);
    }
    return add("accessors", {{"bufferView", view},
                             {"componentType", int(type)},
                             {"count", numbers.size() / components},
                             {"type", names[components]},
                             {"min", least},
                             {"max", greatest}});
  }

  std::string finish() {
    for (char const* key : {"meshes", "materials", "textures", "images", "samplers", "accessors", "bufferViews"})
      if (json_[key].empty()) json_.erase(key);
    bytes_.resize((bytes_.size() + 3) / 4 * 4, '\0');
    if (!bytes_.empty()) json_["buffers"] = Json::array({Json{{"byteLength", bytes_.size()}}});
    std::string text = json_.dump();
    text.resize((text.size() + 3) / 4 * 4, ' ');
    std::size_t const total = 12 + 8 + text.size() + (bytes_.empty() ? 0 : 8 + bytes_.size());
    if (total > UINT32_MAX) throw std::length_error("a GLB file holds at most 4 GiB");
    std::string glb = "glTF";
    auto const put = [&glb](std::size_t value) {
      for (int i = 0; i < 4; ++i) glb.push_back(char(value >> (8 * i) & 255));
    };
    put(2);
    put(total);
    put(text.size());
    glb += "JSON" + text;
    if (bytes_.empty()) return glb;
    put(bytes_.size());
    glb += std::string("BIN\0", 4) + bytes_;
    return glb;
  }

 private:
  Json json_;
  std::string bytes_;
};

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
