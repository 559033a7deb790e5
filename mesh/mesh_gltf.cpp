#include "mesh/mesh_gltf.h"

#include <Eigen/Geometry>
#include <array>
#include <map>

#include "mesh/byte_reader.h"
#include "mesh/gltf_accessors.h"
#include "mesh/gltf_materials.h"
#include "mesh/model_builder.h"

// Khronos, "glTF 2.0 Specification": §3.5 scenes and nodes, §3.7 geometry, §4.4 GLB. A parser of our
// own: tinygltf looks into images beyond their buffers and for files outside the model's folder.

namespace scanview {
namespace {

constexpr std::size_t kNone = SIZE_MAX;
constexpr std::size_t kMost = std::size_t{1} << 25;

enum Mode : std::size_t { kTriangles = 4, kStrip = 5, kFan = 6 };

struct Chunks {
  std::string_view json, binary;
};

Chunks split_glb(std::string_view bytes, std::filesystem::path const& path) {
  auto const fail = [&](char const* what) { throw Error(ErrorCode::bad_input, path, what); };
  ByteReader<std::endian::little> reader(bytes, path);
  reader.next<std::uint32_t>();
  if (reader.next<std::uint32_t>() != 2) fail("a GLB file of another version than 2");
  if (reader.next<std::uint32_t>() > bytes.size()) fail("is cut off");
  Chunks chunks;
  while (reader.left() >= 2 * sizeof(std::uint32_t)) {
    std::size_t const size = reader.next<std::uint32_t>();
    std::string_view const type = reader.take(4), chunk = reader.take(size);
    if (type == "JSON" && chunks.json.empty()) chunks.json = chunk;
    if (type == std::string_view("BIN\0", 4) && chunks.binary.empty()) chunks.binary = chunk;
  }
  if (chunks.json.empty()) fail("a GLB file without JSON");
  return chunks;
}

template <std::size_t kCount>
std::array<double, kCount> numbers(Json const& node, char const* key, std::array<double, kCount> otherwise) {
  auto const field = node.find(key);
  return field == node.end() ? otherwise : field->get<std::array<double, kCount>>();
}

Eigen::Affine3d parent_from_node(Json const& node) {
  Eigen::Affine3d result = Eigen::Affine3d::Identity();
  if (node.contains("matrix")) {
    auto const m = numbers<16>(node, "matrix", {});
    for (int column = 0; column < 4; ++column)
      for (int row = 0; row < 3; ++row) result(row, column) = m[4 * column + row];
    return result;
  }
  auto const t = numbers<3>(node, "translation", {0, 0, 0});
  auto const q = numbers<4>(node, "rotation", {0, 0, 0, 1});
  auto const s = numbers<3>(node, "scale", {1, 1, 1});
  result.translate(Eigen::Vector3d(t[0], t[1], t[2]));
  result.rotate(Eigen::Quaterniond(q[3], q[0], q[1], q[2]).normalized());
  result.scale(Eigen::Vector3d(s[0], s[1], s[2]));
  return result;
}

class GltfReader {
 public:
  GltfReader(Json const& gltf, std::string_view binary, std::filesystem::path const& path)
      : gltf_(gltf),
        path_(path),
        builder_(path),
        accessors_(gltf, binary, path),
        materials_(gltf, accessors_, path, builder_) {}

  PolygonModel read() {
    check_extensions();
    std::vector<Instance> const instances = placed_meshes();
    std::map<std::size_t, std::size_t> left;  // of each mesh
    for (Instance const& instance : instances) ++left[instance.mesh];
    for (Instance const& instance : instances) {
      std::size_t const triangles = builder_.triangle_count(), vertices = builder_.vertex_count();
      add_mesh(gltf_.at("meshes").at(instance.mesh), instance.scene_from_node);
      std::size_t const count = left[instance.mesh]--;
      check_most(triangles + count * (builder_.triangle_count() - triangles));
      check_most(vertices + count * (builder_.vertex_count() - vertices));
    }
    if (left_out_ > 0) builder_.note(fmt::format("{} primitives of points or lines were left out", left_out_));
    if (is_posed_) builder_.note("skins and morph targets were left in the pose they were modelled in");
    return builder_.take_joined();
  }

 private:
  struct Instance {
    std::size_t mesh;
    Eigen::Affine3d scene_from_node;
  };

  std::vector<Instance> placed_meshes() {
    struct Item {
      std::size_t node;
      Eigen::Affine3d scene_from_parent;
    };
    std::vector<Instance> instances;
    std::vector<Item> stack;
    auto const push = [&stack](std::vector<std::size_t> const& nodes, Eigen::Affine3d const& scene_from_parent) {
      for (auto node = nodes.rbegin(); node != nodes.rend(); ++node) stack.push_back({*node, scene_from_parent});
    };
    push(root_nodes(), Eigen::Affine3d::Identity());
    std::vector<bool> seen(list("nodes").size(), false);
    while (!stack.empty()) {
      Item const item = stack.back();
      stack.pop_back();
      Json const& node = gltf_.at("nodes").at(item.node);
      if (seen[item.node]) builder_.fail(fmt::format("node {} has two parents", item.node));
      seen[item.node] = true;
      Eigen::Affine3d const scene_from_node = item.scene_from_parent * parent_from_node(node);
      if (std::size_t const mesh = gltf_size(node, "mesh", kNone, path_); mesh != kNone) {
        instances.push_back({mesh, scene_from_node});
        is_posed_ = is_posed_ || node.contains("skin");
      }
      push(indices_of(node, "children"), scene_from_node);
    }
    return instances;
  }

  Json const& list(char const* key) const {
    static Json const kEmpty = Json::array();
    auto const found = gltf_.find(key);
    return found == gltf_.end() ? kEmpty : *found;
  }

  void check_extensions() {
    for (Json const& name : list("extensionsRequired")) {
      auto const& text = name.get_ref<std::string const&>();
      if (text.find("draco") != std::string::npos || text.find("meshopt") != std::string::npos)
        builder_.fail(fmt::format("is compressed with {}, which is not read", text));
      if (text == "EXT_mesh_gpu_instancing") builder_.fail(fmt::format("needs {}, which is not read", text));
    }
  }

  std::vector<std::size_t> indices_of(Json const& object, char const* key) const {
    std::vector<std::size_t> result;
    auto const field = object.find(key);
    if (field == object.end()) return result;
    for (Json const& index : *field) result.push_back(gltf_size(index, key, path_));
    return result;
  }

  std::vector<std::size_t> root_nodes() const {
    Json const& scenes = list("scenes");
    std::size_t const scene = gltf_size(gltf_, "scene", scenes.size() == 1 ? 0 : kNone, path_);
    if (scene != kNone) return indices_of(scenes.at(scene), "nodes");
    std::vector<bool> is_child(list("nodes").size(), false);
    for (Json const& node : list("nodes"))
      for (std::size_t const child : indices_of(node, "children"))
        if (child < is_child.size()) is_child[child] = true;
    std::vector<std::size_t> roots;
    for (std::size_t i = 0; i < is_child.size(); ++i)
      if (!is_child[i]) roots.push_back(i);
    return roots;
  }

  void add_mesh(Json const& mesh, Eigen::Affine3d const& scene_from_node) {
    struct Vertices {
      std::size_t first = 0, count = 0;
    };
    std::map<std::size_t, Vertices> known;  // primitives often share their vertices
    std::size_t const first_triangle = builder_.triangle_count();
    for (Json const& primitive : mesh.at("primitives")) {
      std::size_t const mode = gltf_size(primitive, "mode", kTriangles, path_);
      if (mode != kTriangles && mode != kStrip && mode != kFan) {
        ++left_out_;
        continue;
      }
      is_posed_ = is_posed_ || primitive.contains("targets");
      std::size_t const accessor = gltf_size(primitive.at("attributes"), "POSITION", kNone, path_);
      if (accessor == kNone) builder_.fail("a primitive without positions");
      auto const [place, is_new] = known.try_emplace(accessor);
      Vertices& vertices = place->second;
      if (is_new) {
        std::vector<Eigen::Vector3d> const positions = accessors_.positions(accessor);
        vertices = {builder_.vertex_count(), positions.size()};
        check_most(vertices.first + vertices.count);
        for (Eigen::Vector3d const& p : positions) {
          Eigen::Vector3d const q = scene_from_node * p;
          builder_.add_vertex(q.x(), q.y(), q.z());
        }
      }
      std::vector<std::int64_t> corners;
      if (std::size_t const index = gltf_size(primitive, "indices", kNone, path_); index != kNone)
        corners = accessors_.indices(index);
      else
        for (std::size_t i = 0; i < vertices.count; ++i) corners.push_back(std::int64_t(i));
      check_most(builder_.triangle_count() + corners.size());
      GltfMaterials::Surface const surface = materials_.surface(primitive);
      std::vector<Eigen::Vector2f> at;  // of the corners
      bool const is_placed = !surface.at.empty() && surface.at.size() >= vertices.count;
      for (std::int64_t& corner : corners) {
        if (corner < 0 || std::size_t(corner) >= vertices.count)
          builder_.fail(fmt::format("a primitive names vertex {}, but has {}", corner, vertices.count));
        if (is_placed) at.push_back(surface.at[corner]);
        corner += std::int64_t(vertices.first);
      }
      add_triangles(corners, mode, surface.light, {surface.number, at});
    }
    if (scene_from_node.linear().determinant() < 0) builder_.turn_from(first_triangle);
  }

  void add_triangles(std::vector<std::int64_t> const& corners, std::size_t mode, Light light,
                     PolygonPaint const& paint) {
    if (mode == kStrip) return builder_.add_strip(corners, light, paint);
    if (mode == kFan) {
      for (std::size_t k = 2; k < corners.size(); ++k) builder_.add_triangle(corners, {0, k - 1, k}, light, paint);
      return;
    }
    if (corners.size() % 3 != 0) builder_.fail("triangles whose indices are no multiple of three");
    for (std::size_t k = 0; k < corners.size(); k += 3) builder_.add_triangle(corners, {k, k + 1, k + 2}, light, paint);
  }

  void check_most(std::size_t count) const {
    if (count > kMost) builder_.fail("holds, with all instances, more than 2^25 triangles or vertices");
  }

  Json const& gltf_;
  std::filesystem::path const& path_;
  ModelBuilder builder_;
  GltfAccessors accessors_;
  GltfMaterials materials_;
  std::size_t left_out_ = 0;
  bool is_posed_ = false;
};

}  // namespace

PolygonModel model_from_gltf(std::string_view bytes, std::filesystem::path const& path) {
  auto const fail = [&](std::string const& what) { throw Error(ErrorCode::bad_input, path, what); };
  Chunks const chunks = bytes.starts_with("glTF") ? split_glb(bytes, path) : Chunks{bytes, {}};
  try {
    Json const gltf = Json::parse(chunks.json);
    if (!gltf.is_object() || !gltf.contains("asset")) fail("is no glTF file");
    std::string const version = gltf.at("asset").at("version");
    if (!version.starts_with("2.")) fail("of a glTF version other than 2");
    return GltfReader(gltf, chunks.binary, path).read();
  } catch (nlohmann::json::parse_error const& error) {
    fail(fmt::format("not valid JSON at byte {}", error.byte));
  } catch (nlohmann::json::exception const& error) {
    fail(fmt::format("is not as glTF wants it: {}", error.what()));
  }
  return {};
}

}  // namespace scanview
