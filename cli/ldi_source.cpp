#include "cli/ldi_source.h"

#include <fmt/format.h>

#include <charconv>
#include <filesystem>
#include <optional>

#include "acquire/scan_set_file.h"
#include "base/error.h"
#include "synth/church.h"
#include "synth/church_views.h"
#include "synth/model_camera.h"
#include "viewer/evaluate/held_out.h"

namespace scanview {
namespace fs = std::filesystem;
namespace {

std::string const kChurch = "church";
constexpr std::size_t kChurchPolygons = 500'000;

bool is_church(std::string const& scene) { return scene == kChurch || scene.starts_with(kChurch + ":"); }

/// Of "church" or "church:N".
std::size_t church_polygons(std::string const& scene) {
  if (scene == kChurch) return kChurchPolygons;
  std::size_t polygons = 0;
  char const *const first = scene.data() + kChurch.size() + 1, *const last = scene.data() + scene.size();
  auto const parsed = std::from_chars(first, last, polygons);
  if (parsed.ec != std::errc() || parsed.ptr != last)
    throw Error(ErrorCode::usage, {}, "\"" + scene + "\": expected church:POLYGONS");
  return polygons;
}

/// So many of `all`, evenly spread, the first one among them.
template <class Value>
std::vector<Value> evenly(std::vector<Value> const& all, int count) {
  std::vector<Value> some;
  for (std::size_t i = 0; i < std::size_t(count); ++i) some.push_back(all[i * all.size() / std::size_t(count)]);
  return some;
}

class ChurchImages final : public LdiSource {
 public:
  ChurchImages(std::size_t polygons, NodeSourceOptions const& options, Context& context) {
    ModelCameraOptions how;
    how.light = options.light == "painted" ? ModelCameraOptions::Light::painted : ModelCameraOptions::Light::baked;
    camera_.emplace(make_church(polygons), how, context);
  }
  Unit unit() const override { return Unit::m; }
  int count() const override { return kChurchReferences; }
  int usual_count() const override { return 12; }  // the paper's
  std::vector<View> views(int count, Context& context) override {
    auto const references = church_references(count);
    while (views_.size() < references.size()) {
      context.check_cancelled();
      ChurchReference const& from = references[views_.size()];
      View view;
      view.name = fmt::format("{:03}", views_.size());
      view.image = camera_->capture(from.camera, from.scene_from_camera, context);
      view.object_from_camera = from.scene_from_camera;
      views_.push_back(std::move(view));
      context.progress("trace", views_.size(), references.size());
    }
    return {views_.begin(), views_.begin() + count};
  }
  std::vector<PathCamera> path(int frames, int width, int height) override {
    Camera const camera = church_references(1)[0].camera;
    std::vector<PathCamera> path;
    for (Eigen::Isometry3d const& pose : church_path(frames))
      path.push_back({width > 0 ? fit_camera(camera, width, height) : camera, pose, fmt::format("{:03}", path.size())});
    return path;
  }
  std::vector<ReferenceFrame> references(std::vector<PathCamera> const& path, Context& context) override {
    std::vector<ReferenceFrame> frames;
    for (PathCamera const& from : path) {
      context.check_cancelled();
      RangeImage const image = camera_->capture(from.camera, from.object_from_camera, context);
      frames.push_back({from, image.color, image.classes == static_cast<uchar>(PixelClass::object)});
      context.progress("trace", frames.size(), path.size());
    }
    return frames;
  }

 private:
  std::optional<ModelCamera> camera_;
  std::vector<View> views_;
};

class SetImages final : public LdiSource {
 public:
  SetImages(fs::path const& folder, NodeSourceOptions const& options, Context& context)
      : set_(read_scan_set(folder, context)) {
    if (!set_.has_poses()) throw Error(ErrorCode::bad_input, folder, "views without poses: register the set first");
    std::size_t const every = held_out_step(options.hold_out);
    std::vector<View> all;
    std::swap(all, set_.views);
    for (std::size_t v = 0; v < all.size(); ++v)
      (every > 0 && v % every == every - 1 ? held_out_ : set_.views).push_back(std::move(all[v]));
  }
  Unit unit() const override { return set_.unit; }
  double depth_error() const override { return set_.error_budget.threshold(); }
  int count() const override { return int(set_.views.size()); }
  std::vector<View> views(int count, Context&) override { return evenly(set_.views, count); }
  std::vector<PathCamera> path(int frames, int width, int height) override {
    Camera const& camera = set_.views.front().image.camera;
    return path_through_views(set_, orbit_frame(set_), frames, width > 0 ? width : camera.width(),
                              width > 0 ? height : camera.height());
  }
  std::vector<ReferenceFrame> references(std::vector<PathCamera> const&, Context&) override {
    std::vector<ReferenceFrame> frames;
    for (View const& view : held_out_)
      frames.push_back({{view.image.camera, *view.object_from_camera, view.name},
                        exposed_photograph(view),
                        view.image.classes == static_cast<uchar>(PixelClass::object)});
    return frames;
  }

 private:
  ScanSet set_;  // without held_out_
  std::vector<View> held_out_;
};

/// The sides of all nodes.
class NodeImages final : public LdiSource {
 public:
  explicit NodeImages(std::unique_ptr<NodeSource> nodes) : nodes_(std::move(nodes)) {}
  Unit unit() const override { return nodes_->unit(); }
  int count() const override { return int(nodes_->count()) * kCubeSides; }
  std::vector<View> views(int count, Context& context) override {
    for (std::size_t n = views_.size() / kCubeSides; views_.size() < std::size_t(count); ++n) {
      context.check_cancelled();
      CapturedNode node = nodes_->capture(n, context);
      for (View& side : node.sides) {
        side.name = node.name + "_" + side.name;
        views_.push_back(std::move(side));
      }
      context.progress("capture", n + 1, nodes_->count());
    }
    return {views_.begin(), views_.begin() + count};
  }
  std::vector<PathCamera> path(int, int, int) override {
    throw Error(ErrorCode::usage, {}, "a report is of the church or of a scan set");
  }
  std::vector<ReferenceFrame> references(std::vector<PathCamera> const&, Context&) override { return {}; }

 private:
  std::unique_ptr<NodeSource> nodes_;
  std::vector<View> views_;
};

}  // namespace

std::unique_ptr<LdiSource> open_ldi_source(std::string const& scene, NodeSourceOptions const& options,
                                           Context& context) {
  bool const is_set = fs::exists(fs::path(scene) / "scanset.json");
  if (!options.hold_out.empty() && (!is_set || is_church(scene)))
    throw Error(ErrorCode::usage, {}, "--hold-out: there are views to hold out in scan sets only");
  if (is_church(scene)) return std::make_unique<ChurchImages>(church_polygons(scene), options, context);
  if (is_set) return std::make_unique<SetImages>(scene, options, context);
  return std::make_unique<NodeImages>(open_node_source(scene, options, Places::chosen, context));
}

}  // namespace scanview
