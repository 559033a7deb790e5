// Walkthroughs (Darsa, Costa, Varshney 1998): error against frame time over triangles, number of nodes and policy, with
// our triangulation and the paper's; independence of the scene's complexity; coverage of automatic nodes.
#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <chrono>
#include <iostream>

#include "base/error.h"
#include "base/html.h"
#include "base/median.h"
#include "base/random.h"
#include "mesh/node_mesh.h"
#include "synth/gallery.h"
#include "synth/model_camera.h"
#include "synth/node_placement.h"
#include "viewer/raster/id_buffer.h"
#include "viewer/walkthrough/policy_figures.h"
#include "viewer/walkthrough/walk_path.h"

namespace {

using namespace scanview;
using Eigen::Vector3d;

Vector3d const kUp = Vector3d::UnitY();

double seconds() { return std::chrono::duration<double>(std::chrono::steady_clock::now().time_since_epoch()).count(); }

/// The paper's triangulation: random probes of Voronoi edges, triangles across steps left out or kept, depths as
/// sampled.
NodeMeshOptions as_the_paper(NodeMeshOptions options, NodeMeshOptions::Silhouettes silhouettes) {
  options.placement = NodeMeshOptions::Placement::probing;
  options.silhouettes = silhouettes;
  options.fit = NodeMeshOptions::Fit::none;
  return options;
}

struct Pair {
  Vector3d from, to;
};
/// Places in four of the gallery's rooms from which things hide each other.
std::vector<Pair> const kPairs = {{{1.9, 1.6, 4.4}, {3.4, 1.6, 3.6}},
                                  {{9.6, 1.6, 2.5}, {11.5, 1.6, 4.0}},
                                  {{19.0, 1.6, 6.0}, {21.0, 1.6, 5.0}},
                                  {{2.0, 1.6, 11.0}, {4.5, 1.6, 11.5}}};

std::vector<NodeMesh> meshed(std::vector<CapturedNode> const& captured, NodeMeshOptions const& options, double& time,
                             Context& context) {
  std::vector<NodeMesh> nodes;
  std::vector<double> times;
  for (CapturedNode const& node : captured) {
    double const start = seconds();
    nodes.push_back(mesh_node(node, options, context));
    times.push_back(seconds() - start);
  }
  time = median(times);
  return nodes;
}

std::size_t triangles_of(std::vector<NodeMesh> const& nodes) {
  std::size_t sum = 0;
  for (NodeMesh const& node : nodes) sum += node.triangles.size();
  return sum;
}

std::vector<ReferenceFrame> traced(ModelCamera& camera, std::vector<PathCamera> const& path, Context& context) {
  std::vector<ReferenceFrame> frames;
  for (PathCamera const& from : path)
    frames.push_back({from, camera.picture(from.camera, from.object_from_camera, context), {}});
  return frames;
}

std::vector<PathCamera> way(Pair const& pair, std::size_t frames, Camera const& camera) {
  return straight_walk(pair.from, pair.to, (pair.to - pair.from).normalized(), kUp, 60, frames, camera);
}

double decibel(double error) { return -10 * std::log10(std::max(error, 1e-10)); }

/// Only pixels that every policy drew: what differs is then how well, not how much.
struct Compared {
  std::vector<PolicyFigures> policies;
  double build_seconds = 0;
  std::size_t triangles = 0;
};

Compared compared(std::vector<CapturedNode> const& captured, NodeMeshOptions const& mesh,
                  WalkthroughOptions const& draw, std::vector<ReferenceFrame> const& frames,
                  std::vector<MergePolicy> const& policies, Context& context) {
  Compared result;
  auto const nodes = meshed(captured, mesh, result.build_seconds, context);
  result.triangles = triangles_of(nodes);
  WalkthroughRenderer renderer(make_node_library(nodes, mesh.walking_radius, draw.quality), draw);
  constexpr int kSamplesSide = 2;
  result.policies = measure_policies(renderer, frames, policies, kSamplesSide, context);
  return result;
}

void print(std::string const& name, Compared const& c) {
  for (PolicyFigures const& p : c.policies)
    fmt::print(
        "  {:28} {:11} {:6} triangles  {:.6f} ({:.2f} dB)  at the centres {:.1f}, {:.1f} dB  {:.2f} ms  "
        "{:.3f} % uncovered  {:.2f} s a node\n",
        name, to_string(p.policy), c.triangles, p.mean_error(), p.psnr(), decibel(p.error.front()),
        decibel(p.error.back()), p.median_milliseconds(),
        100 * std::accumulate(p.uncovered.begin(), p.uncovered.end(), 0.0) / double(p.uncovered.size()),
        c.build_seconds);
}

/// The paper's experiment, its policies and its triangulation beside ours, in each of the pairs' rooms.
void experiment(ModelCamera& camera, std::size_t frames, std::vector<ReportSection>& sections, Context& context) {
  for (std::size_t p = 0; p < kPairs.size(); ++p) {
    std::vector<CapturedNode> captured;
    for (Vector3d const& at : {kPairs[p].from, kPairs[p].to})
      captured.push_back(capture_node(camera, at, 512, fmt::format("{}", captured.size()), context));
    auto const references = traced(camera, way(kPairs[p], frames, walking_camera(256, 192)), context);
    NodeMeshOptions mesh;
    mesh.walking_radius = (kPairs[p].to - kPairs[p].from).norm() / 2;
    WalkthroughOptions draw, paper_draw;
    draw.merged = paper_draw.merged = 2;
    paper_draw.quality = NodeQuality::smooth;
    std::vector<MergePolicy> const all(kMergePolicies.begin(), kMergePolicies.end());
    fmt::print("pair {} ({} frames)\n", p, references.size());
    std::vector<PlotCurve> curves, of_frames;
    auto const add = [&](std::string const& name, std::string const& color, NodeMeshOptions options,
                         WalkthroughOptions const& how, bool frame_by_frame) {
      PlotCurve curve{name, {}, color, false};
      for (int const triangles : {1000, 2000, 4000, 8000, 15000}) {
        options.max_triangles = triangles;
        options.parallax_px = 0.01;
        bool const last = triangles == 15000;
        Compared const c = compared(captured, options, how, references,
                                    last ? all : std::vector<MergePolicy>{MergePolicy::positional}, context);
        if (last) print(name, c);
        PolicyFigures const& positional = c.policies.back();
        curve.points.emplace_back(double(c.triangles), positional.mean_error());
        if (!last) fmt::print("  {:28} {:6} triangles {:.2f} dB\n", name, c.triangles, positional.psnr());
        if (!last || !frame_by_frame) continue;
        char const* const colors[] = {"#999999", "#cc7722", "#2277cc", "#117733"};
        for (std::size_t k = 0; k < c.policies.size(); ++k) {
          PlotCurve one{to_string(c.policies[k].policy), {}, colors[k], false};
          for (std::size_t f = 0; f < references.size(); ++f)
            one.points.emplace_back(double(f), c.policies[k].error[f]);
          of_frames.push_back(std::move(one));
        }
      }
      curves.push_back(std::move(curve));
    };
    add("ours", "#117733", mesh, draw, true);
    NodeMeshOptions inserted = mesh;
    inserted.fit = NodeMeshOptions::Fit::none;
    add("insertion, no fit", "#2277cc", inserted, draw, false);
    add("the paper's, torn", "#999999", as_the_paper(mesh, NodeMeshOptions::Silhouettes::torn), paper_draw, false);
    add("the paper's, with skins", "#cc7722", as_the_paper(mesh, NodeMeshOptions::Silhouettes::skins), paper_draw,
        false);
    Compared const needed = compared(captured, mesh, draw, references, all, context);
    print("ours, within 0.25 px", needed);
    PlotOptions options, by_frame;
    options.x_label = "triangles, both nodes";
    options.y_label = by_frame.y_label = "squared error (positional)";
    options.log_x = options.log_y = true;
    by_frame.x_label = "frame";
    sections.push_back({fmt::format("pair{}", p), fmt::format("Pair {}", p),
                        svg_plot(curves, options) + svg_plot(of_frames, by_frame)});
  }
}

/// Error and time over the number of nodes of the room, for the policies.
void over_nodes(ModelCamera& camera, std::vector<ReportSection>& sections, Context& context) {
  std::vector<CapturedNode> all;
  for (int i = 0; i < 6; ++i) {
    Vector3d const at = kPairs[0].from + (i % 3) * Vector3d(1.4, 0, -0.3) + (i / 3) * Vector3d(-0.9, 0, -2.4);
    all.push_back(capture_node(camera, at, 512, fmt::format("{}", i), context));
  }
  Pair const line{all[0].position + Vector3d(0.5, 0, -0.3), all[5].position + Vector3d(-0.4, 0, 0.5)};
  auto const references = traced(camera, way(line, 40, walking_camera(400, 300)), context);
  fmt::print("nodes\n");
  std::vector<PlotCurve> curves;
  for (int const merged : {1, 2, 3, 4}) {
    PlotCurve curve{fmt::format("{} merged", merged), {}, fmt::format("hsl({} 60% 40%)", 80 * merged), true};
    for (std::size_t const count : {1, 2, 3, 4, 6}) {
      if (count < std::size_t(merged)) continue;
      WalkthroughOptions draw;
      draw.merged = merged;
      Compared const c = compared({all.begin(), all.begin() + std::ptrdiff_t(count)}, NodeMeshOptions(), draw,
                                  references, {MergePolicy::positional}, context);
      print(fmt::format("{} nodes, {} merged", count, merged), c);
      curve.points.emplace_back(c.policies[0].median_milliseconds(), c.policies[0].mean_error());
    }
    curves.push_back(std::move(curve));
  }
  PlotOptions options;
  options.x_label = "ms a frame (400 x 300)";
  options.y_label = "squared error";
  options.log_y = true;
  sections.push_back({"nodes", "Number of nodes", svg_plot(curves, options)});
}

/// The same nodes of the same scene in 100 thousand and in 10 million polygons, beside drawing its polygons.
void over_polygons(std::vector<std::size_t> const& polygons, Context& context) {
  fmt::print("polygons of the scene\n");
  for (std::size_t const count : polygons) {
    TriangleMesh model = make_gallery(count);
    auto const path = way(kPairs[0], 25, walking_camera(640, 480));
    RasterMesh const raster = raster_mesh(model, std::vector<std::uint32_t>(model.triangles.size(), 1));
    Eigen::AlignedBox3d bounds;
    for (auto const& vertex : model.vertices) bounds.extend(vertex.cast<double>());
    std::vector<float> keys(640 * 480);
    std::vector<std::uint32_t> ids(640 * 480);
    std::vector<double> whole;
    for (std::size_t f = 0; f < path.size(); f += 4) {
      double const start = seconds();
      DepthRange range;
      depth_range(bounds, path[f].object_from_camera.inverse(), true, range);
      draw_keyed_ids(raster, path[f].camera, path[f].object_from_camera, range, Culling::back_faces,
                     {keys.data(), ids.data(), 640});
      whole.push_back(1e3 * (seconds() - start));
    }
    ModelCamera camera(std::move(model), {}, context);
    std::vector<CapturedNode> captured;
    for (Vector3d const& at : {kPairs[0].from, kPairs[0].to})
      captured.push_back(capture_node(camera, at, 512, "node", context));
    auto const references = traced(camera, path, context);
    WalkthroughOptions draw;
    draw.merged = 2;
    NodeMeshOptions mesh;
    mesh.walking_radius = (kPairs[0].to - kPairs[0].from).norm() / 2;
    Compared const c = compared(captured, mesh, draw, references, {MergePolicy::positional}, context);
    print(fmt::format("{} polygons", count), c);
    fmt::print("  drawing its polygons (IDs alone, same rasteriser): {:.2f} ms; the walkthrough takes {:.3f} of it\n",
               median(whole), c.policies[0].median_milliseconds() / median(whole));
  }
}

/// A walk that turns and wanders where eyes may be.
std::vector<PathCamera> random_walk(std::vector<Vector3d> const& eyes, std::size_t frames, std::uint64_t seed) {
  std::vector<PathCamera> path;
  CounterRandom random(seed, 0);
  Camera const camera = walking_camera(320, 240);
  std::size_t at = random.below(std::uint32_t(eyes.size()));
  double heading = 0;
  while (path.size() < frames) {
    std::vector<std::size_t> near;
    for (std::size_t i = 0; i < eyes.size(); ++i)
      if (i != at && (eyes[i] - eyes[at]).norm() < 1.5) near.push_back(i);
    std::size_t const next =
        near.empty() ? random.below(std::uint32_t(eyes.size())) : near[random.below(std::uint32_t(near.size()))];
    constexpr int kSteps = 5;
    for (int step = 0; step < kSteps && path.size() < frames; ++step) {
      double const t = double(step) / kSteps;
      Vector3d const eye = (1 - t) * eyes[at] + t * eyes[next];
      heading += 0.15 * random.normal();
      Vector3d const direction(std::cos(heading), 0.2 * random.normal(), std::sin(heading));
      path.push_back({camera, look_at(eye, eye + direction, kUp), {}});
    }
    at = next;
  }
  return path;
}

/// Covered pixels on random walks, with automatic nodes and with a person's.
void coverage(std::vector<std::string> const& hand, double greatest_gap, Context& context) {
  TriangleMesh const model = make_gallery(100'000);
  WalkRegion const region{gallery_walk_box()};
  PlacementOptions placement;
  placement.greatest_gap = greatest_gap;
  double const start = seconds();
  Placement const placed = place_nodes(model, region, placement, context);
  fmt::print("automatic placement: {} nodes, {:.4f} % uncovered by rays, worst eye {:.3f} %, {:.1f} s\n",
             placed.nodes.size(), 100 * placed.uncovered_mean, 100 * placed.uncovered_worst, seconds() - start);
  std::vector<std::pair<std::string, std::vector<Vector3d>>> sets = {{"automatic", placed.nodes}};
  for (std::string const& file : hand) {
    std::vector<Vector3d> nodes;
    for (Json const& at : read_json(file)) nodes.emplace_back(at[0], at[1], at[2]);
    sets.emplace_back(file, std::move(nodes));
  }
  SceneSight const sight(model, SceneWinding::trusted);
  PlacementOptions finer = placement;
  finer.spacing = 0.6;
  auto const path = random_walk(walkable_eyes(sight, region, finer, context), 1000, 11);
  ModelCamera camera(model, {}, context);
  for (auto const& [name, nodes] : sets) {
    std::vector<CapturedNode> captured;
    for (Vector3d const& at : nodes) captured.push_back(capture_node(camera, at, 512, "node", context));
    double time = 0;
    NodeMeshOptions mesh;
    WalkthroughRenderer renderer(make_node_library(meshed(captured, mesh, time, context), mesh.walking_radius), {});
    double uncovered = 0, worst = 0;
    std::size_t off = 0, compared_pixels = 0, gaps = 0, sky_gaps = 0;
    std::vector<double> times;
    for (std::size_t f = 0; f < path.size(); ++f) {
      double const drawing = seconds();
      Frame const frame = renderer.render(path[f].camera, path[f].object_from_camera);
      times.push_back(1e3 * (seconds() - drawing));
      double const share = double(renderer.uncovered()) / double(frame.color.total());
      uncovered += share / double(path.size());
      worst = std::max(worst, share);
      if (f % 50 != 0) continue;
      // Whether what covers a pixel is what is there.
      RangeImage const truth = camera.capture(path[f].camera, path[f].object_from_camera, context);
      for (int y = 0; y < truth.depth.rows; ++y)
        for (int x = 0; x < truth.depth.cols; ++x) {
          if (frame.color(y, x)[3] == 0) {
            ++gaps;
            sky_gaps += !truth.has_depth(x, y);
          }
          if (!truth.has_depth(x, y) || frame.color(y, x)[3] == 0) continue;
          ++compared_pixels;
          off += std::abs(frame.depth(y, x) - truth.depth(y, x)) > 0.05 * truth.depth(y, x);
        }
    }
    fmt::print(
        "  {}: {} nodes, covered {:.3f} % of 1000 frames' pixels, worst frame {:.2f} %, {:.2f} ms a frame; "
        "depth off by more than 5 % at {:.2f} % of pixels; {:.0f} % of the gaps are sky\n",
        name, nodes.size(), 100 * (1 - uncovered), 100 * (1 - worst), median(times),
        100 * double(off) / double(compared_pixels), 100 * double(sky_gaps) / double(std::max<std::size_t>(gaps, 1)));
  }
}

}  // namespace

int main(int argc, char** argv) {
  CLI::App app("Error against frame time of walkthroughs in the gallery");
  std::size_t frames = 250;
  std::string plot;
  std::vector<std::string> hand, parts = {"experiment", "nodes", "polygons", "coverage"};
  std::vector<std::size_t> polygons = {100'000, 10'000'000};
  app.add_option("--frames", frames, "Between two nodes");
  app.add_option("--plot", plot, "A page with the plots");
  app.add_option("--hand", hand, "Files with positions that a person chose, for coverage");
  double gap = PlacementOptions().greatest_gap;
  app.add_option("--gap", gap, "PlacementOptions::greatest_gap, for coverage");
  app.add_option("--polygons", polygons, "Of the gallery, for the part polygons");
  app.add_option("--parts", parts, "experiment, nodes, polygons, coverage");
  CLI11_PARSE(app, argc, argv);
  try {
    Context context;
    std::vector<ReportSection> sections;
    auto const wants = [&](char const* part) { return std::find(parts.begin(), parts.end(), part) != parts.end(); };
    if (wants("experiment") || wants("nodes")) {
      ModelCamera camera(make_gallery(100'000), {}, context);
      if (wants("experiment")) experiment(camera, frames, sections, context);
      if (wants("nodes")) over_nodes(camera, sections, context);
    }
    if (wants("polygons")) over_polygons(polygons, context);
    if (wants("coverage")) coverage(hand, gap, context);
    if (!plot.empty()) write_file(plot, html_page("Walkthroughs", "", sections));
  } catch (Error const& error) {
    std::cerr << error.what() << '\n';
    return static_cast<int>(error.code());
  }
}
