#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <memory>

#include "base/error.h"
#include "cli/stage_flags.h"

namespace scanview {

namespace {

template <typename Choice>
using Names = std::vector<std::pair<std::string, Choice>>;

Names<MeshOptions::Placement> const kPlacements = {{"insertion", MeshOptions::Placement::insertion},
                                                   {"probing", MeshOptions::Placement::probing},
                                                   {"decimation", MeshOptions::Placement::decimation}};
Names<MeshOptions::Fit> const kFits = {
    {"none", MeshOptions::Fit::none}, {"depths", MeshOptions::Fit::depths}, {"joint", MeshOptions::Fit::joint}};

template <typename Choice>
std::vector<std::string> words(Names<Choice> const& names) {
  std::vector<std::string> result;
  for (auto const& [word, choice] : names) result.push_back(word);
  return result;
}

/// Of one of words(names).
template <typename Choice>
Choice choose(Names<Choice> const& names, std::string const& word) {
  return std::find_if(names.begin(), names.end(), [&](auto const& name) { return name.first == word; })->second;
}

}  // namespace

void add_mesh_flags(CLI::App& verb, MeshFlags& flags) {
  verb.add_option("--tolerance", flags.tolerance, "Greatest depth error: T (units), Tsigma, or auto");
  verb.add_option("--triangles", flags.triangles,
                  "So many a view, as far as they do more than model noise (0: as many as the tolerance needs)");
  verb.add_option("--levels", flags.levels, "Also coarser meshes, each of twice the tolerance: so many in all")
      ->check(CLI::Range(1, 16));
  verb.add_option("--placement", flags.placement,
                  "How vertices are placed: insertion (of the worst pixel), probing (random, of Voronoi edges), "
                  "decimation (of the full grid: slow)")
      ->check(CLI::IsMember(words(kPlacements)));
  verb.add_option("--fit", flags.fit, "What follows: none, depths (least squares), joint (places and connections too)")
      ->check(CLI::IsMember(words(kFits)));
  verb.add_option("--marks", flags.marks, "Polygons drawn by hand that restrict or cut meshes (JSON)");
}

MeshRequest resolve(MeshFlags const& flags, std::vector<std::string> const& settings) {
  MeshRequest request;
  request.levels = flags.levels;
  request.marks = flags.marks;
  MeshOptions& options = request.options;
  options.placement = choose(kPlacements, flags.placement);
  options.fit = choose(kFits, flags.fit);
  options.max_triangles = flags.triangles;
  if (flags.tolerance != "auto") {
    try {
      std::size_t used = 0;
      options.tolerance = std::stod(flags.tolerance, &used);
      std::string const rest = flags.tolerance.substr(used);
      if (rest == "sigma")
        options.tolerance_kind = MeshOptions::Tolerance::sigmas;
      else if (rest.empty())
        options.tolerance_kind = MeshOptions::Tolerance::units;
      else
        throw std::invalid_argument(rest);
    } catch (std::logic_error const&) {
      throw Error(ErrorCode::usage, {}, fmt::format("--tolerance {}: expected T, Tsigma or auto", flags.tolerance));
    }
  }
  apply_settings(
      settings, "mesh",
      {number_setting("step_sigmas", options.step_sigmas), number_setting("max_angle_deg", options.max_angle_deg),
       integer_setting("feather_px", options.feather_px), integer_setting("fill_pixels", options.fill_pixels),
       integer_setting("min_patch_pixels", options.min_patch_pixels)});
  options.validate();
  return request;
}

void add_mesh(CLI::App& app, Session& session) {
  struct Arguments {
    std::filesystem::path set;
    MeshFlags flags;
    bool force = false;
  };
  auto arguments = std::make_shared<Arguments>();
  CLI::App* verb = app.add_subcommand("mesh", "Makes a small textured mesh of every view");
  verb->add_option("set", arguments->set, "The scan set")->required();
  add_mesh_flags(*verb, arguments->flags);
  verb->add_flag("--force", arguments->force, "Also where nothing changed");
  verb->callback([arguments, &session] {
    session.verb = "mesh";
    session.work = [arguments, &session] {
      StageOutcome const outcome = mesh_stage(arguments->set, resolve(arguments->flags, session.settings),
                                              arguments->force ? StageMode::force : StageMode::resume, session.context);
      session.report.update(outcome.figures);
      session.exit_code = outcome.exit_code;
    };
  });
}

}  // namespace scanview
