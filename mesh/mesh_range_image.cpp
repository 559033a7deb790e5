#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <numbers>
#include <opencv2/core.hpp>
#include <stdexcept>

#include "base/error.h"
#include "mesh/depth_approximation.h"
#include "mesh/feather.h"
#include "mesh/hole_fill.h"
#include "mesh/mesh_error.h"
#include "mesh/outline.h"
#include "mesh/surface_links.h"
#include "mesh/view_mesh.h"

namespace scanview {
namespace {

/// How far noise alone may be expected to change the tangent of the angle under which a triangle is seen: one sigma of
/// a depth difference over the triangle's least height across the picture.
double tangent_sigma(RangeImage const& image, Eigen::Vector3d const (&p)[3]) {
  Eigen::Vector2d u[3];
  double longest = 0;
  for (int i = 0; i < 3; ++i) u[i] = image.camera.project(p[i]);
  for (int i = 0; i < 3; ++i) longest = std::max(longest, (u[i] - u[(i + 1) % 3]).norm());
  Eigen::Vector2d const a = u[1] - u[0], b = u[2] - u[0], middle = (u[0] + u[1] + u[2]) / 3;
  double const height = std::abs(a.x() * b.y() - a.y() * b.x()) / longest * image.camera.pixel_size(p[0].z());
  int const x = std::clamp(int(std::lround(middle.x())), 0, image.camera.width() - 1);
  int const y = std::clamp(int(std::lround(middle.y())), 0, image.camera.height() - 1);
  return image.has_depth(x, y) && height > 0 ? std::numbers::sqrt2 * image.sigma(y, x) / height : 0;
}

/// Keeps the triangles that are seen well enough, and the vertices they need, in their order.
void keep_well_seen(RangeImage const& image, double max_angle_deg, TriangleMesh& mesh, std::vector<float>& cos_phi) {
  constexpr double kExplained = 2;           // sigma
  constexpr double kAlwaysGrazing = 0.0175;  // cosine of 89 degrees
  double const greatest = std::tan(max_angle_deg * std::numbers::pi / 180);
  double const least_cos = std::cos(max_angle_deg * std::numbers::pi / 180);
  std::vector<Eigen::Vector3i> kept;
  std::vector<int> new_index(mesh.vertices.size(), -1);
  for (Eigen::Vector3i const& triangle : mesh.triangles) {
    Eigen::Vector3d p[3];
    for (int i = 0; i < 3; ++i) p[i] = mesh.vertices[triangle[i]].cast<double>();
    Eigen::Vector3d const normal = (p[1] - p[0]).cross(p[2] - p[0]);
    Eigen::Vector3d ray(0, 0, 1);
    if (image.camera.is_perspective()) ray = p[0] + p[1] + p[2];
    double const cosine = std::min(-normal.dot(ray) / (normal.norm() * ray.norm()), 1.0);
    if (max_angle_deg < 90 && !(cosine >= least_cos)) {  // also those without area
      if (!(cosine >= kAlwaysGrazing)) continue;
      double const tangent = std::sqrt(1 - cosine * cosine) / cosine;
      if (tangent - kExplained * tangent_sigma(image, p) > greatest) continue;
    }
    kept.push_back(triangle);
    cos_phi.push_back(float(cosine));
    for (int i = 0; i < 3; ++i) new_index[triangle[i]] = 0;
  }
  int count = 0;
  for (std::size_t v = 0; v < new_index.size(); ++v)
    if (new_index[v] == 0) {
      mesh.vertices[count] = mesh.vertices[v];
      new_index[v] = count++;
    }
  mesh.vertices.resize(count);
  for (Eigen::Vector3i& triangle : kept)
    for (int i = 0; i < 3; ++i) triangle[i] = new_index[triangle[i]];
  mesh.triangles = std::move(kept);
}

void require(bool holds, char const* what) {
  if (!holds) throw Error(ErrorCode::usage, {}, std::string("mesh options: ") + what);
}

}  // namespace

void ViewMesh::check() const {
  mesh.check();
  if (cos_phi.size() != mesh.triangles.size())
    throw std::logic_error("a view mesh whose cosines are not one a triangle");
  if (feather.cols != camera.width() || feather.rows != camera.height())
    throw std::logic_error("a view mesh whose feather weights do not have the camera's size");
}

void MeshOptions::validate() const {
  require(tolerance_kind == Tolerance::automatic || (std::isfinite(tolerance) && tolerance > 0),
          "tolerance must be greater than 0");
  require(max_triangles >= 0, "max_triangles must not be negative");
  require(std::isfinite(step_sigmas) && step_sigmas > 0, "step_sigmas must be greater than 0");
  require(max_angle_deg > 0 && max_angle_deg <= 90, "max_angle_deg must be greater than 0 and at most 90");
  require(feather_px >= 1 && feather_px <= 65536, "feather_px must be between 1 and 65536");
  require(fill_pixels >= 0, "fill_pixels must not be negative");
  require(min_patch_pixels >= 1, "min_patch_pixels must be at least 1");
}

ViewMeshResult mesh_range_image(RangeImage const& whole, MeshOptions const& options, Context& context,
                                MeshMarks const& marks) {
  options.validate();
  whole.check();
  RangeImage chosen = whole;
  if (!marks.empty()) {
    for (cv::Mat* plane : {static_cast<cv::Mat*>(&chosen.depth), static_cast<cv::Mat*>(&chosen.sigma),
                           static_cast<cv::Mat*>(&chosen.classes)})
      *plane = plane->clone();
    apply_polygons(marks, chosen);
  }
  RangeImage const image =
      options.fill_pixels > 0 ? fill_small_holes(chosen, options.step_sigmas, options.fill_pixels) : chosen;
  ViewMeshResult result;
  result.view_mesh.camera = image.camera;
  SurfaceLinks links = find_surface_links(image, options.step_sigmas, options.min_patch_pixels);
  if (!marks.cut.empty()) {
    apply_cuts(marks, links);
    drop_small_patches(links, options.min_patch_pixels);
  }
  Outline const outline = trace_outline(links);
  context.check_cancelled();
  DepthApproximation approximation = approximate_depths(image, links, outline, options, context);
  result.tolerance = approximation.tolerance;
  TriangleMesh& mesh = result.view_mesh.mesh;
  mesh = approximation.triangulation.to_mesh(image.camera);
  keep_well_seen(image, options.max_angle_deg, mesh, result.view_mesh.cos_phi);

  MeshError const error = measure_mesh(chosen, mesh);
  result.figures = error.figures;
  result.view_mesh.feather = feather_weights(error.covered, links, options.feather_px);
  return result;
}

}  // namespace scanview
