#include "viewer/window/view_window.h"

#define GLFW_INCLUDE_NONE
#include <GLFW/glfw3.h>
#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <functional>
#include <map>
#include <set>

#include "base/error.h"
#include "base/files.h"
#include "base/image_file.h"
#include "base/median.h"
#include "viewer/select/view_selection.h"
#include "viewer/window/file_watch.h"
#include "viewer/window/frame_presenter.h"
#include "viewer/window/glfw_window.h"
#include "viewer/window/keyframes.h"
#include "viewer/window/marking_desk.h"
#include "viewer/window/measuring.h"
#include "viewer/window/orbit_control.h"
#include "viewer/window/panel.h"
#include "viewer/window/pointer_gestures.h"
#include "viewer/window/view_strip.h"

namespace scanview {
namespace {

using Clock = std::chrono::steady_clock;

double seconds_since(Clock::time_point start) { return std::chrono::duration<double>(Clock::now() - start).count(); }

std::filesystem::path free_name(std::filesystem::path const& folder, char const* pattern) {
  for (int number = 0;; ++number) {
    auto path = folder / fmt::format(fmt::runtime(pattern), number);
    if (!std::filesystem::exists(path)) return path;
  }
}

class ViewWindow {
 public:
  ViewWindow(std::shared_ptr<ViewLibrary> library, std::filesystem::path const& folder, WindowOptions const& options,
             Context& context)
      : options_(options),
        context_(context),
        folder_(folder),
        library_(std::move(library)),
        control_(library_->set(), library_->radius()),
        window_(options.width, options.height, options.title),
        gl_(load_gl_functions(window_)),
        presenter_(gl_),
        strip_(gl_),
        panel_(window_),
        desk_(library_, folder),
        watch_(watched_files(folder, library_->set())) {
    back_ends_[BackEnd::gl] = [this](ViewBasedOptions const& o) { return make_gl_renderer(window_, library_, o); };
    for (auto const& [back_end, make] : back_ends_) content_.back_ends.push_back(back_end);
    bool const processor = back_ends_.contains(BackEnd::cpu) && !is_hardware(window_);
    content_.back_end = options.back_end.value_or(processor ? BackEnd::cpu : BackEnd::gl);
    if (!back_ends_.contains(content_.back_end))
      throw Error(ErrorCode::usage, {}, "this back end does not draw in a window");
    make_renderer(options.rendering);
    default_look_ = content_.look = look_of(renderer_->options());
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
      look_at_pictures();
      draw_what_is_stale();
    }
    return {library_->failures(), std::nullopt};
  }

  WindowResult measure() {
    renderer_->set_patient(true);
    std::vector<double> frame, panel, all;
    constexpr int kWarmUp = 3;
    for (int i = -kWarmUp; i < options_.frames && !window_.should_close(); ++i) {
      context_.check_cancelled();
      window_.poll(0);
      auto const start = Clock::now();
      control_.turn(360.0 / options_.frames);
      render_frame();
      window_.make_current();
      present();
      gl_.Finish();
      double const shown = seconds_since(start);
      render_strip();
      draw_panel();
      gl_.Finish();
      double const drawn = seconds_since(start);
      window_.swap();
      if (i < 0) continue;
      frame.push_back(1e3 * shown);
      panel.push_back(1e3 * (drawn - shown));
      all.push_back(seconds_since(start));
    }
    if (all.empty()) return {library_->failures(), std::nullopt};
    return {library_->failures(), FrameTimes{median(frame), median(panel), 1 / median(all)}};
  }

 private:
  void make_renderer(ViewBasedOptions const& rendering) {
    renderer_ = back_ends_.at(content_.back_end)(rendering);
    renderer_->set_patient(false);
    stale_ = true;
  }

  void learn_names() {
    content_.unit = to_string(library_->set().unit);
    content_.view_names.clear();
    directions_.clear();
    for (auto const& view : library_->set().views) {
      content_.view_names.push_back(view.name);
      directions_.push_back(direction_to_eye(view.image.camera, *view.object_from_camera, library_->set().center));
    }
    content_.greatest_threshold = std::max(0.1 * library_->radius(), 10 * default_look_.threshold);
  }

  void say(std::string const& message) {
    content_.message = message;
    panel_frames_ = kSettle;
    if (!message.empty()) context_.log(message);
  }

  // How long nothing may happen before something is to be done.
  double patience() const {
    if (content_.turning || stale_ || panel_frames_ > 0) return 0;
    if (!renderer_->complete()) return 0.02;
    // What moved is drawn once more in full resolution a moment after it stopped.
    if (coarse_ || strip_stale_) return 0.15;
    return 0.5;
  }

  void moved() { moving_ = stale_ = true; }

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
    auto const point = shown_.pick(x, y, viewport_.width, viewport_.height);
    if (content_.mode == WindowMode::measure) {
      distance_.click(point);
      auto const distance = distance_.distance();
      if (!point) {
        say("the object is not there");
      } else if (distance) {
        say("distance " + length_text(*distance, library_->set().unit));
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
      auto const path = free_name(options_.pictures, "scanview-{:03}.png");
      if (shows_picture(content_.mode)) {
        write_file(path, encode_png(desk_.draw(viewport_.width, viewport_.height)));
      } else {
        renderer_->set_patient(true);
        Frame const frame = render(width_, height_);
        renderer_->set_patient(false);
        write_file(path, encode_png(frame.color));
      }
      say("saved " + path.string());
    } catch (Error const& error) {
      say(error.what());
    }
  }

  void save_keyframes() {
    if (keyframes_.size() == 0) return;
    try {
      if (path_file_.empty()) path_file_ = free_name(options_.pictures, "scanview-path-{:03}.json");
      write_json(path_file_, keyframes_.to_json());
      say(fmt::format("{} keyframes in {}", keyframes_.size(), path_file_.string()));
    } catch (Error const& error) {
      say(error.what());
    }
  }

  void look_at_files() {
    if (folder_.empty() || seconds_since(looked_at_files_) < 1) return;
    looked_at_files_ = Clock::now();
    for (auto const& failure : library_->failures()) {
      if (!warned_.insert(failure).second) continue;
      context_.warn(failure);
      panel_frames_ = kSettle;
    }
    if (watch_.changed()) reload();
  }

  void reload() {
    auto const old = library_;
    OrbitControl const eye = control_;
    try {
      library_ = ViewLibrary::open(folder_, context_);
      control_ = OrbitControl(library_->set(), library_->radius());
      control_.take_eye_of(eye);
      // A threshold that the person has not touched follows the new error budget.
      ViewBasedOptions rendering = with_look(options_.rendering, content_.look);
      bool const untouched = content_.look.threshold == default_look_.threshold && content_.look.soft_z;
      if (untouched) rendering.threshold = options_.rendering.threshold;
      make_renderer(rendering);
      desk_.use(library_);
      if (untouched) default_look_.threshold = content_.look.threshold = renderer_->options().threshold;
      learn_names();
      say("the set's files have changed: read again");
    } catch (Error const& error) {
      library_ = old;
      control_ = eye;
      say(std::string("the set's files have changed, but cannot be read: ") + error.what());
      return;
    }
    watch_ = FileWatch(watched_files(folder_, library_->set()));
  }

  // Draws again once a picture that was missing has come.
  void look_at_pictures() {
    if (renderer_->complete() || shows_picture(content_.mode)) return;
    std::size_t come = 0;
    for (auto const& view : used_)
      come += !library_->picture_if_ready(view.view).empty() || library_->failed(view.view);
    stale_ = stale_ || come != come_;
    come_ = come;
  }

  Frame render(int width, int height) {
    return renderer_->render(fit_camera(control_.current().camera, width, height),
                             control_.current().object_from_camera);
  }

  void draw_what_is_stale() {
    if (!stale_ && moving_) {
      moving_ = false;
      stale_ = coarse_;
    } else if (!stale_ && strip_stale_ && panel_.visible) {
      render_strip();
      panel_frames_ = std::max(panel_frames_, 1);
    }
    if (stale_) render_frame();
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
    shown_.camera = fit_camera(control_.current().camera, viewport_.width / part, viewport_.height / part);
    shown_.object_from_camera = control_.current().object_from_camera;
    shown_.frame = renderer_->render(shown_.camera, shown_.object_from_camera);
    window_.make_current();
    presenter_.upload(shown_.frame.color);
    double const seconds = seconds_since(start);
    if (!coarse_) seconds_in_full_ = seconds;
    content_.frame_milliseconds = 1e3 * seconds;
    content_.half_resolution = coarse_;
    content_.stages = renderer_->stages();
    content_.reading = !renderer_->complete();
    used_ = renderer_->view_weights(shown_.camera, shown_.object_from_camera);
    // The strip follows at once where that costs little, else when the eye rests.
    constexpr double kQuick = 0.03;
    strip_stale_ = true;
    if (panel_.visible && options_.frames == 0 && (seconds < kQuick || !moving_) && renderer_->complete())
      render_strip();
  }

  void render_strip() {
    strip_stale_ = false;
    if (shows_picture(content_.mode) || !panel_.visible) {
      content_.strip.clear();
      return;
    }
    content_.strip = strip_.render(*renderer_, used_, control_.current(), viewport_);
    window_.make_current();
  }

  void present() { presenter_.present(viewport_, height_); }

  Overlay overlay() const {
    if (shows_picture(content_.mode)) return desk_.overlay();
    Overlay overlay;
    auto const place = [&](Eigen::Vector3d const& p) { return shown_.place(p, viewport_.width, viewport_.height); };
    Eigen::Vector3f const yellow(1, 0.85F, 0.2F);
    Overlay::Line line{{}, yellow, false};
    for (auto const& p : distance_.points()) {
      auto const at = place(p);
      if (!at) continue;
      line.points.push_back(*at);
      overlay.dots.push_back({*at, yellow, ""});
    }
    if (auto const distance = distance_.distance(); distance && line.points.size() == 2)
      overlay.dots.back().label = length_text(*distance, library_->set().unit);
    overlay.lines.push_back(std::move(line));
    if (auto const pivot = place(control_.pivot()); pivot && pointer_.held())
      overlay.dots.push_back({*pivot, {1, 1, 1}, ""});
    return overlay;
  }

  void draw_panel() {
    content_.failures = library_->failures();
    content_.sphere = sphere_inset(directions_, renderer_->sphere_triangles(), used_,
                                   direction_to_eye(shown_.camera, shown_.object_from_camera, library_->set().center),
                                   shown_.object_from_camera.linear());
    content_.mode_text.clear();
    if (shows_picture(content_.mode)) {
      content_.mode_text = desk_.text();
    } else if (content_.mode == WindowMode::measure) {
      auto const distance = distance_.distance();
      content_.mode_text.push_back(distance                     ? length_text(*distance, library_->set().unit)
                                   : distance_.points().empty() ? "click the first point"
                                                                : "click the second point");
    }
    content_.keyframes = keyframes_.size();
    content_.keyframe_command = path_file_.empty() ? ""
                                                   : fmt::format("scanview render {} --path {} -o FOLDER",
                                                                 folder_.string(), path_file_.string());
    PanelContent const before = content_;
    PanelAnswer const answer = panel_.draw(content_, overlay(), viewport_);
    desk_.kind = content_.outline;
    if (answer.default_look) content_.look = default_look_;
    if (content_.look != before.look) {
      renderer_->set_options(with_look(renderer_->options(), content_.look));
      stale_ = true;
    }
    if (content_.back_end != before.back_end) make_renderer(renderer_->options());
    if (content_.frames_between != before.frames_between) {
      keyframes_.between = content_.frames_between;
      save_keyframes();
    }
    if (answer.jump) jump(*answer.jump);
    for (Command const command : answer.commands) obey(command);
  }

  static constexpr int kSettle = 3;  ///< frames that the panel takes until it shows all that a click has changed

  WindowOptions options_;
  Context& context_;
  std::filesystem::path folder_;
  std::shared_ptr<ViewLibrary> library_;
  OrbitControl control_;
  GlfwWindow window_;
  GlFunctions gl_;
  FramePresenter presenter_;
  ViewStrip strip_;
  Panel panel_;
  std::map<BackEnd, std::function<std::unique_ptr<ViewBasedRenderer>(ViewBasedOptions const&)>> back_ends_;
  std::unique_ptr<ViewBasedRenderer> renderer_;

  PanelContent content_;
  Look default_look_;
  PointerGestures pointer_;
  DistanceTool distance_;
  MarkingDesk desk_;
  Keyframes keyframes_;
  std::filesystem::path path_file_;
  FileWatch watch_;
  Clock::time_point looked_at_files_ = Clock::now();
  std::set<std::string> warned_;

  ShownFrame shown_;
  std::vector<UsedView> used_;  ///< in the shown frame
  std::vector<Eigen::Vector3d> directions_;
  std::size_t come_ = 0;  ///< of the used views, how many are read or failed
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
  ViewWindow window(std::move(library), folder, options, context);
  return options.frames > 0 ? window.measure() : window.run();
}

}  // namespace scanview
