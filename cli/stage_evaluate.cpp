#include <fmt/format.h>

#include <charconv>

#include "acquire/scan_set_file.h"
#include "base/error.h"
#include "cli/stages.h"
#include "viewer/evaluate/held_out.h"

namespace scanview {
namespace fs = std::filesystem;
namespace {

/// "one": each view in turn; "every:N": some of them in turn; or names with commas: together.
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

template <typename Value>
double mean_of(std::vector<ViewFigures> const& views, Value const& value) {
  double sum = 0;
  for (auto const& view : views) sum += value(view);
  return views.empty() ? 0 : sum / static_cast<double>(views.size());
}

/// Means over the views. Times are left out: they differ from run to run, and the record must not.
Json mean_figures(std::vector<ViewFigures> const& views) {
  if (views.empty()) return Json::object();
  double least = std::numeric_limits<double>::infinity();
  for (auto const& f : views) least = std::min(least, f.psnr_common);
  return {{"psnr_common", json_number(mean_of(views, [](auto const& f) { return f.psnr_common; }))},
          {"psnr_common_min", json_number(least)},
          {"psnr_all", json_number(mean_of(views, [](auto const& f) { return f.psnr_all; }))},
          {"ssim", json_number(mean_of(views, [](auto const& f) { return f.ssim; }))},
          {"coverage", json_number(mean_of(views, [](auto const& f) { return f.coverage; }))},
          {"outside", json_number(mean_of(views, [](auto const& f) { return f.outside; }))}};
}

/// "difference_to_ours": theirs minus ours, on the pixels that both drew.
Json to_json(ContenderFigures const& contender, bool is_ours) {
  Json json = mean_figures(contender.views);
  if (is_ours || contender.views.empty()) return json;
  auto const negated = [](Interval const& lead) {
    return Json{{"mean", json_number(-lead.mean)}, {"low", json_number(-lead.high)}, {"high", json_number(-lead.low)}};
  };
  json["difference_to_ours"] = negated(contender.psnr_lead);
  json["ssim_difference_to_ours"] = negated(contender.ssim_lead);
  return json;
}

}  // namespace

StageOutcome evaluate_stage(fs::path const& folder, EvaluateRequest const& request, StageMode mode, Context& context) {
  ScanSet const manifest = read_manifest(folder);
  auto const held_out = views_to_hold_out(manifest, request.hold_out);
  bool const by_name = request.hold_out != "one" && !request.hold_out.starts_with("every:");
  StageRecord record{"evaluate", {{"hold_out", request.hold_out}}, picture_inputs(folder, manifest), {}, {}};
  Json milliseconds = Json::object();
  StageOutcome outcome = run_stage(folder, std::move(record), mode, context, [&](StageRecord& out) {
    ScanSet const set = read_scan_set(folder, context);
    auto const library = std::make_shared<ViewLibrary>(set, read_view_meshes(folder, set, context));
    std::vector<ContenderFigures> held;
    // A set of one view has nothing left to render it from.
    if (set.views.size() > 1) {
      auto contenders = make_contenders(set, library, {}, context);
      held = evaluate_held_out(contenders, set, held_out, by_name ? HoldOut::together : HoldOut::each, context);
    }
    auto const source = evaluate_source_views(library, set, held_out, {}, context);
    out.figures["renderers"] = Json::object();
    for (auto const& one : held) {
      out.figures["renderers"][one.name] = to_json(one, &one == &held.front());
      milliseconds[one.name] = mean_of(one.views, [](auto const& f) { return f.milliseconds; });
    }
    out.figures["renderers"]["source_views"] = mean_figures(source);
    out.figures["views"] = Json::array();
    if (!held.empty()) {
      for (auto const& f : held.front().views) out.figures["views"].push_back(to_json(f));
    }
    return evaluate_section(held, source);
  });
  for (auto const& [name, value] : milliseconds.items()) outcome.figures["renderers"][name]["milliseconds"] = value;
  return outcome;
}

}  // namespace scanview
