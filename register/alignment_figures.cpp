#include "register/alignment_figures.h"

#include <algorithm>
#include <cmath>

#include "base/parallel.h"

namespace scanview {
namespace {

constexpr double kMinNormalCosine = 0.34;

struct OneWay {
  std::size_t asked = 0;
  std::vector<float> distances;
};

OneWay measure_one_way(RangeImage const& image, ViewSurface const& from, ViewSurface const& to,
                       Eigen::Isometry3d const& to_from_from, double gate) {
  OneWay result;
  for (SurfaceSample const& sample : from.samples) {
    ++result.asked;
    Eigen::Vector3d const raw = image.has_depth(sample.x, sample.y) ? image.point(sample.x, sample.y) : sample.point;
    auto const distance = distance_to_surface(to, to_from_from * raw, to_from_from.linear() * sample.normal, gate);
    if (distance) result.distances.push_back(static_cast<float>(*distance));
  }
  return result;
}

double share(std::size_t part, std::size_t whole) {
  return whole > 0 ? static_cast<double>(part) / static_cast<double>(whole) : 0;
}

}  // namespace

std::optional<double> distance_to_surface(ViewSurface const& to, Eigen::Vector3d const& point,
                                          Eigen::Vector3d const& normal, double gate) {
  SurfaceHit hit;
  if (!look_up(to, point, hit)) return std::nullopt;
  if (normal.dot(hit.normal) < kMinNormalCosine) return std::nullopt;
  if (std::abs(point.z() - hit.point.z()) > gate) return std::nullopt;
  return hit.normal.dot(point - hit.point);
}

std::vector<PairDistances> measure_pairs(ScanSet const& set, std::vector<SurfacePyramid> const& views,
                                         std::vector<ViewGraphEdge> const& edges,
                                         std::vector<Eigen::Isometry3d> const& poses, double gate, Context& context) {
  std::vector<PairDistances> result(edges.size());
  for_each_index(context, edges.size(), [&](std::size_t e) {
    std::size_t const a = edges[e].a, b = edges[e].b;
    Eigen::Isometry3d const b_from_a = poses[b].inverse() * poses[a];
    ViewSurface const &surface_a = views[a].levels[0], &surface_b = views[b].levels[0];
    OneWay const ab = measure_one_way(set.views[a].image, surface_a, surface_b, b_from_a, gate);
    OneWay const ba = measure_one_way(set.views[b].image, surface_b, surface_a, b_from_a.inverse(), gate);
    PairDistances& pair = result[e];
    pair.figures.a = a;
    pair.figures.b = b;
    pair.figures.overlap = share(ab.distances.size(), ab.asked);
    pair.distances = ab.distances;
    pair.distances.insert(pair.distances.end(), ba.distances.begin(), ba.distances.end());
    if (pair.distances.empty()) return;
    double squares = 0;
    for (float d : pair.distances) squares += static_cast<double>(d) * d;
    pair.figures.rms = std::sqrt(squares / static_cast<double>(pair.distances.size()));
    std::vector<float> absolute = pair.distances;
    double const scale = robust_scale(absolute);
    pair.figures.median_distance = scale / 1.4826;
    std::size_t inliers = 0;
    for (float d : pair.distances)
      if (std::abs(d) <= 3 * scale) ++inliers;
    pair.figures.inliers = share(inliers, pair.distances.size());
  });
  return result;
}

ErrorPart overall_error(std::vector<PairDistances> const& pairs) {
  std::vector<float> all;
  double squares = 0;
  for (PairDistances const& pair : pairs)
    for (float d : pair.distances) {
      all.push_back(std::abs(d));
      squares += static_cast<double>(d) * d;
    }
  ErrorPart error;
  if (all.empty()) return error;
  error.rms = std::sqrt(squares / static_cast<double>(all.size()));
  auto const at = all.begin() + static_cast<std::ptrdiff_t>((all.size() - 1) * 95 / 100);
  std::nth_element(all.begin(), at, all.end());
  error.p95 = *at;
  return error;
}

}  // namespace scanview
