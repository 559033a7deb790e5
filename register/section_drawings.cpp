#include "register/section_drawings.h"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <numbers>
#include <opencv2/imgproc.hpp>

#include "register/view_graph.h"

namespace scanview {
namespace {

constexpr int kSectionSide = 460;
constexpr int kGraphSide = 920;               // shown at half that
constexpr std::size_t kMostLabels = 36;       // around the graph
constexpr std::size_t kMostLines = 400;       // of the graph: more are a ball of wool
constexpr std::size_t kStrongest = 4;         // lines a view where there are more
constexpr int kObserverSide = 300;            // shown at half that
constexpr std::size_t kLongestShortName = 8;  // letters

cv::Scalar view_color(std::size_t view, std::size_t views) {
  cv::Mat3b pixel(1, 1, cv::Vec3b(static_cast<uchar>(180 * view / std::max<std::size_t>(1, views)), 220, 200));
  cv::cvtColor(pixel, pixel, cv::COLOR_HSV2BGR);
  return {static_cast<double>(pixel(0, 0)[0]), static_cast<double>(pixel(0, 0)[1]),
          static_cast<double>(pixel(0, 0)[2])};
}

// Green up to the usual distance, red at three times that, where a pair is doubted, or where it is for another reason.
cv::Scalar heat(PairFigures const& pair, double usual) {
  double const excess = pair.median_distance > usual ? (pair.median_distance / usual - 1) / 2 : 0;
  double const t = pair.suspicious ? 1 : std::clamp(excess, 0.0, 1.0);
  return {40, 190 * (1 - t) + 20, 60 + 190 * t};
}

// The plane a section is drawn in: through the object's middle, across the direction in which the cameras spread least,
// so that of a turntable it is level.
struct SectionPlane {
  Eigen::Vector3d origin, u, v, normal;
};

SectionPlane section_plane(ScanSet const& set, std::vector<Eigen::Isometry3d> const& poses) {
  std::vector<double> coordinates[3];
  for (std::size_t i = 0; i < set.views.size(); ++i) {
    RangeImage const& image = set.views[i].image;
    for (int y = 0; y < image.depth.rows; y += 4)
      for (int x = 0; x < image.depth.cols; x += 4)
        if (image.has_depth(x, y)) {
          Eigen::Vector3d const p = poses[i] * image.point(x, y);
          for (int k = 0; k < 3; ++k) coordinates[k].push_back(p[k]);
        }
  }
  SectionPlane plane;
  for (int k = 0; k < 3; ++k) {
    auto& c = coordinates[k];
    auto const middle = c.begin() + static_cast<std::ptrdiff_t>(c.size() / 2);
    std::nth_element(c.begin(), middle, c.end());
    plane.origin[k] = c.empty() ? 0 : *middle;
  }
  Eigen::Vector3d mean = Eigen::Vector3d::Zero();
  for (Eigen::Isometry3d const& pose : poses) mean += pose.linear().col(2) / static_cast<double>(poses.size());
  Eigen::Matrix3d spread = Eigen::Matrix3d::Zero();
  for (Eigen::Isometry3d const& pose : poses) {
    Eigen::Vector3d const d = pose.linear().col(2) - mean;
    spread += d * d.transpose();
  }
  Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> const axes(spread);
  bool const turns = axes.eigenvalues()[1] > 0.02 * static_cast<double>(poses.size());
  plane.normal = turns ? Eigen::Vector3d(axes.eigenvectors().col(0)) : Eigen::Vector3d(poses[0].linear().col(1));
  plane.u = (poses[0].linear().col(0) - plane.normal * plane.normal.dot(poses[0].linear().col(0))).normalized();
  if (!plane.u.allFinite() || plane.u.norm() < 0.5) plane.u = plane.normal.unitOrthogonal();
  plane.v = plane.normal.cross(plane.u);
  return plane;
}

struct SectionScale {
  double center_u = 0, center_v = 0, half = 1, slab = 0;
};

// Points of all views in a slab, as (u, v, view).
std::vector<cv::Point3d> slab_points(ScanSet const& set, std::vector<Eigen::Isometry3d> const& poses,
                                     SectionPlane const& plane, double slab) {
  std::vector<cv::Point3d> points;
  for (std::size_t i = 0; i < set.views.size(); ++i) {
    RangeImage const& image = set.views[i].image;
    for (int y = 0; y < image.depth.rows; ++y)
      for (int x = 0; x < image.depth.cols; ++x) {
        if (!image.has_depth(x, y)) continue;
        Eigen::Vector3d const p = poses[i] * image.point(x, y) - plane.origin;
        if (std::abs(p.dot(plane.normal)) <= slab)
          points.emplace_back(p.dot(plane.u), p.dot(plane.v), static_cast<double>(i));
      }
  }
  return points;
}

SectionScale section_scale(std::vector<cv::Point3d> const& points) {
  SectionScale scale;
  if (points.empty()) return scale;
  std::vector<double> us, vs;
  for (cv::Point3d const& p : points) {
    us.push_back(p.x);
    vs.push_back(p.y);
  }
  std::sort(us.begin(), us.end());
  std::sort(vs.begin(), vs.end());
  std::size_t const low = us.size() / 200, high = us.size() - 1 - low;
  scale.center_u = (us[low] + us[high]) / 2;
  scale.center_v = (vs[low] + vs[high]) / 2;
  scale.half = 0.55 * std::max({us[high] - us[low], vs[high] - vs[low], 1e-12});
  return scale;
}

cv::Mat3b draw_section(std::vector<cv::Point3d> const& points, SectionScale const& scale, std::size_t views) {
  cv::Mat3b picture(kSectionSide, kSectionSide, cv::Vec3b(255, 255, 255));
  for (cv::Point3d const& p : points) {
    int const x = static_cast<int>(std::lround((0.5 + (p.x - scale.center_u) / (2 * scale.half)) * kSectionSide));
    int const y = static_cast<int>(std::lround((0.5 + (p.y - scale.center_v) / (2 * scale.half)) * kSectionSide));
    if (x < 0 || y < 0 || x >= kSectionSide || y >= kSectionSide) continue;
    cv::Scalar const color = view_color(static_cast<std::size_t>(p.z), views);
    picture(y, x) = cv::Vec3b(static_cast<uchar>(color[0]), static_cast<uchar>(color[1]), static_cast<uchar>(color[2]));
  }
  return picture;
}

// The lines of the graph, the reddest on top.
std::vector<PairFigures> lines_to_draw(std::size_t views, Alignment const& alignment, double usual) {
  std::vector<PairFigures> lines = alignment.pairs;
  if (lines.size() > kMostLines) {
    std::vector<ViewGraphEdge> edges;
    for (PairFigures const& pair : lines) edges.push_back({pair.a, pair.b, pair.overlap, pair.overlap});
    auto const strongest = strongest_edges(views, edges, kStrongest);
    std::erase_if(lines, [&](PairFigures const& pair) {
      return !pair.suspicious && pair.median_distance < 3 * usual &&
             std::none_of(strongest.begin(), strongest.end(),
                          [&](ViewGraphEdge const& e) { return e.a == pair.a && e.b == pair.b; });
    });
  }
  std::stable_sort(lines.begin(), lines.end(), [](PairFigures const& l, PairFigures const& r) {
    return std::pair(l.suspicious, l.median_distance) < std::pair(r.suspicious, r.median_distance);
  });
  return lines;
}

}  // namespace

std::vector<std::string> short_names(ScanSet const& set) {
  std::vector<std::string> names;
  for (View const& view : set.views) names.push_back(view.name);
  if (names.size() < 2) return names;
  std::size_t common = names[0].size();
  for (std::string const& name : names) {
    auto const end = std::mismatch(names[0].begin(), names[0].end(), name.begin(), name.end()).first;
    common = std::min(common, static_cast<std::size_t>(end - names[0].begin()));
  }
  // A number stays whole.
  while (common > 0 && std::isdigit(static_cast<unsigned char>(names[0][common - 1]))) --common;
  for (std::string& name : names) {
    if (common > 0 && name.size() > common) name.erase(0, common);
    if (name.size() > kLongestShortName) name.erase(0, name.size() - kLongestShortName);
  }
  return names;
}

CrossSections draw_cross_sections(ScanSet const& set, std::vector<Eigen::Isometry3d> const& before,
                                  std::vector<Eigen::Isometry3d> const& after, double slab) {
  SectionPlane const plane = section_plane(set, after);
  auto const points = slab_points(set, after, plane, slab);
  SectionScale const scale = section_scale(points);
  std::size_t const views = set.views.size();
  return {draw_section(slab_points(set, before, plane, slab), scale, views), draw_section(points, scale, views),
          2 * scale.half};
}

cv::Mat3b draw_overlap_graph(ScanSet const& set, Alignment const& alignment, double usual) {
  cv::Mat3b picture(kGraphSide, kGraphSide, cv::Vec3b(255, 255, 255));
  std::size_t const n = set.views.size();
  constexpr double kRing = 0.37;  // of the side: outside it the names need room
  auto const place = [&](std::size_t i, double radius) {
    double const angle = 2 * std::numbers::pi * static_cast<double>(i) / static_cast<double>(n);
    return cv::Point(static_cast<int>(std::lround(kGraphSide * (0.5 + radius * std::sin(angle)))),
                     static_cast<int>(std::lround(kGraphSide * (0.5 - radius * std::cos(angle)))));
  };
  for (PairFigures const& pair : lines_to_draw(n, alignment, usual))
    cv::line(picture, place(pair.a, kRing), place(pair.b, kRing), heat(pair, usual),
             n > kMostLabels ? 1 : 1 + static_cast<int>(std::lround(8 * pair.overlap)), cv::LINE_AA);
  auto const names = short_names(set);
  double const spacing = 2 * std::numbers::pi * kRing * kGraphSide / static_cast<double>(n);
  int const dot = std::clamp(static_cast<int>(0.4 * spacing), 4, 18);
  std::size_t const every = (n + kMostLabels - 1) / kMostLabels;
  for (std::size_t i = 0; i < n; ++i) {
    cv::circle(picture, place(i, kRing), dot, view_color(i, n), cv::FILLED, cv::LINE_AA);
    if (i % every != 0 || n - i < every) continue;  // the last would lie on the first
    constexpr double kLetter = 0.6;
    cv::Size const size = cv::getTextSize(names[i], cv::FONT_HERSHEY_SIMPLEX, kLetter, 1, nullptr);
    cv::putText(picture, names[i], place(i, kRing + 0.07) + cv::Point(-size.width / 2, size.height / 2),
                cv::FONT_HERSHEY_SIMPLEX, kLetter, {0, 0, 0}, 1, cv::LINE_AA);
  }
  return picture;
}

cv::Mat3b draw_pair_matrix(Alignment const& alignment, std::size_t views, double usual) {
  int const n = static_cast<int>(views), cell = std::clamp(kSectionSide / std::max(1, n), 2, 60);
  cv::Mat3b picture(cell * n, cell * n, cv::Vec3b(235, 235, 235));
  for (PairFigures const& pair : alignment.pairs)
    for (auto const& [r, c] : {std::pair{pair.a, pair.b}, {pair.b, pair.a}})
      cv::rectangle(picture, cv::Rect(static_cast<int>(c) * cell, static_cast<int>(r) * cell, cell, cell),
                    heat(pair, usual), cv::FILLED);
  return picture;
}

cv::Vec3b observer_color(int count, int most) {
  if (count <= 0) return {50, 40, 220};
  double const t = most > 1 ? static_cast<double>(std::min(count, most) - 1) / (most - 1) : 1;
  cv::Mat1b value(1, 1, cv::saturate_cast<uchar>(30 + 225 * t));
  cv::Mat3b color;
  cv::applyColorMap(value, color, cv::COLORMAP_VIRIDIS);
  return color(0, 0);
}

cv::Mat3b draw_observers(Observers const& observers, int most) {
  std::vector<cv::Vec3b> colors;
  for (int count = 0; count <= most; ++count) colors.push_back(observer_color(count, most));
  cv::Mat3b picture(observers.counts.size(), cv::Vec3b(225, 225, 225));
  for (int y = 0; y < picture.rows; ++y)
    for (int x = 0; x < picture.cols; ++x)
      if (int const count = observers.counts(y, x); count >= 0)
        picture(y, x) = colors[static_cast<std::size_t>(std::min(count, most))];
  // Every picture is as large on the page, however few pixels it has.
  double const scale = static_cast<double>(kObserverSide) / std::max(picture.rows, picture.cols);
  cv::resize(picture, picture, {}, scale, scale, cv::INTER_NEAREST);
  return picture;
}

}  // namespace scanview
