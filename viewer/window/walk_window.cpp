#include "viewer/window/walk_window.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <utility>

#include "base/error.h"
#include "viewer/walkthrough/walkthrough_file.h"
#include "viewer/walkthrough/walkthrough_renderer.h"
#include "viewer/window/keyframes.h"
#include "viewer/window/walk_panel.h"
#include "viewer/window/window_loop.h"

namespace scanview {
namespace {

using Patience = WalkthroughRenderer::Patience;

// Lengths in walking radii.
constexpr double kPerSecond = 1.2, kHurry = 3, kWheelStep = 0.25;
constexpr double kDragDepth = 2;  // what is that far away follows the pointer

std::shared_ptr<NodeLibrary> open_library(std::filesystem::path const& folder, WalkWindowOptions const& options) {
  NodeCacheOptions cache = options.cache;
  cache.quality = options.rendering.quality;
  return open_node_library(folder, cache);
}

class WalkWindow final : public WindowLoop {
 public:
  WalkWindow(std::filesystem::path folder, WalkWindowOptions const& options, Context& context)
      : WindowLoop(options, context),
        folder_(std::move(folder)),
        manifest_(read_walkthrough(folder_)),
        rendering_(options.rendering),
        renderer_(open_library(folder_, options), options.rendering, context.threads),
        control_(manifest_.up, manifest_.walk) {
    content_.set_name = options.title;
    content_.unit = manifest_.unit;
    for (auto const& node : manifest_.nodes) content_.names.push_back(node.name);
    content_.has_box = manifest_.walk.has_value();
    content_.look = walk_look_of(rendering_);
    reset();
  }

  WalkWindowResult show() {
    WalkWindowResult result;
    if (options_.frames > 0) {
      result.times = measure();
    } else {
      renderer_.set_patience(Patience::answers);
      run();
    }
    warn_of_failures();
    result.failures = renderer_.library().failures();
    if (drawn_ > 0) {
      result.uncovered = sum_uncovered_ / drawn_;
      result.triangles = sum_triangles_ / drawn_;
    }
    return result;
  }

 private:
  std::string help() const override { return walk_window_help(); }
  PanelStatus& status() override { return content_; }
  PanelStatus const& status() const override { return content_; }
  Viewport picture_part(int width, int height) const override { return frame_.viewport(width, height); }

  /// While frames are measured the eye walks, too: along a circle that ends where it began.
  void turn(double degrees) override {
    constexpr double kRadius = 0.5, kRadians = std::numbers::pi / 180;
    double const way = options_.frames > 0 ? kRadius * manifest_.walking_radius * kRadians * degrees : 0;
    control_.walk({way, 0, 0, degrees});
  }

  void reset() {
    content_.turning = false;
    control_.stand_at(manifest_.nodes.front().position);
    control_.face(0, 0);
    if (manifest_.nodes.size() > 1) control_.face(manifest_.nodes[1].position);
  }

  Camera camera(int width, int height) const { return fit_camera(control_.camera(), width, height); }

  cv::Mat4b draw_picture(int width, int height) override {
    cv::Mat4b picture = renderer_.render(camera(width, height), control_.scene_from_camera()).color;
    content_.used = renderer_.used();
    content_.stages = renderer_.stages();
    content_.uncovered = static_cast<double>(renderer_.uncovered()) / static_cast<double>(picture.total());
    for (UsedNode const& node : content_.used) sum_triangles_ += static_cast<double>(node.triangles);
    sum_uncovered_ += content_.uncovered;
    drawn_ += 1;
    paint_gaps(picture, content_.look.gaps);
    return picture;
  }

  cv::Mat4b picture_to_save(int width, int height) override {
    struct UntilAllIsThere {
      explicit UntilAllIsThere(WalkthroughRenderer& of) : renderer(of) { renderer.set_patience(Patience::waits); }
      ~UntilAllIsThere() { renderer.set_patience(Patience::answers); }
      WalkthroughRenderer& renderer;
    } const patient(renderer_);
    cv::Mat4b picture = renderer_.render(camera(width, height), control_.scene_from_camera()).color;
    paint_gaps(picture, content_.look.gaps);
    return picture;
  }

  void look_around() override {
    NodeTraffic const traffic = renderer_.library().traffic();
    if (traffic.settled != content_.traffic.settled) {
      warn_of_failures();
      change();
    }
    bool const reading = traffic.waiting > 0;
    if (reading != content_.reading) refresh();
    content_.reading = reading;
    content_.traffic = traffic;
  }

  double patience() const override {
    constexpr double kUntilNodesCome = 0.02;
    return content_.reading ? kUntilNodesCome : WindowLoop::patience();
  }

  void warn_of_failures() {
    auto const failures = renderer_.library().failures();
    for (auto const& failure : failures)
      if (std::find(content_.failures.begin(), content_.failures.end(), failure) == content_.failures.end())
        context_.warn(failure);
    content_.failures = failures;
  }

  void draw_panel() override {
    Camera const shown = camera(viewport_.width, viewport_.height);
    double const width_deg = 360 / std::numbers::pi * std::atan(0.5 * shown.width() / shown.fx());
    content_.map = node_map(renderer_.library(), content_.used, manifest_.walk, control_, width_deg);
    content_.is_free = control_.is_free;
    content_.keyframes = keyframes_.size();
    if (keyframes_.size() > 0)
      content_.keyframe_command = fmt::format("scanview walkthrough render {} --path {} -o FOLDER", folder_.string(),
                                              keyframes_.file().string());
    WalkLook const before = content_.look;
    int const between = content_.frames_between;
    WalkPanelAnswer const answer = draw_walk_panel(frame_, content_, {}, viewport_);
    if (content_.look != before) use_look();
    if (content_.frames_between != between) {
      keyframes_.between = content_.frames_between;
      save(keyframes_);
    }
    if (answer.jump) jump(*answer.jump);
    for (Command const command : answer.commands) obey(command);
  }

  void use_look() {
    renderer_.set_options(with_walk_look(rendering_, content_.look));
    change();
  }

  bool holds(int key) const override { return walk_step_of_key(key).has_value(); }

  void hold(std::map<int, double> const& seconds) override {
    WalkStep lengths;
    for (auto const& [key, held] : seconds)
      if (auto const step = walk_step_of_key(key)) lengths += *step * held;
    double const turn_deg = lengths.turn_deg;
    lengths = lengths * (kPerSecond * (window_.holds_shift() ? kHurry : 1));
    lengths.turn_deg = turn_deg;
    walk(lengths);
  }

  /// Lengths in walking radii.
  void walk(WalkStep step) {
    double const turn_deg = step.turn_deg;
    step = step * manifest_.walking_radius;
    step.turn_deg = turn_deg;
    moved();
    if (control_.walk(step) == WalkControl::Walked::freely || told_of_box_) return;
    told_of_box_ = true;
    say("this is where the box ends that was made to be walked in; L leaves it");
  }

  void point(Gesture const& gesture) override {
    if (gesture.kind == Gesture::Kind::scroll) {
      walk({kWheelStep * gesture.steps, 0, 0, 0});
      return;
    }
    if (gesture.kind != Gesture::Kind::drag) return;
    Camera const shown = camera(viewport_.width, viewport_.height);
    if (gesture.pan) {
      double const radii = kDragDepth / shown.fx();
      walk({0, -radii * gesture.dx, radii * gesture.dy, 0});
      return;
    }
    Eigen::Vector2d const to(gesture.x - viewport_.x, gesture.y - viewport_.y);
    control_.drag(shown, to - Eigen::Vector2d(gesture.dx, gesture.dy), to);
    moved();
  }

  void press(int key) override {
    if (auto const node = view_of_key(key)) {
      jump(*node);
    } else if (auto const command = walk_command_of_key(key)) {
      obey(*command);
    }
  }

  void jump(std::size_t node) {
    if (node >= manifest_.nodes.size()) return;
    control_.stand_at(manifest_.nodes[node].position);
    say("at node " + manifest_.nodes[node].name);
    change();
  }

  std::size_t nearest_node() const {
    auto const distance = [&](WalkthroughManifest::Node const& node) {
      return (node.position - control_.eye()).squaredNorm();
    };
    auto const& nodes = manifest_.nodes;
    auto const nearest = std::min_element(nodes.begin(), nodes.end(),
                                          [&](auto const& a, auto const& b) { return distance(a) < distance(b); });
    return static_cast<std::size_t>(nearest - nodes.begin());
  }

  void obey(Command command) {
    if (obey_common(command)) return;
    if (auto const words = change_walk_look(content_.look, command)) {
      say(*words);
      use_look();
      return;
    }
    std::size_t const count = manifest_.nodes.size();
    switch (command) {
      case Command::reset:
        reset();
        change();
        return;
      case Command::next_node:
        jump((nearest_node() + 1) % count);
        return;
      case Command::previous_node:
        jump((nearest_node() + count - 1) % count);
        return;
      case Command::toggle_free:
        control_.is_free = !control_.is_free;
        say(control_.is_free ? "the eye may go anywhere" : "the eye stays in the box that was made to be walked in");
        return;
      case Command::add_keyframe:
        if (viewport_.width < 1) return;  // before the first picture
        keyframes_.add({camera(viewport_.width, viewport_.height), control_.scene_from_camera(), ""});
        save(keyframes_);
        return;
      case Command::remove_keyframe:
        keyframes_.remove_last();
        save(keyframes_);
        return;
      default:
        return;
    }
  }

  std::filesystem::path folder_;
  WalkthroughManifest manifest_;
  WalkthroughOptions rendering_;
  WalkthroughRenderer renderer_;
  WalkControl control_;
  WalkPanelContent content_;
  Keyframes keyframes_;
  bool told_of_box_ = false;
  double drawn_ = 0, sum_uncovered_ = 0, sum_triangles_ = 0;  ///< of all frames
};

}  // namespace

void WalkWindowOptions::validate() const {
  BasicWindowOptions::validate();
  rendering.validate();
  cache.validate();
}

WalkWindowResult view_walkthrough(std::filesystem::path const& folder, WalkWindowOptions const& options,
                                  Context& context) {
  options.validate();
  return WalkWindow(folder, options, context).show();
}

}  // namespace scanview
