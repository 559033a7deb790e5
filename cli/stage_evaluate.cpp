#include <fmt/format.h>

#include <charconv>

#include "acquire/scan_set_file.h"
#include "base/error.h"
#include "cli/stages.h"
#include "viewer/evaluate/held_out.h"

namespace scanview {
namespace fs = std::filesystem;
namespace {

/// "one": each view in turn; "every:N"; or names with commas.
std::vector<std::size_t> views_to_hold_out(ScanSet const& set, std::string const& which) {
  std::vector<std::size_t> views;
  std::size_t step = which == "one" ? 1 : 0;
  if (which.starts_with("every:")) {
    auto const [end, error] = std::from_chars(which.data() + 6, which.data() + which.size(), step);
    if (error != std::errc() || end != which.data() + which.size() || step == 0)
      throw Error(ErrorCode::usage, {}, fmt::format("--hold-out {}: N is a positive number", which));
  }
  if (step > 0) {
    for (std::size_t i = 0; i < set.views.size(); i += step) views.push_back(i);
    return views;
  }
  for (std::size_t begin = 0; begin <= which.size();) {
    std::size_t const end = std::min(which.find(',', begin), which.size());
    std::string const name = which.substr(begin, end - begin);
    auto const it = std::find_if(set.views.begin(), set.views.end(), [&](View const& v) { return v.name == name; });
    if (it == set.views.end())
      throw Error(ErrorCode::usage, {}, fmt::format("--hold-out {}: there is no view '{}'", which, name));
    views.push_back(static_cast<std::size_t>(it - set.views.begin()));
    begin = end + 1;
  }
  return views;
}

Json to_json(ViewFigures const& f) {
  return {{"name", f.name},
          {"psnr_common", json_number(f.psnr_common)},
          {"psnr_all", json_number(f.psnr_all)},
          {"ssim", json_number(f.ssim)},
          {"coverage", json_number(f.coverage)}};
}

/// Means over the views. Times are left out: they differ from run to run, and the record must not.
Json mean_figures(std::vector<ViewFigures> const& views) {
  if (views.empty()) return Json::object();
  double psnr_common = 0, psnr_all = 0, ssim = 0, coverage = 0, least = std::numeric_limits<double>::infinity();
  for (auto const& f : views) {
    psnr_common += f.psnr_common, psnr_all += f.psnr_all, ssim += f.ssim, coverage += f.coverage;
    least = std::min(least, f.psnr_common);
  }
  auto const n = static_cast<double>(views.size());
  return {{"psnr_common", json_number(psnr_common / n)},
          {"psnr_common_min", json_number(least)},
          {"psnr_all", json_number(psnr_all / n)},
          {"ssim", json_number(ssim / n)},
          {"coverage", json_number(coverage / n)}};
}

double mean_milliseconds(std::vector<ViewFigures> const& views) {
  double sum = 0;
  for (auto const& f : views) sum += f.milliseconds;
  return views.empty() ? 0 : sum / static_cast<double>(views.size());
}

}  // namespace

StageOutcome evaluate_stage(fs::path const& folder, EvaluateRequest const& request, StageMode mode, Context& context) {
  ScanSet const manifest = read_manifest(folder);
  auto const held_out = views_to_hold_out(manifest, request.hold_out);
  StageRecord record{"evaluate", {{"hold_out", request.hold_out}}, picture_inputs(folder, manifest), {}, {}};
  double milliseconds = 0;
  StageOutcome outcome = run_stage(folder, std::move(record), mode, context, [&](StageRecord& out) {
    ScanSet const set = read_scan_set(folder, context);
    auto const meshes = read_view_meshes(folder, set, context);
    auto const gl = make_offscreen_context();
    // A set of one view has nothing left to render it from.
    auto const held =
        set.views.size() > 1 ? evaluate_held_out(*gl, set, meshes, held_out, {}, context) : std::vector<ViewFigures>();
    auto const source = evaluate_source_views(*gl, set, meshes, held_out, {}, context);
    out.figures["renderers"] = {{"view_based", mean_figures(held)}, {"source_views", mean_figures(source)}};
    out.figures["views"] = Json::array();
    for (auto const& f : held) out.figures["views"].push_back(to_json(f));
    milliseconds = mean_milliseconds(source);
    return evaluate_section(held, source);
  });
  if (milliseconds > 0) outcome.figures["renderers"]["view_based"]["milliseconds"] = milliseconds;
  return outcome;
}

}  // namespace scanview
