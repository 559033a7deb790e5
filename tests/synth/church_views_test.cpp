#include "synth/church_views.h"

#include <gtest/gtest.h>

#include <vector>

#include "synth/church.h"
#include "synth/model_camera.h"
#include "synth/scene_sight.h"
#include "tests/expect_error.h"

namespace scanview {
namespace {

using Eigen::Isometry3d;
using Eigen::Vector3d;

void expect_rigid_and_upright(Isometry3d const& pose) {
  EXPECT_NEAR((pose.linear().transpose() * pose.linear() - Eigen::Matrix3d::Identity()).norm(), 0, 1e-12);
  EXPECT_NEAR(pose.linear().determinant(), 1, 1e-12);
  EXPECT_NEAR(pose.linear().col(0).y(), 0, 1e-12) << "the horizon is level";
  EXPECT_LT(pose.linear().col(1).y(), 0) << "down is down";
}

/// Places seen in every 16th pixel of each pose.
std::vector<Vector3d> seen_from(SceneSight const& sight, Camera const& camera, std::vector<Isometry3d> const& poses) {
  std::vector<Vector3d> points;
  for (Isometry3d const& pose : poses)
    for (int y = 8; y < camera.height(); y += 16)
      for (int x = 8; x < camera.width(); x += 16) {
        Vector3d const direction = pose.linear() * camera.ray_direction(x, y);
        auto const surface = sight.first_surface(pose.translation(), direction);
        if (surface) points.push_back(pose.translation() + surface->distance * direction);
      }
  return points;
}

bool sees(SceneSight const& sight, ChurchReference const& reference, Vector3d const& point) {
  Vector3d const p_camera = reference.scene_from_camera.inverse() * point;
  if (p_camera.z() <= 0 || !reference.camera.contains(reference.camera.project(p_camera))) return false;
  Vector3d const eye = reference.scene_from_camera.translation();
  auto const surface = sight.first_surface(eye, point - eye);
  return surface && surface->distance > 0.999;
}

TEST(ChurchViews, AreASequenceOfWhichOneTakesTheFirst) {
  auto const all = church_references(kChurchReferences), some = church_references(5);
  ASSERT_EQ(all.size(), 36u);
  ASSERT_EQ(some.size(), 5u);
  for (std::size_t i = 0; i < some.size(); ++i)
    EXPECT_EQ(some[i].scene_from_camera.matrix(), all[i].scene_from_camera.matrix());
  for (auto const& reference : all) {
    EXPECT_EQ(reference.camera, Camera::perspective(512, 512, 256, 256, 255.5, 255.5));
    expect_rigid_and_upright(reference.scene_from_camera);
  }
  EXPECT_EQ(church_path().size(), 40u);
  for (Isometry3d const& pose : church_path(7)) expect_rigid_and_upright(pose);
  EXPECT_EQ(church_path(7).back().matrix(), church_path(40).back().matrix());
  EXPECT_SCANVIEW_ERROR(church_references(0), ErrorCode::usage, "1 to 36");
  EXPECT_SCANVIEW_ERROR(church_references(37), ErrorCode::usage, "1 to 36");
  EXPECT_SCANVIEW_ERROR(church_path(1), ErrorCode::usage, "2 or more");
}

TEST(ChurchViews, StandInTheOpen) {
  Context context;
  ModelCameraOptions options;
  options.light = ModelCameraOptions::Light::painted;
  ModelCamera const camera(make_church(kChurchLeast), options, context);
  auto const expect_clear = [&](Vector3d const& eye) {
    EXPECT_GT(camera.clearance(eye), 0.6) << eye.transpose();
    EXPECT_EQ(camera.share_of_backs(eye), 0) << eye.transpose();
  };
  int outside = 0;
  auto const references = church_references(kChurchReferences);
  for (auto const& reference : references) {
    Vector3d const eye = reference.scene_from_camera.translation();
    expect_clear(eye);
    outside += eye.x() < -10;
  }
  EXPECT_EQ(outside, 2);
  for (Isometry3d const& pose : church_path()) {
    expect_clear(pose.translation());
    for (auto const& reference : references)
      EXPECT_GT((reference.scene_from_camera.translation() - pose.translation()).norm(), 0.2);
  }
}

TEST(ChurchViews, NothingButTheInteriorIsSeenTowardsTheEast) {
  SceneSight const sight(make_church(kChurchLeast), SceneWinding::trusted);
  for (auto const& reference : church_references(kChurchReferences)) {
    Isometry3d const& pose = reference.scene_from_camera;
    if (pose.translation().x() < 0 || pose.linear()(0, 2) < 0) continue;
    EXPECT_EQ(seen_from(sight, reference.camera, {pose}).size(), 32u * 32u) << pose.translation().transpose();
  }
}

TEST(ChurchViews, FewShowMostOfAWalkAndAllAlmostAll) {
  SceneSight const sight(make_church(kChurchLeast), SceneWinding::trusted);
  auto const references = church_references(kChurchReferences);
  auto const points = seen_from(sight, references.front().camera, church_path());
  ASSERT_EQ(points.size(), 40u * 32u * 32u);
  std::vector<double> seen_by(references.size() + 1, 0.0);
  for (Vector3d const& point : points)
    for (std::size_t i = 0; i < references.size(); ++i) {
      if (!sees(sight, references[i], point)) continue;
      for (std::size_t count = i + 1; count < seen_by.size(); ++count) seen_by[count] += 1.0 / points.size();
      break;
    }
  EXPECT_GT(seen_by[2], 0.85);
  EXPECT_GT(seen_by[4], 0.93);
  EXPECT_GT(seen_by[8], 0.97);
  EXPECT_GT(seen_by[12], 0.985);
  EXPECT_GT(seen_by[36], 0.998);
}

}  // namespace
}  // namespace scanview
