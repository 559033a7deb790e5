#include "mesh/outline_triangulation.h"

#include <CGAL/Constrained_Delaunay_triangulation_2.h>
#include <CGAL/Exact_predicates_inexact_constructions_kernel.h>
#include <CGAL/Triangulation_face_base_with_info_2.h>
#include <CGAL/Triangulation_vertex_base_with_info_2.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <stdexcept>

#include "mesh/local_surface.h"
#include "mesh/pixel_spans.h"

namespace scanview {
namespace {

using Kernel = CGAL::Exact_predicates_inexact_constructions_kernel;
struct FaceInfo {
  bool inside = false;  ///< on the object
};
using VertexBase = CGAL::Triangulation_vertex_base_with_info_2<int, Kernel>;  // index in the outline
using FaceBase =
    CGAL::Triangulation_face_base_with_info_2<FaceInfo, Kernel, CGAL::Constrained_triangulation_face_base_2<Kernel>>;
using Cdt =
    CGAL::Constrained_Delaunay_triangulation_2<Kernel, CGAL::Triangulation_data_structure_2<VertexBase, FaceBase>,
                                               CGAL::No_constraint_intersection_requiring_constructions_tag>;
using VertexHandle = Cdt::Vertex_handle;
using FaceHandle = Cdt::Face_handle;

Eigen::Vector2d position(VertexHandle v) { return {v->point().x(), v->point().y()}; }

/// The segments that meet in a vertex of the outline part its surroundings into sectors; each has its own depth.
struct Sectors {
  std::vector<double> angles;  ///< of the segments, ascending; sector i reaches from angle i to the next
  std::vector<double> depths;  ///< linear, a sector; NaN where there is no object
  std::vector<int> vertices;   ///< of the triangulation; −1: none yet

  std::size_t at(Eigen::Vector2d const& direction) const {
    double const angle = std::atan2(direction.y(), direction.x());
    auto const after = std::upper_bound(angles.begin(), angles.end(), angle);
    return after == angles.begin() ? angles.size() - 1 : std::size_t(after - angles.begin()) - 1;
  }
};

class OutlineTriangulation {
 public:
  OutlineTriangulation(RangeImage const& image, SurfaceLinks const& links, Outline const& outline,
                       cv::Mat1f const& tolerance)
      : image_(image), links_(links), outline_(outline), tolerance_(tolerance) {}

  DepthTriangulation run() {
    insert_outline();
    if (cdt_.dimension() == 2) {
      mark_inside();
      extract();
    }
    return std::move(result_);
  }

 private:
  void insert_outline() {
    std::vector<std::vector<int>> neighbours(outline_.vertices.size());
    for (OutlineSegment const& segment : outline_.segments) {
      neighbours[segment.from].push_back(segment.to);
      neighbours[segment.to].push_back(segment.from);
    }
    std::vector<VertexHandle> handles(outline_.vertices.size());
    FaceHandle hint;
    for (std::size_t v = 0; v < handles.size(); ++v) {
      Eigen::Vector2d const& place = outline_.vertices[v].position;
      handles[v] = cdt_.insert({place.x(), place.y()}, hint);
      hint = handles[v]->face();
      handles[v]->info() = int(v);
      sectors_.push_back(find_sectors(outline_.vertices[v], neighbours[v]));
    }
    for (OutlineSegment const& segment : outline_.segments)
      cdt_.insert_constraint(handles[segment.from], handles[segment.to]);
  }

  Sectors find_sectors(OutlineVertex const& vertex, std::vector<int> const& neighbours) const {
    Sectors sectors;
    for (int const n : neighbours) {
      Eigen::Vector2d const to = outline_.vertices[n].position - vertex.position;
      sectors.angles.push_back(std::atan2(to.y(), to.x()));
    }
    std::sort(sectors.angles.begin(), sectors.angles.end());
    sectors.vertices.assign(neighbours.size(), -1);
    sectors.depths.assign(neighbours.size(), 0);
    std::vector<int> count(neighbours.size(), 0);
    for (Eigen::Vector2i const& pixel : vertex.pixels) {
      if (!links_.is_object(pixel.x(), pixel.y())) continue;
      Eigen::Vector2d const offset = vertex.position - pixel.cast<double>();
      std::size_t const sector = sectors.at(-offset);
      double const tolerance = tolerance_(pixel.y(), pixel.x());
      sectors.depths[sector] += extend(fit_local_surface(image_, links_, pixel.x(), pixel.y(), tolerance), offset);
      ++count[sector];
    }
    for (std::size_t i = 0; i < count.size(); ++i)
      sectors.depths[i] = count[i] ? sectors.depths[i] / count[i] : std::numeric_limits<double>::quiet_NaN();
    return sectors;
  }

  /// Constraints part faces of the object from others: what is connected and holds a pixel of the object is inside.
  void mark_inside() {
    std::vector<FaceHandle> stack;
    for (auto start = cdt_.finite_faces_begin(); start != cdt_.finite_faces_end(); ++start) {
      if (start->info().inside || !holds_object(start)) continue;
      start->info().inside = true;
      stack.push_back(start);
      while (!stack.empty()) {
        FaceHandle const face = stack.back();
        stack.pop_back();
        for (int i = 0; i < 3; ++i) {
          FaceHandle const next = face->neighbor(i);
          if (face->is_constrained(i) || cdt_.is_infinite(next) || next->info().inside) continue;
          next->info().inside = true;
          stack.push_back(next);
        }
      }
    }
  }

  bool holds_object(FaceHandle face) const {
    bool holds = false;
    for_each_span(position(face->vertex(0)), position(face->vertex(1)), position(face->vertex(2)), tolerance_.cols,
                  tolerance_.rows, [&](int y, int begin, int end) {
                    uchar const* const row = links_.object[y];
                    holds = holds || std::find(row + begin, row + end, 1) != row + end;
                  });
    return holds;
  }

  void extract() {
    for (auto face = cdt_.finite_faces_begin(); face != cdt_.finite_faces_end(); ++face) {
      if (!face->info().inside) continue;
      int corners[3];
      for (int i = 0; i < 3; ++i) corners[i] = vertex_of(face, i);
      result_.add_triangle(corners[0], corners[1], corners[2]);
    }
    result_.connect();
  }

  /// The vertex of the sector in which the face lies.
  int vertex_of(FaceHandle face, int i) {
    VertexHandle const v = face->vertex(i);
    Eigen::Vector2d const a = position(face->vertex(Cdt::ccw(i))), b = position(face->vertex(Cdt::cw(i)));
    Sectors& sectors = sectors_[v->info()];
    std::size_t const sector = sectors.at((a + b) / 2 - position(v));
    int& vertex = sectors.vertices[sector];
    if (vertex < 0) {
      if (std::isnan(sectors.depths[sector])) throw std::logic_error("an outline vertex without depth");
      vertex = result_.add_vertex(position(v), sectors.depths[sector], true);
    }
    return vertex;
  }

  RangeImage const& image_;
  SurfaceLinks const& links_;
  Outline const& outline_;
  cv::Mat1f const& tolerance_;
  Cdt cdt_;
  std::vector<Sectors> sectors_;
  DepthTriangulation result_;
};

}  // namespace

DepthTriangulation triangulate_outline(RangeImage const& image, SurfaceLinks const& links, Outline const& outline,
                                       cv::Mat1f const& tolerance) {
  return OutlineTriangulation(image, links, outline, tolerance).run();
}

}  // namespace scanview
