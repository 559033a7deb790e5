#include "cli/node_source.h"

#include <fmt/format.h>

#include <cstdio>

#include "acquire/json_vector.h"
#include "acquire/panorama.h"
#include "acquire/scan_set_file.h"
#include "base/error.h"
#include "base/json_fields.h"
#include "mesh/polygon_model.h"
#include "synth/model_camera.h"
#include "synth/scanner.h"
#include "viewer/evaluate/held_out.h"
#include "viewer/select/camera_path.h"

namespace scanview {
namespace fs = std::filesystem;
namespace {

PolygonModel read_scene_model(std::string const& scene, NodeSourceOptions const& options, Context& context) {
  if (is_builtin_model(scene)) {
    PolygonModel model;
    model.mesh = builtin_model(scene);
    return model;
  }
  Winding const winding = options.winding == "keep"   ? Winding::keep
                          : options.winding == "flip" ? Winding::flip
                                                      : Winding::automatic;
  PolygonModel model = read_polygon_model(scene, winding);
  for (auto const& note : model.notes) context.log(note);
  return model;
}

class ModelScene final : public NodeSource {
 public:
  ModelScene(PolygonModel model, NodeSourceOptions const& options, Places places, Context& context)
      : options_(options) {
    if (places == Places::chosen) choose(model.mesh, context);
    ModelCameraOptions camera;
    camera.light = options.light == "painted" ? ModelCameraOptions::Light::painted : ModelCameraOptions::Light::baked;
    camera_.emplace(std::move(model), camera, context);
  }

  Unit unit() const override { return Unit::m; }
  Eigen::Vector3d up() const override { return Eigen::Vector3d::UnitY(); }
  std::vector<Eigen::Vector3d> positions() const override { return positions_; }
  CapturedNode capture(std::size_t node, Context& context) override {
    return capture_node(*camera_, positions_[node], options_.size, fmt::format("{:03}", node), context);
  }
  void adjust(NodeMeshOptions& options) const override { options.background = NodeMeshOptions::Background::far; }
  std::optional<Eigen::AlignedBox3d> walk() const override { return walk_; }
  Json placement() const override { return placement_; }
  std::vector<ReferenceFrame> references(std::vector<PathCamera> const& path, Context& context) override {
    std::vector<ReferenceFrame> frames;
    for (PathCamera const& from : path) {
      frames.push_back({from, camera_->picture(from.camera, from.object_from_camera, context), {}});
      context.progress("trace", frames.size(), path.size());
    }
    return frames;
  }

 private:
  void choose(TriangleMesh const& model, Context& context) {
    if (options_.nodes != "auto") {
      positions_ = read_node_positions(options_.nodes);
      return;
    }
    PlacementOptions placement;
    placement.greatest_gap = options_.greatest_gap;
    placement.clearance = options_.clearance;
    WalkRegion region;
    if (options_.walk.size() == 6) {
      region.box = Eigen::AlignedBox3d(Eigen::Vector3d(options_.walk[0], options_.walk[1], options_.walk[2]),
                                       Eigen::Vector3d(options_.walk[3], options_.walk[4], options_.walk[5]));
    } else {
      region = default_walk_region(model, placement, options_.eye_height);
    }
    Placement const chosen = place_nodes(model, region, placement, context);
    positions_ = chosen.nodes;
    walk_ = region.box;
    placement_ = {{"eyes", chosen.eyes},
                  {"uncovered_mean", json_number(chosen.uncovered_mean)},
                  {"uncovered_worst", json_number(chosen.uncovered_worst)}};
  }

  NodeSourceOptions options_;
  std::optional<ModelCamera> camera_;
  std::vector<Eigen::Vector3d> positions_;
  std::optional<Eigen::AlignedBox3d> walk_;
  Json placement_;
};

/// Every frame a node of one side.
class SetScene final : public NodeSource {
 public:
  SetScene(fs::path const& folder, NodeSourceOptions const& options, Context& context)
      : set_(read_scan_set(folder, context)) {
    if (!set_.has_poses()) throw Error(ErrorCode::bad_input, folder, "views without poses: register the set first");
    std::size_t const every = held_out_step(options.hold_out);
    Eigen::Vector3d up = Eigen::Vector3d::Zero();
    for (std::size_t v = 0; v < set_.views.size(); ++v) {
      if (!set_.views[v].image.camera.is_perspective())
        throw Error(ErrorCode::bad_input, folder, "orthographic views cannot be nodes");
      up -= set_.views[v].object_from_camera->linear().col(1);
      (every > 0 && v % every == every - 1 ? held_out_ : nodes_).push_back(v);
    }
    up_ = up.norm() > 0 ? Eigen::Vector3d(up.normalized()) : Eigen::Vector3d(0, 1, 0);
  }

  Unit unit() const override { return set_.unit; }
  Eigen::Vector3d up() const override { return up_; }
  std::vector<Eigen::Vector3d> positions() const override {
    std::vector<Eigen::Vector3d> result;
    for (std::size_t const v : nodes_) result.push_back(set_.views[v].eye());
    return result;
  }
  CapturedNode capture(std::size_t node, Context&) override {
    View const& view = set_.views[nodes_[node]];
    return {view.name, view.eye(), {view}};
  }
  void adjust(NodeMeshOptions& options) const override {
    MeshOptions const frames;
    options.background = NodeMeshOptions::Background::gap;
    options.fill_pixels = frames.fill_pixels;
    options.min_patch_pixels = frames.min_patch_pixels;
  }
  std::vector<ReferenceFrame> references(std::vector<PathCamera> const&, Context&) override {
    std::vector<ReferenceFrame> frames;
    for (std::size_t const v : held_out_) {
      View const& view = set_.views[v];
      frames.push_back({{view.image.camera, *view.object_from_camera, view.name},
                        exposed_photograph(view),
                        view.image.classes == static_cast<uchar>(PixelClass::object)});
    }
    return frames;
  }

 private:
  ScanSet set_;
  Eigen::Vector3d up_;
  std::vector<std::size_t> nodes_, held_out_;
};

class PanoramaScene final : public NodeSource {
 public:
  PanoramaScene(fs::path const& path, NodeSourceOptions const& options) : reader_(path), size_(options.size) {}
  Unit unit() const override { return reader_.unit(); }
  Eigen::Vector3d up() const override { return Eigen::Vector3d::UnitY(); }
  std::vector<Eigen::Vector3d> positions() const override {
    std::vector<Eigen::Vector3d> result;
    for (std::size_t i = 0; i < reader_.count(); ++i)
      result.push_back(reader_.files(i).scene_from_panorama.translation());
    return result;
  }
  CapturedNode capture(std::size_t node, Context& context) override { return reader_.read(node, size_, context); }
  void adjust(NodeMeshOptions& options) const override { options.background = NodeMeshOptions::Background::far; }
  std::vector<ReferenceFrame> references(std::vector<PathCamera> const&, Context&) override { return {}; }

 private:
  PanoramaReader reader_;
  int size_;
};

}  // namespace

std::size_t held_out_step(std::string const& hold_out) {
  int every = 0;
  char end = 0;
  if (!hold_out.empty() && (std::sscanf(hold_out.c_str(), "every:%d%c", &every, &end) != 1 || every < 2))
    throw Error(ErrorCode::usage, {}, "--hold-out " + hold_out + ": expected every:N, N at least 2");
  return static_cast<std::size_t>(every);
}

std::vector<Eigen::Vector3d> read_node_positions(fs::path const& file) {
  Json const json = read_json(file);
  auto const bad = [&](std::string const& what) { throw Error(ErrorCode::bad_input, file, what); };
  if (json.is_object()) refuse_unknown_keys(json, {"format", "nodes"}, "", file);
  Json const& list = json.is_object() ? json_member(json, "nodes", file) : json;
  if (!list.is_array() || list.empty()) bad("nodes: must be a list of positions");
  std::vector<Eigen::Vector3d> positions;
  for (Json const& entry : list) {
    std::string const where = fmt::format("nodes[{}]", positions.size());
    if (entry.is_object()) refuse_unknown_keys(entry, {"name", "position"}, where, file);
    Json const& place = entry.is_object() ? json_member(entry, "position", file) : entry;
    positions.push_back(vector_from_json(place, where, file));
  }
  return positions;
}

std::unique_ptr<NodeSource> open_node_source(std::string const& scene, NodeSourceOptions const& options, Places places,
                                             Context& context) {
  fs::path const path = scene;
  if (is_builtin_model(scene))
    return std::make_unique<ModelScene>(read_scene_model(scene, options, context), options, places, context);
  if (fs::exists(path / "scanset.json")) return std::make_unique<SetScene>(path, options, context);
  if (fs::exists(path / "panoramas.json") || path.filename() == "panoramas.json")
    return std::make_unique<PanoramaScene>(path, options);
  if (fs::is_directory(path))
    throw Error(ErrorCode::bad_input, path, "is neither a scan set nor a folder with panoramas.json");
  return std::make_unique<ModelScene>(read_scene_model(scene, options, context), options, places, context);
}

}  // namespace scanview
