// What `acquire` reaches on synthetic captures, by both decoders of a sweep, beside the statistical limit
// (docs/acquire.md) and the time that reading the pictures alone takes.
//   bench_acquire CAPTURE [-o FOLDER]   a folder made by `scanview synth`, with its truth
//   bench_acquire --steps [-o FOLDER]   makes captures of 24, 48, 96, 192 light steps itself
#include <fmt/format.h>
#include <malloc.h>

#include <CLI/CLI.hpp>
#include <chrono>
#include <fstream>
#include <iostream>
#include <opencv2/core.hpp>
#include <opencv2/imgcodecs.hpp>

#include "acquire/decode_sweep.h"
#include "base/error.h"
#include "base/html.h"
#include "base/image_file.h"
#include "base/parallel.h"
#include "bench/acquire_figures.h"
#include "synth/capture_files.h"
#include "synth/scanner.h"

namespace scanview {
namespace {

namespace fs = std::filesystem;
using Decoder = AcquireOptions::Decoder;

constexpr int kCodeViews = 2;  // whose codes are looked at before resampling
constexpr std::array kStepCounts = {24, 48, 96, 192};

struct Settings {
  fs::path capture, output = "bench_acquire";
  bool steps = false;
  std::string model = "dog";
  int views = 2, repeats = 2, threads = 0;
  double beam_steps = 0.8;
};

double seconds_since(std::chrono::steady_clock::time_point start) {
  return std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
}

/// Least of several runs: a machine that does something else besides only adds.
template <class Work>
double least_seconds(int repeats, Work const& work) {
  double least = std::numeric_limits<double>::infinity();
  for (int i = 0; i < repeats; ++i) {
    auto const start = std::chrono::steady_clock::now();
    work();
    least = std::min(least, seconds_since(start));
  }
  return least;
}

/// The largest resident size since the last reset, MB; Linux only, NaN elsewhere.
double peak_megabytes() {
  std::ifstream status("/proc/self/status");
  for (std::string word; status >> word;)
    if (double kilobytes = 0; word == "VmHWM:" && status >> kilobytes) return kilobytes / 1024;
  return std::nan("");
}

void reset_peak() {
  malloc_trim(0);
  std::ofstream("/proc/self/clear_refs") << 5;
}

/// The options that a synthetic capture was made with.
CaptureOptions options_from(Json const& json, fs::path const& path) {
  if (json.at("pattern") != "sweep") throw Error(ErrorCode::bad_input, path, "is not a sweep");
  CaptureOptions o;
  o.views = json.at("views");
  o.width = json.at("width");
  o.height = json.at("height");
  o.baseline_deg = json.at("baseline_deg");
  o.light.steps = json.at("steps");
  o.light.beam_mm = json.at("beam_mm");
  o.light.beam_steps = json.at("beam_steps");
  o.scene.ambient = json.at("ambient");
  o.scene.gloss = json.at("gloss");
  o.scene.gloss_exponent = json.at("gloss_exponent");
  o.scene.interreflection = json.at("interreflection");
  o.scene.stage = json.at("stage");
  o.scene.backdrop = json.at("backdrop");
  o.sensor.full_scale_electrons = json.at("full_scale_electrons");
  o.sensor.read_electrons = json.at("read_electrons");
  o.sensor.bits = json.at("bits");
  o.sensor.gamma = json.at("gamma");
  o.sensor.exposure = json.at("exposure");
  o.faults.rig_moved_deg = json.at("rig_moved_deg");
  return o;
}

/// Every picture that acquire reads.
std::vector<fs::path> pictures_of(Capture const& capture, AcquireOptions const& options) {
  std::vector<std::string> views = capture.views;
  if (options.remove_background && capture.empty) views.push_back(*capture.empty);
  std::vector<fs::path> files;
  for (auto const& view : views) {
    for (Side const side : kSides)
      for (int k = 0; k < capture.frame_count(); ++k) files.push_back(capture.frame_path(view, side, k));
    if (capture.color) files.push_back(capture.path_of(view, *capture.color));
  }
  return files;
}

struct DecoderRun {
  AcquireResult result;
  DepthFigures depth;
  double seconds = 0, peak_mb = 0;
};

struct Measured {
  int steps = 0;
  std::size_t pictures = 0;
  double read_seconds = 0;
  std::array<DecoderRun, 2> runs;  // space-time, stripe
  EdgeFigures edges;
  CodeFigures codes;

  Json to_json() const {
    Json json = {{"steps", steps}, {"pictures", pictures}, {"read_seconds", read_seconds}};
    for (std::size_t d = 0; d < 2; ++d) {
      Json run = runs[d].depth.to_json();
      run["seconds"] = runs[d].seconds;
      run["seconds_over_read"] = runs[d].seconds / read_seconds;
      run["peak_mb"] = json_number(runs[d].peak_mb);
      json[d == 0 ? "space_time" : "stripe"] = run;
    }
    json["edges"] = edges.to_json();
    json["codes_before_resampling"] = codes.to_json();
    return json;
  }
};

CodeImage decode(Capture const& capture, std::string const& view, Side side, Context& context) {
  SpaceTimeDecoder decoder;
  for (int k = 0; k < capture.frame_count(); ++k) decoder.add(read_gray(capture.frame_path(view, side, k)));
  return decoder.finish(context);
}

Measured measure(fs::path const& folder, CaptureRig const& rig, Settings const& settings, Context& context) {
  Capture const capture = read_capture(folder / "capture.json", folder);
  Measured m;
  m.steps = capture.frame_count();
  AcquireOptions options;
  auto const files = pictures_of(capture, options);
  m.pictures = files.size();
  // The first run warms the cache of the file system.
  m.read_seconds = least_seconds(settings.repeats + 1, [&] {
    for_each_index(context, files.size(), [&](std::size_t i) { cv::imread(files[i].string(), cv::IMREAD_UNCHANGED); });
  });
  for (std::size_t d = 0; d < 2; ++d) {
    options.decoder = d == 0 ? Decoder::space_time : Decoder::stripe;
    m.runs[d].seconds = least_seconds(settings.repeats, [&] {
      m.runs[d].result = {};
      reset_peak();
      m.runs[d].result = acquire(capture, options, context);
      m.runs[d].peak_mb = peak_megabytes();
    });
  }
  for (std::size_t v = 0; v < capture.views.size(); ++v) {
    TrueView const truth = true_view(rig, static_cast<int>(v), context);
    std::array<RangeImage const*, 2> images;
    for (std::size_t d = 0; d < 2; ++d) {
      images[d] = &m.runs[d].result.set.views[v].image;
      m.runs[d].depth.add(*images[d], truth);
    }
    m.edges.add(*images[0], *images[1], truth);
    if (v >= kCodeViews) continue;
    for (Side const side : kSides)
      m.codes.add(decode(capture, capture.views[v], side, context), truth, static_cast<CaptureSide>(side));
  }
  return m;
}

void print(Measured const& m) {
  Json const json = m.to_json();
  auto const number = [](Json const& value, double scale = 1) {
    return value.is_null() ? std::string("-") : fmt::format("{:.4g}", scale * value.get<double>());
  };
  fmt::print("\n{} steps, {} pictures, cv::imread alone {:.2f} s\n", m.steps, m.pictures, m.read_seconds);
  fmt::print("{:<44}{:>12}{:>12}\n", "", "space-time", "stripe");
  auto const line = [&](char const* name, char const* key, double scale) {
    fmt::print("{:<44}{:>12}{:>12}\n", name, number(json["space_time"][key], scale),
               number(json["stripe"][key], scale));
  };
  line("coverage of visible pixels, %", "coverage", 100);
  line("depths wrong by more than 5 sigma, %", "wrong", 100);
  line("RMS of error / sigma", "rms_error_over_sigma", 1);
  line("within 2.2 sigma, %", "within_2_2_sigma", 100);
  line("RMS error, mm", "rms_error", 1);
  line("away from steps: RMS error, mm", "even_rms_error", 1);
  line("  RMS of the bound, mm", "even_rms_bound", 1);
  line("  RMS error / bound", "rms_error_over_bound", 1);
  line("  the same away from paint's edges, too", "plain_rms_error_over_bound", 1);
  line("acquire, s", "seconds", 1);
  line("  / reading alone", "seconds_over_read", 1);
  line("peak memory, MB", "peak_mb", 1);
  Json const &edges = json["edges"], &codes = json["codes_before_resampling"];
  fmt::print("near edges ({} pixels): RMS, mm                {:>10}{:>12}   ratio {}\n",
             edges["pixels"].get<std::size_t>(), number(edges["space_time_rms"]), number(edges["stripe_rms"]),
             number(edges["ratio"]));
  fmt::print("  where both are right ({} pixels)             {:>10}{:>12}   ratio {}\n",
             edges["right_pixels"].get<std::size_t>(), number(edges["right_space_time_rms"]),
             number(edges["right_stripe_rms"]), number(edges["right_ratio"]));
  fmt::print("codes before resampling: error / bound of their light {}, of the pixel's centre {}\n",
             number(codes["rms_over_bound"]), number(codes["center_rms_over_bound"]));
  std::cout.flush();
}

/// A plot as a file of its own, which needs to name its language.
void write_plot(fs::path const& path, std::vector<PlotCurve> const& curves, PlotOptions const& options) {
  std::string svg = svg_plot(curves, options);
  svg.insert(4, " xmlns=\"http://www.w3.org/2000/svg\" font-family=\"sans-serif\" font-size=\"11\"");
  write_file(path, svg);
}

/// How a run of Measured becomes a curve's point.
template <class Value>
PlotCurve curve(std::string const& name, std::string const& color, std::vector<Measured> const& all,
                Value const& value) {
  PlotCurve result{name, {}, color};
  for (auto const& m : all) result.points.emplace_back(m.steps, value(m));
  return result;
}

void measure_capture(Settings const& settings, Context& context) {
  fs::path const path = settings.capture / "synth.json";
  Json const options = read_json(path).at("options");
  context.seed = options.at("seed");
  TriangleMesh const model = read_triangle_mesh(settings.capture / "truth" / "model.ply");
  CaptureRig const rig(model, options_from(options, path), context);
  Measured const m = measure(settings.capture, rig, settings, context);
  print(m);
  write_json(settings.output / "acquire.json", m.to_json());
  // What sigma promises against what the depths are off by, bin by bin of sigma.
  std::vector<PlotCurve> curves;
  for (std::size_t d = 0; d < 2; ++d) {
    std::map<int, std::pair<MeanSquare, MeanSquare>> bins;
    for (std::size_t v = 0; v < m.runs[d].result.set.views.size(); ++v) {
      RangeImage const& image = m.runs[d].result.set.views[v].image;
      cv::Mat1f const depth = rig.truth(static_cast<int>(v), context).depth;
      for (int y = 0; y < depth.rows; ++y)
        for (int x = 0; x < depth.cols; ++x) {
          if (!image.has_depth(x, y) || std::isnan(depth(y, x))) continue;
          double const sigma = image.sigma(y, x), off = image.depth(y, x) - depth(y, x);
          if (std::abs(off) > 5 * sigma) continue;
          auto& [promised, found] = bins[static_cast<int>(std::floor(4 * std::log2(sigma)))];
          promised.add(sigma);
          found.add(off);
        }
    }
    PlotCurve points{d == 0 ? "space-time" : "stripe", {}, d == 0 ? "#1f5fa8" : "#c0392b", true};
    for (auto const& [bin, pair] : bins)
      if (pair.first.count >= 200) points.points.emplace_back(pair.first.rms(), pair.second.rms());
    curves.push_back(points);
  }
  PlotCurve ideal{"equal", {}, "#888888"};
  for (auto const& c : curves)
    for (auto const& p : c.points) ideal.points.emplace_back(p.x, p.x);
  std::sort(ideal.points.begin(), ideal.points.end(), [](auto const& a, auto const& b) { return a.x < b.x; });
  curves.push_back(ideal);
  write_file(
      settings.output / "acquire.svg",
      svg_plot(curves, {.x_label = "reported sigma, mm", .y_label = "RMS error, mm", .log_x = true, .log_y = true}));
}

void measure_steps(Settings const& settings, Context& context) {
  TriangleMesh const model = builtin_model(settings.model);
  std::vector<Measured> all;
  Json json = Json::array();
  for (int const steps : kStepCounts) {
    CaptureOptions options;
    options.views = settings.views;
    options.boards = 0;
    options.light.steps = steps;
    options.light.beam_steps = settings.beam_steps;
    CaptureRig const rig(model, options, context);
    NewFolder folder(settings.output / fmt::format("steps_{}", steps));  // never committed: removed when done
    write_capture(folder.path(), model, rig, context);
    all.push_back(measure(folder.path(), rig, settings, context));
    print(all.back());
    json.push_back(all.back().to_json());
  }
  write_json(settings.output / "acquire_steps.json", json);
  std::string const blue = "#1f5fa8", red = "#c0392b", gray = "#888888";
  auto const error_of = [](std::size_t d) {
    return [d](Measured const& m) { return m.runs[d].depth.even_error.rms(); };
  };
  write_file(
      settings.output / "acquire_error.svg",
      svg_plot(
          {curve("space-time", blue, all, error_of(0)), curve("stripe", red, all, error_of(1)),
           curve("bound of one pixel", gray, all, [](Measured const& m) { return m.runs[0].depth.even_bound.rms(); })},
          {.x_label = "light steps", .y_label = "RMS depth error away from steps, mm", .log_x = true, .log_y = true}));
  auto const seconds_of = [](std::size_t d) { return [d](Measured const& m) { return m.runs[d].seconds; }; };
  write_plot(settings.output / "acquire_time.svg",
             {curve("space-time", blue, all, seconds_of(0)), curve("stripe", red, all, seconds_of(1)),
              curve("cv::imread alone", gray, all, [](Measured const& m) { return m.read_seconds; })},
             {.x_label = "light steps", .y_label = "seconds", .log_x = true, .log_y = true});
}

int run(int argc, char** argv) {
  Settings s;
  CLI::App app{"acquire on synthetic captures, against the truth and the statistical limit"};
  app.add_option("capture", s.capture, "a folder made by scanview synth");
  app.add_flag("--steps", s.steps, "make captures of 24, 48, 96, 192 steps instead");
  app.add_option("--model", s.model, "of --steps: a built-in model");
  app.add_option("--views", s.views, "of --steps");
  app.add_option("--beam-steps", s.beam_steps, "of --steps: standard deviation of the beam, steps");
  app.add_option("--repeats", s.repeats, "runs of which the fastest counts")->check(CLI::Range(1, 100));
  app.add_option("--threads", s.threads, "0: all processors");
  app.add_option("-o,--output", s.output, "folder for JSON and plots");
  CLI11_PARSE(app, argc, argv);
  if (s.steps != s.capture.empty()) throw Error(ErrorCode::usage, {}, "say either a capture or --steps");
  cv::setNumThreads(1);
  fs::create_directories(s.output);
  Context context;
  context.threads = s.threads;
  if (s.steps)
    measure_steps(s, context);
  else
    measure_capture(s, context);
  return 0;
}

}  // namespace
}  // namespace scanview

int main(int argc, char** argv) {
  try {
    return scanview::run(argc, argv);
  } catch (std::exception const& error) {
    std::cerr << "bench_acquire: " << error.what() << '\n';
    return 1;
  }
}
