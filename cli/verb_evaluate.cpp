#include <CLI/CLI.hpp>
#include <memory>

#include "cli/stages.h"

namespace scanview {

void add_evaluate(CLI::App& app, Session& session) {
  struct Arguments {
    std::filesystem::path set;
    EvaluateRequest request;
    bool force = false;
  };
  auto arguments = std::make_shared<Arguments>();
  CLI::App* verb = app.add_subcommand("evaluate", "Renders held-out views and compares them with their photographs");
  verb->add_option("set", arguments->set, "The scan set")->required();
  verb->add_option("--hold-out", arguments->request.hold_out, "one (each in turn), every:N, NAME,...");
  verb->add_flag("--force", arguments->force, "Also where nothing changed");
  verb->callback([arguments, &session] {
    session.verb = "evaluate";
    session.work = [arguments, &session] {
      StageOutcome const outcome = evaluate_stage(
          arguments->set, arguments->request, arguments->force ? StageMode::force : StageMode::resume, session.context);
      session.report.update(outcome.figures);
      session.exit_code = outcome.exit_code;
    };
  });
}

}  // namespace scanview
