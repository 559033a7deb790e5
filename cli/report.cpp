#include "cli/report.h"

#include <fmt/format.h>
#include <sys/utsname.h>

#include <array>
#include <thread>

#include "acquire/scan_set_file.h"
#include "base/error.h"
#include "base/stage_record.h"

namespace scanview {
namespace fs = std::filesystem;
namespace {

struct StageTitle {
  char const* stage;
  char const* title;
};
/// In the order in which data flows.
constexpr std::array kStages = {
    StageTitle{"synth", "Synthetic scan"},   StageTitle{"acquire", "Views"}, StageTitle{"import", "Views"},
    StageTitle{"register", "Alignment"},     StageTitle{"mesh", "Meshes"},   StageTitle{"render", "Pictures"},
    StageTitle{"evaluate", "Held-out views"}};

Json read_or_empty(fs::path const& path) {
  try {
    return read_json(path);
  } catch (Error const&) {
    return Json::object();  // a damaged file is made anew
  }
}

std::string length(Json const& value, std::string const& unit) {
  if (!value.is_number()) return "not known";
  return unit == "m" ? fmt::format("{:.3g} mm", 1000 * value.get<double>())
                     : fmt::format("{:.3g} {}", value.get<double>(), unit == "arbitrary" ? "units" : unit);
}

/// What a stage's own figures say about its error, in one phrase.
std::string error_phrase(std::string const& stage, Json const& figures, Json const& manifest) {
  std::string const unit = manifest.value("unit", "");
  Json const budget = manifest.value("error_budget", Json::object());
  auto const part = [&](char const* name, char const* key = "rms") {
    return length(budget.value(name, Json::object()).value(key, Json()), unit);
  };
  if (stage == "acquire" || stage == "import" || stage == "synth")
    return "noise of a depth: 95 % below " + part("sampling", "p95");  // a few depths of little worth rule an RMS
  if (stage == "register") return "distance between overlapping views: " + part("registration") + " RMS";
  if (stage == "mesh") return "distance from depths to mesh: " + part("approximation") + " RMS";
  if (stage == "evaluate" && figures.contains("renderers")) {
    Json const ours = figures["renderers"].value("view_based", Json::object());
    if (ours.value("psnr_common", Json()).is_number())
      return fmt::format("PSNR {:.1f} dB against photographs that were not used", ours["psnr_common"].get<double>());
  }
  return "";
}

std::string introduction(fs::path const& folder) {
  Json const manifest = read_or_empty(folder / "scanset.json"), timings = read_or_empty(folder / "timings.json");
  std::size_t const views = manifest.value("views", Json::array()).size();
  std::string html = fmt::format(
      "<p>{} view{}, unit {}. Each view keeps its own small textured mesh; a picture from any side blends the views "
      "around "
      "the eye (view-based rendering, Pulli and others 1997). This page says what every stage did and how good it is: "
      "where the depths come from, how well the views agree, how closely the meshes follow the depths, and how a "
      "picture compares with a photograph that was not used to make it.</p>",
      views, views == 1 ? "" : "s", html_escape(manifest.value("unit", "")));
  std::vector<std::vector<std::string>> rows = {{"stage", "seconds", "peak memory, MB", "error"}};
  Json const stages = timings.value("stages", Json::object());
  for (auto const& [stage, title] : kStages) {
    if (!stages.contains(stage)) continue;
    Json const record = read_or_empty(folder / (std::string(stage) + ".json"));
    rows.push_back({stage, fmt::format("{:.2f}", stages[stage].value("seconds", 0.0)),
                    fmt::format("{:.0f}", stages[stage].value("peak_mb", 0.0)),
                    error_phrase(stage, record.value("figures", Json::object()), manifest)});
  }
  html += html_table(rows);
  html += fmt::format("<p>scanview {}, {} threads, {}</p>\n", version(), timings.value("threads", 0),
                      html_escape(timings.value("host", "")));
  for (auto const& [stage, title] : kStages)
    for (auto const& warning : read_or_empty(folder / (std::string(stage) + ".json"))
                                   .value("figures", Json::object())
                                   .value("warnings", Json::array()))
      if (warning.is_string())
        html += fmt::format("<p class=\"warning\">{}: {}</p>\n", stage, html_escape(warning.get<std::string>()));
  return html;
}

}  // namespace

void write_report_section(fs::path const& folder, ReportSection const& section) {
  std::error_code error;
  fs::create_directories(folder / "report", error);
  if (error) throw Error(ErrorCode::io, folder / "report", "cannot create: " + error.message());
  write_file(folder / "report" / (section.id + ".html"), section.html);
}

void write_timing(fs::path const& folder, std::string const& stage, double seconds, double peak_mb, int threads) {
  Json timings = read_or_empty(folder / "timings.json");
  utsname host{};
  ::uname(&host);
  timings["host"] =
      fmt::format("{} {}, {} processors", host.sysname, host.machine, std::thread::hardware_concurrency());
  timings["threads"] = threads > 0 ? threads : static_cast<int>(std::thread::hardware_concurrency());
  timings["stages"][stage] = {{"seconds", seconds}, {"peak_mb", peak_mb}};
  write_json(folder / "timings.json", timings);
}

void write_report(fs::path const& folder) {
  std::vector<ReportSection> sections;
  for (auto const& [stage, title] : kStages) {
    fs::path const kept = folder / "report" / (std::string(stage) + ".html");
    if (fs::exists(kept)) sections.push_back({stage, title, read_file(kept)});
  }
  fs::path const name = fs::absolute(folder).lexically_normal();
  std::string const title = (name.has_filename() ? name.filename() : name.parent_path().filename()).string();
  write_file(folder / "report.html", html_page(title, introduction(folder), sections));
}

}  // namespace scanview
