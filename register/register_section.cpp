#include <fmt/format.h>

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <numbers>
#include <opencv2/imgproc.hpp>

#include "base/parallel.h"
#include "register/alignment.h"
#include "register/alignment_figures.h"

namespace scanview {
namespace {

constexpr int kPictureSide = 460;
constexpr int kBins = 61;

cv::Scalar view_color(std::size_t view, std::size_t views) {
  cv::Mat3b pixel(1, 1, cv::Vec3b(static_cast<uchar>(180 * view / std::max<std::size_t>(1, views)), 220, 200));
  cv::cvtColor(pixel, pixel, cv::COLOR_HSV2BGR);
  return {static_cast<double>(pixel(0, 0)[0]), static_cast<double>(pixel(0, 0)[1]),
          static_cast<double>(pixel(0, 0)[2])};
}

// Green where a value is 0, red where it is `worst` or more.
cv::Scalar heat(double value, double worst) {
  double const t = worst > 0 ? std::clamp(value / worst, 0.0, 1.0) : 0;
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
  cv::Mat3b picture(kPictureSide, kPictureSide, cv::Vec3b(255, 255, 255));
  for (cv::Point3d const& p : points) {
    int const x = static_cast<int>(std::lround((0.5 + (p.x - scale.center_u) / (2 * scale.half)) * kPictureSide));
    int const y = static_cast<int>(std::lround((0.5 + (p.y - scale.center_v) / (2 * scale.half)) * kPictureSide));
    if (x < 0 || y < 0 || x >= kPictureSide || y >= kPictureSide) continue;
    cv::Scalar const color = view_color(static_cast<std::size_t>(p.z), views);
    picture(y, x) = cv::Vec3b(static_cast<uchar>(color[0]), static_cast<uchar>(color[1]), static_cast<uchar>(color[2]));
  }
  return picture;
}

cv::Mat3b draw_graph(ScanSet const& set, Alignment const& alignment, double worst) {
  cv::Mat3b picture(kPictureSide, kPictureSide, cv::Vec3b(255, 255, 255));
  std::size_t const n = set.views.size();
  auto const place = [&](std::size_t i) {
    double const angle = 2 * std::numbers::pi * static_cast<double>(i) / static_cast<double>(n);
    return cv::Point(static_cast<int>(std::lround(kPictureSide * (0.5 + 0.42 * std::sin(angle)))),
                     static_cast<int>(std::lround(kPictureSide * (0.5 - 0.42 * std::cos(angle)))));
  };
  for (PairFigures const& pair : alignment.pairs)
    cv::line(picture, place(pair.a), place(pair.b), heat(pair.median_distance, worst),
             1 + static_cast<int>(std::lround(4 * pair.overlap)), cv::LINE_AA);
  for (std::size_t i = 0; i < n; ++i) {
    cv::circle(picture, place(i), 14, view_color(i, n), cv::FILLED, cv::LINE_AA);
    cv::putText(picture, set.views[i].name.substr(0, 6), place(i) + cv::Point(-12, 4), cv::FONT_HERSHEY_SIMPLEX, 0.36,
                {0, 0, 0}, 1, cv::LINE_AA);
  }
  return picture;
}

cv::Mat3b draw_matrix(Alignment const& alignment, std::size_t n, double worst) {
  int const cell = std::clamp(kPictureSide / std::max(1, static_cast<int>(n)), 2, 40);
  cv::Mat3b picture(cell * static_cast<int>(n), cell * static_cast<int>(n), cv::Vec3b(235, 235, 235));
  for (PairFigures const& pair : alignment.pairs)
    for (auto const& [r, c] : {std::pair{pair.a, pair.b}, {pair.b, pair.a}})
      cv::rectangle(picture, cv::Rect(static_cast<int>(c) * cell, static_cast<int>(r) * cell, cell, cell),
                    heat(pair.median_distance, worst), cv::FILLED);
  return picture;
}

PlotCurve histogram(std::vector<PairDistances> const& pairs, double reach, std::string name, std::string color) {
  std::vector<double> bins(kBins, 0);
  double count = 0;
  for (PairDistances const& pair : pairs)
    for (float d : pair.distances) {
      auto const bin = static_cast<int>(std::floor((d / reach + 1) / 2 * kBins));
      if (bin >= 0 && bin < kBins) bins[static_cast<std::size_t>(bin)] += 1;
      count += 1;
    }
  PlotCurve curve{std::move(name), {}, std::move(color), false};
  for (int k = 0; k < kBins; ++k)
    curve.points.emplace_back(((k + 0.5) / kBins * 2 - 1) * reach,
                              count > 0 ? 100 * bins[static_cast<std::size_t>(k)] / count : 0);
  return curve;
}

std::string figures_table(ScanSet const& set, Alignment const& alignment, std::vector<PairDistances> const& before) {
  std::string const unit = to_string(set.unit);
  std::vector<std::vector<std::string>> rows{{"view", "view", "overlap %", "median before (" + unit + ")",
                                              "median after (" + unit + ")", "RMS after (" + unit + ")", "inliers %",
                                              "remark"}};
  for (std::size_t k = 0; k < alignment.pairs.size(); ++k) {
    PairFigures const& pair = alignment.pairs[k];
    rows.push_back(
        {set.views[pair.a].name, set.views[pair.b].name, fmt::format("{:.0f}", 100 * pair.overlap),
         before[k].distances.empty() ? "no overlap" : fmt::format("{:.3g}", before[k].figures.median_distance),
         fmt::format("{:.3g}", pair.median_distance), fmt::format("{:.3g}", pair.rms),
         fmt::format("{:.0f}", 100 * pair.inliers), pair.suspicious ? "suspicious" : ""});
  }
  return html_table(rows);
}

std::string poses_table(ScanSet const& set, Alignment const& alignment) {
  std::vector<std::vector<std::string>> rows{
      {"view", "rotation, standard deviation (deg)", "place, standard deviation (" + to_string(set.unit) + ")"}};
  for (std::size_t i = 0; i < set.views.size(); ++i)
    rows.push_back({set.views[i].name, fmt::format("{:.3g}", alignment.poses[i].std_deg),
                    fmt::format("{:.3g}", alignment.poses[i].std_length)});
  return html_table(rows);
}

std::string status_sentence(ScanSet const& set, Alignment const& alignment) {
  std::string text;
  switch (alignment.status) {
    case AlignmentStatus::converged:
      text = "The views settled";
      break;
    case AlignmentStatus::not_converged:
      text = "The views were not refined, or did not settle";
      break;
    case AlignmentStatus::disconnected:
      text = "The views fall into parts that nothing joins";
      break;
  }
  text += fmt::format(" after {} joint refinements over {} overlapping pairs.", alignment.iterations,
                      alignment.pairs.size());
  if (std::isfinite(alignment.error.rms))
    text += fmt::format(" Distance between overlapping surfaces: {:.3g} {} RMS, {:.3g} {} at the 95th percentile.",
                        alignment.error.rms, to_string(set.unit), alignment.error.p95, to_string(set.unit));
  for (std::string const& motion : alignment.unobservable) text += " Not held by the data: " + motion + ".";
  return "<p>" + html_escape(text) + "</p>";
}

}  // namespace

ReportSection register_section(ScanSet const& set, std::vector<Eigen::Isometry3d> const& before,
                               Alignment const& alignment) {
  ReportSection section{"register", "Registration", status_sentence(set, alignment)};
  if (set.views.empty() || before.size() != set.views.size()) return section;
  Context context;
  std::vector<SurfacePyramid> views(set.views.size());
  for_each_index(context, views.size(), [&](std::size_t i) {
    views[i] = build_pyramid(set.views[i].image, {1, 12000});
  });
  double radius = 0;
  for (SurfacePyramid const& view : views) radius = std::max(radius, view.radius);

  SectionPlane const plane = section_plane(set, alignment.object_from_camera);
  double const slab = 0.015 * radius;
  auto const after_points = slab_points(set, alignment.object_from_camera, plane, slab);
  SectionScale const scale = section_scale(after_points);
  std::string const width = fmt::format("{:.3g} {} wide", 2 * scale.half, to_string(set.unit));
  section.html +=
      html_row({html_png(draw_section(slab_points(set, before, plane, slab), scale, set.views.size()),
                         "Cross-section before, a colour a view, " + width, kPictureSide),
                html_png(draw_section(after_points, scale, set.views.size()), "The same section after", kPictureSide)});

  std::vector<ViewGraphEdge> edges;
  double worst = 0;
  for (PairFigures const& pair : alignment.pairs) {
    edges.push_back({pair.a, pair.b, pair.overlap, pair.overlap});
    worst = std::max(worst, pair.median_distance);
  }
  double const gate = 0.05 * radius;
  auto const distances_before = measure_pairs(set, views, edges, before, gate, context);
  auto const distances_after = measure_pairs(set, views, edges, alignment.object_from_camera, gate, context);
  double const reach =
      std::isfinite(alignment.error.p95) && alignment.error.p95 > 0 ? 3 * alignment.error.p95 : std::max(gate, 1e-12);
  PlotOptions plot;
  plot.x_label = "distance between overlapping surfaces (" + to_string(set.unit) + ")";
  plot.y_label = "% of the points";
  section.html += html_row(
      {html_png(draw_graph(set, alignment, worst),
                fmt::format("Which views overlap: thicker is more, green to red is median distance 0 to {:.3g} {}",
                            worst, to_string(set.unit)),
                kPictureSide),
       html_png(draw_matrix(alignment, set.views.size(), worst), "Median distance of every pair, same colours", 300),
       "<figure>" +
           svg_plot({histogram(distances_before, reach, "before", "#c0603a"),
                     histogram(distances_after, reach, "after", "#2a7a4b")},
                    plot) +
           "</figure>"});
  section.html += figures_table(set, alignment, distances_before) + poses_table(set, alignment);
  return section;
}

}  // namespace scanview
