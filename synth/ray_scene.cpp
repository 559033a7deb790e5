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

void set_ray(RTCRay16& rays, int i, Vector3f const& origin, Vector3f const& direction, float nearest, float farthest) {
  rays.org_x[i] = origin.x();
  rays.org_y[i] = origin.y();
  rays.org_z[i] = origin.z();
  rays.dir_x[i] = direction.x();
  rays.dir_y[i] = direction.y();
  rays.dir_z[i] = direction.z();
  rays.tnear[i] = nearest;
  rays.tfar[i] = farthest;
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

/// The point of the triangle nearest to p: inside it, or on the edge or corner whose region p is in (Ericson 2005,
/// section 5.1.5).
Vector3f nearest_of_triangle(Vector3f const& p, Vector3f const& a, Vector3f const& b, Vector3f const& c) {
  Vector3f const ab = b - a, ac = c - a;
  float const d1 = ab.dot(p - a), d2 = ac.dot(p - a);
  if (d1 <= 0 && d2 <= 0) return a;
  float const d3 = ab.dot(p - b), d4 = ac.dot(p - b);
  if (d3 >= 0 && d4 <= d3) return b;
  float const vc = d1 * d4 - d3 * d2;
  if (vc <= 0 && d1 >= 0 && d3 <= 0) return a + d1 / (d1 - d3) * ab;
  float const d5 = ab.dot(p - c), d6 = ac.dot(p - c);
  if (d6 >= 0 && d5 <= d6) return c;
  float const vb = d5 * d2 - d1 * d6;
  if (vb <= 0 && d2 >= 0 && d6 <= 0) return a + d2 / (d2 - d6) * ac;
  float const va = d3 * d6 - d5 * d4;
  if (va <= 0 && d4 >= d3 && d5 >= d6) return b + (d4 - d3) / ((d4 - d3) + (d5 - d6)) * (c - b);
  return a + vb / (va + vb + vc) * ab + vc / (va + vb + vc) * ac;
}

struct NearestQuery {
  Vector3f const* vertices;
  Eigen::Vector3i const* triangles;
  Vector3f point;
};

bool shrink_to_triangle(RTCPointQueryFunctionArguments* arguments) {
  auto const& query = *static_cast<NearestQuery const*>(arguments->userPtr);
  Eigen::Vector3i const& t = query.triangles[arguments->primID];
  float const distance =
      (nearest_of_triangle(query.point, query.vertices[t[0]], query.vertices[t[1]], query.vertices[t[2]]) - query.point)
          .norm();
  if (!(distance < arguments->query->radius)) return false;
  arguments->query->radius = distance;
  return true;
}

}  // namespace

struct RayScene::Embree {
  RTCDevice device = nullptr;
  RTCScene scene = nullptr;
  Vector3f const* vertices = nullptr;  ///< in buffers of the scene
  Eigen::Vector3i const* triangles = nullptr;
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
  embree_->vertices = static_cast<Vector3f const*>(points);
  embree_->triangles = static_cast<Eigen::Vector3i const*>(corners);
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
    if (i < count) set_ray(query.ray, i, origins[i], directions[i], nearest, kFar);
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
                                             RayDirections const& directions, int count, float nearest,
                                             float farthest) const {
  RTCRay16 rays;
  alignas(64) std::array<int, kPacket> valid;
  for (int i = 0; i < kPacket; ++i) {
    valid[i] = i < count ? -1 : 0;
    set_ray(rays, i, origins[i], directions[i], nearest, farthest);
  }
  RTCIntersectContext context;
  rtcInitIntersectContext(&context);
  rtcOccluded16(valid.data(), embree_->scene, &context, &rays);
  std::array<bool, kPacket> result;
  for (int i = 0; i < kPacket; ++i) result[i] = rays.tfar[i] < 0;  // Embree's mark: minus infinity
  return result;
}

float RayScene::distance(Vector3f const& point, float farthest) const {
  NearestQuery nearest{embree_->vertices, embree_->triangles, point};
  RTCPointQuery query{point.x(), point.y(), point.z(), 0, farthest};
  RTCPointQueryContext context;
  rtcInitPointQueryContext(&context);
  rtcPointQuery(embree_->scene, &query, &context, shrink_to_triangle, &nearest);
  return query.radius;
}

}  // namespace scanview
