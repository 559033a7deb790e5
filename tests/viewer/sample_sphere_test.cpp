#include "viewer/visibility/sample_sphere.h"

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <cmath>
#include <limits>

#include "base/random.h"
#include "expect_error.h"

namespace scanview {
namespace {

Eigen::Vector3d random_direction(std::uint64_t i) {
  CounterRandom random(7, i);
  return Eigen::Vector3d(random.normal(), random.normal(), random.normal()).normalized();
}

bool is_in_face(SampleSphere const& sphere, std::size_t face, Eigen::Vector3d const& d) {
  for (int k = 0; k < 3; ++k) {
    auto const corner = [&](int i) {
      return sphere.directions()[static_cast<std::size_t>(sphere.faces()[face][i % 3])];
    };
    if (d.dot(corner(k).cross(corner(k + 1))) < -1e-12) return false;
  }
  return true;
}

TEST(SampleSphere, OctahedronsHaveThePapersNumbersOfSamples) {
  std::size_t const counts[] = {6, 18, 66, 258, 1026, 4098};
  for (int level = 0; level < 6; ++level) {
    SampleSphere const sphere = SampleSphere::octahedron(level);
    EXPECT_EQ(sphere.directions().size(), counts[level]);
    EXPECT_EQ(sphere.faces().size(), std::size_t{8} << (2 * level));
    EXPECT_EQ(SampleSphere::octahedron_level(counts[level]), level);
    EXPECT_NEAR(sphere.coverage(), 1, 1e-9);
    for (auto const& d : sphere.directions()) EXPECT_NEAR(d.norm(), 1, 1e-12);
  }
  EXPECT_SCANVIEW_ERROR(SampleSphere::octahedron_level(1000), ErrorCode::usage, "1026");
}

TEST(SampleSphere, FacesAreFoundInAtMostFourTestsALevel) {
  for (int level : {0, 1, 4, 5}) {
    SampleSphere const sphere = SampleSphere::octahedron(level);
    for (std::uint64_t i = 0; i < 500; ++i) {
      Eigen::Vector3d const d = random_direction(i);
      auto const at = sphere.locate(3.5 * d);
      ASSERT_TRUE(at);
      EXPECT_TRUE(is_in_face(sphere, at->face, d)) << i;
      EXPECT_LE(at->tests, 4 * (level + 1));
    }
  }
}

TEST(SampleSphere, EyesOnCornersEdgesAndPlanesAreInAFaceThatTouchesThem) {
  SampleSphere const sphere = SampleSphere::octahedron(3);
  for (auto const& corner : sphere.directions()) EXPECT_TRUE(is_in_face(sphere, sphere.locate(corner)->face, corner));
  for (auto const& face : sphere.faces()) {
    for (int k = 0; k < 3; ++k) {
      Eigen::Vector3d const middle = sphere.directions()[static_cast<std::size_t>(face[k])] +
                                     sphere.directions()[static_cast<std::size_t>(face[(k + 1) % 3])];
      EXPECT_TRUE(is_in_face(sphere, sphere.locate(middle)->face, middle.normalized()));
    }
  }
}

TEST(SampleSphere, TheCentreAndWhatIsNotFiniteAreInNoFace) {
  SampleSphere const sphere = SampleSphere::octahedron(2);
  EXPECT_FALSE(sphere.locate(Eigen::Vector3d::Zero()));
  EXPECT_FALSE(sphere.locate({std::numeric_limits<double>::quiet_NaN(), 0, 1}));
  EXPECT_FALSE(sphere.locate({std::numeric_limits<double>::infinity(), 0, 1}));
}

TEST(SampleSphere, TheHullOfTheOctahedronsDirectionsHasItsFaces) {
  SampleSphere const octahedron = SampleSphere::octahedron(2);
  SampleSphere const hull = SampleSphere::hull(octahedron.directions());
  EXPECT_EQ(hull.faces().size(), octahedron.faces().size());
  EXPECT_NEAR(hull.coverage(), 1, 1e-9);
  for (std::uint64_t i = 0; i < 200; ++i) {
    Eigen::Vector3d const d = random_direction(i);
    ASSERT_TRUE(hull.locate(d));
    EXPECT_TRUE(is_in_face(hull, hull.locate(d)->face, d));
  }
}

TEST(SampleSphere, ThreeFurtherSamplesLieAcrossTheEdges) {
  SampleSphere const sphere = SampleSphere::octahedron(2);
  for (std::size_t f = 0; f < sphere.faces().size(); ++f) {
    for (int k = 0; k < 3; ++k) {
      int const other = sphere.opposite(f)[k];
      ASSERT_GE(other, 0);
      EXPECT_NE(other, sphere.faces()[f][k]);
      // On the other side of the edge than corner k.
      auto const point = [&](int i) { return sphere.directions()[static_cast<std::size_t>(i)]; };
      Eigen::Vector3d const edge = point(sphere.faces()[f][(k + 1) % 3]).cross(point(sphere.faces()[f][(k + 2) % 3]));
      EXPECT_LT(edge.dot(point(other)) * edge.dot(point(sphere.faces()[f][k])), 0);
    }
  }
}

TEST(SampleSphere, CamerasOnOneCircleCoverNothing) {
  std::vector<Eigen::Vector3d> circle;
  for (int i = 0; i < 12; ++i) circle.emplace_back(std::cos(0.5 * i), std::sin(0.5 * i), 0);
  SampleSphere const sphere = SampleSphere::hull(circle);
  EXPECT_EQ(sphere.coverage(), 0);
  EXPECT_FALSE(sphere.locate({1, 0, 0.1}));
}

TEST(SampleSphere, CamerasInOneHalfSpaceCoverOnlyThat) {
  std::vector<Eigen::Vector3d> above;
  for (SampleSphere const sphere = SampleSphere::octahedron(3); auto const& d : sphere.directions()) {
    if (d.z() > -1e-9) above.push_back(d);
  }
  SampleSphere const sphere = SampleSphere::hull(above);
  EXPECT_NEAR(sphere.coverage(), 0.5, 1e-6);
  EXPECT_TRUE(sphere.locate({0.3, 0.2, 1}));
  EXPECT_FALSE(sphere.locate({0.3, 0.2, -1}));
}

TEST(SampleSphere, CamerasInTheSamePlaceCountOnce) {
  std::vector<Eigen::Vector3d> twice = SampleSphere::octahedron(1).directions();
  std::size_t const n = twice.size();
  for (std::size_t i = 0; i < n; ++i) twice.push_back(2.5 * twice[i]);
  SampleSphere const sphere = SampleSphere::hull(twice);
  EXPECT_EQ(sphere.directions().size(), n);
  for (std::size_t i = 0; i < n; ++i) EXPECT_EQ(sphere.representative()[i], sphere.representative()[n + i]);
  EXPECT_SCANVIEW_ERROR(SampleSphere::hull({{1, 0, 0}, {0, 0, 0}}), ErrorCode::bad_input, "centre");
}

}  // namespace
}  // namespace scanview
