#include "viewer/window/view_window.h"

#define GLFW_INCLUDE_NONE
#include <GLFW/glfw3.h>
#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <set>

#include "base/error.h"
#include "base/files.h"
#include "base/image_file.h"
#include "base/median.h"
#include "viewer/window/frame_presenter.h"
#include "viewer/window/glfw_window.h"
#include "viewer/window/keyframes.h"
#include "viewer/window/marking_desk.h"
#include "viewer/window/measuring.h"
#include "viewer/window/orbit_control.h"
#include "viewer/window/panel.h"
#include "viewer/window/pointer_gestures.h"
#include "viewer/window/view_strip.h"
#include "viewer/window/viewed_set.h"

namespace scanview {
namespace {

using Clock = std::chrono::steady_clock;

double seconds_since(Clock::time_point start) { return std::chrono::duration<double>(Clock::now() - start).count(); }

class ViewWindow {
 public:
  ViewWindow(std::shared_ptr<ViewLibrary> const& library, std::filesystem::path const& folder,
             WindowOptions const& options, Context& context)
      : options_(options),
        context_(context),
        window_(options.width, options.height, options.title),
        gl_(load_gl_functions(window_)),
        presenter_(gl_),
        strip_(gl_),
        panel_(window_),
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
  // Everything that holds OpenGL's objects deletes them in the window's context.
  ~ViewWindow() { window_.make_current(); }

  WindowResult run() {
    context_.log(window_help());
    auto last = Clock::now();
    while (!window_.should_close()) {
      context_.check_cancelled();
      for (auto const& event : window_.poll(patience())) handle(event);
      if (content_.turning && !shows_picture(content_.mode)) {
        constexpr double kDegreesASecond = 30;
        control_.turn(kDegreesASecond * seconds_since(last));
        moved();
      }
      last = Clock::now();
      look_at_files();
      stale_ = viewed_.picture_has_come() || stale_;
      draw_what_is_stale();
    }
    return finish(std::nullopt);
  }

  WindowResult measure() {
    viewed_.renderer().set_patient(true);
    std::vector<double> frame, panel, all;
    constexpr int kWarmUp = 3;
    for (int i = -kWarmUp; i < options_.frames && !window_.should_close(); ++i) {
      context_.check_cancelled();
      window_.poll(0);
      auto const start = Clock::now();
      control_.turn(360.0 / options_.frames);
      moved();
      render_frame();
      window_.make_current();
      present();
      gl_.Finish();
      double const shown = seconds_since(start);
      if (strip_is_due()) render_strip();
      draw_panel();
      gl_.Finish();
      double const drawn = seconds_since(start);
      window_.swap();
      if (i < 0) continue;
      frame.push_back(1e3 * shown);
      panel.push_back(1e3 * (drawn - shown));
      all.push_back(seconds_since(start));
    }
    if (all.empty()) return finish(std::nullopt);
    return finish(FrameTimes{viewport_.width, viewport_.height, median(frame), median(panel), 1 / median(all)});
  }

 private:
  void learn_names() {
    content_.unit = to_string(viewed_.set().unit);
    content_.view_names.clear();
    for (auto const& view : viewed_.set().views) content_.view_names.push_back(view.name);
    content_.greatest_threshold = viewed_.greatest_threshold();
  }

  void say(std::string const& message) {
    content_.message = message;
    panel_frames_ = kSettle;
    if (!message.empty()) context_.log(message);
  }

  // How long nothing may happen before something is to be done.
  double patience() const {
    if (content_.turning || stale_ || panel_frames_ > 0) return 0;
    if (!viewed_.renderer().complete()) return 0.02;
    return moving_ || (strip_stale_ && panel_.visible) ? kRest : 0.5;
  }

  void moved() {
    moving_ = stale_ = true;
    moved_ = Clock::now();
  }

  void handle(WindowEvent const& event) {
    using Kind = WindowEvent::Kind;
    int width = 0, height = 0;
    window_.size_in_pixels(width, height);
    bool const inside = viewport_.contains(event.x, event.y);
    if (event.kind == Kind::exposed) {
      stale_ = stale_ || width != width_ || height != height_;
      panel_frames_ = std::max(panel_frames_, 1);
      return;
    }
    // The panel lights up what the pointer is over; elsewhere a move alone changes nothing.
    if (event.kind != Kind::move || !inside || was_beside_) panel_frames_ = kSettle;
    was_beside_ = !inside;
    if (event.kind == Kind::key || event.kind == Kind::press) content_.message.clear();
    if (event.kind == Kind::key) {
      if (!panel_.takes_keys()) press(event.key);
      return;
    }
    if (!inside && !pointer_.held()) return;
    for (auto const& gesture : pointer_.feed(event)) {
      if (shows_picture(content_.mode)) {
        on_picture(gesture);
      } else {
        on_object(gesture);
      }
    }
  }

  void on_object(Gesture const& gesture) {
    double const x = gesture.x - viewport_.x, y = gesture.y - viewport_.y;
    switch (gesture.kind) {
      case Gesture::Kind::drag: {
        // Shares of the height, so that dragging feels the same in every size.
        double const right = gesture.dx / viewport_.height, down = gesture.dy / viewport_.height;
        if (gesture.pan) {
          control_.pan(right, down);
        } else {
          control_.orbit(right, down);
        }
        moved();
        return;
      }
      case Gesture::Kind::scroll:
        control_.zoom(gesture.steps);
        moved();
        return;
      case Gesture::Kind::double_click:
      case Gesture::Kind::click:
        break;
    }
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
      stale_ = true;
    } else if (gesture.kind == Gesture::Kind::scroll) {
      desk_.sheet().zoom(x, y, gesture.steps);
      stale_ = true;
    } else {
      say(desk_.click(x, y));
    }
  }

  void press(int key) {
    if (auto const view = view_of_key(key)) {
      jump(*view);
    } else if (auto const command = command_of_key(key, content_.mode)) {
      obey(*command);
    }
  }

  void jump(std::size_t view) {
    content_.turning = false;
    if (shows_picture(content_.mode)) {
      stale_ = desk_.show(view) || stale_;
    } else {
      stale_ = control_.jump(view) || stale_;
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
    stale_ = true;
  }

  void obey(Command command) {
    switch (command) {
      case Command::quit:
        window_.close();
        return;
      case Command::help:
        say(window_help());
        return;
      case Command::toggle_panel:
        panel_.visible = !panel_.visible;
        stale_ = true;
        return;
      case Command::save_picture:
        save_picture();
        return;
      case Command::turntable:
        content_.turning = !content_.turning;
        return;
      case Command::add_keyframe:
        keyframes_.add(control_.current());
        save_keyframes();
        return;
      case Command::remove_keyframe:
        keyframes_.remove_last();
        save_keyframes();
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
    stale_ = true;
    if (shows_picture(content_.mode)) {
      say(desk_.obey(command));
    } else if (command == Command::reset) {
      content_.turning = false;
      control_.reset();
    } else if (command == Command::remove_last) {
      distance_.remove_last();
    }
  }

  void save_picture() {
    if (width_ < 1 || height_ < 1) return;
    // A full disk must not end the session.
    try {
      auto const path = first_free(options_.pictures, "scanview-", ".png");
      if (shows_picture(content_.mode)) {
        write_file(path, encode_png(desk_.draw(viewport_.width, viewport_.height)));
      } else {
        viewed_.renderer().set_patient(true);
        Frame const frame = viewed_.renderer().render(fit_camera(control_.current().camera, width_, height_),
                                                      control_.current().object_from_camera);
        write_file(path, encode_png(frame.color));
      }
      say("saved " + path.string());
    } catch (Error const& error) {
      say(error.what());
    }
    viewed_.renderer().set_patient(false);
  }

  void save_keyframes() {
    if (keyframes_.size() == 0) return;
    try {
      keyframes_.save(options_.pictures);
      say(fmt::format("{} keyframes in {}", keyframes_.size(), keyframes_.file().string()));
    } catch (Error const& error) {
      say(error.what());
    }
  }

  void warn_of_failures() {
    for (auto const& failure : viewed_.library()->failures()) {
      if (!warned_.insert(failure).second) continue;
      context_.warn(failure);
      panel_frames_ = kSettle;
    }
  }

  WindowResult finish(std::optional<FrameTimes> const& times) {
    warn_of_failures();
    return {viewed_.library()->failures(), times};
  }

  void look_at_files() {
    if (seconds_since(looked_at_files_) < 1) return;
    looked_at_files_ = Clock::now();
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
    stale_ = true;
    say("the set's files have changed: read again");
  }

  void draw_what_is_stale() {
    // Once more in full resolution a moment after the last move.
    if (!stale_ && moving_ && seconds_since(moved_) >= kRest) {
      moving_ = false;
      stale_ = coarse_;
    }
    if (stale_) render_frame();
    if (strip_is_due()) {
      render_strip();
      panel_frames_ = std::max(panel_frames_, 1);
    }
    if (panel_frames_ <= 0 || width_ < 1 || height_ < 1) return;
    --panel_frames_;
    window_.make_current();
    auto const start = Clock::now();
    present();
    draw_panel();
    window_.swap();
    check_gl(gl_, "drawing the window");
    content_.panel_milliseconds = 1e3 * seconds_since(start);
  }

  void render_frame() {
    window_.size_in_pixels(width_, height_);
    stale_ = false;
    if (width_ < 1 || height_ < 1) return;
    viewport_ = panel_.viewport(width_, height_, content_.mode);
    panel_frames_ = std::max(panel_frames_, 1);
    auto const start = Clock::now();
    if (shows_picture(content_.mode)) {
      cv::Mat4b const picture = desk_.draw(viewport_.width, viewport_.height);
      window_.make_current();
      presenter_.upload(picture);
      content_.frame_milliseconds = 1e3 * seconds_since(start);
      content_.stages.clear();
      content_.half_resolution = content_.reading = coarse_ = moving_ = false;
      return;
    }
    // A slow machine turns the object in half the resolution.
    constexpr double kSlow = 0.08;
    coarse_ =
        moving_ && options_.frames == 0 && seconds_in_full_ > kSlow && viewport_.width > 1 && viewport_.height > 1;
    int const part = coarse_ ? 2 : 1;
    viewed_.render(control_.current(), viewport_.width / part, viewport_.height / part);
    window_.make_current();
    presenter_.upload(viewed_.shown().frame.color);
    double const seconds = seconds_since(start);
    if (!coarse_) seconds_in_full_ = seconds;
    content_.frame_milliseconds = 1e3 * seconds;
    content_.half_resolution = coarse_;
    content_.stages = viewed_.renderer().stages();
    content_.reading = !viewed_.renderer().complete();
    strip_stale_ = true;
  }

  /// The strip follows ten times a second where frames are quick, else when the eye rests.
  bool strip_is_due() const {
    constexpr double kQuick = 30, kEvery = 0.1;
    bool const follows = content_.frame_milliseconds < kQuick && seconds_since(strip_drawn_) > kEvery;
    return strip_stale_ && panel_.visible && (follows || !moving_) && viewed_.renderer().complete();
  }

  void render_strip() {
    strip_stale_ = false;
    strip_drawn_ = Clock::now();
    if (shows_picture(content_.mode) || !panel_.visible) {
      content_.strip.clear();
      return;
    }
    content_.strip = strip_.render(viewed_.renderer(), viewed_.used(), control_.current(), viewport_);
    window_.make_current();
  }

  void present() { presenter_.present(viewport_, height_); }

  Overlay overlay() const {
    if (shows_picture(content_.mode)) return desk_.overlay();
    Overlay overlay = distance_.overlay(viewed_.shown(), viewport_.width, viewport_.height, viewed_.set().unit);
    auto const pivot = viewed_.shown().place(control_.pivot(), viewport_.width, viewport_.height);
    if (pivot && pointer_.held()) overlay.dots.push_back({*pivot, {1, 1, 1}, ""});
    return overlay;
  }

  void draw_panel() {
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
      stale_ = true;
    }
    if (content_.back_end != before.back_end) {
      viewed_.draw_with(content_.back_end);
      stale_ = true;
    }
    if (content_.frames_between != before.frames_between) {
      keyframes_.between = content_.frames_between;
      save_keyframes();
    }
    if (answer.jump) jump(*answer.jump);
    for (Command const command : answer.commands) obey(command);
  }

  static constexpr double kRest = 0.15;  ///< seconds after which what moved has come to rest
  static constexpr int kSettle = 3;      ///< frames that the panel takes until it shows all that a click has changed

  WindowOptions options_;
  Context& context_;
  GlfwWindow window_;
  GlFunctions gl_;
  FramePresenter presenter_;
  ViewStrip strip_;
  Panel panel_;
  ViewedSet viewed_;
  OrbitControl control_;
  MarkingDesk desk_;

  PanelContent content_;
  PointerGestures pointer_;
  DistanceTool distance_;
  Keyframes keyframes_;
  Clock::time_point looked_at_files_ = Clock::now(), strip_drawn_, moved_;
  std::set<std::string> warned_;

  int width_ = 0, height_ = 0;
  Viewport viewport_;
  bool stale_ = true, strip_stale_ = false, moving_ = false, coarse_ = false, was_beside_ = true;
  int panel_frames_ = kSettle;
  double seconds_in_full_ = 0;
};

}  // namespace

void WindowOptions::validate() const {
  rendering.validate();
  if (width < 1 || height < 1) throw Error(ErrorCode::usage, {}, "a window needs at least one pixel");
  if (frames < 0) throw Error(ErrorCode::usage, {}, "frames must not be negative");
}

WindowResult view_window(std::shared_ptr<ViewLibrary> library, std::filesystem::path const& folder,
                         WindowOptions const& options, Context& context) {
  options.validate();
  ViewWindow window(library, folder, options, context);
  return options.frames > 0 ? window.measure() : window.run();
}

}  // namespace scanview
