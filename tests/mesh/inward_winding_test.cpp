#include "mesh/inward_winding.h"

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <algorithm>

#include "mesh/polygon_model.h"

namespace scanview {
namespace {

namespace fs = std::filesystem;

/// A box wound outwards; without its top it is open.
TriangleMesh box(Eigen::Vector3f const& low, Eigen::Vector3f const& high, bool open = false) {
  TriangleMesh mesh;
  for (int i = 0; i < 8; ++i)
    mesh.vertices.emplace_back(i & 1 ? high.x() : low.x(), i & 2 ? high.y() : low.y(), i & 4 ? high.z() : low.z());
  constexpr int faces[6][4] = {{0, 2, 3, 1}, {0, 1, 5, 4}, {1, 3, 7, 5}, {3, 2, 6, 7}, {2, 0, 4, 6}, {4, 5, 7, 6}};
  for (int f = 0; f < (open ? 5 : 6); ++f) {
    mesh.triangles.emplace_back(faces[f][0], faces[f][1], faces[f][2]);
    mesh.triangles.emplace_back(faces[f][0], faces[f][2], faces[f][3]);
  }
  return mesh;
}

TriangleMesh operator+(TriangleMesh a, TriangleMesh const& b) {
  Eigen::Vector3i const shift = Eigen::Vector3i::Constant(int(a.vertices.size()));
  a.vertices.insert(a.vertices.end(), b.vertices.begin(), b.vertices.end());
  for (Eigen::Vector3i const& t : b.triangles) a.triangles.push_back(t + shift);
  return a;
}

void expect_outwards(TriangleMesh const& mesh) {
  EXPECT_FALSE(is_wound_inwards(mesh));
  EXPECT_TRUE(is_wound_inwards(turned(mesh)));
}

TEST(InwardWinding, ClosedPartsTellByTheirVolume) {
  TriangleMesh const cube = box({-1, -1, -1}, {1, 1, 1});
  expect_outwards(cube);
  expect_outwards(box({1000, 1000, 1000}, {1001, 1001, 1001}));
  // A hollow: the cavity is wound the other way, and the whole outwards.
  expect_outwards(cube + turned(box({-0.5, -0.5, -0.5}, {0.5, 0.5, 0.5})));
  // Boxes that share an edge: four triangles meet there.
  expect_outwards(cube + box({1, 1, -1}, {2, 2, 1}));
}

TEST(InwardWinding, DoubledVerticesDoNotOpenAModel) {
  TriangleMesh const cube = box({-1, -1, -1}, {1, 1, 1});
  TriangleMesh split;
  for (Eigen::Vector3i const& t : cube.triangles) {
    int const first = int(split.vertices.size());
    for (int const corner : t) split.vertices.push_back(cube.vertices[corner]);
    split.triangles.emplace_back(first, first + 1, first + 2);
  }
  expect_outwards(split);
}

TEST(InwardWinding, OpenModelsOnlyWhereItIsClear) {
  expect_outwards(box({-1, -1, -1}, {1, 1, 1}, true));
  TriangleMesh sheet;
  sheet.vertices = {{0, 0, 0}, {1, 0, 0}, {1, 1, 0.2f}, {0, 1, -0.1f}};
  sheet.triangles = {{0, 1, 2}, {0, 2, 3}};
  EXPECT_FALSE(is_wound_inwards(sheet));
  EXPECT_FALSE(is_wound_inwards(turned(sheet)));
  TriangleMesh const doubled = sheet + turned(sheet);
  EXPECT_FALSE(is_wound_inwards(doubled));
  EXPECT_FALSE(is_wound_inwards(turned(doubled)));
  // A small closed part does not speak for the large open one.
  TriangleMesh const shell = box({-1, -1, -1}, {1, 1, 1}, true);
  expect_outwards(shell + turned(box({0, 0, 0}, {0.1f, 0.1f, 0.1f})));
}

TEST(InwardWinding, NothingAndDegenerateTrianglesAreNotInwards) {
  EXPECT_FALSE(is_wound_inwards({}));
  TriangleMesh mesh;
  mesh.vertices = {{0, 0, 0}, {1, 0, 0}, {2, 0, 0}};
  mesh.triangles = {{0, 0, 1}, {0, 1, 2}};
  EXPECT_FALSE(is_wound_inwards(mesh));
}

struct Model {
  char const* name;
  std::size_t triangles;
  bool inwards;
};

class PolygonModels : public ::testing::TestWithParam<Model> {};

TEST_P(PolygonModels, AreReadAndTurnedOutwards) {
  fs::path const path = fs::path(SCANVIEW_SOURCE_DIR) / "../shared/data/models" / GetParam().name;
  if (!fs::exists(path)) GTEST_SKIP() << "no data: models/" << GetParam().name;
  PolygonModel const model = read_polygon_model(path);
  EXPECT_NO_THROW(model.mesh.check());
  EXPECT_EQ(model.mesh.triangles.size(), GetParam().triangles);
  EXPECT_EQ(model.polygon_count(), GetParam().triangles);
  EXPECT_FALSE(is_wound_inwards(model.mesh));
  std::vector<std::string> const& notes = model.notes;
  EXPECT_EQ(std::any_of(notes.begin(), notes.end(), [](auto const& note) { return note.starts_with("wound inwards"); }),
            GetParam().inwards);
}

INSTANTIATE_TEST_SUITE_P(Models, PolygonModels,
                         ::testing::Values(Model{"horse.ply", 96966, true}, Model{"armadillo.obj", 86482, false},
                                           Model{"igea.ply", 268686, false},
                                           Model{"brain-surface.obj.gz", 163840, false},
                                           Model{"freesurfer-binary-surface.gz", 327680, false},
                                           Model{"car.obj.gz", 56042, false}));

}  // namespace
}  // namespace scanview
