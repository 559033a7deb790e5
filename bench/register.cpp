// What `register` reaches on pairs of views, and in what time, peers beside.
//   bench_register TRIALS --data FOLDER   a pinned list of starts; the folder holds the Stanford archives
#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <chrono>
#include <iostream>
#include <numbers>

#include "base/error.h"
#include "base/median.h"
#include "bench/register_pcl.h"
#include "bench/register_trials.h"
#include "register/alignment.h"

namespace scanview {
namespace {

namespace fs = std::filesystem;

struct Settings {
  fs::path trials, data;
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

Outcome run_ours(RegisterTrial const& trial, ScanSet const& set, bool automatic, bool verbose) {
  Context context;
  context.threads = 1;
  if (verbose) context.on_log = [](std::string const& line) { fmt::print("  {}\n", line); };
  RegisterOptions options;
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
        "{:24} {:3} of {:3} right, {:3} accepted, {:3} wrongly | median {:.4f} deg {:.4f} mm, worst {:.4f} deg {:.4f} "
        "mm | {:.3f} s\n",
        who, converged, count, accepted, wrong, median(degrees), median(lengths),
        *std::max_element(degrees.begin(), degrees.end()), *std::max_element(lengths.begin(), lengths.end()),
        median(seconds));
  }
};

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
    note("scanview", run_ours(trial, set, settings.automatic, settings.verbose));
    if (!settings.peers) continue;
    for (auto const method : {PclMethod::plane, PclMethod::gicp}) {
      Outcome outcome;
      auto const start = std::chrono::steady_clock::now();
      Eigen::Isometry3d const b_from_a = align_with_pcl(set, trial.start, trial.size, method);
      outcome.seconds = seconds_since(start);
      measure(trial, set, b_from_a, outcome);
      note(method == PclMethod::plane ? "PCL plane" : "PCL GICP", outcome);
    }
  }
  for (auto const& [who, tally] : tallies) tally.print(who);
}

}  // namespace
}  // namespace scanview

int main(int argc, char** argv) {
  scanview::Settings settings;
  CLI::App app("Speed and error of register on pairs of views");
  app.add_option("trials", settings.trials, "Pinned starts")->required();
  app.add_option("--data", settings.data, "Folder of the Stanford archives")->required();
  app.add_flag("--auto", settings.automatic, "From nothing instead of the start");
  app.add_flag("--peers", settings.peers, "PCL's methods as well");
  app.add_flag("--verbose", settings.verbose, "A line a trial");
  app.add_option("--only", settings.only, "Trials whose set and views have this in their names");
  CLI11_PARSE(app, argc, argv);
  try {
    scanview::bench(settings);
  } catch (scanview::Error const& error) {
    std::cerr << "error: " << error.what() << '\n';
    return 1;
  }
  return 0;
}
