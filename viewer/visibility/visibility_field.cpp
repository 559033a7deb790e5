#include "viewer/visibility/visibility_field.h"

#include <algorithm>
#include <cmath>

namespace scanview {
namespace {

using Query = VisibilityField::Query;

void add_row(Query& query, std::size_t row) {
  if (query.count < std::size(query.rows)) query.rows[query.count++] = row;
}

void ask(SphereLookup const& lookup, Eigen::Vector3d const& direction, double distance, Query& query) {
  auto const& shells = lookup.shells;
  auto const located = lookup.sphere.locate(direction);
  if (!located || shells.empty() || !(distance >= shells.front())) return;
  query.tests = located->tests;
  std::size_t const faces = lookup.sphere.faces().size(), directions = lookup.sphere.directions().size();
  // Between two shells; beyond the last, what that sees is all there is.
  std::size_t outer = 1;
  while (outer < shells.size() && distance > shells[outer]) ++outer;
  std::size_t const inner = outer - 1;
  query.cell = inner * faces + located->face;
  if (lookup.rows_are_cells) {
    add_row(query, query.cell);
    return;
  }
  Eigen::Vector3i const& face = lookup.sphere.faces()[located->face];
  Eigen::Vector3i const& opposite = lookup.sphere.opposite(located->face);
  for (std::size_t shell = inner; shell <= std::min(outer, shells.size() - 1); ++shell) {
    for (int k = 0; k < 3; ++k) {
      add_row(query, shell * directions + static_cast<std::size_t>(face[k]));
      if (lookup.opposite && opposite[k] >= 0)
        add_row(query, shell * directions + static_cast<std::size_t>(opposite[k]));
    }
  }
}

void ask(PathLookup const& lookup, Eigen::Vector3d const& eye, Query& query) {
  if (lookup.eyes.empty() || !eye.allFinite()) return;
  std::size_t nearest = 0;
  double least = std::numeric_limits<double>::infinity();
  for (std::size_t i = 0; i < lookup.eyes.size(); ++i) {
    double const distance = (lookup.eyes[i] - eye).squaredNorm();
    if (distance < least) {
      least = distance;
      nearest = i;
    }
  }
  // Off the path nothing is known: farther from its nearest frame than that is from the next.
  std::size_t const beside = nearest + 1 < lookup.eyes.size() ? nearest + 1 : nearest - (nearest > 0 ? 1 : 0);
  if (least > (lookup.eyes[beside] - lookup.eyes[nearest]).squaredNorm() + 1e-18) return;
  query.cell = nearest / lookup.stretch;
  add_row(query, query.cell);
}

void ask(GridLookup const& lookup, Eigen::Vector3d const& eye, Query& query) {
  if (!eye.allFinite() || !lookup.box.contains(eye)) return;
  Eigen::Vector3i cell;
  for (int k = 0; k < 3; ++k) {
    double const share = (eye[k] - lookup.box.min()[k]) / std::max(lookup.box.sizes()[k], 1e-300);
    cell[k] = std::clamp(static_cast<int>(share * lookup.cells[k]), 0, lookup.cells[k] - 1);
  }
  auto const row = [&](Eigen::Vector3i const& at) {
    return static_cast<std::size_t>(at.x()) +
           static_cast<std::size_t>(lookup.cells.x()) *
               (static_cast<std::size_t>(at.y()) +
                static_cast<std::size_t>(lookup.cells.y()) * static_cast<std::size_t>(at.z()));
  };
  query.cell = row(cell);
  Eigen::Vector3i const last = lookup.cells - Eigen::Vector3i::Ones();
  Eigen::Vector3i const low = (cell - Eigen::Vector3i::Ones()).cwiseMax(0);
  Eigen::Vector3i const high = (cell + Eigen::Vector3i::Ones()).cwiseMin(last);
  for (int z = low.z(); z <= high.z(); ++z) {
    for (int y = low.y(); y <= high.y(); ++y) {
      for (int x = low.x(); x <= high.x(); ++x) add_row(query, row({x, y, z}));
    }
  }
}

}  // namespace

Query VisibilityField::query(Eigen::Vector3d const& eye) const {
  Query query;
  if (auto const* sphere = std::get_if<SphereLookup>(&lookup)) {
    Eigen::Vector3d const from_center = eye - center;
    ask(*sphere, from_center, from_center.norm() / radius, query);
  } else if (auto const* path = std::get_if<PathLookup>(&lookup)) {
    ask(*path, eye, query);
  } else {
    ask(std::get<GridLookup>(lookup), eye, query);
  }
  return query;
}

}  // namespace scanview
