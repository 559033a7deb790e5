#include "mesh/depth_approximation.h"

#include <algorithm>
#include <cmath>
#include <opencv2/core.hpp>

#include "mesh/depth_fit.h"
#include "mesh/greedy_insertion.h"
#include "mesh/grid_decimation.h"
#include "mesh/joint_fit.h"
#include "mesh/outline_triangulation.h"
#include "mesh/pixel_spans.h"
#include "mesh/voronoi_probing.h"

namespace scanview {
namespace {

/// Of a million pixels of normal noise half a one is farther off: a tolerance that noise alone does not exceed.
constexpr double kAutomaticSigmas = 5.0;
/// A vertex inside has three numbers, each of which takes up one sigma² of noise.
constexpr double kVertexNumbers = 3;
/// Sigma² by which a vertex must lower the squares: two for each number by Akaike's criterion (1974), and more because
/// the best of several places is taken; never less than noise alone offers every fourth time.
constexpr double kVertexWorth = 10, kLeastWorth = 1.5;
/// Tolerances: sums and rounding must not take a pixel just beyond.
constexpr double kWithin = 0.9995;
/// Tolerances within which insertion stays before depths are fitted: a fit halves the greatest error, so that little is
/// left to insert.
constexpr double kCoarsely = 1.5;
constexpr int kSweeps = 2, kSpendingSweeps = 4, kAutomaticSweeps = 5;

class Approximation {
 public:
  Approximation(RangeImage const& image, SurfaceLinks const& links, Outline const& outline, MeshOptions const& options,
                Context& context)
      : image_(image), links_(links), outline_(outline), options_(options), context_(context) {
    if (options.tolerance_kind == MeshOptions::Tolerance::units)
      tolerance_ = cv::Mat1f(image.depth.size(), float(options.tolerance));
    else
      tolerance_ = cv::Mat1f((is_automatic() ? kAutomaticSigmas : options.tolerance) * image.sigma);
    field_ = make_depth_field(image, links, tolerance_);
    object_pixels_ = cv::countNonZero(links.object);
  }

  DepthApproximation run() {
    DepthApproximation result;
    result.tolerance = is_automatic() ? kAutomaticSigmas : options_.tolerance;
    triangulation_ = triangulate_outline(image_, links_, outline_, tolerance_);
    place_vertices();
    triangulation_.order_by_place();
    fit();
    constexpr int kRounds = 8;
    for (int round = 0; round < kRounds; ++round) {
      triangulation_.round_to_single(image_.camera);
      if (!mend()) break;
    }
    result.triangulation = std::move(triangulation_);
    return result;
  }

 private:
  bool is_automatic() const { return options_.tolerance_kind == MeshOptions::Tolerance::automatic; }

  void place_vertices() {
    VertexMaker const maker(image_, links_, tolerance_, options_.fit != MeshOptions::Fit::none);
    int const most = options_.max_triangles;
    switch (options_.placement) {
      case MeshOptions::Placement::insertion:
        if (options_.fit != MeshOptions::Fit::none && !is_automatic()) {
          insert_greedily(triangulation_, field_, maker, kCoarsely, most, context_);
          triangulation_.order_by_place();
          fit_depths(triangulation_, field_, kWithin, scan_errors(triangulation_, field_));
        }
        insert_greedily(triangulation_, field_, maker, kWithin, most, context_);
        return;
      case MeshOptions::Placement::probing:
        probe_voronoi_edges(triangulation_, field_, maker, kWithin, most, context_);
        return;
      case MeshOptions::Placement::decimation:
        constexpr double kExactly = 0.01;  // tolerances within which the grid follows every pixel
        insert_greedily(triangulation_, field_, VertexMaker(image_, links_, tolerance_, false), kExactly, 0, context_);
        context_.check_cancelled();
        triangulation_ = decimate_grid(triangulation_, field_, image_.camera, kWithin, most);
        return;
    }
  }

  void fit() {
    double limit = kWithin;
    if (options_.fit == MeshOptions::Fit::none) return;
    std::vector<TriangleError> errors = scan_errors(triangulation_, field_);
    if (is_full())
      for (TriangleError const& error : errors) limit = std::max(limit, double(error.worst));
    // Insertion has fitted already what little it then added to.
    bool const is_fitted = options_.placement == MeshOptions::Placement::insertion && !is_automatic();
    if (options_.fit == MeshOptions::Fit::depths || !is_fitted)
      errors = fit_depths(triangulation_, field_, limit, std::move(errors));
    if (options_.fit == MeshOptions::Fit::depths) return;
    JointFitOptions joint;
    joint.limit = limit;
    joint.sweeps = kSweeps;
    joint.max_triangles = options_.max_triangles;
    if (is_automatic() && !is_full()) {
      fit_as_noise_allows(joint, std::move(errors));
      return;
    }
    joint.fewer = !is_full();
    if (joint.fewer) errors = fit_jointly(triangulation_, field_, joint, std::move(errors), context_);
    if (joint.fewer && joint.max_triangles == 0) return;
    // A number of triangles was asked for: they are used up, as long as they do not model noise.
    joint.fewer = false;
    joint.sweeps = kSpendingSweeps;
    joint.worth = kVertexWorth * mean_noise();
    fit_jointly(triangulation_, field_, joint, std::move(errors), context_);
  }

  /// Of the squared sigma, in squared tolerances.
  double mean_noise() const {
    double sum = 0;
    for (int y = 0; y < field_.height(); ++y)
      for (int x = 0; x < field_.width(); ++x) {
        if (!links_.object(y, x)) continue;
        double const sigma = image_.sigma(y, x) / tolerance_(y, x);
        sum += sigma * sigma;
      }
    return object_pixels_ > 0 ? sum / object_pixels_ : 0;
  }

  /// Adds and joins vertices as they pay. What a mesh of triangles leaves of a smooth surface, its bias, squared, falls
  /// with the square of the number of vertices, while the noise they take up grows with it: their sum is least where
  /// the bias is half of the noise, and hardly more where it is as much. As long as it is more than that, a vertex may
  /// cost more than it seems to be worth, for it pays only once its neighbours have moved.
  void fit_as_noise_allows(JointFitOptions joint, std::vector<TriangleError> errors) {
    joint.sweeps = 1;
    double worth = kVertexWorth;
    for (int sweep = 0; sweep < kAutomaticSweeps; ++sweep) {
      joint.worth = worth / (kAutomaticSigmas * kAutomaticSigmas);
      errors = fit_jointly(triangulation_, field_, joint, std::move(errors), context_);
      double squares = 0;
      for (TriangleError const& error : errors) squares += error.squares;
      squares *= kAutomaticSigmas * kAutomaticSigmas;
      double const taken_up = kVertexNumbers * triangulation_.count_vertices();
      double const bias = squares - object_pixels_ + taken_up;
      if (sweep > 0 && bias > taken_up) worth = std::max(worth / 2, kLeastWorth);
    }
  }

  /// Whether the number of triangles, not the tolerance, ended the placement.
  bool is_full() const { return options_.max_triangles > 0 && triangulation_.count() + 2 > options_.max_triangles; }

  /// The pixel of a triangle that is farthest off, in tolerances of depth, in double precision.
  struct Worst {
    double error = 0;
    int x = 0, y = 0;
  };
  Worst worst_pixel(DepthTriangle const& shape) const {
    DepthPlane const plane = shape.plane();
    Worst worst;
    for_each_span(shape.corner[0], shape.corner[1], shape.corner[2], field_.width(), field_.height(),
                  [&](int y, int begin, int end) {
                    for (int x = begin; x < end; ++x) {
                      if (!links_.object(y, x)) continue;
                      double const z = linear_depth(image_.camera, plane.at({double(x), double(y)}));
                      double const error = std::abs(z - image_.depth(y, x)) / tolerance_(y, x);
                      if (error > worst.error) worst = {error, x, y};
                    }
                  });
    return worst;
  }

  /// Makes pixels beyond tolerance vertices. False where there are none or no triangle is left to spend.
  bool mend() {
    bool mended = false;
    int const count = int(triangulation_.triangles().size());
    std::vector<int> around;
    std::vector<char> changed(count, 0);
    for (int t = 0; t < count; ++t) {
      if (!triangulation_.alive(t) || changed[t]) continue;
      Worst const worst = worst_pixel(triangulation_.shape(t));
      if (!(worst.error > 1)) continue;
      if (is_full()) return false;
      double const depth = linear_depth(image_.camera, image_.depth(worst.y, worst.x));
      auto const added = triangulation_.insert(t, Eigen::Vector2d(worst.x, worst.y), depth);
      if (!added) continue;
      mended = true;
      triangulation_.triangles_around(*added, around);
      for (int const n : around)
        if (n < count) changed[n] = 1;
    }
    return mended;
  }

  RangeImage const& image_;
  SurfaceLinks const& links_;
  Outline const& outline_;
  MeshOptions const& options_;
  Context& context_;
  cv::Mat1f tolerance_;
  DepthField field_;
  double object_pixels_ = 0;
  DepthTriangulation triangulation_;
};

}  // namespace

DepthApproximation approximate_depths(RangeImage const& image, SurfaceLinks const& links, Outline const& outline,
                                      MeshOptions const& options, Context& context) {
  return Approximation(image, links, outline, options, context).run();
}

}  // namespace scanview
