#include "synth/node_placement.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>

#include "base/error.h"
#include "base/median.h"
#include "base/parallel.h"
#include "base/random.h"

namespace scanview {
namespace {

using Eigen::Vector3d;

constexpr double kWantedEyes = 450;
constexpr std::size_t kFewestEyes = 300, kMostEyes = 600;
constexpr double kMostCells = 1e6, kMostDerivedCells = 3e4;
constexpr double kMostBytes = 1e9;

double clearance_of(SceneSight const& scene, PlacementOptions const& options) {
  return options.clearance > 0 ? options.clearance : 0.02 * scene.radius();
}

void check(WalkRegion const& region) {
  if (region.box.isEmpty() || !region.box.min().allFinite() || !region.box.max().allFinite())
    throw Error(ErrorCode::bad_input, {}, "the walkable region is no box: a corner is not finite, or below the other");
}

/// How many cells of about `spacing` the box has along each axis; one where it is flat.
Vector3d cell_counts(Eigen::AlignedBox3d const& box, double spacing) {
  Vector3d counts;
  for (int axis = 0; axis < 3; ++axis) counts[axis] = std::max(1.0, std::round(box.sizes()[axis] / spacing));
  return counts;
}

/// The spacing at which a box has about so many cells.
double spacing_for(Eigen::AlignedBox3d const& box, double cells) {
  double low = 0, high = box.sizes().maxCoeff();
  for (int step = 0; step < 60; ++step) {
    double const middle = 0.5 * (low + high);
    (cell_counts(box, middle).prod() > cells ? low : high) = middle;
  }
  return high;
}

std::vector<Vector3d> eyes_at_spacing(SceneSight const& scene, WalkRegion const& region, double spacing,
                                      double clearance, std::uint64_t seed, Context& context) {
  Vector3d counts = Vector3d::Ones();
  if (spacing > 0) counts = cell_counts(region.box, spacing);
  if (counts.prod() > kMostCells)
    throw Error(
        ErrorCode::bad_input, {},
        fmt::format("the walkable region has {:.2g} cells of {}: choose a greater spacing", counts.prod(), spacing));
  auto const cells = static_cast<std::size_t>(counts.prod());
  auto const nx = static_cast<std::size_t>(counts.x()), ny = static_cast<std::size_t>(counts.y());
  std::vector<std::optional<Vector3d>> found(cells);
  constexpr std::size_t kCellsATask = 64;
  for_each_index(context, (cells + kCellsATask - 1) / kCellsATask, [&](std::size_t task) {
    for (std::size_t i = task * kCellsATask; i < std::min(cells, (task + 1) * kCellsATask); ++i) {
      CounterRandom random(seed, i);
      std::size_t const x = i % nx, y = i / nx % ny, z = i / (nx * ny);
      Vector3d const cell(static_cast<double>(x), static_cast<double>(y), static_cast<double>(z));
      Vector3d const jitter(random.uniform(), random.uniform(), random.uniform());
      Vector3d const eye =
          region.box.min() + ((cell + jitter).array() / counts.array() * region.box.sizes().array()).matrix();
      if (scene.distance(eye, clearance) >= clearance && !scene.is_inside_object(eye)) found[i] = eye;
    }
  });
  std::vector<Vector3d> eyes;
  for (auto const& eye : found)
    if (eye) eyes.push_back(*eye);
  return eyes;
}

/// Free space above a place of the floor.
struct Headroom {
  double floor = 0, height = 0;
};

/// The highest of one column, looked through from below the scene.
Headroom highest_room(SceneSight const& scene, Vector3d const& bottom, double top) {
  Headroom best;
  double const skin = 1e-5 * scene.radius();
  std::optional<double> floor;
  for (double y = bottom.y();;) {
    auto const hit = scene.first_surface({bottom.x(), y, bottom.z()}, Vector3d::UnitY());
    double const above = hit ? y + hit->distance : top;
    if (floor && above - *floor > best.height) best = {*floor, above - *floor};
    if (!hit) return best;
    floor.reset();
    if (hit->is_back) floor = above;
    y = above + skin;
  }
}

}  // namespace

void PlacementOptions::validate() const {
  auto const refuse = [](std::string const& message) { throw Error(ErrorCode::usage, {}, message); };
  if (!(clearance >= 0) || !std::isfinite(clearance)) refuse(fmt::format("clearance is {}, no length", clearance));
  if (!(spacing >= 0) || !std::isfinite(spacing)) refuse(fmt::format("spacing is {}, no length", spacing));
  if (directions < 16 || directions > 65536) refuse(fmt::format("directions is {}, not in 16 .. 65536", directions));
  if (!(greatest_gap >= 0 && greatest_gap < 1))
    refuse(fmt::format("greatest_gap is {}, not in 0 .. 1 (without 1)", greatest_gap));
  if (most_nodes < 1) refuse("most_nodes is 0: at least one node is needed");
  if (steps < 0) refuse(fmt::format("steps is {}, less than 0", steps));
  sight.validate();
}

std::vector<Vector3d> walkable_eyes(SceneSight const& scene, WalkRegion const& region, PlacementOptions const& options,
                                    Context& context) {
  options.validate();
  check(region);
  double const clearance = clearance_of(scene, options);
  std::uint64_t const seed = context.seed;
  auto const at = [&](double spacing) { return eyes_at_spacing(scene, region, spacing, clearance, seed, context); };
  double cells = kWantedEyes;
  auto eyes = at(options.spacing > 0 ? options.spacing : spacing_for(region.box, cells));
  for (int attempt = 0; options.spacing == 0 && attempt < 6; ++attempt) {
    if (eyes.size() >= kFewestEyes && eyes.size() <= kMostEyes) break;
    double const wanted = cells * kWantedEyes / std::max(1.0, static_cast<double>(eyes.size()));
    double const next = std::clamp(wanted, 1.0, kMostDerivedCells);
    if (next == cells) break;
    cells = next;
    eyes = at(spacing_for(region.box, cells));
  }
  if (eyes.empty())
    throw Error(ErrorCode::bad_input, {},
                fmt::format("no eye can be in the walkable region: all of it is inside objects or nearer than the "
                            "clearance, {}, to a surface. Move the region, lower the clearance, or ignore the winding "
                            "where the triangles are wound the wrong way round",
                            clearance));
  return eyes;
}

Placement place_nodes(TriangleMesh const& mesh, WalkRegion const& region, PlacementOptions const& options,
                      Context& context) {
  options.validate();
  check(region);
  SceneSight const scene(mesh, options.winding);
  auto const eyes = walkable_eyes(scene, region, options, context);
  std::uint64_t const seed = context.seed;
  SightRules rules = options.sight;
  if (rules.sharp_from == 0) rules.sharp_from = 0.25 * region.box.diagonal().norm();

  GroupCoverProblem problem;
  problem.sets = problem.groups = eyes.size();
  problem.words = (static_cast<std::size_t>(options.directions) + 63) / 64;
  problem.spare = static_cast<int>(std::floor(options.greatest_gap * options.directions));
  std::size_t const row = problem.groups * problem.words;
  double const bytes = static_cast<double>(eyes.size()) *
                       (8.0 * static_cast<double>(row) + options.directions * static_cast<double>(sizeof(SeenPoint)));
  if (bytes > kMostBytes)
    throw Error(ErrorCode::bad_input, {},
                fmt::format("{} test eyes with {} directions need {:.1f} GB, more than 1: choose a greater spacing",
                            eyes.size(), options.directions, 1e-9 * bytes));

  std::vector<std::vector<SeenPoint>> seen(eyes.size());
  problem.items.resize(row);
  for_each_index(context, eyes.size(), [&](std::size_t eye) {
    seen[eye] = scene.look_around(eyes[eye], options.directions, rules, seed, eye);
    for (std::size_t i = 0; i < seen[eye].size(); ++i)
      if (seen[eye][i].is_there()) problem.items[eye * problem.words + i / 64] |= std::uint64_t{1} << (i % 64);
  });
  if (std::all_of(problem.items.begin(), problem.items.end(), [](auto word) { return word == 0; }))
    throw Error(ErrorCode::bad_input, {}, "from nowhere in the walkable region is any surface seen: move the region");
  problem.members.resize(eyes.size() * row);
  for_each_index(
      context, eyes.size(),
      [&](std::size_t node) {
        for (std::size_t eye = 0; eye < eyes.size(); ++eye) {
          auto* const to = problem.members.data() + node * row + eye * problem.words;
          // An eye sees all that it sees, also what rounding would hide.
          if (eye == node)
            std::copy_n(problem.items.data() + eye * problem.words, problem.words, to);
          else
            std::ranges::copy(scene.sees(eyes[node], seen[eye]), to);
        }
      },
      "place nodes");
  seen.clear();

  GroupCover const cover = cover_groups(problem, options.most_nodes, options.steps, context);
  Placement placement;
  placement.eyes = eyes.size();
  placement.ended = cover.ended;
  for (std::size_t const set : cover.sets) placement.nodes.push_back(eyes[set]);
  std::vector<double> uncovered(eyes.size());
  for_each_index(context, eyes.size(), [&](std::size_t eye) {
    std::uint64_t const other_seed = CounterRandom(seed, eye, 1).bits();
    uncovered[eye] = uncovered_share(scene, placement.nodes, eyes[eye], options.directions, rules, other_seed);
  });
  for (double const share : uncovered) {
    placement.uncovered_mean += share / static_cast<double>(eyes.size());
    placement.uncovered_worst = std::max(placement.uncovered_worst, share);
  }
  return placement;
}

WalkRegion default_walk_region(TriangleMesh const& mesh, PlacementOptions const& options,
                               std::optional<double> eye_height) {
  options.validate();
  SceneSight const scene(mesh, options.winding);
  Eigen::AlignedBox3d const box = scene.box();
  constexpr int kColumns = 64;
  std::vector<double> floors, heights;
  double const skin = 1e-3 * scene.radius();
  for (int i = 0; i < kColumns * kColumns; ++i) {
    int const column = i % kColumns, row = i / kColumns;
    Vector3d const share((column + 0.5) / kColumns, 0, (row + 0.5) / kColumns);
    Vector3d const bottom = box.min() + share.cwiseProduct(box.sizes()) - skin * Vector3d::UnitY();
    Headroom const room = highest_room(scene, bottom, box.max().y());
    if (room.height < skin) continue;
    floors.push_back(room.floor);
    heights.push_back(room.height);
  }
  if (floors.empty())
    throw Error(ErrorCode::bad_input, {},
                "the scene has no floor with free space above it (up is +y): give the walkable region");
  double const height = eye_height.value_or(0.45 * median(heights)), clearance = clearance_of(scene, options);
  Vector3d low = box.min() + Vector3d::Constant(clearance), high = box.max() - Vector3d::Constant(clearance);
  low.y() = high.y() = median(floors) + height;
  Eigen::AlignedBox3d const walkable(low, high);
  if (walkable.isEmpty())
    throw Error(ErrorCode::bad_input, {},
                fmt::format("the scene is narrower than twice the clearance, {}: lower it", clearance));
  return {walkable};
}

}  // namespace scanview
