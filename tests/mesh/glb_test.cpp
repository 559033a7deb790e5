#include <gtest/gtest.h>
#include <tiny_gltf.h>

#include <Eigen/Geometry>

#include "mesh/polygon_model.h"
#include "mesh/texture_split.h"
#include "mesh/view_mesh.h"
#include "tests/mesh/depth_maps.h"

namespace scanview {
namespace {

using namespace testing;

struct TwoViews {
  ScanSet set;
  std::vector<ViewMesh> meshes;

  explicit TwoViews(Unit unit = Unit::mm) {
    Context context;
    set.unit = unit;
    for (int i = 0; i < 2; ++i) {
      Camera const camera = small_camera();
      View view;
      view.name = "00" + std::to_string(i);
      view.image = depth_map(camera, 1e-3, [&](int x, int y) { return plane_depth(camera, {0.9, 0.2, 1}, 3, x, y); });
      view.object_from_camera = Eigen::Isometry3d::Identity();
      view.object_from_camera->translate(Eigen::Vector3d(i, 2, 3));
      view.object_from_camera->rotate(Eigen::AngleAxisd(0.5 * i, Eigen::Vector3d::UnitY()));
      meshes.push_back(mesh_range_image(view.image, {}, context).view_mesh);
      set.views.push_back(std::move(view));
    }
  }
  std::string glb() const { return encode_glb({&meshes[0], &meshes[1]}, set, {0, 1}); }
};

tinygltf::Model load(std::string const& glb) {
  tinygltf::TinyGLTF loader;
  loader.SetImageLoader([](tinygltf::Image*, int, std::string*, std::string*, int, int, unsigned char const* bytes,
                           int size, void*) { return size > 3 && bytes[0] == 0xff && bytes[1] == 0xd8; },  // JPEG
                        nullptr);
  tinygltf::Model model;
  std::string error, warning;
  EXPECT_TRUE(loader.LoadBinaryFromMemory(&model, &error, &warning, reinterpret_cast<unsigned char const*>(glb.data()),
                                          unsigned(glb.size())));
  EXPECT_EQ(error, "");
  EXPECT_EQ(warning, "");
  return model;
}

std::vector<float> floats(tinygltf::Model const& model, int accessor) {
  auto const& a = model.accessors[accessor];
  auto const& view = model.bufferViews[a.bufferView];
  auto const* const data =
      reinterpret_cast<float const*>(model.buffers[view.buffer].data.data() + view.byteOffset + a.byteOffset);
  int const components = a.type == TINYGLTF_TYPE_SCALAR ? 1 : a.type;
  return {data, data + a.count * components};
}

TEST(Glb, IsReadByAnotherProgramWithPosesAxesAndUnit) {
  TwoViews const two;
  tinygltf::Model const model = load(two.glb());
  ASSERT_EQ(model.nodes.size(), 3u);
  EXPECT_EQ(model.nodes[0].children, (std::vector<int>{1, 2}));
  EXPECT_EQ(model.nodes[0].matrix, (std::vector<double>{0.001, 0, 0, 0, 0, -0.001, 0, 0, 0, 0, -0.001, 0, 0, 0, 0, 1}));
  for (int i = 0; i < 2; ++i) {
    EXPECT_EQ(model.nodes[1 + i].name, two.set.views[i].name);
    Eigen::Matrix4d const pose = two.set.views[i].object_from_camera->matrix();
    EXPECT_EQ(Eigen::Matrix4d(model.nodes[1 + i].matrix.data()), pose);
  }
  EXPECT_EQ(model.images.size(), 2u);
  EXPECT_EQ(model.extensionsUsed, std::vector<std::string>{"KHR_materials_unlit"});
  EXPECT_EQ(load(TwoViews(Unit::m).glb()).nodes[0].matrix[0], 1.0);
}

TEST(Glb, IsReadByOurOwnReader) {
  TwoViews const two;
  TriangleMesh const mesh = parse_polygon_model(two.glb(), "two.glb").mesh;
  std::size_t triangles = 0;
  for (auto const& accessor : load(two.glb()).accessors)
    if (accessor.type == TINYGLTF_TYPE_SCALAR && accessor.componentType == TINYGLTF_COMPONENT_TYPE_UNSIGNED_INT)
      triangles += accessor.count / 3;
  EXPECT_EQ(mesh.triangles.size(), triangles);
  // Millimetres to metres, y and z turned round.
  Eigen::Vector3d const p = *two.set.views[0].object_from_camera * two.meshes[0].mesh.vertices[0].cast<double>();
  Eigen::Vector3f const placed = (Eigen::Vector3d(p.x(), -p.y(), -p.z()) / 1000).cast<float>();
  float nearest = 1;
  for (Eigen::Vector3f const& vertex : mesh.vertices) nearest = std::min(nearest, (vertex - placed).norm());
  EXPECT_LT(nearest, 1e-8f);
}

TEST(Glb, AccessorsAreAlignedAndTheirLimitsHold) {
  tinygltf::Model const model = load(TwoViews().glb());
  for (auto const& view : model.bufferViews) {
    EXPECT_EQ(view.byteOffset % 4, 0u);
    EXPECT_LE(view.byteOffset + view.byteLength, model.buffers[0].data.size());
  }
  for (auto const& mesh : model.meshes) {
    auto const& attributes = mesh.primitives[0].attributes;
    for (char const* name : {"POSITION", "TEXCOORD_0", "_COS", "_FEATHER"}) {
      ASSERT_TRUE(attributes.contains(name)) << name;
      int const index = attributes.at(name);
      std::vector<float> const values = floats(model, index);
      std::size_t const components = values.size() / model.accessors[index].count;
      for (std::size_t i = 0; i < values.size(); ++i) {
        EXPECT_GE(values[i], float(model.accessors[index].minValues[i % components]));
        EXPECT_LE(values[i], float(model.accessors[index].maxValues[i % components]));
      }
    }
  }
}

TEST(Glb, PlainTextureCoordinatesAreWithinHalfATexelEverywhere) {
  // Planes from 0 to 75 degrees, one with a great range of depths in two triangles.
  for (double degrees : {0.0, 40.0, 60.0, 75.0}) {
    Camera const camera = small_camera(640, 480);
    TriangleMesh mesh;
    double const t = std::tan(degrees * 3.14159265358979 / 180);
    for (auto const& [x, y] :
         {std::pair(-0.5, -0.5), std::pair(639.5, -0.5), std::pair(639.5, 479.5), std::pair(-0.5, 479.5)}) {
      double const z = 1 / (1 + 0.003 * t * (x + 0.5 * y) / 10);
      mesh.vertices.push_back(camera.unproject(x, y, z).cast<float>());
    }
    mesh.triangles = {{0, 2, 1}, {0, 3, 2}};
    TriangleMesh const split = split_for_plain_texture(camera, mesh, 0.5);
    double worst = 0;
    for (Eigen::Vector3i const& triangle : split.triangles) {
      Eigen::Vector3d p[3];
      Eigen::Vector2d u[3];
      for (int i = 0; i < 3; ++i) {
        p[i] = split.vertices[triangle[i]].cast<double>();
        u[i] = camera.project(p[i]);
      }
      constexpr int n = 8;
      for (int a = 0; a <= n; ++a)
        for (int b = 0; a + b <= n; ++b) {
          double const wa = double(a) / n, wb = double(b) / n, wc = 1 - wa - wb;
          Eigen::Vector2d const plain = wa * u[0] + wb * u[1] + wc * u[2];
          worst = std::max(worst, (plain - camera.project(wa * p[0] + wb * p[1] + wc * p[2])).norm());
        }
    }
    EXPECT_LE(worst, 0.5) << degrees;
    if (degrees == 0) {
      EXPECT_EQ(split.triangles.size(), 2u);
    }
  }
}

TEST(Glb, SplittingKeepsAreaAndOpensNoCracks) {
  TwoViews const two;
  ViewMesh const& vm = two.meshes[0];
  TriangleMesh const split = split_for_plain_texture(vm.camera, vm.mesh, 0.05);
  EXPECT_GT(split.triangles.size(), vm.mesh.triangles.size());
  auto const area = [](TriangleMesh const& mesh) {
    double sum = 0;
    for (Eigen::Vector3i const& t : mesh.triangles) {
      Eigen::Vector3d const a = mesh.vertices[t[0]].cast<double>();
      Eigen::Vector3d const normal =
          (mesh.vertices[t[1]].cast<double>() - a).cross(mesh.vertices[t[2]].cast<double>() - a);
      EXPECT_LT(normal.dot(a), 0) << "still turned to the camera";
      sum += normal.norm() / 2;
    }
    return sum;
  };
  EXPECT_NEAR(area(split), area(vm.mesh), 1e-5 * area(vm.mesh));
  // Every edge but those of the old border has a partner that runs the other way.
  auto const open_edges = [](TriangleMesh const& mesh) {
    std::map<std::pair<int, int>, int> edges;
    for (Eigen::Vector3i const& t : mesh.triangles)
      for (int i = 0; i < 3; ++i) ++edges[{t[i], t[(i + 1) % 3]}];
    double length = 0;
    for (auto const& [edge, count] : edges) {
      EXPECT_EQ(count, 1);
      if (!edges.contains({edge.second, edge.first}))
        length += (mesh.vertices[edge.first] - mesh.vertices[edge.second]).cast<double>().norm();
    }
    return length;
  };
  EXPECT_NEAR(open_edges(split), open_edges(vm.mesh), 1e-5 * open_edges(vm.mesh));
}

TEST(Glb, EmptyMeshesAndMissingPosesAreAllowed) {
  TwoViews two;
  two.meshes[1].mesh = {};
  two.meshes[1].cos_phi.clear();
  two.set.views[0].object_from_camera.reset();
  tinygltf::Model const model = load(two.glb());
  EXPECT_EQ(model.meshes.size(), 1u);
  EXPECT_EQ(model.nodes[2].mesh, -1);
  EXPECT_TRUE(model.nodes[1].matrix.empty());
  EXPECT_NO_THROW(load(encode_glb({}, two.set, {})));
}

TEST(Glb, SameBytesAgain) { EXPECT_EQ(TwoViews().glb(), TwoViews().glb()); }

TEST(MeshSection, NamesEveryViewAndItsCount) {
  TwoViews const two;
  Context context;
  std::vector<ViewMeshResult> results;
  for (View const& view : two.set.views) results.push_back(mesh_range_image(view.image, {}, context));
  ReportSection const section = mesh_section(two.set, results);
  EXPECT_EQ(section.id, "mesh");
  for (std::size_t i = 0; i < 2; ++i) {
    EXPECT_NE(section.html.find(two.set.views[i].name), std::string::npos);
    EXPECT_NE(section.html.find(std::to_string(results[i].figures.triangles)), std::string::npos);
  }
}

}  // namespace
}  // namespace scanview
