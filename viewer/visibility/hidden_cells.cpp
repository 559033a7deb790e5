#include "viewer/visibility/hidden_cells.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "base/parallel.h"
#include "viewer/visibility/solid_interior.h"

namespace scanview {
namespace {

using Eigen::Vector3f;

/// Eyes, in radii from the model's centre: the hull of these corners. w 0: infinitely far.
struct Cell {
  std::array<Eigen::Vector4f, 6> corners;
};

/// The directions in which a ball's points see a cell: around `middle`, in it and in all other directions of the cell
/// within `spread` (radians).
struct Shaft {
  Vector3f middle;
  float spread;
};

Shaft shaft_of(Ball const& ball, Cell const& cell) {
  std::array<Vector3f, 6> directions;
  std::array<float, 6> blur;  // by which the direction differs between the ball's points
  Shaft shaft{Vector3f::Zero(), 0};
  for (std::size_t k = 0; k < 6; ++k) {
    Vector3f const to_corner = cell.corners[k].head<3>() - cell.corners[k].w() * ball.center;
    float const distance = to_corner.norm();
    directions[k] = to_corner / distance;
    blur[k] = std::asin(std::min(1.0F, cell.corners[k].w() * ball.radius / distance));
    shaft.middle += directions[k];
  }
  shaft.middle.normalize();
  // The widest angle of a convex cone is at one of its corners.
  for (std::size_t k = 0; k < 6; ++k) {
    float const angle = std::acos(std::clamp(shaft.middle.dot(directions[k]), -1.0F, 1.0F));
    shaft.spread = std::max(shaft.spread, angle + blur[k]);
  }
  shaft.spread += 1e-3F;  // single precision
  return shaft;
}

bool is_hidden(Ball const& ball, Shaft const& shaft, SolidInterior const& solid) {
  if (shaft.spread > 1) return false;
  float const growth = 2 * std::sin(shaft.spread / 2);
  bool found = false;
  float t = ball.radius;
  while (t < 2) {  // in radii: beyond the model
    float const need = ball.radius + t * growth, have = solid.clearance(ball.center + t * shaft.middle);
    if (have >= need) {
      found = true;
      break;
    }
    // The clearance grows no faster than the way.
    t += std::max(solid.voxel(), need - have);
  }
  if (!found) return false;
  float const widening = std::tan(shaft.spread);
  for (Ball const& window : solid.windows()) {
    Vector3f const to_window = window.center - ball.center;
    float const along = to_window.dot(shaft.middle), across = (to_window - along * shaft.middle).norm();
    float const reach = along + window.radius + ball.radius;
    if (reach > 0 && across <= window.radius + ball.radius + reach * widening) return false;
  }
  return true;
}

}  // namespace

void find_hidden_cells(VisibilityField& field, TriangleMesh const& drawn, std::size_t opaque, SampleSphere sphere,
                       HiddenCellOptions const& options, Context& context) {
  // In radii from the centre, as planes and eyes are.
  TriangleMesh scaled = drawn;
  for (auto& vertex : scaled.vertices) vertex = ((vertex.cast<double>() - field.center) / field.radius).cast<float>();
  std::vector<Ball> balls(field.patches.count());
  for (std::size_t p = 0; p < balls.size(); ++p) {
    Eigen::AlignedBox3f box;
    auto const for_each_corner = [&](auto const& use) {
      for (std::size_t i = field.patches.begins[p]; i < field.patches.begins[p + 1]; ++i) {
        for (int k = 0; k < 3; ++k) use(scaled.vertices[static_cast<std::size_t>(scaled.triangles[i][k])]);
      }
    };
    for_each_corner([&](Vector3f const& v) { box.extend(v); });
    balls[p].center = box.center();
    for_each_corner([&](Vector3f const& v) { balls[p].radius = std::max(balls[p].radius, (v - box.center()).norm()); });
    balls[p].radius *= 1 + 1e-5F;
  }
  bool const has_transparent = opaque < drawn.triangles.size();
  scaled.triangles.resize(opaque);
  SolidInterior const solid(scaled, options.voxels);

  SphereLookup lookup;
  lookup.sphere = std::move(sphere);
  lookup.rows_are_cells = true;
  for (int k = 0; k < options.intervals; ++k)
    lookup.shells.push_back(options.nearest * options.intervals / (options.intervals - k));
  auto const& faces = lookup.sphere.faces();
  // Corners of the far side stand out so far that their hull holds the sphere's part between them.
  double const bulge = 1 / std::cos(std::min(lookup.sphere.radius(), 1.5));
  field.rows = BitRows(lookup.shells.size() * faces.size(), 2 * field.patches.count());
  for_each_index(
      context, faces.size(),
      [&](std::size_t f) {
        for (std::size_t shell = 0; shell < lookup.shells.size(); ++shell) {
          Cell cell;
          for (std::size_t k = 0; k < 3; ++k) {
            Eigen::Vector3d const d =
                lookup.sphere.directions()[static_cast<std::size_t>(faces[f][static_cast<int>(k)])];
            bool const far = shell + 1 == lookup.shells.size();
            cell.corners[k] << (lookup.shells[shell] * d).cast<float>(), 1;
            cell.corners[3 + k] << (far ? d : Eigen::Vector3d(bulge * lookup.shells[shell + 1] * d)).cast<float>(),
                far ? 0.0F : 1.0F;
          }
          std::size_t const row = shell * faces.size() + f;
          for (std::size_t p = 0; p < balls.size(); ++p) {
            bool const always = has_transparent && p + 1 == balls.size();
            if (!always && is_hidden(balls[p], shaft_of(balls[p], cell), solid)) continue;
            field.rows.set(row, 2 * p);
            field.rows.set(row, 2 * p + 1);
          }
        }
      },
      "proving");
  field.lookup = std::move(lookup);
}

}  // namespace scanview
