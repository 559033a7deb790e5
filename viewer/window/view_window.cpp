#include "viewer/window/view_window.h"

#include <fmt/format.h>

#include <algorithm>
#include <set>

#include "base/error.h"
#include "viewer/window/keyframes.h"
#include "viewer/window/marking_desk.h"
#include "viewer/window/measuring.h"
#include "viewer/window/panel.h"
#include "viewer/window/view_strip.h"
#include "viewer/window/viewed_set.h"
#include "viewer/window/window_loop.h"

namespace scanview {
namespace {

class ViewWindow final : public WindowLoop {
 public:
  ViewWindow(std::shared_ptr<ViewLibrary> const& library, std::filesystem::path const& folder,
             WindowOptions const& options, Context& context)
      : WindowLoop(options, context),
        strip_(gl_),
        panel_(frame_),
        viewed_(window_, library, folder, options.rendering, options.back_end, context.threads),
        control_(library->set(), library->radius()),
        desk_(library, folder) {
    content_.back_ends = viewed_.back_ends();
    content_.back_end = viewed_.renderer().back_end();
    content_.look = viewed_.look();
    content_.set_name = options.title;
    learn_names();
    if (options.mode != WindowMode::look) enter(options.mode);
  }
  ~ViewWindow() override { window_.make_current(); }

  WindowResult show() {
    std::optional<FrameTimes> times;
    if (options_.frames > 0) {
      viewed_.renderer().set_patient(true);
      times = measure();
    } else {
      run();
    }
    warn_of_failures();
    return {viewed_.library()->failures(), times};
  }

 private:
  void learn_names() {
    content_.unit = to_string(viewed_.set().unit);
    content_.view_names.clear();
    for (auto const& view : viewed_.set().views) content_.view_names.push_back(view.name);
    content_.greatest_threshold = viewed_.greatest_threshold();
  }

  std::string help() const override { return window_help(); }
  PanelStatus& status() override { return content_; }
  PanelStatus const& status() const override { return content_; }
  bool is_flat() const override { return shows_picture(content_.mode); }
  Viewport picture_part(int width, int height) const override { return panel_.viewport(width, height, content_.mode); }
  void turn(double degrees) override { control_.turn(degrees); }

  double patience() const override {
    if (!viewed_.renderer().complete()) return 0.02;
    return strip_stale_ && frame_.visible ? kRest : WindowLoop::patience();
  }

  void point(Gesture const& gesture) override {
    if (shows_picture(content_.mode)) {
      on_picture(gesture);
    } else {
      on_object(gesture);
    }
  }

  void on_object(Gesture const& gesture) {
    if (steer(control_, gesture)) return;
    double const x = gesture.x - viewport_.x, y = gesture.y - viewport_.y;
    auto const point = viewed_.shown().pick(x, y, viewport_.width, viewport_.height);
    if (content_.mode == WindowMode::measure) {
      distance_.click(point);
      auto const distance = distance_.distance();
      if (!point) {
        say("the object is not there");
      } else if (distance) {
        say("distance " + length_text(*distance, viewed_.set().unit));
      }
    } else if (gesture.kind == Gesture::Kind::double_click) {
      if (point) control_.set_pivot(*point);
      say(point ? "turning about that point" : "the object is not there");
    }
  }

  void on_picture(Gesture const& gesture) {
    double const x = gesture.x - viewport_.x, y = gesture.y - viewport_.y;
    if (gesture.kind == Gesture::Kind::drag) {
      desk_.sheet().pan(gesture.dx, gesture.dy);
      change();
    } else if (gesture.kind == Gesture::Kind::scroll) {
      desk_.sheet().zoom(x, y, gesture.steps);
      change();
    } else {
      say(desk_.click(x, y));
    }
  }

  void press(int key) override {
    if (auto const view = view_of_key(key)) {
      jump(*view);
    } else if (auto const command = command_of_key(key, content_.mode)) {
      obey(*command);
    }
  }

  void jump(std::size_t view) {
    content_.turning = false;
    if (shows_picture(content_.mode)) {
      if (desk_.show(view)) change();
    } else {
      if (control_.jump(view)) change();
    }
  }

  void enter(WindowMode mode) {
    if (shows_picture(mode)) {
      try {
        desk_.enter(mode);
      } catch (Error const& error) {
        say(error.what());
        return;
      }
    }
    content_.mode = mode;
    if (mode != WindowMode::measure) distance_.clear();
    content_.message.clear();
    change();
  }

  void obey(Command command) {
    if (obey_common(command)) return;
    switch (command) {
      case Command::add_keyframe:
        keyframes_.add(control_.current());
        save(keyframes_);
        return;
      case Command::remove_keyframe:
        keyframes_.remove_last();
        save(keyframes_);
        return;
      case Command::look:
        enter(WindowMode::look);
        return;
      case Command::measure:
        enter(WindowMode::measure);
        return;
      case Command::mark:
        enter(WindowMode::mark);
        return;
      case Command::outline:
        enter(WindowMode::outline);
        return;
      default:
        break;
    }
    change();
    if (shows_picture(content_.mode)) {
      say(desk_.obey(command));
    } else if (command == Command::reset) {
      content_.turning = false;
      control_.reset();
    } else if (command == Command::remove_last) {
      distance_.remove_last();
    }
  }

  cv::Mat4b picture_to_save(int width, int height) override {
    if (shows_picture(content_.mode)) return desk_.draw(viewport_.width, viewport_.height);
    struct Patience {
      explicit Patience(ViewBasedRenderer& of) : renderer(of) { renderer.set_patient(true); }
      ~Patience() { renderer.set_patient(false); }
      ViewBasedRenderer& renderer;
    } const until_all_is_drawn(viewed_.renderer());
    Frame const frame = viewed_.renderer().render(fit_camera(control_.current().camera, width, height),
                                                  control_.current().object_from_camera);
    return frame.color;
  }

  void warn_of_failures() {
    for (auto const& failure : viewed_.library()->failures()) {
      if (!warned_.insert(failure).second) continue;
      context_.warn(failure);
      refresh();
    }
  }

  void look_around() override {
    look_at_files();
    if (viewed_.picture_has_come()) change();
  }

  void look_at_files() {
    if (seconds_since_start() - looked_at_files_ < 1) return;
    looked_at_files_ = seconds_since_start();
    warn_of_failures();
    switch (viewed_.follow_files(context_)) {
      case ViewedSet::Reload::unchanged:
        return;
      case ViewedSet::Reload::failed:
        say("the set's files have changed, but cannot be read: " + viewed_.problem());
        return;
      case ViewedSet::Reload::done:
        break;
    }
    OrbitControl const eye = control_;
    control_ = OrbitControl(viewed_.set(), viewed_.library()->radius());
    control_.take_eye_of(eye);
    desk_.use(viewed_.library());
    if (content_.look.soft_z) content_.look = viewed_.look();
    learn_names();
    change();
    say("the set's files have changed: read again");
  }

  cv::Mat4b draw_picture(int width, int height) override {
    if (shows_picture(content_.mode)) {
      content_.stages.clear();
      content_.reading = false;
      return desk_.draw(width, height);
    }
    viewed_.render(control_.current(), width, height);
    content_.stages = viewed_.renderer().stages();
    content_.reading = !viewed_.renderer().complete();
    strip_stale_ = true;
    return viewed_.shown().frame.color;
  }

  /// The strip follows ten times a second where frames are quick, else when the eye rests.
  bool strip_is_due() const {
    constexpr double kQuick = 30, kEvery = 0.1;
    bool const follows = content_.frame_milliseconds < kQuick && seconds_since_start() - strip_drawn_ > kEvery;
    return strip_stale_ && frame_.visible && (follows || !is_moving()) && viewed_.renderer().complete();
  }

  bool draw_beside() override {
    if (!strip_is_due()) return false;
    strip_stale_ = false;
    strip_drawn_ = seconds_since_start();
    if (shows_picture(content_.mode)) {
      content_.strip.clear();
    } else {
      content_.strip = strip_.render(viewed_.renderer(), viewed_.used(), control_.current(), viewport_);
    }
    return true;
  }

  Overlay overlay() const {
    if (shows_picture(content_.mode)) return desk_.overlay();
    Overlay overlay = distance_.overlay(viewed_.shown(), viewport_.width, viewport_.height, viewed_.set().unit);
    mark(overlay, viewed_.shown().place(control_.pivot(), viewport_.width, viewport_.height));
    return overlay;
  }

  void draw_panel() override {
    content_.failures = viewed_.library()->failures();
    content_.sphere = viewed_.inset();
    content_.mode_text.clear();
    if (shows_picture(content_.mode)) {
      content_.mode_text = desk_.text();
    } else if (content_.mode == WindowMode::measure) {
      auto const distance = distance_.distance();
      content_.mode_text.push_back(distance                     ? length_text(*distance, viewed_.set().unit)
                                   : distance_.points().empty() ? "click the first point"
                                                                : "click the second point");
    }
    content_.keyframes = keyframes_.size();
    content_.keyframe_command = keyframes_.file().empty()
                                    ? ""
                                    : fmt::format("scanview render {} --path {} -o FOLDER", viewed_.folder().string(),
                                                  keyframes_.file().string());
    PanelContent const before = content_;
    PanelAnswer const answer = panel_.draw(content_, overlay(), viewport_);
    desk_.kind = content_.outline;
    if (answer.default_look) content_.look = viewed_.default_look();
    if (content_.look != before.look) {
      viewed_.set_look(content_.look);
      change();
    }
    if (content_.back_end != before.back_end) {
      viewed_.draw_with(content_.back_end);
      change();
    }
    if (content_.frames_between != before.frames_between) {
      keyframes_.between = content_.frames_between;
      save(keyframes_);
    }
    if (answer.jump) jump(*answer.jump);
    for (Command const command : answer.commands) obey(command);
  }

  ViewStrip strip_;
  Panel panel_;
  ViewedSet viewed_;
  OrbitControl control_;
  MarkingDesk desk_;

  PanelContent content_;
  DistanceTool distance_;
  Keyframes keyframes_;
  double looked_at_files_ = 0, strip_drawn_ = 0;  ///< seconds since the start
  std::set<std::string> warned_;
  bool strip_stale_ = false;
};

}  // namespace

void WindowOptions::validate() const {
  BasicWindowOptions::validate();
  rendering.validate();
}

WindowResult view_window(std::shared_ptr<ViewLibrary> library, std::filesystem::path const& folder,
                         WindowOptions const& options, Context& context) {
  options.validate();
  return ViewWindow(library, folder, options, context).show();
}

}  // namespace scanview
