#include "viewer/visibility/visibility_check.h"

#include <tbb/enumerable_thread_specific.h>

#include <algorithm>
#include <numeric>

#include "base/parallel.h"
#include "base/random.h"

namespace scanview {
namespace {

RasterMesh numbered(TriangleMesh const& mesh) {
  std::vector<std::uint32_t> labels(mesh.triangles.size());
  std::iota(labels.begin(), labels.end(), 0U);
  return raster_mesh(mesh, std::move(labels));
}

Eigen::AlignedBox3d bounds_of(TriangleMesh const& mesh) {
  Eigen::AlignedBox3d bounds;
  for (auto const& vertex : mesh.vertices) bounds.extend(vertex.cast<double>());
  return bounds;
}

void mark(std::span<IndexRange const> ranges, std::vector<std::uint8_t>& is_drawn) {
  std::fill(is_drawn.begin(), is_drawn.end(), 0);
  for (IndexRange const& range : ranges) std::fill_n(is_drawn.begin() + range.first, range.count, std::uint8_t{1});
}

}  // namespace

std::vector<Eigen::Vector3d> unseen_eyes(VisibilityField const& field, std::size_t count, double nearest,
                                         double farthest, std::uint64_t seed) {
  std::vector<Eigen::Vector3d> eyes;
  for (std::size_t i = 0; i < count; ++i) {
    CounterRandom random(seed, i);
    Eigen::Vector3d const direction = Eigen::Vector3d(random.normal(), random.normal(), random.normal()).normalized();
    eyes.push_back(field.center + direction * field.radius * (nearest + (farthest - nearest) * random.uniform()));
  }
  return eyes;
}

SampleCamera eye_camera(VisibilityField const& field, Eigen::Vector3d const& eye, int resolution) {
  Eigen::Vector3d const from_center = eye - field.center;
  return ball_camera(field.center, field.radius, from_center, from_center.norm() / field.radius, resolution);
}

VisibilityFigures check_visibility(VisibilityField const& field, TriangleMesh const& drawn,
                                   std::vector<std::int32_t> const& polygons, bool facing,
                                   std::vector<Eigen::Vector3d> const& eyes, int resolution, Context& context) {
  struct Worker {
    TriangleSampler sampler;
    VisibilitySelector selector;
    std::vector<std::uint8_t> is_drawn, polygon;
  };
  RasterMesh const raster = numbered(drawn);
  TrianglePlanes const planes(drawn, field.center, field.radius);
  Eigen::AlignedBox3d const bounds = bounds_of(drawn);
  std::size_t const count = polygons.empty() ? drawn.triangles.size() : static_cast<std::size_t>(polygons.back()) + 1;
  tbb::enumerable_thread_specific<Worker> workers([&] {
    return Worker{TriangleSampler(raster, planes, bounds),
                  VisibilitySelector(field, drawn, facing),
                  std::vector<std::uint8_t>(drawn.triangles.size()),
                  {}};
  });
  struct One {
    double culled = 0, visible = 0, ranges = 0, patches = 0;
    std::size_t wrong = 0;
  };
  std::vector<One> each(eyes.size());
  for_each_index(
      context, eyes.size(),
      [&](std::size_t e) {
        Worker& worker = workers.local();
        One& one = each[e];
        SampleCamera const camera = eye_camera(field, eyes[e], resolution);
        auto const ranges = worker.selector.select(eyes[e]);
        one.ranges = static_cast<double>(ranges.size());
        one.patches = static_cast<double>(worker.selector.patches());
        mark(ranges, worker.is_drawn);
        // A polygon is drawn, or seen, if a triangle of it is.
        auto const share = [&](auto const& holds) {
          worker.polygon.assign(count, 0);
          for (std::size_t i = 0; i < drawn.triangles.size(); ++i) {
            std::uint32_t const original = field.patches.triangles[i];
            if (holds(i))
              worker.polygon[polygons.empty() ? original : static_cast<std::size_t>(polygons[original])] = 1;
          }
          return static_cast<double>(std::count(worker.polygon.begin(), worker.polygon.end(), 1)) /
                 static_cast<double>(count);
        };
        one.culled = 1 - share([&](std::size_t i) { return worker.is_drawn[i] != 0; });
        SeenTriangles const& seen = worker.sampler.sample(camera, Seen::in_picture);
        one.visible =
            share([&](std::size_t i) { return ((seen.front[i / 64] | seen.back[i / 64]) >> (i % 64) & 1) != 0; });
        // What is nearest stays nearest: only pixels whose triangle is not drawn can differ.
        worker.sampler.for_each_pixel([&](int, int, std::uint32_t triangle) {
          if (worker.is_drawn[triangle] == 0) ++one.wrong;
        });
      },
      "checking");
  VisibilityFigures figures;
  for (std::size_t e = 0; e < each.size(); ++e) {
    auto const n = static_cast<double>(each.size());
    figures.culling_rate += each[e].culled / n;
    figures.visible += each[e].visible / n;
    figures.ranges += each[e].ranges / n;
    figures.patches += each[e].patches / n;
    figures.wrong_pixels += each[e].wrong;
  }
  figures.pixels = eyes.size() * static_cast<std::size_t>(resolution) * static_cast<std::size_t>(resolution);
  return figures;
}

namespace {

/// Calls use(x, y, triangle, grey value) for each pixel.
template <typename Use>
cv::Mat3b shaded(TriangleMesh const& mesh, SampleCamera const& camera, Use const& color) {
  RasterMesh const raster = numbered(mesh);
  Eigen::AlignedBox3d const bounds = bounds_of(mesh);
  cv::Mat3b picture(camera.camera.height(), camera.camera.width(), cv::Vec3b(255, 255, 255));
  if (mesh.triangles.empty()) return picture;
  TrianglePlanes const planes(mesh, bounds.center(), std::max(bounds.diagonal().norm() / 2, 1e-30));
  TriangleSampler sampler(raster, planes, bounds);
  sampler.sample(camera, Seen::in_picture);
  EyePoint const eye = planes.eye(camera);
  sampler.for_each_pixel([&](int x, int y, std::uint32_t triangle) {
    float const light = std::min(1.0F, std::abs(planes.cosine(triangle, eye)));
    picture(y, x) = color(triangle, static_cast<std::uint8_t>(40 + 200 * light));
  });
  return picture;
}

}  // namespace

MissedPixels missed_pixels(TriangleMesh const& drawn, std::span<IndexRange const> ranges, SampleCamera const& camera) {
  std::vector<std::uint8_t> is_drawn(drawn.triangles.size());
  mark(ranges, is_drawn);
  MissedPixels result;
  result.picture = shaded(drawn, camera, [&](std::uint32_t triangle, std::uint8_t grey) {
    if (is_drawn[triangle] != 0) return cv::Vec3b(grey, grey, grey);
    ++result.count;
    return cv::Vec3b(0, 0, 255);
  });
  return result;
}

cv::Mat3b selection_picture(TriangleMesh const& drawn, std::span<IndexRange const> ranges, SampleCamera const& camera) {
  TriangleMesh part;
  part.vertices = drawn.vertices;
  for (IndexRange const& range : ranges)
    part.triangles.insert(part.triangles.end(), drawn.triangles.begin() + range.first,
                          drawn.triangles.begin() + range.first + range.count);
  return shaded(part, camera, [](std::uint32_t, std::uint8_t grey) { return cv::Vec3b(grey, grey, grey); });
}

}  // namespace scanview
