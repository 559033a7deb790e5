#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <opencv2/imgproc.hpp>

#include "mesh/view_mesh.h"

namespace scanview {
namespace {

constexpr int kWidth = 640;  // pixels of a picture

/// The triangles' edges over the darkened picture, or over gray where there is none.
cv::Mat3b draw_wireframe(ViewMesh const& view_mesh, cv::Mat3b const& color) {
  Camera const camera = view_mesh.camera.resized(
      kWidth, std::max(1, int(std::lround(double(kWidth) * view_mesh.camera.height() / view_mesh.camera.width()))));
  cv::Mat3b picture(camera.height(), camera.width(), cv::Vec3b(64, 64, 64));
  if (!color.empty()) {
    cv::resize(color, picture, picture.size(), 0, 0, cv::INTER_AREA);
    picture *= 0.6;
  }
  constexpr int kFractionBits = 4;
  std::vector<cv::Point> corners;
  for (Eigen::Vector3f const& vertex : view_mesh.mesh.vertices) {
    Eigen::Vector2d const pixel = camera.project(vertex.cast<double>()) * (1 << kFractionBits);
    corners.emplace_back(int(std::lround(pixel.x())), int(std::lround(pixel.y())));
  }
  for (Eigen::Vector3i const& t : view_mesh.mesh.triangles)
    for (int i = 0; i < 3; ++i)
      cv::line(picture, corners[t[i]], corners[t[(i + 1) % 3]], {90, 230, 120}, 1, cv::LINE_AA, kFractionBits);
  return picture;
}

std::string length(double value, Unit unit) { return fmt::format("{:.3g} {}", value, to_string(unit)); }

}  // namespace

ReportSection mesh_section(ScanSet const& set, std::vector<ViewMeshResult> const& results) {
  std::vector<std::vector<std::string>> rows = {
      {"view", "triangles", "rms error", "95 % below", "greatest", "not covered"}};
  std::vector<std::string> figures;
  std::size_t triangles = 0;
  for (std::size_t i = 0; i < results.size(); ++i) {
    MeshFigures const& f = results[i].figures;
    View const& view = set.views.at(i);
    triangles += f.triangles;
    rows.push_back({view.name, fmt::format("{}", f.triangles), length(f.rms, set.unit), length(f.p95, set.unit),
                    length(f.max, set.unit), fmt::format("{:.2f} %", 100 * f.uncovered)});
    figures.push_back(html_jpeg(draw_wireframe(results[i].view_mesh, view.image.color),
                                fmt::format("{}: {} triangles", view.name, f.triangles), kWidth / 2));
  }
  std::string html = fmt::format(
      "<p>Every view became a mesh of its own, {} triangles in all. Errors are in depth, from the range image to the "
      "mesh, at the pixels that the mesh covers; small groups of pixels and surfaces seen too grazingly are not "
      "covered.</p>\n",
      triangles);
  return {"mesh", "Meshes", html + html_table(rows) + html_row(figures)};
}

}  // namespace scanview
