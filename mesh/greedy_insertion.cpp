#include "mesh/greedy_insertion.h"

#include <CGAL/Constrained_Delaunay_triangulation_2.h>
#include <CGAL/Exact_predicates_inexact_constructions_kernel.h>
#include <CGAL/Triangulation_face_base_with_info_2.h>
#include <CGAL/Triangulation_vertex_base_with_info_2.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <numeric>
#include <optional>
#include <queue>
#include <stdexcept>
#include <unordered_map>

#include "mesh/local_surface.h"
#include "mesh/triangle_scan.h"

namespace scanview {
namespace {

struct VertexInfo {
  int pixel = -1;    ///< of a vertex in the picture
  double depth = 0;  ///< linear, of a vertex in the picture
  int border = -1;   ///< index of the border vertex
};
struct FaceInfo {
  bool inside = false;      ///< on the object
  std::uint32_t stamp = 0;  ///< of its latest look at its pixels; 0: none
};

using Kernel = CGAL::Exact_predicates_inexact_constructions_kernel;
using VertexBase = CGAL::Triangulation_vertex_base_with_info_2<VertexInfo, Kernel>;
using FaceBase =
    CGAL::Triangulation_face_base_with_info_2<FaceInfo, Kernel, CGAL::Constrained_triangulation_face_base_2<Kernel>>;
using Cdt =
    CGAL::Constrained_Delaunay_triangulation_2<Kernel, CGAL::Triangulation_data_structure_2<VertexBase, FaceBase>,
                                               CGAL::No_constraint_intersection_requiring_constructions_tag>;
using VertexHandle = Cdt::Vertex_handle;
using FaceHandle = Cdt::Face_handle;

Eigen::Vector2d position(VertexHandle v) { return {v->point().x(), v->point().y()}; }

/// A vertex of the outline. The constraints that meet in it part its surroundings into sectors; each has its own depth.
struct BorderVertex {
  int segment = -1;            ///< whose inside it lies on; -1: an end of segments
  std::vector<double> angles;  ///< of the constraints, ascending; sector i reaches from angle i to the next
  std::vector<double> depths;  ///< linear, a sector; NaN where there is no object

  std::size_t sector(Eigen::Vector2d const& direction) const {
    double const angle = std::atan2(direction.y(), direction.x());
    auto const after = std::upper_bound(angles.begin(), angles.end(), angle);
    return after == angles.begin() ? angles.size() - 1 : std::size_t(after - angles.begin()) - 1;
  }
};

struct Candidate {
  double error;  ///< over tolerance
  int pixel;
  FaceHandle face;
  std::uint32_t stamp;
  bool operator<(Candidate const& other) const {
    return error != other.error ? error < other.error : pixel > other.pixel;
  }
};

class GreedyTriangulation {
 public:
  GreedyTriangulation(RangeImage const& image, SurfaceLinks const& links, Outline const& outline,
                      cv::Mat1f const& tolerance, int max_triangles, Context& context)
      : image_(image),
        links_(links),
        outline_(outline),
        tolerance_(tolerance),
        max_triangles_(max_triangles),
        context_(context),
        is_vertex_(cv::Mat1b::zeros(tolerance.size())) {}

  TriangleMesh run() {
    insert_outline();
    if (cdt_.dimension() < 2) return {};
    mark_inside();
    for (auto face = cdt_.finite_faces_begin(); face != cdt_.finite_faces_end(); ++face)
      if (face->info().inside) look_at(face);
    // Single precision moves vertices by about 1e-4 pixels: what that costs is looked up and mended.
    constexpr int kRounds = 8;
    for (int round = 0;; ++round) {
      bool const finished = refine();
      extract();
      if (!finished || round == kRounds || !mend()) return std::move(mesh_);
    }
  }

 private:
  void insert_outline() {
    border_.resize(outline_.vertices.size());
    std::vector<std::vector<int>> neighbours(outline_.vertices.size());
    for (std::size_t s = 0; s < outline_.segments.size(); ++s) {
      auto const [from, to] = std::pair(outline_.segments[s].from, outline_.segments[s].to);
      neighbours[from].push_back(to);
      neighbours[to].push_back(from);
      segment_of_ends_[std::minmax(from, to)] = int(s);
    }
    std::vector<VertexHandle> handles(outline_.vertices.size());
    FaceHandle hint;
    for (std::size_t v = 0; v < handles.size(); ++v) {
      OutlineVertex const& vertex = outline_.vertices[v];
      handles[v] = cdt_.insert({vertex.position.x(), vertex.position.y()}, hint);
      hint = handles[v]->face();
      handles[v]->info().border = int(v);
      std::vector<Eigen::Vector2d> ends;
      for (int n : neighbours[v]) ends.push_back(outline_.vertices[n].position);
      border_[v] = make_border_vertex(-1, vertex.position, ends, vertex.pixels);
    }
    for (OutlineSegment const& segment : outline_.segments)
      cdt_.insert_constraint(handles[segment.from], handles[segment.to]);
  }

  BorderVertex make_border_vertex(int segment, Eigen::Vector2d const& position,
                                  std::vector<Eigen::Vector2d> const& ends,
                                  std::vector<Eigen::Vector2i> const& pixels) const {
    BorderVertex vertex;
    vertex.segment = segment;
    for (Eigen::Vector2d const& end : ends)
      vertex.angles.push_back(std::atan2(end.y() - position.y(), end.x() - position.x()));
    std::sort(vertex.angles.begin(), vertex.angles.end());
    vertex.depths.assign(ends.size(), 0);
    std::vector<int> count(ends.size(), 0);
    for (Eigen::Vector2i const& pixel : pixels) {
      if (!links_.is_object(pixel.x(), pixel.y())) continue;
      Eigen::Vector2d const offset = position - pixel.cast<double>();
      std::size_t const sector = vertex.sector(-offset);
      LocalSurface const surface = local_surface(pixel.x(), pixel.y());
      vertex.depths[sector] += extend(surface, offset);
      ++count[sector];
    }
    for (std::size_t i = 0; i < count.size(); ++i)
      vertex.depths[i] = count[i] ? vertex.depths[i] / count[i] : std::numeric_limits<double>::quiet_NaN();
    return vertex;
  }

  LocalSurface local_surface(int x, int y) const { return fit_local_surface(image_, links_, x, y, tolerance_(y, x)); }

  /// Constraints part faces of the object from others: what is connected and holds a pixel of the object is inside.
  void mark_inside() {
    std::vector<FaceHandle> stack;
    for (auto start = cdt_.finite_faces_begin(); start != cdt_.finite_faces_end(); ++start) {
      if (start->info().inside) continue;
      bool on_object = false;
      scan(start, [&](int x, int y, double, double, double) { on_object = on_object || links_.object(y, x); });
      if (!on_object) continue;
      start->info().inside = true;
      stack.push_back(start);
      while (!stack.empty()) {
        FaceHandle const face = stack.back();
        stack.pop_back();
        ++triangles_;
        for (int i = 0; i < 3; ++i) {
          FaceHandle const next = face->neighbor(i);
          if (face->is_constrained(i) || cdt_.is_infinite(next) || next->info().inside) continue;
          next->info().inside = true;
          stack.push_back(next);
        }
      }
    }
  }

  template <typename Visit>
  void scan(FaceHandle face, Visit&& visit) const {
    for_each_pixel(position(face->vertex(0)), position(face->vertex(1)), position(face->vertex(2)), tolerance_.cols,
                   tolerance_.rows, visit);
  }

  /// Which of the sectors of its vertex i the face lies in; 0 in the picture.
  std::size_t sector(FaceHandle face, int i) const {
    VertexInfo const& info = face->vertex(i)->info();
    if (info.border < 0) return 0;
    Eigen::Vector2d const a = position(face->vertex(Cdt::ccw(i))), b = position(face->vertex(Cdt::cw(i)));
    return border_[info.border].sector((a + b) / 2 - position(face->vertex(i)));
  }
  double linear_depth_at(FaceHandle face, int i) const {
    VertexInfo const& info = face->vertex(i)->info();
    return info.border < 0 ? info.depth : border_[info.border].depths[sector(face, i)];
  }

  /// Finds the face's worst pixel and queues it where it is beyond tolerance.
  void look_at(FaceHandle face) {
    double const a = linear_depth_at(face, 0), b = linear_depth_at(face, 1), c = linear_depth_at(face, 2);
    if (std::isnan(a + b + c)) throw std::logic_error("greedy insertion: a border vertex without depth");
    Candidate worst{1.0, -1, face, ++stamp_};
    scan(face, [&](int x, int y, double wa, double wb, double wc) {
      if (is_vertex_(y, x)) return;
      double const z = linear_depth(image_.camera, wa * a + wb * b + wc * c);
      double const error = std::abs(z - image_.depth(y, x)) / tolerance_(y, x);
      int const pixel = y * tolerance_.cols + x;
      if (error > worst.error || (error == worst.error && worst.pixel >= 0 && pixel < worst.pixel)) {
        worst.error = error;
        worst.pixel = pixel;
      }
    });
    face->info().stamp = worst.stamp;
    if (worst.pixel >= 0) queue_.push(worst);
  }

  /// False where the limit of triangles ended it.
  bool refine() {
    for (std::size_t step = 0; !queue_.empty(); ++step) {
      if (step % 1024 == 0) context_.check_cancelled();
      Candidate const worst = queue_.top();
      if (worst.face->info().stamp != worst.stamp) {
        queue_.pop();
        continue;
      }
      if (max_triangles_ > 0 && triangles_ + 2 > max_triangles_) return false;
      queue_.pop();
      Eigen::Vector2d const point(worst.pixel % tolerance_.cols, worst.pixel / tolerance_.cols);
      if (!split_border(worst.face, point)) insert_pixel(worst.face, worst.pixel);
    }
    return true;
  }

  struct Split {
    int edge;  ///< of the face
    int segment;
    std::size_t gate;
    double along;  ///< 0 at the segment's first end, 1 at its last
  };

  /// How obtuse the angle is under which a point sees an edge: beyond it a triangle on that edge says nothing about the
  /// surface's normal.
  static bool sees_flatly(Eigen::Vector2d const& point, Eigen::Vector2d const& u, Eigen::Vector2d const& v) {
    constexpr double kCos = -0.7071;  // 135 degrees
    return (u - point).dot(v - point) < kCos * (u - point).norm() * (v - point).norm();
  }

  /// A border edge of the face that is too long beside a point so near to it, and the gate at which to split it: the
  /// nearest to the point that is not next to an end of the edge.
  std::optional<Split> find_split(FaceHandle face, Eigen::Vector2d const& point) const {
    for (int i = 0; i < 3; ++i) {
      if (!face->is_constrained(i)) continue;
      VertexHandle const u = face->vertex(Cdt::ccw(i)), v = face->vertex(Cdt::cw(i));
      if (!sees_flatly(point, position(u), position(v))) continue;
      int const index = segment_of(u->info().border, v->info().border);
      OutlineSegment const& segment = outline_.segments[index];
      auto const along_at = [&](Eigen::Vector2d const& place) { return along_segment(segment, place); };
      // Gates come in the order in which the segment passes them.
      auto const after = std::partition_point(segment.gates.begin(), segment.gates.end(), [&](Gate const& gate) {
        return along_gate(segment, gate) < along_at(point);
      });
      std::optional<Split> best;
      double best_distance = INFINITY;
      for (auto gate = after == segment.gates.begin() ? after : after - 1; gate != segment.gates.end() && gate <= after;
           ++gate) {
        double const along = along_gate(segment, *gate);
        Eigen::Vector2d const place = on_segment(segment, along);
        constexpr double kApart = 0.5;
        bool const apart = (place - position(u)).norm() >= kApart && (place - position(v)).norm() >= kApart;
        bool const between = (place - position(u)).dot(place - position(v)) < 0;
        double const distance = (place - point).norm();
        if (!apart || !between || distance >= best_distance) continue;
        best_distance = distance;
        best = Split{i, index, std::size_t(gate - segment.gates.begin()), along};
      }
      if (best) return best;
    }
    return std::nullopt;
  }

  Eigen::Vector2d on_segment(OutlineSegment const& segment, double along) const {
    Eigen::Vector2d const from = outline_.vertices[segment.from].position;
    return from + along * (outline_.vertices[segment.to].position - from);
  }
  double along_segment(OutlineSegment const& segment, Eigen::Vector2d const& place) const {
    Eigen::Vector2d const from = outline_.vertices[segment.from].position;
    Eigen::Vector2d const whole = outline_.vertices[segment.to].position - from;
    return (place - from).dot(whole) / whole.squaredNorm();
  }
  /// Where the segment crosses the line through the gate's two pixels.
  double along_gate(OutlineSegment const& segment, Gate const& gate) const {
    Eigen::Vector2d const from = outline_.vertices[segment.from].position;
    Eigen::Vector2d const whole = outline_.vertices[segment.to].position - from;
    int const axis = gate.left.x() == gate.right.x() ? 0 : 1;  // the coordinate that is fixed on that line
    return whole[axis] == 0 ? 0 : (gate.left[axis] - from[axis]) / whole[axis];
  }

  int segment_of(int border_u, int border_v) const {
    if (border_[border_u].segment >= 0) return border_[border_u].segment;
    if (border_[border_v].segment >= 0) return border_[border_v].segment;
    return segment_of_ends_.at(std::minmax(border_u, border_v));
  }

  /// Puts a vertex on the border where an edge of the face is too long beside the point. False where none is.
  bool split_border(FaceHandle face, Eigen::Vector2d const& point) {
    auto const split = find_split(face, point);
    if (!split) return false;
    // A multiple of 2^-20 of a segment whose ends are multiples of 1/8 is exact in a double: the border stays straight.
    OutlineSegment const& segment = outline_.segments[split->segment];
    Eigen::Vector2d const from = outline_.vertices[segment.from].position;
    Eigen::Vector2d const to = outline_.vertices[segment.to].position;
    constexpr double kParts = 1 << 20;
    Eigen::Vector2d const place = on_segment(segment, std::round(split->along * kParts) / kParts);

    VertexHandle const u = face->vertex(Cdt::ccw(split->edge)), v = face->vertex(Cdt::cw(split->edge));
    Kernel::Point_2 const point_u = u->point(), point_v = v->point();
    FaceHandle const other = face->neighbor(split->edge);
    bool const other_inside = !cdt_.is_infinite(other) && other->info().inside;
    bool const this_inside = face->info().inside;
    VertexHandle const added = cdt_.insert({place.x(), place.y()}, Cdt::EDGE, face, split->edge);
    Gate const& gate = segment.gates[split->gate];
    std::vector<Eigen::Vector2i> pixels;
    for (Eigen::Vector2i const& beside : {gate.left, gate.right}) pixels.push_back(beside);
    added->info().border = int(border_.size());
    border_.push_back(make_border_vertex(split->segment, place, {from, to}, pixels));
    triangles_ += this_inside + other_inside;

    look_around(added, [&](FaceHandle around) {
      for (int i = 0; i < 3; ++i) {
        auto const side = CGAL::orientation(point_u, point_v, around->vertex(i)->point());
        if (side != CGAL::COLLINEAR) return side == CGAL::LEFT_TURN ? this_inside : other_inside;
      }
      return false;
    });
    return true;
  }

  void insert_pixel(FaceHandle face, int pixel) {
    int const x = pixel % tolerance_.cols, y = pixel / tolerance_.cols;
    is_vertex_(y, x) = 1;
    Kernel::Point_2 const point(x, y);
    if (cdt_.is_infinite(face)) face = face->neighbor(face->index(cdt_.infinite_vertex()));
    int edge = -1;
    bool moved = true;
    while (moved) {
      moved = false;
      edge = -1;
      for (int i = 0; i < 3 && !moved; ++i) {
        auto const side =
            CGAL::orientation(face->vertex(Cdt::ccw(i))->point(), face->vertex(Cdt::cw(i))->point(), point);
        if (side == CGAL::COLLINEAR) edge = i;
        if (side != CGAL::RIGHT_TURN) continue;
        face = face->neighbor(i);
        if (cdt_.is_infinite(face)) throw std::logic_error("greedy insertion: a pixel outside the triangulation");
        moved = true;
      }
    }
    VertexHandle const added = cdt_.insert(point, edge < 0 ? Cdt::FACE : Cdt::EDGE, face, edge);
    added->info().pixel = pixel;
    added->info().depth = local_surface(x, y).depth;
    triangles_ += 2;
    look_around(added, [](FaceHandle) { return true; });
    while (split_border_around(added)) {
    }
  }

  /// Splits one border edge that is too long beside a vertex so near to it. False where none is.
  bool split_border_around(VertexHandle vertex) {
    if (max_triangles_ > 0 && triangles_ + 2 > max_triangles_) return false;
    auto around = cdt_.incident_faces(vertex), start = around;
    do {
      FaceHandle const face = around;
      if (!cdt_.is_infinite(face) && face->info().inside && split_border(face, position(vertex))) return true;
    } while (++around != start);
    return false;
  }

  /// All faces that an insertion changes have the new vertex.
  template <typename Inside>
  void look_around(VertexHandle vertex, Inside&& is_inside) {
    std::vector<FaceHandle> faces;
    auto around = cdt_.incident_faces(vertex), start = around;
    do {
      faces.push_back(around);
    } while (++around != start);
    for (FaceHandle const face : faces) {
      // Also of a face outside the hull, which may have been one inside before an edge of the hull was split.
      face->info().inside = !cdt_.is_infinite(face) && is_inside(face);
      face->info().stamp = 0;
      if (face->info().inside) look_at(face);
    }
  }

  void extract() {
    mesh_ = {};
    faces_.clear();
    std::map<std::pair<int, int>, int> index_of_sector;  // of border vertices
    std::unordered_map<int, int> index_of_pixel;
    auto add = [&](FaceHandle face, int i) {
      VertexHandle const v = face->vertex(i);
      int const next = int(mesh_.vertices.size());
      auto const [index, is_new] = [&] {
        if (v->info().border < 0) {
          auto const [it, inserted] = index_of_pixel.try_emplace(v->info().pixel, next);
          return std::pair(it->second, inserted);
        }
        auto const [it, inserted] = index_of_sector.try_emplace({v->info().border, int(sector(face, i))}, next);
        return std::pair(it->second, inserted);
      }();
      if (is_new) {
        double const z = linear_depth(image_.camera, linear_depth_at(face, i));
        mesh_.vertices.push_back(image_.camera.unproject(v->point().x(), v->point().y(), z).cast<float>());
      }
      return index;
    };
    for (auto face = cdt_.finite_faces_begin(); face != cdt_.finite_faces_end(); ++face) {
      if (!face->info().inside) continue;
      // Counter-clockwise in (x right, y down) faces away from the camera: the other way round.
      int const a = add(face, 0), c = add(face, 1), b = add(face, 2);
      mesh_.triangles.emplace_back(a, b, c);
      faces_.push_back(face);
    }
  }

  /// Queues pixels that are out of tolerance on the single precision mesh. False where there are none.
  bool mend() {
    std::map<int, Candidate> worst_of_pixel;
    for (std::size_t t = 0; t < faces_.size(); ++t) {
      Eigen::Vector2d corners[3];
      double depths[3];
      for (int i = 0; i < 3; ++i) {
        Eigen::Vector3d const p = mesh_.vertices[mesh_.triangles[t][i]].cast<double>();
        corners[i] = image_.camera.project(p);
        depths[i] = linear_depth(image_.camera, p.z());
      }
      for_each_pixel(corners[0], corners[1], corners[2], tolerance_.cols, tolerance_.rows,
                     [&](int x, int y, double wa, double wb, double wc) {
                       if (is_vertex_(y, x)) return;
                       double const z = linear_depth(image_.camera, wa * depths[0] + wb * depths[1] + wc * depths[2]);
                       double const error = std::abs(z - image_.depth(y, x)) / tolerance_(y, x);
                       if (!(error > 1)) return;
                       int const pixel = y * tolerance_.cols + x;
                       worst_of_pixel.try_emplace(pixel, Candidate{error, pixel, faces_[t], 0});
                     });
    }
    for (auto const& [pixel, candidate] : worst_of_pixel) {
      if (max_triangles_ > 0 && triangles_ + 2 > max_triangles_) return false;
      insert_pixel(candidate.face, pixel);
    }
    return !worst_of_pixel.empty();
  }

  RangeImage const& image_;
  SurfaceLinks const& links_;
  Outline const& outline_;
  cv::Mat1f const& tolerance_;
  int max_triangles_;
  Context& context_;
  Cdt cdt_;
  std::vector<BorderVertex> border_;
  std::map<std::pair<int, int>, int> segment_of_ends_;
  std::priority_queue<Candidate> queue_;
  std::uint32_t stamp_ = 0;
  int triangles_ = 0;
  cv::Mat1b is_vertex_;
  TriangleMesh mesh_;
  std::vector<FaceHandle> faces_;  ///< of the triangles of mesh_
};

}  // namespace

TriangleMesh triangulate_by_greedy_insertion(RangeImage const& image, SurfaceLinks const& links, Outline const& outline,
                                             cv::Mat1f const& tolerance, int max_triangles, Context& context) {
  return GreedyTriangulation(image, links, outline, tolerance, max_triangles, context).run();
}

}  // namespace scanview
