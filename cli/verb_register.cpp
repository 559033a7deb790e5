#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <memory>

#include "acquire/scan_set_file.h"
#include "base/error.h"
#include "cli/stage_flags.h"
#include "register/pose_file.h"

namespace scanview {
namespace {

double degrees(std::string const& text, std::string const& whole) {
  try {
    std::size_t used = 0;
    double const value = std::stod(text, &used);
    if (used == text.size() && std::abs(value) <= 360) return value;
  } catch (std::exception const&) {
    // Said below.
  }
  throw Error(ErrorCode::usage, {}, fmt::format("--init {}: '{}' is no angle in degrees", whole, text));
}

/// turntable, turntable:DEG or turntable:DEG:X,Y,Z (the axis in the first camera's frame; also x, y or z).
void parse_turntable(std::string const& text, RegisterOptions& options) {
  options.init = RegisterOptions::Init::turntable;
  std::string rest = text.size() > 9 ? text.substr(10) : "";
  auto const colon = rest.find(':');
  std::string const step = rest.substr(0, colon);
  if (!step.empty()) options.turntable_step_deg = degrees(step, text);
  if (colon == std::string::npos) return;
  std::string const axis = rest.substr(colon + 1);
  if (axis == "x" || axis == "y" || axis == "z") {
    options.turntable_axis = Eigen::Vector3d::Unit(axis[0] - 'x');
    return;
  }
  double x = 0, y = 0, z = 0;
  char end = 0;
  if (std::sscanf(axis.c_str(), "%lf,%lf,%lf%c", &x, &y, &z, &end) != 3 || !(Eigen::Vector3d(x, y, z).norm() > 0))
    throw Error(ErrorCode::usage, {}, fmt::format("--init {}: the axis is x, y, z or three numbers X,Y,Z", text));
  options.turntable_axis = {x, y, z};
}

/// Poses of the set against those of another file, over the views that both have.
Json compare_with(std::filesystem::path const& folder, std::filesystem::path const& reference, Context& context) {
  ScanSet set = read_scan_set(folder, context);
  ScanSet other = set;
  read_poses(reference, other);
  std::vector<Eigen::Isometry3d> poses, expected;
  for (std::size_t i = 0; i < set.views.size(); ++i) {
    poses.push_back(*set.views[i].object_from_camera);
    expected.push_back(*other.views[i].object_from_camera);
  }
  auto const relative = compare_poses(set, poses, expected), absolute = compare_poses_absolute(set, poses, expected);
  return {{"median_deg", relative.median_deg},       {"max_deg", relative.max_deg},
          {"median_length", relative.median_length}, {"max_length", relative.max_length},
          {"pose_max_deg", absolute.max_deg},        {"pose_max_length", absolute.max_length}};
}

}  // namespace

void add_register_flags(CLI::App& verb, RegisterFlags& flags) {
  verb.add_option("--init", flags.init,
                  "given, auto, none, turntable[:DEG[:AXIS]], or a file (default: given, else auto): Stanford .conf, "
                  "MeshLab .aln, TUM or Redwood trajectory, transforms.json, COLMAP's images.txt, scanset.json, "
                  "rgbd.json, or the folder of one of these; or marks");
  verb.add_flag("--no-refine", flags.no_refine, "Take the initial poses as they are");
}

RegisterRequest resolve(RegisterFlags const& flags, std::vector<std::string> const& settings) {
  RegisterRequest request;
  request.start = RegisterRequest::Start::options;
  request.options.refine = !flags.no_refine;
  if (flags.init.empty()) {
    request.start = RegisterRequest::Start::automatic;
  } else if (flags.init == "given") {
    request.options.init = RegisterOptions::Init::given;
  } else if (flags.init == "auto") {
    request.options.init = RegisterOptions::Init::automatic;
  } else if (flags.init == "none") {
    request.options.init = RegisterOptions::Init::none;
  } else if (flags.init == "turntable" || flags.init.starts_with("turntable:")) {
    parse_turntable(flags.init, request.options);
  } else {
    request.start = RegisterRequest::Start::file;
    request.pose_file = flags.init;
    if (!std::filesystem::exists(request.pose_file))
      throw Error(ErrorCode::usage, {}, fmt::format("--init {}: neither a way to start nor a file", flags.init));
  }
  apply_settings(
      settings, "register",
      {number_setting("given_std", request.options.given_std), integer_setting("levels", request.options.levels),
       integer_setting("max_iterations", request.options.max_iterations),
       integer_setting("max_correspondences", request.options.max_correspondences),
       number_setting("min_overlap", request.options.min_overlap), integer_setting("exposure", request.exposure)});
  request.options.validate();
  return request;
}

void add_register(CLI::App& app, Session& session) {
  struct Arguments {
    std::filesystem::path set, reference;
    RegisterFlags flags;
    bool force = false;
  };
  auto arguments = std::make_shared<Arguments>();
  CLI::App* verb = app.add_subcommand("register", "Aligns the views of a scan set");
  verb->add_option("set", arguments->set, "The scan set")->required();
  add_register_flags(*verb, arguments->flags);
  verb->add_option("--reference", arguments->reference,
                   "Poses to compare the result with: a file (or its folder) as for --init");
  verb->add_flag("--force", arguments->force, "Also where nothing changed");
  verb->callback([arguments, &session] {
    session.verb = "register";
    session.work = [arguments, &session] {
      StageOutcome const outcome =
          register_stage(arguments->set, resolve(arguments->flags, session.settings),
                         arguments->force ? StageMode::force : StageMode::resume, session.context);
      session.report.update(outcome.figures);
      session.exit_code = outcome.exit_code;
      if (!arguments->reference.empty())
        session.report["reference"] = compare_with(arguments->set, arguments->reference, session.context);
    };
  });
}

}  // namespace scanview
