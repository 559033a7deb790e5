#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <array>
#include <iostream>
#include <memory>
#include <optional>

#include "base/error.h"
#include "cli/acquire_flags.h"
#include "cli/import_flags.h"
#include "cli/stage_flags.h"

namespace scanview {
namespace fs = std::filesystem;
namespace {

constexpr std::array kVerbs = {"import", "register", "mesh", "render", "evaluate"};
constexpr std::size_t kViews = 0;  // of a capture, `acquire` takes the place of `import`

struct RunArguments {
  fs::path input, output;
  std::string kind, from, to, hold_out = "one";
  bool force = false, dry_run = false;
  AcquireFlags acquire_flags;
  ImportFlags import_flags;
  RegisterFlags register_flags;
  MeshFlags mesh_flags;
};

std::size_t verb_index(std::string const& name, std::size_t otherwise) {
  if (name.empty()) return otherwise;
  if (name == "acquire") return kViews;
  auto const it = std::find(kVerbs.begin(), kVerbs.end(), name);
  if (it == kVerbs.end()) throw Error(ErrorCode::usage, {}, fmt::format("'{}' is no stage of run", name));
  return static_cast<std::size_t>(it - kVerbs.begin());
}

bool is_scan_set(fs::path const& path) { return fs::exists(path / "scanset.json"); }

/// What is in place of an import's box, ground and frames: only depth range and background mean something to a capture.
AcquireRequest acquire_request(RunArguments const& arguments, std::vector<std::string> const& settings) {
  ImportOptions const import = resolve(arguments.import_flags);
  if (import.box || import.cut_ground || import.step != 1)
    throw Error(ErrorCode::usage, {}, "--box, --cut-ground and --step are no options of a capture");
  AcquireFlags flags = arguments.acquire_flags;
  flags.options.min_depth = import.min_depth;
  flags.options.max_depth = import.max_depth;
  flags.options.remove_background = import.background != ImportOptions::Background::keep;
  return resolve(flags, arguments.input, settings);
}

class Pipeline {
 public:
  Pipeline(RunArguments const& arguments, Session& session)
      : arguments_(arguments),
        session_(session),
        register_request_(resolve(arguments.register_flags, session.settings)),
        mesh_request_(resolve(arguments.mesh_flags, session.settings)) {
    if (!fs::exists(arguments.input)) throw Error(ErrorCode::bad_input, arguments.input, "does not exist");
    folder_ = arguments.output;
    if (folder_.empty()) {
      if (!is_scan_set(arguments.input)) throw Error(ErrorCode::usage, {}, "say with -o where the scan set goes");
      folder_ = arguments.input;
    }
    std::error_code error;
    in_place_ =
        is_scan_set(arguments.input) && (arguments.output.empty() || fs::equivalent(arguments.input, folder_, error));
    if (in_place_) return;
    bool const is_description = arguments.input.filename() == "capture.json";
    if (is_description || !arguments.acquire_flags.manifest.empty() ||
        (arguments.kind.empty() && !is_scan_set(arguments.input) && is_capture(arguments.input))) {
      acquire_ = acquire_request(arguments, session.settings);
      return;
    }
    import_.input = arguments.input;
    import_.options = resolve(arguments.import_flags);
    import_.kind = !arguments.kind.empty()        ? arguments.kind
                   : is_scan_set(arguments.input) ? "scanset"
                                                  : guess_import_kind(arguments.input);
    if (import_.kind.empty())
      throw Error(
          ErrorCode::bad_input, arguments.input,
          "is none of the layouts that are known; describe colour and depth frames in an rgbd.json, or say --kind");
  }

  StageOutcome stage(std::string const& verb, StageMode mode) {
    Context& context = session_.context;
    if (verb == "import") {
      if (in_place_) return {.figures = Json::object(), .was_up_to_date = true};
      if (acquire_) return acquire_stage(folder_, *acquire_, mode, context);
      return import_stage(folder_, import_, mode, context);
    }
    if (verb == "register") return register_stage(folder_, register_request_, mode, context);
    if (verb == "mesh") return mesh_stage(folder_, mesh_request_, mode, context);
    if (verb == "render") return render_stage(folder_, mode, context);
    return evaluate_stage(folder_, {arguments_.hold_out}, mode, context);
  }

  void run() {
    std::size_t const first = verb_index(arguments_.from, 0), last = verb_index(arguments_.to, kVerbs.size() - 1);
    if (first > last) throw Error(ErrorCode::usage, {}, "--from comes after --to");
    session_.report["stages"] = Json::object();
    bool stale = false;  // once a stage would work, all after it would
    for (std::size_t i = first; i <= last; ++i) {
      std::string const verb = kVerbs[i], name = i == kViews && acquire_ ? "acquire" : verb;
      if (arguments_.dry_run) {
        stale = stale || arguments_.force || (!in_place_ && !is_scan_set(folder_)) ||
                !stage(verb, StageMode::check).was_up_to_date;
        std::cout << fmt::format("{:<10} {}\n", name, stale ? "would run" : "is up to date");
        continue;
      }
      session_.context.check_cancelled();
      StageOutcome const outcome = stage(verb, arguments_.force ? StageMode::force : StageMode::resume);
      session_.context.log(fmt::format("{:<10} {}", name, outcome.was_up_to_date ? "is up to date" : "done"));
      session_.report["stages"][name] = outcome.figures;
      if (session_.exit_code == 0) session_.exit_code = outcome.exit_code;
    }
    if (!arguments_.dry_run && !session_.quiet) std::cout << (folder_ / "report.html").string() << '\n';
  }

 private:
  RunArguments const& arguments_;
  Session& session_;
  fs::path folder_;
  bool in_place_ = false;
  std::optional<AcquireRequest> acquire_;  ///< the input is a capture
  ImportRequest import_;
  RegisterRequest register_request_;
  MeshRequest mesh_request_;
};

}  // namespace

void add_run(CLI::App& app, Session& session) {
  auto arguments = std::make_shared<RunArguments>();
  CLI::App* verb = app.add_subcommand("run", "Every stage in order, from a capture or frames to pictures and a report");
  verb->add_option("input", arguments->input, "A capture, colour and depth frames, scans, or a scan set")->required();
  verb->add_option("-o,--output", arguments->output, "The scan set to make (a set alone is worked on in place)");
  verb->add_option("--kind", arguments->kind,
                   "Kind of the input, where it cannot be told: rgbd, stanford, nerfstudio, colmap");
  verb->add_option("--from", arguments->from, "First stage: acquire (import), register, mesh, render, evaluate");
  verb->add_option("--to", arguments->to, "Last stage");
  verb->add_flag("--force", arguments->force, "Also where nothing changed");
  verb->add_flag("--dry-run", arguments->dry_run, "Only say what would run");
  verb->add_option("--hold-out", arguments->hold_out,
                   "Views to judge pictures by: one (each in turn), every:N, NAME,...");
  add_acquire_flags(*verb, arguments->acquire_flags);
  add_import_flags(*verb, arguments->import_flags);
  add_register_flags(*verb, arguments->register_flags);
  add_mesh_flags(*verb, arguments->mesh_flags);
  verb->callback([arguments, &session] {
    session.verb = "run";
    session.work = [arguments, &session] {
      check_settings(session.settings, {"acquire", "register", "mesh"});
      Pipeline(*arguments, session).run();
    };
  });
}

}  // namespace scanview
