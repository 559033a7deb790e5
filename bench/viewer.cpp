// What pictures of views cost, and how near they come to photographs that were held out: all contenders of
// `scanview evaluate`, and ours over the number of views, triangles, resolution and views that fill.
//   bench_viewer --set SET ... [--frames N] [--plot FILE.html|.svg]
//   bench_viewer                      the same on a synthetic set
//   bench_viewer --speed              both back ends against each other in time
// Times are those of this run, in turns; nothing is held against them.
#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <chrono>
#include <functional>
#include <iostream>
#include <opencv2/imgproc.hpp>

#include "acquire/scan_set_file.h"
#include "base/files.h"
#include "base/html.h"
#include "base/median.h"
#include "bench/viewer_speed.h"
#include "mesh/view_mesh.h"
#include "synth/scanner.h"
#include "viewer/evaluate/held_out.h"

namespace scanview {
namespace {

namespace fs = std::filesystem;

struct Settings {
  std::vector<fs::path> sets;
  std::string model = "statuette";
  int views = 24, frames = 6;
  fs::path plot;
  bool speed = false;
};

/// What is drawn: a set, its meshes, and which views are held out in turn.
struct Scene {
  std::string name;
  ScanSet set;
  std::vector<ViewMesh> meshes;
  std::vector<std::size_t> held_out;
};

double milliseconds_since(std::chrono::steady_clock::time_point start) {
  return std::chrono::duration<double, std::milli>(std::chrono::steady_clock::now() - start).count();
}

/// Ours, with more views left out than the one that is compared, or at another resolution.
class Ours final : public HeldOutRenderer {
 public:
  using Excluded = std::function<std::vector<std::size_t>(std::size_t held_out)>;
  Ours(std::unique_ptr<ViewBasedRenderer> renderer, Excluded excluded = nullptr, double scale = 1)
      : renderer_(std::move(renderer)), excluded_(std::move(excluded)), scale_(scale) {}
  void exclude(std::vector<std::size_t> const& views) override {
    renderer_->exclude(excluded_ ? excluded_(views.front()) : views);
  }
  Frame render(Camera const& camera, Eigen::Isometry3d const& object_from_camera) override {
    if (scale_ == 1) {
      auto const start = std::chrono::steady_clock::now();
      Frame drawn = renderer_->render(camera, object_from_camera);
      drawing_ms_ = milliseconds_since(start);
      return drawn;
    }
    Camera const scaled = camera.resized(std::max(1, static_cast<int>(std::lround(scale_ * camera.width()))),
                                         std::max(1, static_cast<int>(std::lround(scale_ * camera.height()))));
    auto const start = std::chrono::steady_clock::now();
    Frame const drawn = renderer_->render(scaled, object_from_camera);
    drawing_ms_ = milliseconds_since(start);
    return {resized(drawn.color, camera), nearest(drawn.depth, camera)};
  }
  /// Of the last frame, without bringing it to the photograph's size.
  double drawing_ms() const { return drawing_ms_; }

 private:
  /// To the photograph's size; colours only from where something was drawn.
  cv::Mat4b resized(cv::Mat4b const& picture, Camera const& camera) const {
    cv::Mat4f premultiplied(picture.size());
    for (int y = 0; y < picture.rows; ++y) {
      for (int x = 0; x < picture.cols; ++x) {
        float const alpha = static_cast<float>(picture(y, x)[3]) / 255;
        for (int c = 0; c < 3; ++c) premultiplied(y, x)[c] = alpha * static_cast<float>(picture(y, x)[c]);
        premultiplied(y, x)[3] = alpha;
      }
    }
    cv::resize(premultiplied, premultiplied, {camera.width(), camera.height()}, 0, 0,
               scale_ > 1 ? cv::INTER_AREA : cv::INTER_LINEAR);
    cv::Mat4b result(premultiplied.size());
    for (int y = 0; y < result.rows; ++y) {
      for (int x = 0; x < result.cols; ++x) {
        auto const& sum = premultiplied(y, x);
        for (int c = 0; c < 3; ++c) result(y, x)[c] = cv::saturate_cast<std::uint8_t>(sum[3] > 0 ? sum[c] / sum[3] : 0);
        result(y, x)[3] = cv::saturate_cast<std::uint8_t>(255 * sum[3]);
      }
    }
    return result;
  }
  static cv::Mat1f nearest(cv::Mat1f const& depth, Camera const& camera) {
    cv::Mat1f result;
    cv::resize(depth, result, {camera.width(), camera.height()}, 0, 0, cv::INTER_NEAREST);
    return result;
  }

  std::unique_ptr<ViewBasedRenderer> renderer_;
  Excluded excluded_;
  double scale_;
  double drawing_ms_ = 0;
};

struct Row {
  std::string what;
  double milliseconds = 0, psnr = 0, psnr_drawn = 0, ssim = 0, coverage = 0;
};

double milliseconds_of(Renderer& renderer, View const& view) {
  auto const start = std::chrono::steady_clock::now();
  renderer.render(view.image.camera, *view.object_from_camera);
  auto const* const ours = dynamic_cast<Ours const*>(&renderer);
  return ours != nullptr ? ours->drawing_ms() : milliseconds_since(start);
}

/// Pictures of the held-out views, each made without it; then the times of plain frames, in turns.
std::vector<Row> measure(Scene const& scene, std::vector<Contender>& contenders) {
  Context context;
  auto const figures = evaluate_held_out(contenders, scene.set, scene.held_out, HoldOut::each, context);
  std::vector<std::vector<double>> times(contenders.size());
  for (auto& contender : contenders) contender.renderer->exclude({scene.held_out.front()});
  constexpr int kTurns = 4;  // the first one warms up
  for (int turn = 0; turn < kTurns; ++turn) {
    for (std::size_t const view : scene.held_out) {
      for (std::size_t c = 0; c < contenders.size(); ++c) {
        double const ms = milliseconds_of(*contenders[c].renderer, scene.set.views[view]);
        if (turn > 0) times[c].push_back(ms);
      }
    }
  }
  std::vector<Row> rows;
  for (std::size_t c = 0; c < contenders.size(); ++c) {
    Row row;
    row.what = figures[c].title;
    row.milliseconds = median(times[c]);
    for (auto const& view : figures[c].views) {
      double const share = 1 / static_cast<double>(figures[c].views.size());
      row.psnr += share * view.psnr_all;
      row.psnr_drawn += share * view.psnr_common;
      row.ssim += share * view.ssim;
      row.coverage += share * view.coverage;
    }
    rows.push_back(row);
    fmt::print(
        "  {:36} {:8.2f} ms a frame | PSNR {:6.2f} dB, of drawn pixels {:6.2f} | SSIM {:.4f} | coverage {:6.2f} %\n",
        row.what, row.milliseconds, row.psnr, row.psnr_drawn, row.ssim, 100 * row.coverage);
  }
  std::cout.flush();
  return rows;
}

/// A sweep is measured in one go, so that all its points meet the same machine.
struct Sweep {
  std::string name;
  std::vector<Row> rows;
};

Sweep sweep(Scene const& scene, std::string const& name, std::vector<Contender> points) {
  fmt::print(" over {}\n", name);
  return {name, measure(scene, points)};
}

Sweep over_views(Scene const& scene, std::shared_ptr<ViewLibrary> const& library) {
  std::vector<Contender> points;
  for (std::size_t const every : {1U, 2U, 4U}) {
    // Of those at the held-out view's place in the order, and so without it a gap twice as wide as between the others.
    auto const excluded = [every, count = scene.set.views.size()](std::size_t held_out) {
      std::vector<std::size_t> result;
      for (std::size_t i = 0; i < count; ++i) {
        if (i == held_out || i % every != held_out % every) result.push_back(i);
      }
      return result;
    };
    if (scene.set.views.size() / every < 2) continue;
    points.push_back({"ours", every == 1 ? "all views" : fmt::format("one view of {}", every),
                      std::make_unique<Ours>(make_cpu_renderer(library), excluded)});
  }
  return sweep(scene, "number of views", std::move(points));
}

Sweep over_triangles(Scene const& scene) {
  std::vector<Contender> points;
  for (int const triangles : {500, 2000, 8000, 20000}) {
    Context context;
    MeshOptions options;
    options.max_triangles = triangles;
    std::vector<ViewMesh> meshes;
    double mean = 0;
    for (auto const& view : scene.set.views) {
      meshes.push_back(mesh_range_image(view.image, options, context).view_mesh);
      mean += static_cast<double>(meshes.back().mesh.triangles.size()) / static_cast<double>(scene.set.views.size());
    }
    points.push_back({"ours", fmt::format("at most {} triangles: {:.0f}", triangles, mean),
                      std::make_unique<Ours>(make_cpu_renderer(std::make_shared<ViewLibrary>(scene.set, meshes)))});
  }
  return sweep(scene, "triangles a view", std::move(points));
}

Sweep over_resolution(Scene const& scene, std::shared_ptr<ViewLibrary> const& library) {
  std::vector<Contender> points;
  for (double const scale : {0.5, 1.0, 2.0, 3.0}) {
    points.push_back({"ours", fmt::format("resolution times {}", scale),
                      std::make_unique<Ours>(make_cpu_renderer(library), nullptr, scale)});
  }
  return sweep(scene, "resolution", std::move(points));
}

Sweep over_fill_views(Scene const& scene, std::shared_ptr<ViewLibrary> const& library) {
  std::vector<Contender> points;
  for (int const fill : {0, 2, 4, 8, 16}) {
    ViewBasedOptions options;
    options.fill_views = fill;
    points.push_back(
        {"ours", fmt::format("{} views that fill", fill), std::make_unique<Ours>(make_cpu_renderer(library, options))});
  }
  return sweep(scene, "views that fill", std::move(points));
}

/// PSNR over milliseconds: a dot each contender, a line each sweep.
std::string plot(std::vector<Row> const& contenders, std::vector<Sweep> const& sweeps) {
  static constexpr char const* kColors[] = {"#c0392b", "#7f8c8d", "#8e44ad", "#2980b9", "#27ae60",
                                            "#d68910", "#b03070", "#3a6fc0", "#7ab648"};
  std::vector<PlotCurve> curves;
  auto const color = [&] { return kColors[curves.size() % std::size(kColors)]; };
  for (auto const& row : contenders) curves.push_back({row.what, {{row.milliseconds, row.psnr}}, color(), true});
  for (auto const& sweep : sweeps) {
    PlotCurve curve{"ours over " + sweep.name, {}, color(), false};
    for (auto const& row : sweep.rows) curve.points.emplace_back(row.milliseconds, row.psnr);
    curves.push_back(curve);
  }
  PlotOptions options;
  options.x_label = "milliseconds a frame";
  options.y_label = "PSNR of held-out views, all object pixels (dB)";
  options.log_x = true;
  options.width = 860;
  options.height = 520;
  return svg_plot(curves, options);
}

std::string table(std::vector<Row> const& contenders, std::vector<Sweep> const& sweeps) {
  std::vector<std::vector<std::string>> rows{
      {"what", "ms a frame", "PSNR (dB)", "PSNR, drawn pixels (dB)", "SSIM", "coverage (%)"}};
  auto const add = [&](Row const& row) {
    rows.push_back({row.what, fmt::format("{:.2f}", row.milliseconds), fmt::format("{:.2f}", row.psnr),
                    fmt::format("{:.2f}", row.psnr_drawn), fmt::format("{:.4f}", row.ssim),
                    fmt::format("{:.2f}", 100 * row.coverage)});
  };
  for (auto const& row : contenders) add(row);
  for (auto const& sweep : sweeps) {
    for (auto const& row : sweep.rows) add(row);
  }
  return html_table(rows);
}

Scene scene_of(std::string const& name, ScanSet set, std::vector<ViewMesh> meshes, int frames) {
  Scene scene{name, std::move(set), std::move(meshes), {}};
  std::size_t const views = scene.set.views.size(), count = std::min(views, static_cast<std::size_t>(frames));
  for (std::size_t i = 0; i < count; ++i) scene.held_out.push_back(i * views / count);
  return scene;
}

Scene read_scene(fs::path const& folder, int frames) {
  Context context;
  ScanSet set = read_scan_set(folder, context);
  std::vector<ViewMesh> meshes;
  for (auto const& view : set.views) {
    meshes.push_back(read_view_mesh(folder / view_folder(view.name), view.image.camera));
  }
  return scene_of(folder.string(), std::move(set), std::move(meshes), frames);
}

Scene synthetic_scene(Settings const& settings) {
  Context context;
  SynthOptions options;
  options.views = settings.views;
  options.noise.depth_sigma = 5e-4;
  options.noise.color_sigma = 2;
  ScanSet set = synthesize(builtin_model(settings.model), options, context).set;
  std::vector<ViewMesh> meshes;
  for (auto const& view : set.views) meshes.push_back(mesh_range_image(view.image, {}, context).view_mesh);
  return scene_of(settings.model, std::move(set), std::move(meshes), settings.frames);
}

ReportSection bench_scene(Scene const& scene) {
  double triangles = 0;
  for (auto const& mesh : scene.meshes) triangles += static_cast<double>(mesh.mesh.triangles.size());
  fmt::print("{}: {} views, {:.0f} triangles a view, {} held out in turn\n", scene.name, scene.set.views.size(),
             triangles / static_cast<double>(scene.meshes.size()), scene.held_out.size());
  Context context;
  auto const library = std::make_shared<ViewLibrary>(scene.set, scene.meshes);
  auto contenders = make_contenders(scene.set, library, {}, context);
  fmt::print(" contenders\n");
  auto const rows = measure(scene, contenders);
  std::vector<Sweep> const sweeps{over_views(scene, library), over_triangles(scene), over_resolution(scene, library),
                                  over_fill_views(scene, library)};
  return {scene.name, scene.name, plot(rows, sweeps) + table(rows, sweeps)};
}

void bench(Settings const& settings) {
  if (settings.speed) {
    bench_speed(3 * settings.frames);
    if (settings.sets.empty()) return;
  }
  std::vector<ReportSection> sections;
  for (auto const& set : settings.sets) sections.push_back(bench_scene(read_scene(set, settings.frames)));
  if (settings.sets.empty()) sections.push_back(bench_scene(synthetic_scene(settings)));
  if (settings.plot.empty()) return;
  if (settings.plot.extension() == ".svg") {
    std::string const& html = sections.front().html;
    write_file(settings.plot, html.substr(0, html.find("</svg>") + 6));
  } else {
    write_file(settings.plot, html_page("Held-out views: PSNR over milliseconds a frame", "", sections));
  }
}

}  // namespace
}  // namespace scanview

int main(int argc, char** argv) {
  scanview::Settings settings;
  CLI::App app("Quality of held-out views against time");
  app.add_option("--set", settings.sets, "Scan sets with meshes");
  app.add_option("--model", settings.model, "Without a set: a built-in model");
  app.add_option("--views", settings.views, "Without a set: how many views of it")->check(CLI::Range(4, 1000));
  app.add_option("--frames", settings.frames, "Views to hold out in turn")->check(CLI::Range(1, 1000));
  app.add_option("--plot", settings.plot, "Page (.html), or the plot of the first set alone (.svg)");
  app.add_flag("--speed", settings.speed, "Both back ends against each other (alone, or before the sets)");
  CLI11_PARSE(app, argc, argv);
  try {
    scanview::bench(settings);
  } catch (std::exception const& error) {
    std::cerr << "error: " << error.what() << '\n';
    return 1;
  }
  return 0;
}
