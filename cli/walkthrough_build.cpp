#include "cli/walkthrough_build.h"

#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <cmath>

#include "base/error.h"
#include "base/median.h"
#include "mesh/node_mesh_file.h"
#include "viewer/walkthrough/walkthrough_file.h"

namespace scanview {
namespace {

double seconds_from(std::chrono::steady_clock::time_point start) {
  return std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
}

/// Half of the median distance from a node to the one nearest to it; of a single node a quarter of its median depth.
double default_radius(std::vector<Eigen::Vector3d> const& positions, CapturedNode const& first) {
  std::vector<double> distances;
  for (std::size_t i = 0; i < positions.size(); ++i) {
    double nearest = INFINITY;
    for (std::size_t j = 0; j < positions.size(); ++j)
      if (j != i && (positions[i] - positions[j]).norm() > 0)
        nearest = std::min(nearest, (positions[i] - positions[j]).norm());
    if (std::isfinite(nearest)) distances.push_back(nearest);
  }
  if (!distances.empty()) return 0.5 * median(distances);
  std::vector<double> depths;
  for (View const& side : first.sides)
    for (int y = 0; y < side.image.depth.rows; y += 4)
      for (int x = 0; x < side.image.depth.cols; x += 4)
        if (side.image.has_depth(x, y)) depths.push_back(side.image.depth(y, x));
  if (depths.empty()) throw Error(ErrorCode::bad_input, {}, "node " + first.name + " has no depth at all");
  return 0.25 * median(depths);
}

}  // namespace

Json build_walkthrough(NodeSource& scene, std::filesystem::path const& output, WalkthroughBuildOptions const& options,
                       Context& context) {
  if (scene.count() == 0) throw Error(ErrorCode::bad_input, {}, "the scene has no nodes");
  NodeMeshOptions mesh = options.mesh;
  scene.adjust(mesh);
  WalkthroughManifest manifest;
  manifest.unit = scene.unit();
  manifest.up = scene.up();
  manifest.walk = scene.walk();
  std::vector<Eigen::Vector3d> const positions = scene.positions();
  NewFolder folder(output);
  std::vector<double> focal_lengths, build_seconds, capture_seconds;
  for (std::size_t n = 0; n < scene.count(); ++n) {
    context.check_cancelled();
    auto const capturing = std::chrono::steady_clock::now();
    CapturedNode captured = scene.capture(n, context);
    capture_seconds.push_back(seconds_from(capturing));
    if (!(mesh.walking_radius > 0)) mesh.walking_radius = default_radius(positions, captured);
    WalkthroughManifest::Node node;
    node.name = captured.name;
    node.position = captured.position;
    NodeMeshOptions of_level = mesh;
    for (int level = 0; level < options.levels; ++level) {
      if (level > 0) {
        captured = half_resolution(captured);
        of_level.max_triangles = std::max(of_level.max_triangles / 4, of_level.max_triangles > 0 ? 1 : 0);
      }
      auto const building = std::chrono::steady_clock::now();
      NodeMesh const simplified = mesh_node(captured, of_level, context);
      if (level == 0) {
        build_seconds.push_back(seconds_from(building));
        node.triangles = simplified.triangles.size();
        node.parallax_px = simplified.parallax_px;
        for (NodeMesh::Side const& side : simplified.sides) focal_lengths.push_back(side.camera.fx());
      }
      node.levels.push_back(fmt::format("nodes/{}/{}", node.name, level));
      std::filesystem::path const to = folder.path() / node.levels.back();
      std::filesystem::create_directories(to.parent_path());
      write_node_mesh(to, simplified);
    }
    manifest.nodes.push_back(std::move(node));
    context.progress("nodes", n + 1, scene.count());
  }
  manifest.walking_radius = mesh.walking_radius;
  manifest.focal_length = median(focal_lengths);
  write_walkthrough(folder.path(), manifest);
  folder.commit();

  Json figures = {{"nodes", Json::array()},
                  {"triangles", 0},
                  {"walking_radius", manifest.walking_radius},
                  {"capture_seconds", median(capture_seconds)},
                  {"build_seconds", median(build_seconds)}};
  std::size_t triangles = 0;
  for (std::size_t n = 0; n < manifest.nodes.size(); ++n) {
    WalkthroughManifest::Node const& node = manifest.nodes[n];
    triangles += node.triangles;
    figures["nodes"].push_back({{"name", node.name},
                                {"position", {node.position.x(), node.position.y(), node.position.z()}},
                                {"triangles", node.triangles},
                                {"parallax_px", node.parallax_px},
                                {"build_seconds", build_seconds[n]}});
  }
  figures["triangles"] = triangles;
  if (Json placement = scene.placement(); !placement.is_null()) figures["placement"] = std::move(placement);
  return figures;
}

}  // namespace scanview
