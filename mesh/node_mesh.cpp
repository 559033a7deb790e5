#include "mesh/node_mesh.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <map>
#include <opencv2/core.hpp>
#include <stdexcept>
#include <string>
#include <utility>

#include "base/error.h"
#include "base/parallel.h"
#include "mesh/depth_fit.h"
#include "mesh/feather.h"
#include "mesh/greedy_insertion.h"
#include "mesh/hole_fill.h"
#include "mesh/joint_fit.h"
#include "mesh/node_gutter.h"
#include "mesh/node_paint.h"
#include "mesh/node_panes.h"
#include "mesh/node_seams.h"
#include "mesh/outline.h"
#include "mesh/outline_triangulation.h"
#include "mesh/padded_texture.h"
#include "mesh/voronoi_probing.h"

namespace scanview {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;

void require(bool holds, char const* what) {
  if (!holds) throw Error(ErrorCode::usage, {}, std::string("node mesh options: ") + what);
}

/// A side on its way from pictures to triangles.
struct Work {
  RangeImage image;     ///< with the sky where it is far
  cv::Mat1f tolerance;  ///< of depth
  cv::Mat1b feather;
  SurfaceLinks steps;  ///< links as the depths are; those of `side` may cross steps (Silhouettes::torn)
  SideTriangulation side;
  double worst = 0;  ///< error, in tolerances
};

class NodeMesher {
 public:
  NodeMesher(CapturedNode const& node, NodeMeshOptions const& options, Context& context)
      : node_(node), options_(options), context_(context), sides_(node.sides), work_(node.sides.size()) {}

  NodeMesh run() {
    double const sky = sky_depth();
    for_each_side([&](std::size_t s) { put_image(s, sky); });
    for_each_side([&](std::size_t s) { prepare(s); });
    join();
    place_vertices();
    for_each_side([&](std::size_t s) { fit(work_[s]); });
    NodeMesh result = assemble();
    if (options_.background == NodeMeshOptions::Background::far) add_panes(result, sky);
    return result;
  }

 private:
  static constexpr double kWithin = 0.9995;  ///< tolerances: rounding must not take a pixel just beyond

  template <typename Do>
  void for_each_side(Do const& act) {
    for_each_index(context_, work_.size(), act);
  }

  /// Of 1/z, a pixel of parallax at the walking radius.
  double pixel_of(Camera const& camera) const {
    return 1 / (std::max(camera.fx(), camera.fy()) * options_.walking_radius);
  }

  double sky_depth() const {
    constexpr double kBeyond = 100, kMoved = 0.01;
    double depth = 0;
    for (View const& side : node_.sides) {
      depth = std::max(depth, 1 / (kMoved * pixel_of(side.image.camera)));
      for (int y = 0; y < side.image.depth.rows; ++y)
        for (int x = 0; x < side.image.depth.cols; ++x)
          if (side.image.has_depth(x, y)) depth = std::max(depth, kBeyond * double(side.image.depth(y, x)));
    }
    return depth;
  }

  void put_image(std::size_t s, double sky) {
    RangeImage& image = sides_[s].image;
    if (options_.background == NodeMeshOptions::Background::far) put_sky(image, sky);
    if (options_.fill_pixels > 0) image = fill_small_holes(image, options_.step_sigmas, options_.fill_pixels);
  }

  void prepare(std::size_t s) {
    Work& work = work_[s];
    work.image = sides_[s].image;
    constexpr int kStepReach = 3;  // pixels that the decision about a step looks at
    int const gutter = std::max(kStepReach, options_.feather_px);
    RangeImage const wide = with_gutter(sides_, s, gutter);
    SurfaceLinks const links = find_surface_links(wide, options_.step_sigmas, options_.min_patch_pixels);
    cv::Rect const inside(gutter, gutter, work.image.camera.width(), work.image.camera.height());
    work.feather = feather_weights(links.object * 255, links, options_.feather_px)(inside).clone();
    work.side.beyond = beyond_edges(wide, links, gutter);
    work.steps = without_gutter(links, gutter);
    work.side.camera = work.image.camera;
    work.side.node_from_camera = sides_[s].object_from_camera->linear();
    work.side.links = work.steps;
    if (options_.silhouettes != NodeMeshOptions::Silhouettes::constrained) link_everything(work.side.links);
    find_tolerances(work);
    work.side.triangulation =
        triangulate_outline(work.image, work.side.links, trace_outline(work.side.links), work.tolerance);
  }

  static void put_sky(RangeImage& image, double depth) {
    image.depth = image.depth.clone();
    image.sigma = image.sigma.clone();
    image.classes = image.classes.clone();
    for (int y = 0; y < image.depth.rows; ++y)
      for (int x = 0; x < image.depth.cols; ++x) {
        if (image.classes(y, x) != static_cast<uchar>(PixelClass::background)) continue;
        image.depth(y, x) = float(depth);
        image.sigma(y, x) = float(1e-6 * depth);
        image.classes(y, x) = static_cast<uchar>(PixelClass::object);
      }
  }

  static void link_everything(SurfaceLinks& links) {
    links.right = links.right.clone();  // shared with the steps
    links.down = links.down.clone();
    for (int y = 0; y < links.object.rows; ++y)
      for (int x = 0; x < links.object.cols; ++x) {
        links.right(y, x) = links.is_object(x, y) && links.is_object(x + 1, y);
        links.down(y, x) = links.is_object(x, y) && links.is_object(x, y + 1);
      }
  }

  void find_tolerances(Work& work) {
    double const parallax = options_.parallax_px * pixel_of(work.image.camera);
    constexpr double kSigmas = 3, kMostOfDepth = 0.25;
    cv::Mat1f linear(work.image.depth.size(), float(parallax));
    work.tolerance = cv::Mat1f(work.image.depth.size(), 1.0F);
    for (int y = 0; y < linear.rows; ++y)
      for (int x = 0; x < linear.cols; ++x) {
        if (!work.image.has_depth(x, y)) continue;
        double const z = work.image.depth(y, x);
        double const allowed = std::max(parallax, kSigmas * work.image.sigma(y, x) / (z * z));
        linear(y, x) = float(allowed);
        work.tolerance(y, x) = float(std::min(allowed * z * z, kMostOfDepth * z));
      }
    work.side.field = make_linear_depth_field(work.image, work.side.links, linear);
  }

  void join() {
    std::vector<SideTriangulation> sides;
    double tolerance = INFINITY;
    for (Work& work : work_) {
      tolerance = std::min(tolerance, options_.parallax_px * pixel_of(work.side.camera) / 2);
      sides.push_back(std::move(work.side));
    }
    constexpr std::size_t kLeast = 64;
    constexpr int kShare = 20;  // of the triangles, that vertices on seams may be
    std::size_t const most = std::max(kLeast, std::size_t(options_.max_triangles) / kShare);
    if (options_.max_triangles > 0)
      while (std::isfinite(tolerance) && count_seam_vertices(sides, tolerance) > most &&
             count_seam_vertices(sides, 2 * tolerance) < count_seam_vertices(sides, tolerance))
        tolerance *= 2;
    join_seams(sides, tolerance);
    for (std::size_t s = 0; s < work_.size(); ++s) work_[s].side = std::move(sides[s]);
  }

  int count() const {
    int sum = 0;
    for (Work const& work : work_) sum += work.side.triangulation.count();
    return sum;
  }

  void measure(Work& work) const {
    work.worst = 0;
    for (TriangleError const& error : scan_errors(work.side.triangulation, work.side.field))
      work.worst = std::max(work.worst, double(error.worst));
  }

  /// Triangles that may still be made.
  int left() const {
    return options_.max_triangles > 0 ? options_.max_triangles - count() : std::numeric_limits<int>::max();
  }

  /// Rounds: every side comes within the same limit, which falls until the tolerance is kept or all triangles are used.
  void place_vertices() {
    for_each_side([&](std::size_t s) { measure(work_[s]); });
    double limit = 0;
    for (Work const& work : work_) limit = std::max(limit, work.worst);
    while (limit > kWithin && left() >= 2) {
      limit = std::max(limit / 2, kWithin);
      while (come_within(limit)) {
      }
    }
  }

  /// Lets all sides that are not within the limit yet take some of the triangles that are left: together half of them,
  /// in equal parts, for no side may take what others need as much. False once there are no such sides or triangles.
  bool come_within(double limit) {
    std::vector<std::size_t> open;
    for (std::size_t s = 0; s < work_.size(); ++s)
      if (work_[s].worst > limit) open.push_back(s);
    int const spare = left();
    if (open.empty() || spare < 2) return false;
    if (std::size_t(spare) / 2 < open.size()) open.resize(std::size_t(spare) / 2);
    int const part = std::max(2, spare / (2 * int(open.size())));
    for_each_index(context_, open.size(), [&](std::size_t k) {
      Work& work = work_[open[k]];
      int const most = options_.max_triangles > 0 ? work.side.triangulation.count() + part : 0;
      place_within(work, limit, most);
      measure(work);
      // What no vertex can mend: it ended of itself.
      if (most == 0 || work.side.triangulation.count() + 2 <= most) work.worst = std::min(work.worst, limit);
    });
    return true;
  }

  void place_within(Work& work, double limit, int most) {
    bool const smooth = options_.fit != NodeMeshOptions::Fit::none;
    VertexMaker const maker(work.image, work.side.links, work.tolerance, smooth);
    if (options_.silhouettes == NodeMeshOptions::Silhouettes::constrained)
      refine_border(work.side.triangulation, work.side.field, maker, limit, most);
    if (options_.placement == NodeMeshOptions::Placement::probing)
      probe_voronoi_edges(work.side.triangulation, work.side.field, maker, limit, most, context_);
    else
      insert_greedily(work.side.triangulation, work.side.field, maker, limit, most, context_);
  }

  void fit(Work& work) {
    if (options_.fit == NodeMeshOptions::Fit::none) return;
    DepthTriangulation& triangulation = work.side.triangulation;
    triangulation.order_by_place();
    auto errors = scan_errors(triangulation, work.side.field);
    JointFitOptions joint;
    joint.limit = kWithin;
    for (TriangleError const& error : errors) joint.limit = std::max(joint.limit, double(error.worst));
    errors = fit_depths(triangulation, work.side.field, joint.limit, std::move(errors));
    if (options_.fit == NodeMeshOptions::Fit::joint) {
      joint.fewer = joint.limit <= 1;
      joint.max_triangles = 0;
      errors = fit_jointly(triangulation, work.side.field, joint, std::move(errors), context_);
    }
    work.worst = 0;
    for (TriangleError const& error : errors) work.worst = std::max(work.worst, double(error.worst));
  }

  /// Whether an edge passes between two pixels that are not on one surface.
  static bool crosses_step(SurfaceLinks const& links, Vector2d const& from, Vector2d const& to) {
    int const count = std::max(1, int(std::ceil(2 * (to - from).cwiseAbs().maxCoeff())));
    auto const pixel = [&](int k) -> Eigen::Vector2i {
      Vector2d const p = from + double(k) / count * (to - from);
      return {std::clamp(int(std::lround(p.x())), 0, links.object.cols - 1),
              std::clamp(int(std::lround(p.y())), 0, links.object.rows - 1)};
    };
    for (int k = 0; k < count; ++k) {
      Eigen::Vector2i const a = pixel(k), b = pixel(k + 1);
      if (a.x() != b.x() && !links.linked(a.x(), a.y(), b.x(), a.y())) return true;
      if (a.y() != b.y() && !links.linked(b.x(), a.y(), b.x(), b.y())) return true;
    }
    return false;
  }

  bool is_torn(Work const& work, DepthTriangle const& shape) const {
    if (options_.silhouettes != NodeMeshOptions::Silhouettes::torn) return false;
    for (int i = 0; i < 3; ++i)
      if (crosses_step(work.steps, shape.corner[i], shape.corner[(i + 1) % 3])) return true;
    return false;
  }

  double least_linear_depth() const {
    double farthest = 0;
    for (Work const& work : work_)
      for (int y = 0; y < work.image.depth.rows; ++y)
        for (int x = 0; x < work.image.depth.cols; ++x)
          if (work.image.has_depth(x, y)) farthest = std::max(farthest, double(work.image.depth(y, x)));
    return farthest > 0 ? 1 / farthest : 0;
  }

  NodeMesh assemble() {
    NodeMesh result;
    result.position = node_.position;
    std::map<std::pair<std::array<long, 3>, double>, int> held;
    // Within tolerance of infinitely far is also what lies beyond it, behind the eye.
    double const least = least_linear_depth();
    for (std::size_t s = 0; s < work_.size(); ++s) {
      Work const& work = work_[s];
      DepthTriangulation const& m = work.side.triangulation;
      NodeMesh::Side side;
      side.camera = work.side.camera;
      side.node_from_camera = work.side.node_from_camera;
      side.first = result.triangles.size();
      std::vector<int> index(m.vertices().size(), -1);
      auto const vertex_of = [&](int v) {
        if (index[v] >= 0) return index[v];
        DepthTriangulation::Vertex const& vertex = m.vertex(v);
        Vector3d const ray =
            side.node_from_camera * side.camera.ray_direction(vertex.position.x(), vertex.position.y());
        int const next = int(result.vertices.size());
        index[v] = next;
        if (vertex.is_held) {
          auto const key = seam_key(side.camera, side.node_from_camera, vertex.position);
          index[v] = held.try_emplace({key, vertex.depth}, next).first->second;
        }
        if (index[v] == next) result.vertices.push_back((ray / std::max(vertex.depth, least)).cast<float>());
        return index[v];
      };
      for (int t = 0; t < int(m.triangles().size()); ++t) {
        if (!m.alive(t) || is_torn(work, m.shape(t))) continue;
        auto const& v = m.triangle(t).vertex;
        // In the picture from x to y, y down, the right-hand normal points away from the camera.
        Eigen::Vector3i const triangle(vertex_of(v[0]), vertex_of(v[2]), vertex_of(v[1]));
        result.triangles.push_back(triangle);
        result.quality.push_back(quality_of(result, triangle));
      }
      side.end = result.triangles.size();
      result.parallax_px = std::max(result.parallax_px, work.worst * options_.parallax_px);
      paint(work, node_.sides[s].gain, side);
      result.sides.push_back(std::move(side));
    }
    return result;
  }

  static float quality_of(NodeMesh const& mesh, Eigen::Vector3i const& triangle) {
    Vector3d p[3];
    for (int i = 0; i < 3; ++i) p[i] = mesh.vertices[triangle[i]].cast<double>();
    Vector3d const normal = (p[1] - p[0]).cross(p[2] - p[0]), ray = p[0] + p[1] + p[2];
    double const lengths = normal.norm() * ray.norm();
    return lengths > 0 ? float(std::min(std::abs(normal.dot(ray)) / lengths, 1.0)) : 0.0F;
  }

  void paint(Work const& work, Vector3d const& gain, NodeMesh::Side& side) const {
    ViewMesh covered;
    covered.camera = side.camera;
    covered.feather = work.feather;
    side.color = with_gain(padded_texture(work.image, covered), gain);
    side.feather = covered.feather;
  }

  CapturedNode const& node_;
  NodeMeshOptions const& options_;
  Context& context_;
  std::vector<View> sides_;  ///< with the sky where it is far
  std::vector<Work> work_;
};

}  // namespace

std::vector<float> NodeMesh::smooth_quality() const {
  std::vector<double> sum(vertices.size(), 0), weight(vertices.size(), 0);
  for (std::size_t t = 0; t < triangles.size(); ++t)
    for (int i = 0; i < 3; ++i) {
      Vector3d const at = vertices[triangles[t][i]].cast<double>();
      Vector3d const u = vertices[triangles[t][(i + 1) % 3]].cast<double>() - at;
      Vector3d const v = vertices[triangles[t][(i + 2) % 3]].cast<double>() - at;
      double const angle = std::atan2(u.cross(v).norm(), u.dot(v));
      sum[triangles[t][i]] += angle * quality[t];
      weight[triangles[t][i]] += angle;
    }
  std::vector<float> result(vertices.size(), 0);
  for (std::size_t v = 0; v < result.size(); ++v)
    if (weight[v] > 0) result[v] = float(sum[v] / weight[v]);
  return result;
}

void NodeMesh::check() const {
  if (quality.size() != triangles.size()) throw std::logic_error("a node whose qualities are not one a triangle");
  std::size_t next = 0, next_pane = 0;
  panes.check();
  for (Side const& side : sides) {
    if (side.first_pane != next_pane || side.end_pane < next_pane)
      throw std::logic_error("a node whose panes do not follow each other");
    next_pane = side.end_pane;
    if (side.first != next || side.end < side.first)
      throw std::logic_error("a node whose sides do not follow each other");
    next = side.end;
    if (side.color.cols != side.camera.width() || side.color.rows != side.camera.height() ||
        side.feather.size() != side.color.size())
      throw std::logic_error("a side of a node whose picture has another size than its camera's");
  }
  if (next_pane != panes.triangles.size()) throw std::logic_error("a node with panes of no side");
  if (next != triangles.size()) throw std::logic_error("a node with triangles of no side");
  for (Eigen::Vector3f const& vertex : vertices)
    if (!vertex.allFinite()) throw std::logic_error("a node with a vertex that is not finite");
  for (Eigen::Vector3i const& triangle : triangles)
    if (triangle.minCoeff() < 0 || triangle.maxCoeff() >= int(vertices.size()))
      throw std::logic_error("a node with an index out of range");
}

void NodeMeshOptions::validate() const {
  require(max_triangles >= 0, "max_triangles must not be negative");
  require(std::isfinite(parallax_px) && parallax_px > 0, "parallax_px must be greater than 0");
  require(std::isfinite(walking_radius) && walking_radius > 0, "walking_radius must be greater than 0");
  require(std::isfinite(step_sigmas) && step_sigmas > 0, "step_sigmas must be greater than 0");
  require(min_patch_pixels >= 1, "min_patch_pixels must be at least 1");
  require(fill_pixels >= 0, "fill_pixels must not be negative");
  require(feather_px >= 1 && feather_px <= 65536, "feather_px must be between 1 and 65536");
}

NodeMesh mesh_node(CapturedNode const& node, NodeMeshOptions const& options, Context& context) {
  options.validate();
  node.check();
  return NodeMesher(node, options, context).run();
}

}  // namespace scanview
