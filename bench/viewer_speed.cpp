#include "bench/viewer_speed.h"

#include <fmt/format.h>

#include <chrono>
#include <cmath>
#include <ctime>
#include <iostream>
#include <numbers>
#include <opencv2/core.hpp>

#include "base/error.h"
#include "base/median.h"
#include "mesh/view_mesh.h"
#include "synth/scanner.h"
#include "viewer/evaluate/image_quality.h"
#include "viewer/view_based/view_based_renderer.h"

namespace scanview {
namespace {

using Eigen::Vector3d;

/// A round, bumpy, many-coloured object: what fills a picture evenly.
TriangleMesh bumpy_ball() {
  constexpr int kAround = 700, kRings = 350;
  TriangleMesh mesh;
  for (int r = 0; r <= kRings; ++r) {
    double const e = std::numbers::pi * r / kRings;
    for (int i = 0; i < kAround; ++i) {
      double const a = 2 * std::numbers::pi * i / kAround;
      Vector3d const n(std::sin(e) * std::sin(a), std::cos(e), std::sin(e) * std::cos(a));
      double const bump = std::sin(17 * n.x()) + std::sin(19 * n.y() + 1) + std::sin(23 * n.z() + 2);
      mesh.vertices.push_back(((50 + 0.5 * bump) * n).cast<float>());
      auto const wave = [&](double x) { return static_cast<std::uint8_t>(130 + 90 * std::sin(x)); };
      mesh.colors.emplace_back(wave(31 * n.z()), wave(43 * n.x() + 20 * n.y()), wave(9 * n.y() + bump));
    }
  }
  for (int r = 0; r < kRings; ++r) {
    for (int i = 0; i < kAround; ++i) {
      int const a = r * kAround + i, b = r * kAround + (i + 1) % kAround, c = a + kAround, d = b + kAround;
      if (r > 0) mesh.triangles.emplace_back(a, c, b);
      if (r + 1 < kRings) mesh.triangles.emplace_back(b, c, d);
    }
  }
  return mesh;
}

double process_ms() {
  timespec time{};
  clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &time);
  return 1e3 * static_cast<double>(time.tv_sec) + 1e-6 * static_cast<double>(time.tv_nsec);
}

struct Times {
  std::vector<double> cpu, wall;
};

Frame measured(Renderer& renderer, Camera const& camera, Eigen::Isometry3d const& pose, Times& times) {
  auto const start = std::chrono::steady_clock::now();
  double const before = process_ms();
  Frame frame = renderer.render(camera, pose);
  times.cpu.push_back(process_ms() - before);
  times.wall.push_back(std::chrono::duration<double, std::milli>(std::chrono::steady_clock::now() - start).count());
  return frame;
}

double covered(Frame const& frame) {
  int count = 0;
  for (auto const& pixel : frame.color) count += pixel[3] != 0;
  return count / static_cast<double>(frame.color.total());
}

double psnr_of_both(Frame const& a, Frame const& b) {
  cv::Mat alpha_a, alpha_b, color_a, color_b;
  cv::extractChannel(a.color, alpha_a, 3);
  cv::extractChannel(b.color, alpha_b, 3);
  std::vector<int> const bgr{0, 0, 1, 1, 2, 2};
  color_a.create(a.color.size(), CV_8UC3);
  color_b.create(b.color.size(), CV_8UC3);
  cv::mixChannels({a.color}, {color_a}, bgr);
  cv::mixChannels({b.color}, {color_b}, bgr);
  return psnr(color_a, color_b, alpha_a & alpha_b);
}

}  // namespace

void bench_speed(int frames) {
  Context context;
  // Seven views 20 degrees about the pole: from there three have weight, and the others fill.
  SynthOptions synth_options;
  synth_options.views = 7;
  synth_options.layout = SynthOptions::Layout::circle;
  synth_options.elevation_deg = 70;
  synth_options.width = synth_options.height = 800;
  SynthResult const synth = synthesize(bumpy_ball(), synth_options, context);
  Camera const source = synth.set.views[0].image.camera;
  double const distance = (synth.true_poses[0].translation() - synth.set.center).norm();
  // Between the views, looking down along y.
  Eigen::Isometry3d pose = Eigen::Isometry3d::Identity();
  pose.linear().col(0) = Vector3d::UnitX();
  pose.linear().col(1) = Vector3d::UnitZ();
  pose.linear().col(2) = -Vector3d::UnitY();
  pose.translation() = synth.set.center + distance * Vector3d(0.01, 1, 0.02).normalized();

  std::unique_ptr<GlContext> gl_context;
  try {
    gl_context = make_offscreen_context();
    gl_context->make_current();
    fmt::print("speed: OpenGL {}\n", is_hardware(*gl_context) ? "on a graphics card" : "in software");
  } catch (Error const& error) {
    fmt::print("speed: without OpenGL ({})\n", error.what());
  }
  for (int const triangles : {20000, 100000}) {
    MeshOptions mesh_options;
    mesh_options.tolerance_kind = MeshOptions::Tolerance::units;
    mesh_options.tolerance = 1e-6;
    mesh_options.max_triangles = triangles;
    mesh_options.fit = MeshOptions::Fit::none;
    std::vector<ViewMesh> meshes;
    double mean_triangles = 0;
    for (auto const& view : synth.set.views) {
      meshes.push_back(mesh_range_image(view.image, mesh_options, context).view_mesh);
      mean_triangles += static_cast<double>(meshes.back().mesh.triangles.size()) / 7;
    }
    auto const library = std::make_shared<ViewLibrary>(synth.set, meshes);
    for (int const fill : {0, ViewBasedOptions().fill_views}) {
      ViewBasedOptions options;
      options.fill_views = fill;
      auto const cpu = make_cpu_renderer(library, options);
      std::unique_ptr<ViewBasedRenderer> gl;
      if (gl_context) gl = make_gl_renderer(*gl_context, library, options);
      // Zoomed until the object covers seven tenths.
      Camera camera = source;
      double share = 0;
      for (int i = 0; i < 4; ++i) {
        share = covered(cpu->render(camera, pose));
        double const zoom = std::sqrt(0.7 / share);
        if (i < 3)
          camera = Camera::perspective(800, 800, zoom * camera.fx(), zoom * camera.fy(), camera.cx(), camera.cy());
      }
      Times of_cpu, of_gl, warming;
      Frame by_cpu, by_gl;
      for (int i = 0; i < 3; ++i) {
        by_cpu = measured(*cpu, camera, pose, warming);
        if (gl) by_gl = measured(*gl, camera, pose, warming);
      }
      for (int i = 0; i < frames; ++i) {
        measured(*cpu, camera, pose, of_cpu);
        if (gl) measured(*gl, camera, pose, of_gl);
      }
      fmt::print("  {:6.0f} triangles a view, {} views, {:.0f} % covered | CPU back end {:6.2f} CPU-ms, {:6.2f} ms",
                 mean_triangles, cpu->view_weights(camera, pose).size(), 100 * share, median(of_cpu.cpu),
                 median(of_cpu.wall));
      if (gl) {
        fmt::print(" | OpenGL {:7.2f} CPU-ms, {:7.2f} ms | OpenGL / CPU {:.2f} in CPU-ms, {:.2f} in ms | {:.1f} dB",
                   median(of_gl.cpu), median(of_gl.wall), median(of_gl.cpu) / median(of_cpu.cpu),
                   median(of_gl.wall) / median(of_cpu.wall), psnr_of_both(by_cpu, by_gl));
      }
      fmt::print("\n");
      std::cout.flush();
    }
  }
}

}  // namespace scanview
