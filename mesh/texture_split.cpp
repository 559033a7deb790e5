#include "mesh/texture_split.h"

#include <algorithm>
#include <cmath>
#include <unordered_map>

namespace scanview {
namespace {

class EdgeSplitter {
 public:
  EdgeSplitter(Camera const& camera, TriangleMesh& mesh, double tolerance_px)
      : camera_(camera), mesh_(mesh), tolerance_px_(tolerance_px) {}

  /// One round; false where nothing was split.
  bool run() {
    middles_.clear();
    std::vector<Eigen::Vector3i> triangles;
    for (Eigen::Vector3i const& t : mesh_.triangles) {
      int middle[3];  // of the edge from corner i to the next
      int count = 0, split = 0, whole = 0;
      for (int i = 0; i < 3; ++i) {
        middle[i] = middle_of(t[i], t[(i + 1) % 3]);
        count += middle[i] >= 0;
        (middle[i] >= 0 ? split : whole) = i;
      }
      if (count == 0) {
        triangles.push_back(t);
      } else if (count == 3) {
        for (int i = 0; i < 3; ++i) triangles.emplace_back(t[i], middle[i], middle[(i + 2) % 3]);
        triangles.emplace_back(middle[0], middle[1], middle[2]);
      } else {
        // One edge, or the two that follow the one that stays whole.
        int const first = count == 1 ? split : (whole + 1) % 3;
        int const a = t[first], b = t[(first + 1) % 3], c = t[(first + 2) % 3];
        int const m = middle[first], n = middle[(first + 1) % 3];
        triangles.emplace_back(m, b, n < 0 ? c : n);
        if (n >= 0) triangles.emplace_back(m, n, c);
        triangles.emplace_back(a, m, c);
      }
    }
    mesh_.triangles = std::move(triangles);
    return !middles_.empty();
  }

 private:
  /// The vertex in the middle of an edge that is too far off; −1 where it need not be split.
  int middle_of(int a, int b) {
    if (a > b) std::swap(a, b);
    auto const key = std::uint64_t(a) << 32 | std::uint64_t(b);
    if (auto const known = middles_.find(key); known != middles_.end()) return known->second;
    Eigen::Vector3d const p = mesh_.vertices[a].cast<double>(), q = mesh_.vertices[b].cast<double>();
    double const length = (camera_.project(p) - camera_.project(q)).norm();
    double const root = std::sqrt(std::max(p.z(), q.z()) / std::min(p.z(), q.z()));
    if (!(length * (root - 1) / (root + 1) > tolerance_px_ / 2)) return -1;
    mesh_.vertices.push_back(((p + q) / 2).cast<float>());
    return middles_[key] = int(mesh_.vertices.size()) - 1;
  }

  Camera const& camera_;
  TriangleMesh& mesh_;
  double tolerance_px_;
  std::unordered_map<std::uint64_t, int> middles_;
};

}  // namespace

TriangleMesh split_for_plain_texture(Camera const& camera, TriangleMesh const& mesh, double tolerance_px) {
  TriangleMesh result;
  result.vertices = mesh.vertices;
  result.triangles = mesh.triangles;
  if (!camera.is_perspective()) return result;
  // A round takes an edge's error to about a quarter: sixteen suffice for any picture.
  EdgeSplitter splitter(camera, result, tolerance_px);
  for (int round = 0; round < 16 && splitter.run(); ++round) {
  }
  return result;
}

}  // namespace scanview
