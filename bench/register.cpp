// What `register` reaches on pairs of views, and in what time, peers beside.
//   bench_register TRIALS --data FOLDER   a pinned list of starts; the folder holds the Stanford archives
//   bench_register --multiway N --data FOLDER   the ten synthetic views together, from N starts 3 degrees and 2 % off
#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <chrono>
#include <iostream>
#include <numbers>

#include "base/error.h"
#include "base/files.h"
#include "base/html.h"
#include "base/median.h"
#include "base/random.h"
#include "bench/register_open3d.h"
#include "bench/register_pcl.h"
#include "bench/register_trials.h"
#include "register/alignment.h"

namespace scanview {
namespace {

namespace fs = std::filesystem;

struct Settings {
  fs::path trials, data, plot;
  int multiway = 0;
  bool automatic = false, peers = false, verbose = false;
  std::string only;
};

double seconds_since(std::chrono::steady_clock::time_point start) {
  return std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
}

struct Outcome {
  double degrees = 0, length = 0, seconds = 0;
  bool accepted = true;
};

/// The error where the two views share a surface.
void measure(RegisterTrial const& trial, ScanSet const& set, Eigen::Isometry3d const& b_from_a, Outcome& outcome) {
  PoseComparison const error =
      compare_poses(set, {b_from_a, Eigen::Isometry3d::Identity()}, {trial.truth, Eigen::Isometry3d::Identity()});
  outcome.degrees = error.max_deg;
  outcome.length = error.max_length;
}

ScanSet pair_of(RegisterTrial const& trial, TrialViews const& views) {
  ScanSet set;
  set.unit = Unit::mm;
  set.views = {views.at(trial.set).at(trial.a), views.at(trial.set).at(trial.b)};
  set.views[0].object_from_camera = trial.start;
  set.views[1].object_from_camera = Eigen::Isometry3d::Identity();
  return set;
}

Outcome run_ours(RegisterTrial const& trial, ScanSet const& set, RegisterOptions options, bool automatic,
                 bool verbose) {
  Context context;
  context.threads = 1;
  if (verbose) context.on_log = [](std::string const& line) { fmt::print("  {}\n", line); };
  options.given_std = 0;
  if (automatic) options.init = RegisterOptions::Init::automatic;
  Outcome outcome;
  auto const start = std::chrono::steady_clock::now();
  Alignment const got = align(set, options, context);
  outcome.seconds = seconds_since(start);
  outcome.accepted = got.parts.size() == 1;
  measure(trial, set, got.object_from_camera[1].inverse() * got.object_from_camera[0], outcome);
  return outcome;
}

struct Tally {
  std::vector<double> degrees, lengths, seconds;
  int converged = 0, accepted = 0, wrong = 0, count = 0;

  void add(Outcome const& outcome, double size) {
    bool const is_right = outcome.degrees < 2 && outcome.length < 0.02 * size;
    ++count;
    converged += is_right;
    accepted += outcome.accepted;
    wrong += outcome.accepted && !is_right;
    degrees.push_back(outcome.degrees);
    lengths.push_back(outcome.length);
    seconds.push_back(outcome.seconds);
  }
  void print(std::string const& who) const {
    fmt::print(
        "{:38} {:3} of {:3} right, {:3} accepted, {:3} wrongly | median {:.4f} deg {:.4f} mm, worst {:.4f} deg {:.4f} "
        "mm | {:.3f} s\n",
        who, converged, count, accepted, wrong, median(degrees), median(lengths),
        *std::max_element(degrees.begin(), degrees.end()), *std::max_element(lengths.begin(), lengths.end()),
        median(seconds));
  }
};

/// Our own settings between speed and error: correspondences, and levels of the pyramid.
std::vector<RegisterOptions> knobs() {
  std::vector<RegisterOptions> all;
  for (int const correspondences : {500, 1500, 6000, 20000}) {
    all.emplace_back();
    all.back().max_correspondences = correspondences;
  }
  for (int const levels : {2, 3}) {
    all.emplace_back();
    all.back().levels = levels;
  }
  return all;
}

std::string knob_name(RegisterOptions const& knob) {
  return knob.max_correspondences > 0 ? fmt::format("scanview, {} correspondences", knob.max_correspondences)
                                      : fmt::format("scanview, {} levels", knob.levels);
}

/// A cross that a plot of lines shows.
PlotCurve cross_at(cv::Point2d const& at, double height, std::string const& name, std::string const& color) {
  constexpr double kWidth = 1.05;
  return {name,
          {{at.x / kWidth, at.y}, {at.x * kWidth, at.y}, at, {at.x, at.y - height}, {at.x, at.y + height}},
          color,
          false};
}

/// Median error against median time of all trials of a set: our two knobs as lines, a cross a peer.
void write_plot(fs::path const& path, std::map<std::string, Tally> const& tallies) {
  std::map<std::string, std::map<std::string, cv::Point2d>> of_sets;
  for (auto const& [name, tally] : tallies)
    of_sets[name.substr(0, name.find(':'))][name.substr(name.find(':') + 2)] = {median(tally.seconds),
                                                                                median(tally.degrees)};
  std::map<std::string, std::string> const peers = {
      {"PCL plane", "#c0603a"}, {"PCL GICP", "#8a4fa8"}, {"Open3D plane", "#3a6fc0"}};
  PlotOptions axes;
  axes.x_label = "seconds a pair, one thread, preparation included";
  axes.y_label = "median error, degrees";
  axes.log_x = true;
  axes.width = 720, axes.height = 480;
  std::vector<ReportSection> sections;
  for (auto const& [set, points] : of_sets) {
    double highest = 0;
    for (auto const& [who, at] : points) highest = std::max(highest, at.y);
    PlotCurve correspondences{"500 to all", {}, "#2a7a4b", false}, levels{"2 to 4 levels", {}, "#7ab648", false};
    for (RegisterOptions const& knob : knobs())
      if (auto const at = points.find(knob_name(knob)); at != points.end())
        (knob.max_correspondences > 0 ? correspondences : levels).points.push_back(at->second);
    for (PlotCurve* const line : {&correspondences, &levels})
      if (points.contains("scanview")) line->points.push_back(points.at("scanview"));
    std::vector<PlotCurve> curves{correspondences, levels};
    for (auto const& [who, color] : peers)
      if (auto const at = points.find(who); at != points.end())
        curves.push_back(cross_at(at->second, 0.02 * highest, who, color));
    sections.push_back({set, set, svg_plot(curves, axes)});
  }
  write_file(path, html_page("Registration: error against time",
                             "<p>Lines: scanview from 500 correspondences a pair to all, and from 2 levels to 4.</p>",
                             sections));
}

void bench(Settings const& settings) {
  Context context;
  TrialViews const views = read_trial_views(settings.data, context);
  auto const trials = read_trials(settings.trials, settings.data, views, context.seed);
  std::map<std::string, Tally> tallies;
  for (RegisterTrial const& trial : trials) {
    if (!settings.only.empty() &&
        fmt::format("{} {} {}", trial.set, trial.b, trial.a).find(settings.only) == std::string::npos)
      continue;
    ScanSet const set = pair_of(trial, views);
    auto const note = [&](std::string const& who, Outcome const& outcome) {
      tallies["all: " + who].add(outcome, trial.size);
      tallies[trial.set + ": " + who].add(outcome, trial.size);
      if (settings.verbose)
        fmt::print("{} {} {} {:g}/{:g} {:8} {:.4f} deg {:.4f} mm {} {:.3f} s\n", trial.set, trial.b, trial.a,
                   trial.angle_deg, trial.percent, who, outcome.degrees, outcome.length,
                   outcome.accepted ? "" : "refused", outcome.seconds);
      std::cout.flush();
    };
    note("scanview", run_ours(trial, set, {}, settings.automatic, settings.verbose));
    if (!settings.plot.empty())
      for (RegisterOptions const& knob : knobs())
        note(knob_name(knob), run_ours(trial, set, knob, settings.automatic, false));
    if (!settings.peers) continue;
    auto const peer = [&](std::string const& who, auto const& align_pair) {
      Outcome outcome;
      auto const start = std::chrono::steady_clock::now();
      Eigen::Isometry3d const b_from_a = align_pair();
      outcome.seconds = seconds_since(start);
      measure(trial, set, b_from_a, outcome);
      note(who, outcome);
    };
    peer("PCL plane", [&] { return align_with_pcl(set, trial.start, trial.size, PclMethod::plane); });
    peer("PCL GICP", [&] { return align_with_pcl(set, trial.start, trial.size, PclMethod::gicp); });
#ifdef SCANVIEW_WITH_OPEN3D
    peer("Open3D plane", [&] { return align_with_open3d(set, trial.start, trial.size); });
#endif
  }
  for (auto const& [who, tally] : tallies) tally.print(who);
  if (!settings.plot.empty()) write_plot(settings.plot, tallies);
}

/// All pairs whose views share 0.3 of the smaller one's surface, at the true poses.
void print_pairs(std::string const& who, ScanSet const& set, std::vector<Eigen::Isometry3d> const& poses,
                 std::vector<Eigen::Isometry3d> const& truth, double seconds) {
  std::vector<double> degrees, lengths;
  for (std::size_t a = 0; a < set.views.size(); ++a)
    for (std::size_t b = a + 1; b < set.views.size(); ++b) {
      ScanSet pair;
      pair.views = {set.views[a], set.views[b]};
      if (shared_share(set.views[a].image, set.views[b].image, truth[b].inverse() * truth[a]) < 0.3) continue;
      PoseComparison const error = compare_poses(pair, {poses[a], poses[b]}, {truth[a], truth[b]});
      degrees.push_back(error.max_deg);
      lengths.push_back(error.max_length);
    }
  fmt::print("{:24} {} pairs: median {:.4f} deg {:.4f} mm, worst {:.4f} deg {:.4f} mm | {:.2f} s\n", who,
             degrees.size(), median(degrees), median(lengths), *std::max_element(degrees.begin(), degrees.end()),
             *std::max_element(lengths.begin(), lengths.end()), seconds);
  std::cout.flush();
}

void bench_multiway(Settings const& settings) {
  constexpr double kDegrees = 3, kShare = 0.02, kSize = 156;  // mm
  for (int turn = 0; turn < settings.multiway; ++turn) {
    Context context;
    context.threads = 1;
    context.seed += static_cast<std::uint64_t>(turn);
    if (settings.verbose) context.on_log = [](std::string const& line) { fmt::print("  {}\n", line); };
    ScanSet set;
    set.unit = Unit::mm;
    std::vector<Eigen::Isometry3d> truth;
    for (auto const& [name, view] : read_synthetic_views(settings.data, context)) {
      set.views.push_back(view);
      truth.push_back(*view.object_from_camera);
    }
    for (std::size_t i = 0; i < set.views.size(); ++i)
      set.views[i].object_from_camera =
          disturbed(truth[i], set.views[i].image, kDegrees, kShare * kSize, context.seed, i);
    RegisterOptions options;
    options.given_std = 0;
    auto start = std::chrono::steady_clock::now();
    Alignment const ours = align(set, options, context);
    print_pairs("scanview", set, ours.object_from_camera, truth, seconds_since(start));
#ifdef SCANVIEW_WITH_OPEN3D
    if (settings.peers) {
      start = std::chrono::steady_clock::now();
      auto const theirs = multiway_with_open3d(set, kSize);
      print_pairs("Open3D multiway", set, theirs, truth, seconds_since(start));
    }
#endif
  }
}

}  // namespace
}  // namespace scanview

int main(int argc, char** argv) {
  scanview::Settings settings;
  CLI::App app("Speed and error of register on pairs of views");
  app.add_option("trials", settings.trials, "Pinned starts");
  app.add_option("--multiway", settings.multiway, "Starts of the ten synthetic views together");
  app.add_option("--data", settings.data, "Folder of the Stanford archives")->required();
  app.add_option("--plot", settings.plot, "Page with error against time, our knobs beside");
  app.add_flag("--auto", settings.automatic, "From nothing instead of the start");
  app.add_flag("--peers", settings.peers, "PCL's methods as well, and Open3D's where it is installed");
  app.add_flag("--verbose", settings.verbose, "A line a trial");
  app.add_option("--only", settings.only, "Trials whose set and views have this in their names");
  CLI11_PARSE(app, argc, argv);
  try {
    if (settings.multiway > 0) scanview::bench_multiway(settings);
    if (!settings.trials.empty()) scanview::bench(settings);
  } catch (scanview::Error const& error) {
    std::cerr << "error: " << error.what() << '\n';
    return 1;
  }
  return 0;
}
