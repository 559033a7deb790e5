// What `mesh` makes of depth maps, in what time, and what peers make of them. All errors are those of an independent
// rasteriser of the result against the input pixels.
//   bench_mesh --data FOLDER [--peers] [--slow] [--plot FILE]   the bunny's first scan and a synthetic map with steps
//   bench_mesh --set SET ...                                    the views of scan sets
//   bench_mesh --auto                                           the automatic tolerance on synthetic views
#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <chrono>
#include <iostream>

#include "acquire/scan_set_file.h"
#include "base/error.h"
#include "base/files.h"
#include "base/html.h"
#include "base/median.h"
#include "bench/mesh_depth_maps.h"
#include "bench/mesh_peers.h"
#include "mesh/view_mesh.h"
#include "synth/scanner.h"
#include "tests/mesh/reference_raster.h"

namespace scanview {
namespace {

namespace fs = std::filesystem;

struct Settings {
  fs::path data, plot;
  std::vector<fs::path> sets;
  std::vector<double> tolerances = {1.0, 0.5};
  bool peers = false, slow = false, automatic = false;
};

double seconds_since(std::chrono::steady_clock::time_point start) {
  return std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
}

struct Row {
  std::string who;
  std::size_t triangles = 0;
  double rms = 0, rms_away = 0, max = 0, uncovered = 0;  ///< over valid pixels; away: from steps
  std::size_t spanning = 0;                              ///< triangles that cover pixels of several surfaces
  double seconds = 0;
};

/// Triangles that cover centres of pixels of more than one surface.
std::size_t count_spanning(DepthMap const& map, Camera const& camera, TriangleMesh const& mesh) {
  if (map.surface.empty()) return 0;
  std::size_t count = 0;
  for (Eigen::Vector3i const& triangle : mesh.triangles) {
    int first = -1;
    bool spans = false;
    testing::for_each_centre(camera, mesh, triangle, [&](int x, int y, double) {
      int const surface = map.surface(y, x);
      if (first < 0) first = surface;
      spans = spans || surface != first;
    });
    count += spans;
  }
  return count;
}

Row judge(DepthMap const& map, std::string const& who, TriangleMesh const& mesh, double seconds) {
  RangeImage const image = to_range_image(map, false);
  testing::ReferenceRaster const raster = testing::reference_raster(image, mesh);
  cv::Mat1b const away = away_from_steps(map);
  Row row;
  row.who = who;
  row.triangles = mesh.triangles.size();
  row.seconds = seconds;
  double squares_away = 0, count = 0, count_away = 0;
  for (int y = 0; y < away.rows; ++y)
    for (int x = 0; x < away.cols; ++x) {
      if (!image.has_depth(x, y) || raster.count(y, x) == 0) continue;
      double const square = raster.worst_error(y, x) * raster.worst_error(y, x);
      ++count;
      if (!away(y, x)) continue;
      squares_away += square;
      ++count_away;
    }
  row.rms = std::sqrt(raster.squares / count);
  row.rms_away = std::sqrt(squares_away / count_away);
  row.max = raster.max_error;
  row.uncovered = double(raster.uncovered) / double(raster.object);
  row.spanning = count_spanning(map, image.camera, mesh);
  return row;
}

void print(Row const& row) {
  fmt::print(
      "  {:34} {:7} triangles | rms {:.4f}, away from steps {:.4f}, max {:8.4f} | uncovered {:.3f} %, spanning {:5} "
      "| {:.3f} s\n",
      row.who, row.triangles, row.rms, row.rms_away, row.max, 100 * row.uncovered, row.spanning, row.seconds);
  std::cout.flush();
}

MeshOptions with_tolerance(double tolerance) {
  MeshOptions options;
  options.tolerance_kind = MeshOptions::Tolerance::units;
  options.tolerance = tolerance;
  return options;
}

/// Greedy insertion as published: the whole raster in one piece, vertices at their pixels' depths.
MeshOptions plain(MeshOptions options) {
  options.fit = MeshOptions::Fit::none;
  options.max_angle_deg = 90;
  options.step_sigmas = 1e9;
  return options;
}
/// Ours, but in one piece across steps and holes, as most peers leave it.
MeshOptions in_one_piece(MeshOptions options) {
  options.max_angle_deg = 90;
  options.step_sigmas = 1e9;
  return options;
}

Row run_ours(DepthMap const& map, std::string const& who, MeshOptions const& options, bool everywhere) {
  Context context;
  RangeImage const image = to_range_image(map, everywhere);
  std::vector<double> seconds;
  ViewMeshResult result;
  constexpr int kRuns = 3;
  for (int run = 0; run < kRuns; ++run) {
    auto const start = std::chrono::steady_clock::now();
    result = mesh_range_image(image, options, context);
    seconds.push_back(seconds_since(start));
  }
  return judge(map, who, result.view_mesh.mesh, median(seconds));
}

/// RMS and time against triangles.
using Curves = std::map<std::string, std::vector<Row>>;

void run_peers(DepthMap const& map, int triangles, bool slow, Curves& curves) {
  TriangleMesh const grid = full_grid(to_range_image(map, true));
  struct Peer {
    MeshPeer peer;
    char const* name;
    bool slow;
  };
  for (Peer const& peer : {Peer{MeshPeer::meshoptimizer, "meshoptimizer", false},
                           Peer{MeshPeer::lindstrom_turk, "CGAL Lindstrom-Turk", true},
                           Peer{MeshPeer::garland_heckbert, "CGAL Garland-Heckbert", true}}) {
    if (peer.slow && !slow && grid.triangles.size() > 500000) continue;
    auto const start = std::chrono::steady_clock::now();
    TriangleMesh const mesh = simplify_with_peer(peer.peer, grid, triangles);
    double const seconds = seconds_since(start);
    curves[peer.name].push_back(judge(map, peer.name, mesh, seconds));
    print(curves[peer.name].back());
  }
}

/// Our time over meshoptimizer's to as many triangles, in turns, so that both meet the same machine.
void compare_times(DepthMap const& map, MeshOptions const& options, int triangles) {
  RangeImage const image = to_range_image(map, false);
  TriangleMesh const grid = full_grid(to_range_image(map, true));
  std::vector<double> ours, theirs;
  constexpr int kTurns = 7;
  for (int turn = 0; turn < kTurns; ++turn) {
    Context context;
    auto start = std::chrono::steady_clock::now();
    mesh_range_image(image, options, context);
    ours.push_back(seconds_since(start));
    start = std::chrono::steady_clock::now();
    simplify_with_peer(MeshPeer::meshoptimizer, grid, triangles);
    theirs.push_back(seconds_since(start));
  }
  fmt::print("  time / meshoptimizer's {:.3f} ({:.3f} s and {:.3f} s, medians of {} in turns, one thread)\n",
             median(ours) / median(theirs), median(ours), median(theirs), kTurns);
}

void bench_map(DepthMap const& map, Settings const& settings, Curves& curves) {
  for (double const tolerance : settings.tolerances) {
    fmt::print("{} {} x {}, tolerance {}\n", map.name, map.height.cols, map.height.rows, tolerance);
    MeshOptions const options = with_tolerance(tolerance);
    auto const note = [&](std::string const& curve, Row const& row) {
      curves[curve].push_back(row);
      print(row);
      return row;
    };
    Row const insertion = note("plain insertion", run_ours(map, "plain insertion, one piece", plain(options), true));
    MeshOptions same_count = options;
    same_count.max_triangles = int(insertion.triangles);
    Row const piece =
        note("scanview, one piece", run_ours(map, "scanview, one piece, as many", in_one_piece(same_count), true));
    Row const torn_many = run_ours(map, "scanview, as many", same_count, false);
    print(torn_many);
    Row const torn = note("scanview", run_ours(map, "scanview", options, false));
    for (auto const& [placement, name] : {std::pair(MeshOptions::Placement::probing, "scanview, probing"),
                                          std::pair(MeshOptions::Placement::decimation, "scanview, decimation")}) {
      if (placement == MeshOptions::Placement::decimation && !settings.slow && map.height.total() > 500000) continue;
      MeshOptions other = options;
      other.placement = placement;
      note(name, run_ours(map, name, other, false));
    }
    if (settings.peers) {
      compare_times(map, options, int(torn.triangles));
      run_peers(map, int(torn.triangles), settings.slow, curves);
      if (map.height.total() < 500000) run_peers(map, int(insertion.triangles), settings.slow, curves);
    }
    fmt::print("  rms of as many / plain: one piece {:.3f}, torn {:.3f}; triangles / plain at that tolerance {:.3f}\n",
               piece.rms / insertion.rms, torn_many.rms / insertion.rms,
               double(torn.triangles) / double(insertion.triangles));
  }
}

void write_plot(fs::path const& path, std::map<std::string, Curves> const& maps) {
  std::vector<std::string> const colors = {"#2a7a4b", "#7ab648", "#c0603a", "#8a4fa8",
                                           "#3a6fc0", "#c09a2a", "#606060", "#b03070"};
  std::vector<ReportSection> sections;
  for (auto const& [map, curves] : maps) {
    std::string html;
    struct Axis {
      char const* label;
      double Row::*value;
    };
    for (Axis const& axis : {Axis{"RMS error, away from steps", &Row::rms_away}, Axis{"RMS error", &Row::rms},
                             Axis{"greatest error", &Row::max}, Axis{"seconds", &Row::seconds}}) {
      PlotOptions options;
      options.x_label = "triangles";
      options.y_label = axis.label;
      options.log_x = options.log_y = true;
      options.width = 720, options.height = 440;
      std::vector<PlotCurve> plotted;
      for (auto const& [who, rows] : curves) {
        PlotCurve curve{who, {}, colors[plotted.size() % colors.size()], false};
        for (Row const& row : rows) curve.points.emplace_back(double(row.triangles), row.*axis.value);
        std::sort(curve.points.begin(), curve.points.end(),
                  [](cv::Point2d const& a, cv::Point2d const& b) { return a.x < b.x; });
        plotted.push_back(curve);
      }
      html += svg_plot(plotted, options);
    }
    sections.push_back({map, map, html});
  }
  write_file(path, html_page("Meshes: error and time against triangles", "", sections));
}

void bench_set(fs::path const& folder) {
  Context context;
  ScanSet const set = read_scan_set(folder, context);
  fmt::print("{}: {} views\n", folder.string(), set.views.size());
  struct Total {
    double triangles = 0, squares = 0, over_sigma = 0, depths = 0, uncovered = 0, seconds = 0, max = 0;
  };
  auto const measure = [&](std::string const& who, MeshOptions const& options, std::vector<int> const* counts) {
    Total total;
    std::vector<int> triangles;
    for (std::size_t v = 0; v < set.views.size(); ++v) {
      RangeImage const& image = set.views[v].image;
      MeshOptions own = options;
      if (counts) own.max_triangles = (*counts)[v];
      auto const start = std::chrono::steady_clock::now();
      ViewMeshResult const result = mesh_range_image(image, own, context);
      total.seconds += seconds_since(start);
      testing::ReferenceRaster const raster = testing::reference_raster(image, result.view_mesh.mesh);
      triangles.push_back(int(result.view_mesh.mesh.triangles.size()));
      total.triangles += triangles.back();
      total.squares += raster.squares;
      for (int y = 0; y < image.depth.rows; ++y)
        for (int x = 0; x < image.depth.cols; ++x)
          if (image.has_depth(x, y) && raster.count(y, x) > 0) {
            double const relative = raster.worst_error(y, x) / image.sigma(y, x);
            total.over_sigma += relative * relative;
          }
      total.depths += double(raster.object - raster.uncovered);
      total.uncovered += double(raster.uncovered);
      total.max = std::max(total.max, raster.max_over_sigma);
    }
    double const views = double(set.views.size());
    fmt::print(
        "  {:34} {:7.0f} triangles a view | rms {:.4g} {}, {:.3f} sigma, max {:.2f} sigma | uncovered {:.3f} % | "
        "{:.3f} s a view\n",
        who, total.triangles / views, std::sqrt(total.squares / total.depths), to_string(set.unit),
        std::sqrt(total.over_sigma / total.depths), total.max, 100 * total.uncovered / (total.depths + total.uncovered),
        total.seconds / views);
    std::cout.flush();
    return triangles;
  };
  measure("scanview, auto", {}, nullptr);
  for (double const sigmas : {3.0, 5.0, 8.0}) {
    MeshOptions options;
    options.tolerance_kind = MeshOptions::Tolerance::sigmas;
    options.tolerance = sigmas;
    measure(fmt::format("scanview, {} sigma", sigmas), options, nullptr);
    MeshOptions bare = options;
    bare.fit = MeshOptions::Fit::none;
    auto const counts = measure(fmt::format("insertion alone, {} sigma", sigmas), bare, nullptr);
    measure("scanview, as many", options, &counts);
  }
}

/// `--tolerance auto` against a sweep of tolerances, by the error to the true surface, on synthetic views with noise.
void bench_automatic() {
  for (std::string const model : {"dog", "basket", "statuette"})
    for (double const noise : {5e-4, 2e-3, 8e-3}) {
      SynthOptions options;
      options.views = 4;
      options.noise.depth_sigma = noise;
      Context context;
      SynthResult const synth = synthesize(builtin_model(model), options, context);
      auto const measure = [&](MeshOptions const& mesh_options) {
        double squares = 0, depths = 0, triangles = 0;
        for (std::size_t v = 0; v < synth.set.views.size(); ++v) {
          RangeImage const& image = synth.set.views[v].image;
          TriangleMesh const mesh = mesh_range_image(image, mesh_options, context).view_mesh.mesh;
          testing::ReferenceRaster const raster = testing::reference_raster(image, mesh);
          RangeImage truth = image;
          truth.depth = synth.true_depth[v];
          testing::ReferenceRaster const errors = testing::reference_raster(truth, mesh);
          for (int y = 0; y < image.depth.rows; ++y)
            for (int x = 0; x < image.depth.cols; ++x) {
              if (!image.has_depth(x, y) || raster.count(y, x) == 0) continue;
              double const relative = errors.worst_error(y, x) / image.sigma(y, x);
              squares += relative * relative;
              ++depths;
            }
          triangles += double(mesh.triangles.size());
        }
        return std::pair(std::sqrt(squares / depths), triangles / double(synth.set.views.size()));
      };
      auto const [automatic, count] = measure({});
      double best = INFINITY, best_at = 0, best_count = 0;
      MeshOptions swept;
      swept.tolerance_kind = MeshOptions::Tolerance::sigmas;
      for (swept.tolerance = 1.5; swept.tolerance < 25; swept.tolerance *= 1.25)
        if (auto const [error, triangles] = measure(swept); error < best) {
          best = error;
          best_at = swept.tolerance;
          best_count = triangles;
        }
      fmt::print(
          "{:10} noise {:.2g} of the radius: auto {:.3f} sigma from the truth, {:6.0f} triangles; best of the sweep "
          "{:.3f} at {:.2f} sigma, {:6.0f} triangles\n",
          model, noise, automatic, count, best, best_at, best_count);
      std::cout.flush();
    }
}

void bench(Settings const& settings) {
  MeshOptions const defaults;
  fmt::print("options: step_sigmas {}, max_angle_deg {}, min_patch_pixels {}, fit joint\n", defaults.step_sigmas,
             defaults.max_angle_deg, defaults.min_patch_pixels);
  for (fs::path const& set : settings.sets) bench_set(set);
  if (settings.automatic) bench_automatic();
  if (settings.data.empty()) return;
  std::map<std::string, Curves> maps;
  for (DepthMap const& map : {bunny_depth_map(settings.data), synthetic_depth_map()})
    bench_map(map, settings, maps[map.name]);
  if (!settings.plot.empty()) write_plot(settings.plot, maps);
}

}  // namespace
}  // namespace scanview

int main(int argc, char** argv) {
  scanview::Settings settings;
  CLI::App app("Triangles, error and time of meshes of depth maps");
  app.add_option("--data", settings.data, "Folder of bunny_range.tar.xz: the two depth maps");
  app.add_option("--set", settings.sets, "Scan sets");
  app.add_option("--tolerance", settings.tolerances, "Greatest errors, in units");
  app.add_option("--plot", settings.plot, "Page with error and time against triangles");
  app.add_flag("--peers", settings.peers, "CGAL's simplification, and meshoptimizer where it is installed");
  app.add_flag("--auto", settings.automatic, "The automatic tolerance against a sweep, on synthetic views");
  app.add_flag("--slow", settings.slow, "Also the slow ones on the large map: minutes");
  CLI11_PARSE(app, argc, argv);
  try {
    scanview::bench(settings);
  } catch (std::exception const& error) {
    std::cerr << "error: " << error.what() << '\n';
    return 1;
  }
  return 0;
}
