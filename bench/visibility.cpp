// Precomputed visibility: culling rate against wrong pixels and against build time, beside cone culling, back-face
// culling and the exact limit, all over the same unseen eyes.
#include <fmt/format.h>
#include <tbb/parallel_for.h>

#include <CLI/CLI.hpp>
#include <Eigen/Geometry>
#include <algorithm>
#include <chrono>
#include <iostream>
#include <limits>
#include <map>

#include "base/error.h"
#include "base/files.h"
#include "base/html.h"
#include "synth/visible_triangles.h"
#include "viewer/visibility/visibility_check.h"
#include "viewer/visibility/visibility_file.h"
#ifdef SCANVIEW_WITH_MESHOPTIMIZER
#include <meshoptimizer.h>
#endif

namespace {

using namespace scanview;

constexpr int kRaysAPolygon = 12, kPixels = 1024;

double seconds() { return std::chrono::duration<double>(std::chrono::steady_clock::now().time_since_epoch()).count(); }

struct Row {
  std::string name;
  double culled = 0, wrong = 0, build_s = 0, bits = 0, select_us = 0, ranges = 0;
  std::size_t patches = 0;
};

Row measured(std::string name, PolygonModel const& model, VisibilityOptions const& options, bool facing,
             std::vector<Eigen::Vector3d> const& eyes, Context& context) {
  Row row{std::move(name)};
  VisibilityTimes times;
  VisibilityField const field = build_visibility(model, options, context, &times);
  TriangleMesh const drawn = drawn_mesh(model.mesh, field.patches);
  auto const figures = check_visibility(field, drawn, model.polygons, facing, eyes, kPixels, context);
  row.culled = figures.culling_rate;
  row.wrong = static_cast<double>(figures.wrong_pixels) / static_cast<double>(figures.pixels);
  row.build_s = times.patches + times.sampling;
  row.bits = 8.0 * static_cast<double>(format_visibility(field, model.mesh).size()) /
             static_cast<double>(model.polygon_count());
  row.patches = field.patches.count();
  row.ranges = figures.ranges;
  VisibilitySelector selector(field, drawn, facing);
  row.select_us = std::numeric_limits<double>::infinity();
  for (int turn = 0; turn < 5; ++turn) {
    double const start = seconds();
    for (auto const& eye : eyes) selector.select(eye);
    row.select_us = std::min(row.select_us, 1e6 * (seconds() - start) / static_cast<double>(eyes.size()));
  }
  return row;
}

/// What no camera outside could see of closed bodies: triangles that turn away.
Row back_faces(PolygonModel const& model, VisibilityField const& ball, std::vector<Eigen::Vector3d> const& eyes) {
  Row row{"back faces alone"};
  TrianglePlanes const planes(model.mesh, ball.center, ball.radius);
  for (auto const& eye : eyes) {
    EyePoint const e = planes.eye(eye);
    std::size_t away = 0;
    for (std::size_t i = 0; i < model.mesh.triangles.size(); ++i) away += planes.height(i, e) <= 0 ? 1U : 0U;
    row.culled += static_cast<double>(away) / static_cast<double>(model.mesh.triangles.size() * eyes.size());
  }
  return row;
}

#ifdef SCANVIEW_WITH_MESHOPTIMIZER
/// Meshlets of 16 triangles, cone weight 1, apex test.
Row cones(PolygonModel const& model, std::vector<Eigen::Vector3d> const& eyes) {
  Row row{"cones (meshoptimizer, 16 triangles)"};
  double const start = seconds();
  constexpr std::size_t kTriangles = 16, kVertices = 48;
  std::vector<unsigned> indices;
  for (auto const& t : model.mesh.triangles) {
    for (int k = 0; k < 3; ++k) indices.push_back(static_cast<unsigned>(t[k]));
  }
  float const* const positions = model.mesh.vertices.front().data();
  std::size_t const stride = sizeof(Eigen::Vector3f);
  std::vector<meshopt_Meshlet> meshlets(meshopt_buildMeshletsBound(indices.size(), kVertices, kTriangles));
  std::vector<unsigned> vertices(meshlets.size() * kVertices);
  std::vector<unsigned char> triangles(meshlets.size() * kTriangles * 3);
  meshlets.resize(meshopt_buildMeshlets(meshlets.data(), vertices.data(), triangles.data(), indices.data(),
                                        indices.size(), positions, model.mesh.vertices.size(), stride, kVertices,
                                        kTriangles, 1.0F));
  std::vector<meshopt_Bounds> bounds;
  for (auto const& m : meshlets)
    bounds.push_back(meshopt_computeMeshletBounds(&vertices[m.vertex_offset], &triangles[m.triangle_offset],
                                                  m.triangle_count, positions, model.mesh.vertices.size(), stride));
  row.build_s = seconds() - start;
  row.patches = meshlets.size();
  for (auto const& eye : eyes) {
    std::size_t away = 0;
    for (std::size_t i = 0; i < bounds.size(); ++i) {
      Eigen::Vector3f const apex(bounds[i].cone_apex), axis(bounds[i].cone_axis);
      if ((apex - eye.cast<float>()).normalized().dot(axis) >= bounds[i].cone_cutoff)
        away += meshlets[i].triangle_count;
    }
    row.culled += static_cast<double>(away) / static_cast<double>(model.mesh.triangles.size() * eyes.size());
  }
  return row;
}
#endif

double exact_limit(PolygonModel const& model, std::vector<Eigen::Vector3d> const& eyes, Context& context) {
  RayScene const scene(model.mesh.vertices, model.mesh.triangles);
  double hidden = 0;
  for (auto const& eye : eyes) {
    auto const visible =
        visible_triangles(scene, model.mesh.vertices, model.mesh.triangles, eye, kRaysAPolygon, context);
    std::vector<std::uint8_t> polygon(model.polygon_count());
    for (std::size_t i = 0; i < visible.size(); ++i) {
      if (visible[i]) polygon[model.polygons.empty() ? i : static_cast<std::size_t>(model.polygons[i])] = 1;
    }
    hidden += static_cast<double>(std::count(polygon.begin(), polygon.end(), 0)) /
              static_cast<double>(polygon.size() * eyes.size());
  }
  return hidden;
}

/// The same ID pictures by rays and by our rasteriser, on all processors: seconds for `pictures` of them.
void compare_with_rays(PolygonModel const& model, VisibilityField const& ball, int pictures, int resolution) {
  SampleSphere const sphere = SampleSphere::octahedron(4);
  std::vector<SampleCamera> cameras;
  for (int i = 0; i < pictures; ++i) {
    std::size_t const at = static_cast<std::size_t>(i) * 37 % sphere.directions().size();
    cameras.push_back(ball_camera(ball.center, ball.radius, sphere.directions()[at], 2, resolution));
  }
  RayScene const scene(model.mesh.vertices, model.mesh.triangles);
  double start = seconds();
  tbb::parallel_for(std::size_t{0}, cameras.size(), [&](std::size_t i) {
    Eigen::Isometry3d const& pose = cameras[i].object_from_camera;
    Eigen::Vector3f const origin = pose.translation().cast<float>();
    std::uint64_t sum = 0;
    for (int y = 0; y < resolution; ++y) {
      for (int x = 0; x < resolution; x += kPacket) {
        RayDirections rays;
        for (int k = 0; k < kPacket; ++k)
          rays[static_cast<std::size_t>(k)] = (pose.linear() * cameras[i].camera.unproject(x + k, y, 1)).cast<float>();
        for (RayHit const& hit : scene.first_hits(origin, rays)) sum += static_cast<std::uint64_t>(hit.triangle + 1);
      }
    }
    if (sum == 1) std::cout << "";
  });
  double const rays_s = seconds() - start;
  Context context;
  VisibilityOptions options;
  options.cameras = cameras;
  options.resolution = resolution;
  for (Seen const seen : {Seen::in_picture, Seen::nearly}) {
    options.seen = seen;
    VisibilityTimes times;
    build_visibility(model, options, context, &times);
    fmt::print("  {} pictures of {}²: rays {:.2f} s, ours {:.2f} s ({}): {:.2f} of it; 1026 in {:.2f} s\n", pictures,
               resolution, rays_s, times.sampling,
               seen == Seen::nearly ? "nearly seen, patches chosen" : "pictures only", times.sampling / rays_s,
               times.sampling / pictures * 1026);
  }
}

}  // namespace

int main(int argc, char** argv) {
  CLI::App app("Culling rate against wrong pixels and build time");
  std::vector<std::string> files;
  std::size_t eye_count = 200;
  std::string plot;
  bool sweep = false;
  app.add_option("models", files, "Polygon models")->required();
  app.add_option("--eyes", eye_count, "Unseen eyes at 2 to 5 radii");
  app.add_option("--plot", plot, "A page with the plots");
  app.add_flag("--sweep", sweep, "Also over samples, patches and widening");
  CLI11_PARSE(app, argc, argv);
  try {
    std::vector<ReportSection> sections;
    for (auto const& file : files) {
      PolygonModel const model = read_polygon_model(file);
      Context context;
      VisibilityField const ball = field_ball(model);
      auto const eyes = unseen_eyes(ball, eye_count, 2, 5, 7);
      std::vector<Eigen::Vector3d> const few(
          eyes.begin(), eyes.begin() + static_cast<std::ptrdiff_t>(std::min<std::size_t>(eyes.size(), 40)));
      double const limit = exact_limit(model, few, context);
      fmt::print("{}: {} polygons, exact limit {:.1f} % ({} rays a polygon, {} eyes)\n", file, model.polygon_count(),
                 100 * limit, kRaysAPolygon, few.size());
      std::map<std::string, std::vector<Row>> groups;
      VisibilityOptions const standard;
      groups["ours"].push_back(measured("ours, as it is", model, standard, true, eyes, context));
      VisibilityOptions fine = standard;
      fine.shells = {2, 2.4, 3, 4.5, std::numeric_limits<double>::infinity()};
      fine.patches = model.polygon_count() / 8;
      groups["ours, fine"].push_back(measured("ours, 5 shells, 8 polygons a patch", model, fine, true, few, context));
      VisibilityOptions conservative = standard;
      conservative.conservative = true;
      groups["conservative"].push_back(measured("conservative", model, conservative, false, eyes, context));
      VisibilityOptions id = standard;
      id.method = VisibilityMethod::id;
      id.seen = Seen::in_picture;
      id.shells = {2};
      groups["id (2001)"].push_back(measured("id, pictures only, as the paper", model, id, false, few, context));
      VisibilityOptions patch = id;
      patch.method = VisibilityMethod::patch;
      patch.cut = PatchCut::even;
      patch.patches = 1000;
      groups["patch (2002)"].push_back(
          measured("1000 patches, pictures only, as the paper", model, patch, false, few, context));
      if (sweep) {
        for (std::size_t const samples : {66, 258, 4098}) {
          VisibilityOptions options = standard;
          options.samples = samples;
          groups["ours"].push_back(
              measured(fmt::format("ours, {} samples", samples), model, options, true, few, context));
          id.samples = patch.samples = samples;
          groups["id (2001)"].push_back(
              measured(fmt::format("id, {} samples", samples), model, id, false, few, context));
          groups["patch (2002)"].push_back(
              measured(fmt::format("1000 patches, {} samples", samples), model, patch, false, few, context));
        }
        for (double const widening : {0.15, 0.5}) {
          VisibilityOptions options = standard;
          options.widening = widening;
          groups["ours"].push_back(
              measured(fmt::format("ours, widening {}", widening), model, options, true, few, context));
        }
      }
#ifdef SCANVIEW_WITH_MESHOPTIMIZER
      groups["cones"].push_back(cones(model, eyes));
#endif
      groups["back faces"].push_back(back_faces(model, ball, eyes));
      groups["exact limit"].push_back({"exact limit", limit});
      std::vector<std::vector<std::string>> table{
          {"", "culled %", "of limit", "wrong pixels", "build s", "patches", "bits", "select us", "ranges"}};
      std::vector<PlotCurve> wrong, build;
      char const* const colors[] = {"#36c", "#c33", "#393", "#a5a", "#e80", "#088", "#888", "#444"};
      std::size_t color = 0;
      for (auto const& [name, rows] : groups) {
        PlotCurve against_wrong{name, {}, colors[color % 8], true}, against_build{name, {}, colors[color % 8], true};
        ++color;
        for (Row const& row : rows) {
          table.push_back({row.name, fmt::format("{:.1f}", 100 * row.culled), fmt::format("{:.3f}", row.culled / limit),
                           fmt::format("{:.2g}", row.wrong), fmt::format("{:.2f}", row.build_s),
                           fmt::format("{}", row.patches), fmt::format("{:.1f}", row.bits),
                           fmt::format("{:.1f}", row.select_us), fmt::format("{:.0f}", row.ranges)});
          against_wrong.points.emplace_back(std::max(row.wrong, 1e-9), 100 * row.culled);
          against_build.points.emplace_back(std::max(row.build_s, 1e-2), 100 * row.culled);
        }
        wrong.push_back(against_wrong);
        build.push_back(against_build);
      }
      for (auto const& cells : table) {
        fmt::print("  {:<42}", cells[0]);
        for (std::size_t c = 1; c < cells.size(); ++c) fmt::print("{:>13}", cells[c]);
        fmt::print("\n");
      }
      compare_with_rays(model, ball, 256, 512);
      std::fflush(stdout);
      sections.push_back(
          {"model", file,
           html_table(table) + html_row({svg_plot(wrong, {"wrong pixels (none: 1e-9)", "culling rate %", true}),
                                         svg_plot(build, {"build, seconds", "culling rate %", true})})});
    }
    if (!plot.empty()) write_file(plot, html_page("Visibility: what is culled, at what price", "", sections));
  } catch (Error const& error) {
    std::cerr << error.what() << '\n';
    return static_cast<int>(error.code());
  }
  return 0;
}
