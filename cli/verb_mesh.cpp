#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <memory>

#include "base/error.h"
#include "cli/stage_flags.h"

namespace scanview {

void add_mesh_flags(CLI::App& verb, MeshFlags& flags) {
  verb.add_option("--tolerance", flags.tolerance, "Greatest depth error: T (units), Tsigma, or auto");
  verb.add_option("--triangles", flags.triangles, "At most so many a view (0: as many as the tolerance needs)");
}

MeshOptions resolve(MeshFlags const& flags, std::vector<std::string> const& settings) {
  MeshOptions options;
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
       integer_setting("feather_px", options.feather_px)});
  options.validate();
  return options;
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
