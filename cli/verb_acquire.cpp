#include <CLI/CLI.hpp>
#include <memory>

#include "base/error.h"
#include "cli/acquire_flags.h"

namespace scanview {
namespace fs = std::filesystem;

void add_acquire_flags(CLI::App& verb, AcquireFlags& flags) {
  verb.add_option("--capture", flags.manifest, "Describes the pictures, in place of the capture.json beside them");
  verb.add_option("--rig", flags.options.rig, "Calibration of the two cameras, in place of the capture's own");
  verb.add_option("--decoder", flags.decoder,
                  "Of a sweep: space-time (when each pixel was brightest) or stripe (where each frame was brightest)")
      ->check(CLI::IsMember({"space-time", "stripe"}));
  verb.add_flag("--refine-focal", flags.options.refine_focal,
                "Where the capture has intrinsics but no rig: find the focal length, too, if the scene tells it");
}

AcquireRequest resolve(AcquireFlags const& flags, fs::path const& capture, std::vector<std::string> const& settings) {
  if (!fs::exists(capture)) throw Error(ErrorCode::bad_input, capture, "does not exist");
  AcquireRequest request;
  bool const is_manifest = fs::is_regular_file(capture);
  request.folder = is_manifest ? capture.parent_path() : capture;
  if (request.folder.empty()) request.folder = ".";
  request.manifest = !flags.manifest.empty() ? flags.manifest : is_manifest ? capture : capture / "capture.json";
  if (!fs::exists(request.manifest))
    throw Error(ErrorCode::bad_input, request.manifest, "does not exist; it says which picture is what");
  request.options = flags.options;
  request.options.decoder =
      flags.decoder == "stripe" ? AcquireOptions::Decoder::stripe : AcquireOptions::Decoder::space_time;
  request.measure_reading = flags.measure_reading;
  AcquireOptions& options = request.options;
  int use_rows = options.use_rows ? 1 : 0;
  apply_settings(settings, "acquire",
                 {integer_setting("use_rows", use_rows), number_setting("row_tolerance", options.row_tolerance),
                  number_setting("backdrop_tolerance", options.backdrop_tolerance)});
  options.use_rows = use_rows != 0;
  options.validate();
  return request;
}

void add_acquire(CLI::App& app, Session& session) {
  struct Arguments {
    fs::path capture, output;
    AcquireFlags flags;
    bool keep_background = false, force = false;
  };
  auto arguments = std::make_shared<Arguments>();
  CLI::App* verb = app.add_subcommand("acquire", "What two cameras saw of a moving light becomes a scan set");
  verb->add_option("capture", arguments->capture, "A folder with capture.json and pictures")->required();
  verb->add_option("-o,--output", arguments->output, "The scan set to make")->required();
  add_acquire_flags(*verb, arguments->flags);
  verb->add_option("--min-depth", arguments->flags.options.min_depth, "Drop depths below, in the rig's unit");
  verb->add_option("--max-depth", arguments->flags.options.max_depth, "Drop depths above, in the rig's unit");
  verb->add_flag("--keep-background", arguments->keep_background, "Keep what the empty scene or the backdrop shows");
  verb->add_flag("--measure-reading", arguments->flags.measure_reading,
                 "Also read all pictures without decoding, to compare times");
  verb->add_flag("--force", arguments->force, "Also where nothing changed");
  verb->callback([arguments, &session] {
    session.verb = "acquire";
    session.work = [arguments, &session] {
      check_settings(session.settings, {"acquire"});
      if (arguments->keep_background) arguments->flags.options.remove_background = false;
      AcquireRequest const request = resolve(arguments->flags, arguments->capture, session.settings);
      StageOutcome const outcome = acquire_stage(
          arguments->output, request, arguments->force ? StageMode::force : StageMode::resume, session.context);
      session.report.update(outcome.figures);
      session.exit_code = outcome.exit_code;
    };
  });
}

}  // namespace scanview
