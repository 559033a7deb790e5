// LDI trees (Chang, Bishop, Lastra 1998) in the church: error against time over the number of reference images, the
// resolution of cells and the distance of the eye, beside warping all images, against ray tracing.
#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <chrono>
#include <iostream>
#include <map>
#include <opencv2/core.hpp>

#include "base/error.h"
#include "base/html.h"
#include "base/median.h"
#include "base/srgb.h"
#include "synth/church.h"
#include "synth/church_views.h"
#include "synth/model_camera.h"
#include "viewer/layered/image_warper.h"
#include "viewer/layered/ldi_builder.h"
#include "viewer/layered/ldi_renderer.h"
#include "viewer/select/camera_path.h"

namespace {

using namespace scanview;
using Eigen::Vector3d;

double seconds() { return std::chrono::duration<double>(std::chrono::steady_clock::now().time_since_epoch()).count(); }

/// What a frame should look like.
struct Truth {
  Eigen::Isometry3d pose;
  cv::Mat3b picture;
  cv::Mat1b counts;  ///< pixels that are compared
  cv::Mat1b seen;    ///< pixels whose surface some reference shows; empty: not known
};

struct Scene {
  Camera camera = Camera::perspective(512, 512, 256, 256, 255.5, 255.5);
  std::vector<View> references;
  std::vector<Truth> path;
};

/// Whether any of the first `count` references shows the point: its depth there agrees to half a percent.
bool is_seen(std::vector<View> const& references, std::size_t count, Vector3d const& point) {
  for (std::size_t i = 0; i < count; ++i) {
    View const& view = references[i];
    Vector3d const p = view.object_from_camera->inverse() * point;
    if (p.z() <= 0) continue;
    Eigen::Vector2d const at = view.image.camera.project(p);
    if (!view.image.camera.contains(at)) continue;
    int const x = static_cast<int>(std::lround(at.x())), y = static_cast<int>(std::lround(at.y()));
    constexpr double kSame = 0.005;
    if (view.image.has_depth(x, y) && std::abs(double(view.image.depth(y, x)) - p.z()) < kSame * p.z()) return true;
  }
  return false;
}

Scene capture_scene(std::size_t every, Context& context) {
  Scene scene;
  ModelCamera camera(make_church(200'000), {}, context);
  for (ChurchReference const& from : church_references(kChurchReferences)) {
    View view;
    view.name = fmt::format("{:03}", scene.references.size());
    view.object_from_camera = from.scene_from_camera;
    view.image = camera.capture(from.camera, from.scene_from_camera, context);
    scene.references.push_back(std::move(view));
  }
  std::vector<Eigen::Isometry3d> const path = church_path(40);
  for (std::size_t i = 0; i < path.size(); i += every) {
    RangeImage const image = camera.capture(scene.camera, path[i], context);
    Truth truth{path[i], camera.picture(scene.camera, path[i], context), {}, {}};
    truth.seen = cv::Mat1b(image.depth.size(), 0);
    for (int y = 0; y < image.depth.rows; ++y)
      for (int x = 0; x < image.depth.cols; ++x)
        if (image.has_depth(x, y))
          truth.seen(y, x) = is_seen(scene.references, 36, path[i] * image.point(x, y)) ? 1 : 0;
    scene.path.push_back(std::move(truth));
  }
  return scene;
}

/// Mean squared difference of what is drawn over `background` (sRGB, BGR), 0 to 255.
double squared_error(Frame const& frame, Truth const& truth, cv::Vec3b const& background) {
  double sum = 0;
  std::size_t count = 0;
  for (int y = 0; y < truth.picture.rows; ++y)
    for (int x = 0; x < truth.picture.cols; ++x) {
      if (!truth.counts.empty() && truth.counts(y, x) == 0) continue;
      cv::Vec4b const& pixel = frame.color(y, x);
      double const alpha = pixel[3] / 255.0;
      for (int c = 0; c < 3; ++c) {
        double const light = alpha * linear_from_srgb8()[pixel[c]] + (1 - alpha) * linear_from_srgb8()[background[c]];
        double const off = 255 * srgb_from_linear(light) - truth.picture(y, x)[c];
        sum += off * off;
      }
      count += 3;
    }
  return sum / double(std::max<std::size_t>(count, 1));
}

double decibel(double squared) { return 10 * std::log10(255.0 * 255.0 / std::max(squared, 1e-9)); }

/// A renderer on all frames of the path.
struct Measured {
  double milliseconds = 0, psnr = 0;
  double uncovered = 0;          ///< share of the pixels that some reference shows
  double cells = 0, splats = 0;  ///< of a frame
};
Measured measure(Renderer& renderer, Scene const& scene) {
  Measured result;
  auto const* const tree = dynamic_cast<LdiRenderer const*>(&renderer);
  std::vector<double> times;
  double error = 0;
  std::size_t uncovered = 0, seen = 0;
  for (Truth const& truth : scene.path) {
    Frame frame;
    double best = 1e9;
    for (int repeat = 0; repeat < 3; ++repeat) {
      double const start = seconds();
      frame = renderer.render(scene.camera, truth.pose);
      best = std::min(best, 1e3 * (seconds() - start));
    }
    times.push_back(best);
    if (tree != nullptr) {
      result.cells += double(tree->traversed().size()) / double(scene.path.size());
      result.splats += double(tree->splats()) / double(scene.path.size());
    }
    error += squared_error(frame, truth, {0, 0, 0}) / double(scene.path.size());
    for (int y = 0; y < frame.color.rows; ++y)
      for (int x = 0; x < frame.color.cols; ++x)
        if (truth.seen(y, x) != 0) ++seen, uncovered += frame.color(y, x)[3] < 128;
  }
  result.milliseconds = median(times);
  result.psnr = decibel(error);
  result.uncovered = double(uncovered) / double(std::max<std::size_t>(seen, 1));
  return result;
}

struct Built {
  std::shared_ptr<LdiTree const> tree;
  double seconds = 0;
};
Built build(Scene const& scene, std::size_t images, LdiOptions const& options, Context& context) {
  std::vector<View> const views(scene.references.begin(), scene.references.begin() + std::ptrdiff_t(images));
  double const start = seconds();
  LdiBuilder builder(options);
  builder.add(views, context);
  Built built;
  built.tree = std::make_shared<LdiTree>(builder.build(Unit::m, context));
  built.seconds = seconds() - start;
  return built;
}

struct Way {
  char const* name;
  LdiRenderOptions::Splats splats;
  double stamp_px;
};
std::vector<Way> const kWays = {
    {"blended", LdiRenderOptions::Splats::blended, 1},   {"blended", LdiRenderOptions::Splats::blended, 1.4},
    {"blended", LdiRenderOptions::Splats::blended, 2},   {"squares", LdiRenderOptions::Splats::squares, 1},
    {"squares", LdiRenderOptions::Splats::squares, 1.4}, {"squares", LdiRenderOptions::Splats::squares, 2},
    {"squares", LdiRenderOptions::Splats::squares, 2.8}};

void print(Way const& way, Measured const& m, Measured const& warped) {
  fmt::print(
      "  {} {:.1f} px  {:6.2f} ms ({:.2f} of warping)  {:.2f} dB ({:+.2f})  {:.4f} % uncovered  {:.0f} cells  {:.0f} "
      "splats\n",
      way.name, way.stamp_px, m.milliseconds, m.milliseconds / warped.milliseconds, m.psnr, m.psnr - warped.psnr,
      100 * m.uncovered, m.cells, m.splats);
}

/// The paper's charts 1 to 3, and the peer.
void over_images(Scene const& scene, std::vector<ReportSection>& sections, Context& context) {
  std::vector<PlotCurve> curves = {
      {"blended", {}, "#117733", true}, {"squares", {}, "#2277cc", true}, {"warping all", {}, "#cc7722", true}};
  PlotCurve memory{"tree", {}, "#117733", false}, input{"images", {}, "#999999", false};
  for (std::size_t const images : {2, 4, 8, 12, 24, 36}) {
    Built const built = build(scene, images, {}, context);
    ImageWarper warper({scene.references.begin(), scene.references.begin() + std::ptrdiff_t(images)});
    Measured const warped = measure(warper, scene);
    fmt::print("{} images: {:.1f} MB, {:.3f} of the images', built in {:.2f} s, {} cells\n", images,
               double(built.tree->bytes()) / 1e6, double(built.tree->bytes()) / double(built.tree->input_bytes),
               built.seconds, built.tree->cells.size());
    fmt::print("  warping all    {:6.2f} ms                   {:.2f} dB          {:.4f} % uncovered\n",
               warped.milliseconds, warped.psnr, 100 * warped.uncovered);
    curves[2].points.emplace_back(warped.milliseconds, warped.psnr);
    memory.points.emplace_back(double(images), double(built.tree->bytes()) / 1e6);
    input.points.emplace_back(double(images), double(built.tree->input_bytes) / 1e6);
    for (Way const& way : kWays) {
      LdiRenderOptions options;
      options.splats = way.splats;
      options.stamp_px = way.stamp_px;
      LdiRenderer renderer(built.tree, options);
      Measured const m = measure(renderer, scene);
      print(way, m, warped);
      curves[way.splats == LdiRenderOptions::Splats::squares ? 1 : 0].points.emplace_back(m.milliseconds, m.psnr);
      if (way.splats != LdiRenderOptions::Splats::blended || way.stamp_px != 1) continue;
      renderer.options.gaps = LdiRenderOptions::Gaps::background;
      Measured const bare = measure(renderer, scene);
      fmt::print("    without filling {:6.2f} ms  {:.2f} dB  {:.4f} % uncovered\n", bare.milliseconds, bare.psnr,
                 100 * bare.uncovered);
    }
  }
  PlotOptions errors, bytes;
  errors.x_label = "ms a frame (512 x 512)";
  errors.y_label = "PSNR (dB)";
  errors.log_x = true;
  bytes.x_label = "images";
  bytes.y_label = "MB";
  sections.push_back({"images", "2 to 36 images", svg_plot(curves, errors) + svg_plot({memory, input}, bytes)});
}

void over_resolution(Scene const& scene, std::vector<ReportSection>& sections, Context& context) {
  std::vector<PlotCurve> curves;
  Measured const none{1, 0, 0};
  for (int const resolution : {16, 32, 64, 128, 256}) {
    LdiOptions options;
    options.resolution = resolution;
    Built const built = build(scene, 36, options, context);
    fmt::print("cells of {0} x {0}: {1:.1f} MB, built in {2:.2f} s, {3} cells\n", resolution,
               double(built.tree->bytes()) / 1e6, built.seconds, built.tree->cells.size());
    PlotCurve curve{fmt::format("{}", resolution), {}, fmt::format("hsl({} 60% 40%)", 40 + resolution), true};
    for (Way const& way : kWays) {
      LdiRenderOptions how;
      how.splats = way.splats;
      how.stamp_px = way.stamp_px;
      LdiRenderer renderer(built.tree, how);
      Measured const m = measure(renderer, scene);
      print(way, m, none);
      curve.points.emplace_back(m.milliseconds, m.psnr);
    }
    curves.push_back(std::move(curve));
  }
  PlotOptions options;
  options.x_label = "ms a frame (512 x 512)";
  options.y_label = "PSNR (dB)";
  options.log_x = true;
  sections.push_back({"resolution", "Resolution of cells", svg_plot(curves, options)});
}

/// From the nave and from ten times as far, on its axis before the open end; at references; in steps.
void from_places(Scene const& scene, Context& context) {
  Built const built = build(scene, 36, {}, context);
  ModelCamera camera(make_church(200'000), {}, context);
  Vector3d const center(20, 5, 0);
  for (auto const splats : {LdiRenderOptions::Splats::blended, LdiRenderOptions::Splats::squares}) {
    LdiRenderOptions how;
    how.splats = splats;
    LdiRenderer renderer(built.tree, how);
    double near_time = 0;
    for (double const distance : {6.0, 12.0, 60.0, 120.0}) {
      Eigen::Isometry3d const pose = look_at(center - Vector3d(distance, 0, 0), center, Vector3d::UnitY());
      RangeImage const image = camera.capture(scene.camera, pose, context);
      Truth truth{pose, camera.picture(scene.camera, pose, context), cv::Mat1b(image.depth.size(), 0), {}};
      cv::Vec3b background = truth.picture(0, 0);
      for (int y = 0; y < image.depth.rows; ++y)
        for (int x = 0; x < image.depth.cols; ++x)
          if (image.has_depth(x, y))
            truth.counts(y, x) = 1;
          else
            background = truth.picture(y, x);
      std::vector<double> times;
      Frame frame;
      for (int repeat = 0; repeat < 9; ++repeat) {
        double const start = seconds();
        frame = renderer.render(scene.camera, pose);
        times.push_back(1e3 * (seconds() - start));
      }
      if (distance < 20) near_time = median(times);
      fmt::print("{} from {} m: {:.2f} ms ({:.3f} of the last near one), {:.2f} dB on {} pixels\n",
                 splats == LdiRenderOptions::Splats::blended ? "blended" : "squares", distance, median(times),
                 median(times) / near_time, decibel(squared_error(frame, truth, background)),
                 cv::countNonZero(truth.counts));
    }
  }
  LdiRenderer renderer(built.tree, {});
  for (std::size_t i = 0; i < scene.references.size(); i += 6) {
    View const& view = scene.references[i];
    Truth const truth{
        *view.object_from_camera, view.image.color, view.image.classes == static_cast<uchar>(PixelClass::object), {}};
    Frame const frame = renderer.render(scene.camera, truth.pose);
    fmt::print("at reference {}: {:.2f} dB, {} splats\n", i, decibel(squared_error(frame, truth, {0, 0, 0})),
               renderer.splats());
  }
  // One image alone: what is lost by resampling it once into the tree and once to the screen.
  View const& first = scene.references[0];
  LdiRenderer alone(build(scene, 1, {}, context).tree, {});
  Truth const truth{*first.object_from_camera, first.image.color, {}, {}};
  fmt::print("one image alone, from where it was taken: {:.2f} dB\n",
             decibel(squared_error(alone.render(scene.camera, truth.pose), truth, {0, 0, 0})));
}

void in_steps(Scene const& scene, Context& context) {
  Built const built = build(scene, 36, {}, context);
  LdiRenderer renderer(built.tree, {});
  std::vector<double> full_times;
  double full_error = 0;
  std::map<std::size_t, std::pair<std::vector<double>, double>> steps;  // times since the start, error
  for (Truth const& truth : scene.path) {
    double start = seconds();
    full_error += squared_error(renderer.render(scene.camera, truth.pose), truth, {0, 0, 0});
    full_times.push_back(1e3 * (seconds() - start));
    renderer.begin(scene.camera, truth.pose);
    double spent = 0;
    bool more = true;
    for (std::size_t step = 0; more; ++step) {
      start = seconds();
      more = renderer.refine();
      double const refined = 1e3 * (seconds() - start);
      start = seconds();
      Frame const frame = renderer.picture();
      double const shown = 1e3 * (seconds() - start);
      spent += refined;
      steps[step].first.push_back(spent + shown);
      steps[step].second += squared_error(frame, truth, {0, 0, 0});
    }
  }
  double const count = double(scene.path.size());
  fmt::print("at once: {:.2f} ms, {:.2f} dB\n", median(full_times), decibel(full_error / count));
  for (auto const& [step, figures] : steps)
    fmt::print("  step {}: after {:.2f} ms ({:.2f} of it), {:.2f} dB\n", step, median(figures.first),
               median(figures.first) / median(full_times), decibel(figures.second / double(figures.first.size())));
}

}  // namespace

int main(int argc, char** argv) {
  CLI::App app("Error against time of LDI trees in the church");
  std::size_t every = 1;
  std::string plot;
  std::vector<std::string> parts = {"images", "resolution", "places", "steps"};
  app.add_option("--every", every, "Of the path's 40 frames each so many-th")->check(CLI::Range(1, 40));
  app.add_option("--plot", plot, "A page with the plots");
  app.add_option("--parts", parts, "images, resolution, places, steps");
  CLI11_PARSE(app, argc, argv);
  try {
    Context context;
    double const start = seconds();
    Scene const scene = capture_scene(every, context);
    fmt::print("36 references and {} frames ray traced in {:.1f} s\n", scene.path.size(), seconds() - start);
    std::vector<ReportSection> sections;
    auto const wants = [&](char const* part) { return std::find(parts.begin(), parts.end(), part) != parts.end(); };
    if (wants("images")) over_images(scene, sections, context);
    if (wants("resolution")) over_resolution(scene, sections, context);
    if (wants("places")) from_places(scene, context);
    if (wants("steps")) in_steps(scene, context);
    if (!plot.empty()) write_file(plot, html_page("LDI trees", "", sections));
  } catch (Error const& error) {
    std::cerr << error.what() << '\n';
    return static_cast<int>(error.code());
  }
}
