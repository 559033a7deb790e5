#include "viewer/window/tree_window.h"

#include <fmt/format.h>

#include <utility>

#include "base/error.h"
#include "viewer/window/keyframes.h"
#include "viewer/window/tree_eye.h"
#include "viewer/window/tree_panel.h"
#include "viewer/window/viewed_tree.h"
#include "viewer/window/window_loop.h"

namespace scanview {
namespace {

// Lengths in radii of the tree.
constexpr double kPerSecond = 0.12, kHurry = 3, kWheelStep = 0.03;
constexpr double kDragDepth = 0.3;  // what is that far away follows the pointer

class TreeWindow final : public WindowLoop {
 public:
  TreeWindow(std::shared_ptr<LdiTree const> tree, TreeWindowOptions const& options, Context& context)
      : WindowLoop(options, context),
        milliseconds_(options.milliseconds),
        viewed_(std::move(tree), options.rendering, context.threads),
        eye_(viewed_.tree()),
        up_(up_of_views(viewed_.tree().views)) {
    LdiTree const& shown = viewed_.tree();
    content_.set_name = options.title;
    content_.unit = shown.unit;
    content_.cells = shown.cells.size();
    content_.bytes = shown.bytes();
    for (View const& view : shown.views) content_.view_names.push_back(view.name);
    content_.look = tree_look_of(options.rendering);
  }

  TreeWindowResult show() {
    TreeWindowResult result;
    if (options_.frames > 0) {
      // The first view of a scene is often at its border, with nothing behind.
      if (walks()) jump(eye_.middle_view());
      result.times = measure();
    } else {
      run();
    }
    result.failures = viewed_.failures();
    if (drawn_ > 0) {
      result.cells = sum_cells_ / drawn_;
      result.splats = sum_splats_ / drawn_;
      result.uncovered = sum_uncovered_ / drawn_;
    }
    return result;
  }

 private:
  std::string help() const override { return tree_window_help(); }
  PanelStatus& status() override { return content_; }
  PanelStatus const& status() const override { return content_; }
  Viewport picture_part(int width, int height) const override { return frame_.viewport(width, height); }
  void turn(double degrees) override { eye_.turn(degrees); }
  bool walks() const { return eye_.mode() == TreeEye::Mode::walk; }

  PathCamera camera(int width, int height) const {
    PathCamera eye = eye_.current();
    eye.camera = fit_camera(eye.camera, width, height);
    return eye;
  }

  cv::Mat4b draw_picture(int width, int height) override {
    PathCamera const eye = camera(width, height);
    cv::Mat4b picture = options_.frames > 0
                            ? viewed_.render_at_once(eye.camera, eye.object_from_camera, content_.look)
                            : viewed_.render(eye.camera, eye.object_from_camera, content_.look, milliseconds_);
    TreeFigures const& figures = viewed_.figures();
    sum_cells_ += static_cast<double>(figures.cells);
    sum_splats_ += static_cast<double>(figures.splats);
    sum_uncovered_ += figures.uncovered;
    drawn_ += 1;
    learn_of_picture();
    return picture;
  }

  void learn_of_picture() {
    LdiTree const& tree = viewed_.tree();
    content_.figures = viewed_.figures();
    using Progress = TreePanelContent::Progress;
    content_.progress = !viewed_.is_complete() ? Progress::refining
                        : viewed_.has_failed() ? Progress::damaged
                                               : Progress::complete;
    content_.levels.clear();
    for (LevelCount const& count : content_.figures.levels)
      content_.levels.push_back({level_color(tree, count.level), level_text(count, tree.unit)});
    content_.map = cell_map(tree, viewed_.traversed(), up_, viewed_.shown().camera, viewed_.shown().object_from_camera);
    for (std::size_t i = content_.failures.size(); i < viewed_.failures().size(); ++i)
      context_.warn(viewed_.failures()[i]);
    content_.failures = viewed_.failures();
  }

  cv::Mat4b picture_to_save(int width, int height) override {
    PathCamera const eye = camera(width, height);
    cv::Mat4b picture = viewed_.render(eye.camera, eye.object_from_camera, content_.look, 0);
    change();  // what is picked in is of that size now
    return picture;
  }

  bool is_refining() const { return !is_moving() && !viewed_.is_complete(); }

  void look_around() override {
    if (is_refining()) change();
  }

  double patience() const override { return is_refining() ? 0 : WindowLoop::patience(); }

  void draw_panel() override {
    content_.mode = eye_.mode();
    content_.keyframes = keyframes_.size();
    if (keyframes_.size() > 0)
      content_.keyframe_command = fmt::format("scanview ldi render {} --path {} -o FOLDER",
                                              viewed_.tree().path.string(), keyframes_.file().string());
    Overlay overlay;
    if (!walks()) mark(overlay, viewed_.shown().place(eye_.orbit().pivot(), viewport_.width, viewport_.height));
    TreeLook const before = content_.look;
    int const between = content_.frames_between;
    TreePanelAnswer const answer = draw_tree_panel(frame_, content_, overlay, viewport_);
    if (content_.look != before) change();
    if (content_.frames_between != between) {
      keyframes_.between = content_.frames_between;
      save(keyframes_);
    }
    if (answer.jump) jump(*answer.jump);
    for (Command const command : answer.commands) obey(command);
  }

  bool holds(int key) const override { return walks() && walk_step_of_key(key).has_value(); }

  void hold(std::map<int, double> const& seconds) override {
    if (!walks()) return;
    WalkStep lengths;
    for (auto const& [key, held] : seconds)
      if (auto const step = walk_step_of_key(key)) lengths += *step * held;
    double const turn_deg = lengths.turn_deg;
    lengths = lengths * (kPerSecond * (window_.holds_shift() ? kHurry : 1));
    lengths.turn_deg = turn_deg;
    walk(lengths);
  }

  void walk(WalkStep const& step) {
    eye_.walk(step);
    moved();
  }

  void point(Gesture const& gesture) override {
    if (walks()) {
      point_walking(gesture);
    } else if (!steer(eye_.orbit(), gesture) && gesture.kind == Gesture::Kind::double_click) {
      auto const p = seen_at(gesture.x - viewport_.x, gesture.y - viewport_.y);
      if (p) eye_.orbit().set_pivot(*p);
      say(p ? "turning about that point" : "the object is not there");
    }
  }

  void point_walking(Gesture const& gesture) {
    if (gesture.kind == Gesture::Kind::scroll) {
      walk({kWheelStep * gesture.steps, 0, 0, 0});
      return;
    }
    if (gesture.kind != Gesture::Kind::drag) return;
    Camera const shown = camera(viewport_.width, viewport_.height).camera;
    if (gesture.pan) {
      double const radii = kDragDepth / shown.fx();
      walk({0, -radii * gesture.dx, radii * gesture.dy, 0});
      return;
    }
    Eigen::Vector2d const to(gesture.x - viewport_.x, gesture.y - viewport_.y);
    eye_.walker().drag(shown, to - Eigen::Vector2d(gesture.dx, gesture.dy), to);
    moved();
  }

  std::optional<Eigen::Vector3d> seen_at(double x, double y) const {
    return viewed_.shown().pick(x, y, viewport_.width, viewport_.height);
  }

  void press(int key) override {
    if (auto const view = view_of_key(key)) {
      jump(*view);
    } else if (auto const command = tree_command_of_key(key)) {
      obey(*command);
    }
  }

  void jump(std::optional<std::size_t> view) {
    if (!view || !eye_.jump(*view)) return;
    content_.turning = false;
    say("at view " + content_.view_names[*view]);
    change();
  }

  void obey(Command command) {
    if (obey_common(command)) return;
    if (auto const words = change_tree_look(content_.look, command)) {
      say(*words);
      change();
      return;
    }
    switch (command) {
      case Command::reset:
        content_.turning = false;
        eye_.reset();
        change();
        return;
      case Command::next_view:
        jump(eye_.view_after(1));
        return;
      case Command::previous_view:
        jump(eye_.view_after(-1));
        return;
      case Command::toggle_walking:
        eye_.change_mode(seen_at(0.5 * viewport_.width, 0.5 * viewport_.height).value_or(viewed_.tree().center));
        say(walks() ? "walking" : "going around what was in the middle");
        change();
        return;
      case Command::add_keyframe:
        if (viewport_.width < 1) return;  // before the first picture
        keyframes_.add(camera(viewport_.width, viewport_.height));
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

  double milliseconds_;
  ViewedTree viewed_;
  TreeEye eye_;
  Eigen::Vector3d up_;
  TreePanelContent content_;
  Keyframes keyframes_;
  double drawn_ = 0, sum_cells_ = 0, sum_splats_ = 0, sum_uncovered_ = 0;  ///< of all frames
};

}  // namespace

void TreeWindowOptions::validate() const {
  BasicWindowOptions::validate();
  rendering.validate();
  if (!(milliseconds >= 0 && milliseconds <= 60000))
    throw Error(ErrorCode::usage, {}, "milliseconds: must be 0 to 60000");
}

TreeWindowResult view_ldi_tree(std::shared_ptr<LdiTree const> tree, TreeWindowOptions const& options,
                               Context& context) {
  options.validate();
  return TreeWindow(std::move(tree), options, context).show();
}

}  // namespace scanview
