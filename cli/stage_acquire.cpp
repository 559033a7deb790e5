#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <limits>
#include <opencv2/imgcodecs.hpp>

#include "acquire/acquire_section.h"
#include "acquire/sampling_error.h"
#include "acquire/scan_set_file.h"
#include "base/error.h"
#include "base/parallel.h"
#include "cli/report.h"
#include "cli/stages.h"

namespace scanview {
namespace fs = std::filesystem;
namespace {

/// What --report says about time. NaN: not measured.
struct Times {
  static constexpr double kNone = std::numeric_limits<double>::quiet_NaN();
  double decode = kNone, write = kNone, read = kNone, hash = kNone;
};

class Stopwatch {
 public:
  double seconds() const { return std::chrono::duration<double>(std::chrono::steady_clock::now() - start_).count(); }

 private:
  std::chrono::steady_clock::time_point start_ = std::chrono::steady_clock::now();
};

Json to_json(AcquireOptions const& options) {
  Json json = {{"decoder", options.decoder == AcquireOptions::Decoder::stripe ? "stripe" : "space-time"},
               {"refine_focal", options.refine_focal},
               {"use_rows", options.use_rows},
               {"row_tolerance", options.row_tolerance},
               {"min_depth", options.min_depth},
               {"remove_background", options.remove_background},
               {"backdrop_tolerance", options.backdrop_tolerance}};
  if (std::isfinite(options.max_depth)) json["max_depth"] = options.max_depth;
  return json;
}

/// All pictures that a capture names, each once; the empty scene's colour is optional.
std::vector<fs::path> pictures(Capture const& capture) {
  std::vector<fs::path> files;
  auto const add_view = [&](std::string const& view) {
    for (Side const side : kSides) {
      auto const s = static_cast<std::size_t>(side);
      for (int k = 0; k < capture.frame_count(); ++k) files.push_back(capture.frame_path(view, side, k));
      for (auto const& level : {capture.white, capture.black})
        if (level) files.push_back(capture.path_of(view, (*level)[s]));
    }
    if (capture.color) files.push_back(capture.path_of(view, *capture.color));
  };
  for (auto const& view : capture.views) add_view(view);
  if (capture.empty) add_view(*capture.empty);
  std::sort(files.begin(), files.end());
  files.erase(std::unique(files.begin(), files.end()), files.end());
  std::error_code error;
  std::erase_if(files, [&](fs::path const& file) { return !fs::exists(file, error); });
  return files;
}

/// Everything that decides the result: the capture's description, the rig, and every picture. Pictures that are not
/// there are not named: that, too, is a difference.
Json hash_inputs(Capture const& capture, AcquireOptions const& options, Context& context) {
  auto files = pictures(capture);
  std::vector<std::string> names;
  for (auto const& file : files) names.push_back(file.lexically_relative(capture.folder).generic_string());
  auto const add = [&](std::string const& name, fs::path const& file) {
    names.push_back(name);
    files.push_back(file);
  };
  add("capture", capture.file);
  if (!options.rig.empty())
    add("rig", options.rig);
  else if (capture.rig)
    add("rig", capture.folder / *capture.rig);
  std::vector<std::string> hashes(files.size());
  for_each_index(context, files.size(), [&](std::size_t i) { hashes[i] = hash_file(files[i]); });
  Json inputs = Json::object();
  for (std::size_t i = 0; i < files.size(); ++i) inputs[names[i]] = hashes[i];
  return inputs;
}

/// Seconds that it takes to only read the pictures, on as many threads as decoding has.
double time_reading(Capture const& capture, Context& context) {
  auto const files = pictures(capture);
  Stopwatch const watch;
  for_each_index(context, files.size(), [&](std::size_t i) { cv::imread(files[i].string(), cv::IMREAD_UNCHANGED); });
  return watch.seconds();
}

Json to_json(AcquiredView const& view, RangeImage const& image) {
  return {{"name", view.name},
          {"depths", view.depths},
          {"decodable", view.decodable},
          {"why_missing", why_missing(image)},
          {"sigma_median", view.sigma_median},
          {"ambiguous", view.ambiguous},
          {"background_removed", view.background_removed},
          {"row_pairs", view.row_pairs},
          {"row_off_2", view.row_off_2},
          {"row_off_4", view.row_off_4},
          {"sheet_scatter", view.sheet_scatter},
          {"angle_deg", view.angle_deg},
          {"beam_sigma", view.beam_sigma},
          {"noise", {{"read", view.noise_read}, {"gain", view.noise_gain}}},
          {"soundness", view.soundness},
          {"warnings", view.warnings}};
}

Json figures_of(Capture const& capture, AcquireResult const& result) {
  Json views = Json::array();
  std::size_t depths = 0;
  for (std::size_t v = 0; v < result.views.size(); ++v) {
    views.push_back(to_json(result.views[v], result.set.views[v].image));
    depths += result.views[v].depths;
  }
  return {{"views", views},
          {"depths", depths},
          {"unit", to_string(result.set.unit)},
          {"baseline", result.rig.baseline()},
          {"relative_pose", result.relative_pose},
          {"pattern", capture.pattern == Capture::Pattern::gray ? "gray" : "sweep"},
          {"frames", capture.frame_count()}};
}

void add_times(Json& figures, Times const& times) {
  figures["decode_seconds"] = json_number(times.decode);
  figures["write_seconds"] = json_number(times.write);
  figures["read_seconds"] = json_number(times.read);
  figures["hash_seconds"] = json_number(times.hash);
}

}  // namespace

StageOutcome acquire_stage(fs::path const& folder, AcquireRequest const& request, StageMode mode, Context& context) {
  require_replaceable(folder);
  Capture const capture = read_capture(request.manifest, request.folder);
  StageRecord wanted{"acquire", to_json(request.options), Json::object(), {}, {}};
  StageOutcome outcome;
  if (mode != StageMode::force && fs::exists(folder / "acquire.json")) {
    try {
      wanted.inputs = hash_inputs(capture, request.options, context);
    } catch (Error const& error) {
      // A file that cannot be read is named by the work itself.
      if (error.code() == ErrorCode::interrupted) throw;
    }
    if (is_up_to_date(folder, wanted)) {
      outcome.was_up_to_date = true;
      outcome.figures = read_stage_record(folder, "acquire").figures;
      add_times(outcome.figures, Times());
      return outcome;
    }
  }
  if (mode == StageMode::check) return outcome;

  Times times;
  if (request.measure_reading) times.read = time_reading(capture, context);  // once to fill the cache
  // New views make every later stage's output stale, so the whole folder is replaced at once.
  NewFolder fresh(folder);
  outcome = run_stage(fresh.path(), std::move(wanted), StageMode::force, context, [&](StageRecord& record) {
    Stopwatch const decoding;
    AcquireResult result = acquire(capture, request.options, context);
    times.decode = decoding.seconds();
    result.set.center = median_center(result.set);
    result.set.error_budget.sampling = sampling_error(result.set);
    record.figures = figures_of(capture, result);
    if (record.figures["depths"] == 0) context.warn("no depth is left in any view");
    Stopwatch const writing;
    write_scan_set(fresh.path(), result.set, context);
    record.outputs = image_hashes(fresh.path(), result.set);
    times.write = writing.seconds();
    Stopwatch const hashing;  // after the work, when the pictures are in the cache
    record.inputs = hash_inputs(capture, request.options, context);
    times.hash = hashing.seconds();
    return acquire_section(result);
  });
  if (request.measure_reading) times.read = std::min(times.read, time_reading(capture, context));
  add_times(outcome.figures, times);
  fresh.commit();
  // Its title is the folder's name, which is only now the final one.
  write_report(folder);
  return outcome;
}

}  // namespace scanview
