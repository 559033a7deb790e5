#include <CLI/CLI.hpp>
#include <memory>

#include "base/error.h"
#include "cli/import_flags.h"
#include "cli/stages.h"

namespace scanview {

void add_import_flags(CLI::App& verb, ImportFlags& flags) {
  verb.add_option("--box", flags.box, "Keep only x0 y0 z0 x1 y1 z1, object coordinates")->expected(6)->delimiter(',');
  verb.add_flag("--cut-ground", flags.options.cut_ground, "Remove the dominant plane and all behind it");
  verb.add_option("--min-depth", flags.options.min_depth, "Drop depths below, in units");
  verb.add_option("--max-depth", flags.options.max_depth, "Drop depths above, in units");
  verb.add_option("--background", flags.background,
                  "What stays the same over the views of a fixed camera: auto, keep, remove")
      ->check(CLI::IsMember({"auto", "keep", "remove"}));
  verb.add_option("--step", flags.options.step, "Every so many frames only");
}

ImportOptions resolve(ImportFlags const& flags) {
  ImportOptions options = flags.options;
  if (!flags.box.empty())
    options.box = {Eigen::Vector3d(flags.box[0], flags.box[1], flags.box[2]),
                   Eigen::Vector3d(flags.box[3], flags.box[4], flags.box[5])};
  if (flags.background == "keep") options.background = ImportOptions::Background::keep;
  if (flags.background == "remove") options.background = ImportOptions::Background::remove_static;
  options.validate();
  return options;
}

void add_import(CLI::App& app, Session& session) {
  struct Arguments {
    std::string kind;
    std::filesystem::path input, output;
    ImportFlags flags;
    bool force = false;
  };
  auto arguments = std::make_shared<Arguments>();
  CLI::App* verb = app.add_subcommand("import", "Other people's data becomes a scan set");
  verb->add_option("kind", arguments->kind, "rgbd, stanford, nerfstudio, colmap or scanset")->required();
  verb->add_option("input", arguments->input, "Folder, file or archive")->required();
  verb->add_option("-o,--output", arguments->output, "The scan set to make")->required();
  verb->add_flag("--force", arguments->force, "Also where nothing changed");
  add_import_flags(*verb, arguments->flags);
  verb->callback([arguments, &session] {
    session.verb = "import";
    session.work = [arguments, &session] {
      StageOutcome const outcome =
          import_stage(arguments->output, {arguments->kind, arguments->input, resolve(arguments->flags)},
                       arguments->force ? StageMode::force : StageMode::resume, session.context);
      session.report.update(outcome.figures);
      session.exit_code = outcome.exit_code;
    };
  });
}

}  // namespace scanview
