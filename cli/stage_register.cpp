#include <fmt/format.h>

#include <cmath>

#include "acquire/scan_set_file.h"
#include "base/error.h"
#include "cli/stages.h"
#include "register/pose_file.h"
#include "register/register_section.h"
#include "viewer/blend/exposure.h"

namespace scanview {
namespace fs = std::filesystem;
namespace {

Json to_json(RegisterOptions const& options) {
  return {{"init", static_cast<int>(options.init)},
          {"turntable_step_deg", options.turntable_step_deg},
          {"turntable_axis", {options.turntable_axis.x(), options.turntable_axis.y(), options.turntable_axis.z()}},
          {"refine", options.refine},
          {"levels", options.levels},
          {"max_iterations", options.max_iterations},
          {"max_correspondences", options.max_correspondences},
          {"min_overlap", options.min_overlap},
          {"given_std", options.given_std}};
}

Json poses_json(ScanSet const& set) {
  Json poses = Json::object();
  for (auto const& view : set.views)
    poses[view.name] = view.object_from_camera ? pose_to_json(*view.object_from_camera) : Json(nullptr);
  return poses;
}

/// poses.json keeps where registration started beside where it ended: scanset.json has only the latter. Where the
/// manifest still holds what registration wrote, the next registration starts from the same poses again; where a person
/// or another program changed it, from those.
Json initial_poses(fs::path const& folder, ScanSet const& set) {
  Json const current = poses_json(set);
  fs::path const path = folder / "poses.json";
  if (!fs::exists(path)) return current;
  Json const kept = read_json(path);
  return kept.value("registered", Json()) == current ? kept.value("initial", current) : current;
}

void set_poses(ScanSet& set, Json const& poses, fs::path const& path) {
  for (auto& view : set.views) {
    Json const pose = poses.value(view.name, Json(nullptr));
    view.object_from_camera.reset();
    if (!pose.is_null())
      view.object_from_camera = pose_from_json(pose, path, fmt::format("pose of view {}", view.name));
  }
}

Json to_json(PoseComparison const& c) {
  return {{"median_deg", c.median_deg},
          {"max_deg", c.max_deg},
          {"median_length", c.median_length},
          {"max_length", c.max_length}};
}

Json to_json(ErrorPart const& part) { return {{"rms", json_number(part.rms)}, {"p95", json_number(part.p95)}}; }

Json figures_of(ScanSet const& set, Alignment const& alignment, AlignmentReview const& review) {
  auto const name = [&](std::size_t i) { return set.views[i].name; };
  Json figures = {{"pairs", Json::array()},
                  {"unobservable", alignment.unobservable},
                  {"parts", Json::array()},
                  {"poses", Json::object()}};
  for (auto const& pair : alignment.pairs)
    figures["pairs"].push_back({{"a", name(pair.a)},
                                {"b", name(pair.b)},
                                {"overlap", json_number(pair.overlap)},
                                {"rms", json_number(pair.rms)},
                                {"median_distance", json_number(pair.median_distance)},
                                {"inliers", json_number(pair.inliers)},
                                {"suspicious", pair.suspicious}});
  figures["worst_pair"] = nullptr;
  if (PairFigures const* const worst = worst_pair(alignment))
    figures["worst_pair"] = {{"a", name(worst->a)},
                             {"b", name(worst->b)},
                             {"rms", json_number(worst->rms)},
                             {"median_distance", json_number(worst->median_distance)}};
  figures["error"] = to_json(alignment.error);
  for (auto const& part : alignment.parts) {
    Json names = Json::array();
    for (std::size_t const i : part) names.push_back(name(i));
    figures["parts"].push_back(names);
  }
  for (std::size_t i = 0; i < alignment.poses.size(); ++i)
    figures["poses"][name(i)] = {{"std_deg", json_number(alignment.poses[i].std_deg)},
                                 {"std_length", json_number(alignment.poses[i].std_length)},
                                 {"seen_by", json_number(review.seen[i])}};
  figures["iterations"] = alignment.iterations;
  figures["converged"] = alignment.status == AlignmentStatus::converged;
  return figures;
}

RegisterOptions resolve(RegisterRequest const& request, ScanSet& set) {
  RegisterOptions options = request.options;
  if (request.start == RegisterRequest::Start::file) {
    read_poses(request.pose_file, set);
    options.init = RegisterOptions::Init::given;
  } else if (request.start == RegisterRequest::Start::automatic && !set.has_poses()) {
    options.init = RegisterOptions::Init::automatic;
  }
  return options;
}

}  // namespace

StageOutcome register_stage(fs::path const& folder, RegisterRequest const& request, StageMode mode, Context& context) {
  ScanSet manifest = read_manifest(folder);
  Json const initial = initial_poses(folder, manifest);
  Json cameras = Json::array();
  for (auto const& view : manifest.views) cameras.push_back(view.image.camera.to_json());
  StageRecord record{"register", to_json(request.options), image_hashes(folder, manifest), {}, {}};
  record.options["start"] = static_cast<int>(request.start);
  record.options["exposure"] = request.exposure;
  record.options["seed"] = context.seed;
  record.inputs["scanset.json#cameras"] = hash_bytes(cameras.dump());
  record.inputs["scanset.json#initial_poses"] = hash_bytes(initial.dump());
  if (request.start == RegisterRequest::Start::file)
    record.inputs["init"] = hash_file(find_pose_file(request.pose_file));
  // The manifest may have been put back to the initial poses: the record's inputs fit, but not what it vouches for.
  if (fs::exists(folder / "poses.json") &&
      read_json(folder / "poses.json").value("registered", Json()) != poses_json(manifest)) {
    if (mode == StageMode::check) return {};
    mode = StageMode::force;
  }

  return run_stage(folder, std::move(record), mode, context, [&](StageRecord& out) {
    ScanSet set = read_scan_set(folder, context);
    set_poses(set, initial, folder / "poses.json");
    RegisterOptions const options = resolve(request, set);
    set.center = median_center(set);
    Alignment const alignment = align(set, options, context);

    std::vector<Eigen::Isometry3d> before, after = alignment.object_from_camera;
    for (std::size_t i = 0; i < set.views.size(); ++i)
      before.push_back(set.views[i].object_from_camera.value_or(Eigen::Isometry3d::Identity()));
    bool const had_poses = set.has_poses();
    for (std::size_t i = 0; i < set.views.size(); ++i) set.views[i].object_from_camera = after[i];
    set.center = median_center(set);
    set.error_budget.registration = alignment.error;
    set.error_budget.approximation = {};  // the meshes' turn comes after this

    Exposure exposure;
    exposure.gains.assign(set.views.size(), Eigen::Vector3d::Ones());
    if (request.exposure != 0) {
      ExposureOptions how;
      if (request.exposure == 1) how.light = ExposureOptions::Light::never;
      exposure = estimate_exposure(set, how, context);
    }
    for (std::size_t i = 0; i < set.views.size(); ++i) set.views[i].gain = exposure.gains[i];
    set.light = exposure.light;
    write_json(folder / "poses.json", {{"initial", initial}, {"registered", poses_json(set)}});
    write_manifest(folder, set);
    AlignmentReview const reviewed = review_alignment(set, before, alignment, context);
    out.figures = figures_of(set, alignment, reviewed);
    if (request.exposure != 0) {
      out.figures["exposure"] = {{"rms_before", json_number(exposure.rms_before)},
                                 {"rms_gains", json_number(exposure.rms_gains)},
                                 {"rms_light", json_number(exposure.rms_light)},
                                 {"light_stands_with_camera", exposure.light.has_value()}};
    }
    if (had_poses) out.figures["moved"] = to_json(compare_poses(set, after, before));
    if (alignment.status == AlignmentStatus::disconnected)
      out.figures["stage_exit"] = static_cast<int>(ErrorCode::partial);
    out.outputs["poses.json"] = hash_file(folder / "poses.json");
    return register_section(set, before, alignment, reviewed);
  });
}

}  // namespace scanview
