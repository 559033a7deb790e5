#include "synth/ray_scene.h"

#include <embree3/rtcore.h>

#include <cstring>
#include <limits>

#include "base/error.h"
#include "base/parallel.h"

namespace scanview {
namespace {

using Eigen::Vector3f;

constexpr float kFar = std::numeric_limits<float>::infinity();

void set_ray(RTCRay16& rays, int i, Vector3f const& origin, Vector3f const& direction, float nearest) {
  rays.org_x[i] = origin.x();
  rays.org_y[i] = origin.y();
  rays.org_z[i] = origin.z();
  rays.dir_x[i] = direction.x();
  rays.dir_y[i] = direction.y();
  rays.dir_z[i] = direction.z();
  rays.tnear[i] = nearest;
  rays.tfar[i] = kFar;
  rays.time[i] = 0;
  rays.mask[i] = ~0u;
  rays.id[i] = 0;
  rays.flags[i] = 0;
}

RTCIntersectContext coherent_context() {
  RTCIntersectContext context;
  rtcInitIntersectContext(&context);
  context.flags = RTC_INTERSECT_CONTEXT_FLAG_COHERENT;
  return context;
}

}  // namespace

struct RayScene::Embree {
  RTCDevice device = nullptr;
  RTCScene scene = nullptr;
  Embree() : device(rtcNewDevice(nullptr)) {
    if (device) scene = rtcNewScene(device);
    if (!scene) throw Error(ErrorCode::io, {}, "the ray caster (Embree) does not start on this machine");
  }
  ~Embree() {
    if (scene) rtcReleaseScene(scene);
    if (device) rtcReleaseDevice(device);
  }
  Embree(Embree const&) = delete;
  Embree& operator=(Embree const&) = delete;
  void require_success(char const* doing) const {
    if (rtcGetDeviceError(device) != RTC_ERROR_NONE)
      throw Error(ErrorCode::io, {}, std::string("the ray caster (Embree) failed while ") + doing);
  }
};

RayScene::RayScene(std::vector<Vector3f> const& vertices, std::vector<Eigen::Vector3i> const& triangles)
    : embree_(std::make_unique<Embree>()) {
  RTCGeometry const geometry = rtcNewGeometry(embree_->device, RTC_GEOMETRY_TYPE_TRIANGLE);
  void* const points = rtcSetNewGeometryBuffer(geometry, RTC_BUFFER_TYPE_VERTEX, 0, RTC_FORMAT_FLOAT3, sizeof(Vector3f),
                                               vertices.size());
  void* const corners = rtcSetNewGeometryBuffer(geometry, RTC_BUFFER_TYPE_INDEX, 0, RTC_FORMAT_UINT3,
                                                sizeof(Eigen::Vector3i), triangles.size());
  embree_->require_success("taking the model");
  std::memcpy(points, vertices.data(), vertices.size() * sizeof(Vector3f));
  std::memcpy(corners, triangles.data(), triangles.size() * sizeof(Eigen::Vector3i));
  rtcCommitGeometry(geometry);
  rtcAttachGeometry(embree_->scene, geometry);
  rtcReleaseGeometry(geometry);
  // Robust: no ray slips between two triangles that share an edge.
  rtcSetSceneFlags(embree_->scene, RTC_SCENE_FLAG_ROBUST);
  // The order of triangles in the tree decides between equal distances, and would depend on the number of threads.
  Context one_thread;
  one_thread.threads = 1;
  for_each_index(one_thread, 1, [&](std::size_t) { rtcCommitScene(embree_->scene); });
  embree_->require_success("building its tree");
}

RayScene::~RayScene() = default;

RayHit RayScene::first_hit(Vector3f const& origin, Vector3f const& direction) const {
  RTCRayHit query{};
  query.ray.org_x = origin.x();
  query.ray.org_y = origin.y();
  query.ray.org_z = origin.z();
  query.ray.dir_x = direction.x();
  query.ray.dir_y = direction.y();
  query.ray.dir_z = direction.z();
  query.ray.tfar = kFar;
  query.ray.mask = ~0u;
  query.hit.geomID = RTC_INVALID_GEOMETRY_ID;
  RTCIntersectContext context = coherent_context();
  rtcIntersect1(embree_->scene, &context, &query);
  if (query.hit.geomID == RTC_INVALID_GEOMETRY_ID) return {};
  return {static_cast<int>(query.hit.primID), query.hit.u, query.hit.v, query.ray.tfar};
}

std::array<RayHit, kPacket> RayScene::first_hits(Vector3f const& origin, RayDirections const& directions) const {
  std::array<Vector3f, kPacket> origins;
  origins.fill(origin);
  return first_hits(origins, directions, kPacket, 0);
}

std::array<RayHit, kPacket> RayScene::first_hits(std::array<Vector3f, kPacket> const& origins,
                                                 RayDirections const& directions, int count, float nearest) const {
  RTCRayHit16 query;
  alignas(64) std::array<int, kPacket> valid;
  for (int i = 0; i < kPacket; ++i) {
    valid[i] = i < count ? -1 : 0;
    query.hit.geomID[i] = RTC_INVALID_GEOMETRY_ID;
    query.hit.instID[0][i] = RTC_INVALID_GEOMETRY_ID;
    if (i < count) set_ray(query.ray, i, origins[i], directions[i], nearest);
  }
  RTCIntersectContext context = coherent_context();
  rtcIntersect16(valid.data(), embree_->scene, &context, &query);
  std::array<RayHit, kPacket> hits;
  for (int i = 0; i < count; ++i)
    if (query.hit.geomID[i] != RTC_INVALID_GEOMETRY_ID)
      hits[i] = {static_cast<int>(query.hit.primID[i]), query.hit.u[i], query.hit.v[i], query.ray.tfar[i]};
  return hits;
}

std::array<bool, kPacket> RayScene::occluded(std::array<Vector3f, kPacket> const& origins,
                                             RayDirections const& directions, int count, float nearest) const {
  RTCRay16 rays;
  alignas(64) std::array<int, kPacket> valid;
  for (int i = 0; i < kPacket; ++i) {
    valid[i] = i < count ? -1 : 0;
    set_ray(rays, i, origins[i], directions[i], nearest);
  }
  RTCIntersectContext context;
  rtcInitIntersectContext(&context);
  rtcOccluded16(valid.data(), embree_->scene, &context, &rays);
  std::array<bool, kPacket> result;
  for (int i = 0; i < kPacket; ++i) result[i] = rays.tfar[i] < 0;  // Embree's mark: minus infinity
  return result;
}

}  // namespace scanview
