#include "viewer/window/window_loop.h"

#include <fmt/format.h>

#include <algorithm>
#include <utility>
#include <vector>

#include "base/error.h"
#include "base/files.h"
#include "base/image_file.h"
#include "base/median.h"
#include "viewer/window/keyframes.h"

namespace scanview {
namespace {

double seconds_since(std::chrono::steady_clock::time_point start) {
  return std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
}

}  // namespace

void BasicWindowOptions::validate() const {
  if (width < 1 || height < 1) throw Error(ErrorCode::usage, {}, "a window needs at least one pixel");
  if (frames < 0) throw Error(ErrorCode::usage, {}, "frames must not be negative");
}

WindowLoop::WindowLoop(BasicWindowOptions options, Context& context)
    : options_(std::move(options)),
      context_(context),
      window_(options_.width, options_.height, options_.title),
      gl_(load_gl_functions(window_)),
      frame_(window_),
      presenter_(gl_) {}

// Everything that holds OpenGL's objects deletes them in the window's context.
WindowLoop::~WindowLoop() { window_.make_current(); }

void WindowLoop::run() {
  context_.log(help());
  auto last = Clock::now();
  while (!window_.should_close()) {
    context_.check_cancelled();
    for (auto const& event : window_.poll(idle_seconds())) handle(event);
    if (status().turning && !is_flat()) {
      constexpr double kDegreesASecond = 30;
      turn(kDegreesASecond * seconds_since(last));
      moved();
    }
    last = Clock::now();
    if (keys_.any()) hold(keys_.take(window_.seconds()));
    look_around();
    draw_what_is_stale();
  }
}

std::optional<FrameTimes> WindowLoop::measure() {
  std::vector<double> frame, panel, all;
  constexpr int kWarmUp = 3;
  for (int i = -kWarmUp; i < options_.frames && !window_.should_close(); ++i) {
    context_.check_cancelled();
    window_.poll(0);
    auto const start = Clock::now();
    turn(360.0 / options_.frames);
    moved();
    render_frame();
    window_.make_current();
    presenter_.present(viewport_, height_);
    gl_.Finish();
    double const shown = seconds_since(start);
    draw_beside();
    window_.make_current();
    draw_panel();
    gl_.Finish();
    double const drawn = seconds_since(start);
    window_.swap();
    if (i < 0) continue;
    frame.push_back(1e3 * shown);
    panel.push_back(1e3 * (drawn - shown));
    all.push_back(seconds_since(start));
  }
  if (all.empty()) return std::nullopt;
  return FrameTimes{viewport_.width, viewport_.height, median(frame), median(panel), 1 / median(all)};
}

void WindowLoop::save(Keyframes& keyframes) {
  if (keyframes.size() == 0) return;
  try {
    keyframes.save(options_.pictures);
    say(fmt::format("{} keyframes in {}", keyframes.size(), keyframes.file().string()));
  } catch (Error const& error) {
    say(error.what());
  }
}

void WindowLoop::say(std::string const& message) {
  status().message = message;
  refresh();
  if (!message.empty()) context_.log(message);
}

void WindowLoop::moved() {
  moving_ = stale_ = true;
  moved_ = Clock::now();
}

double WindowLoop::seconds_since_start() const { return seconds_since(started_); }

double WindowLoop::idle_seconds() const {
  return status().turning || stale_ || panel_frames_ > 0 || keys_.any() ? 0 : patience();
}

void WindowLoop::handle(WindowEvent const& event) {
  using Kind = WindowEvent::Kind;
  int width = 0, height = 0;
  window_.size_in_pixels(width, height);
  bool const inside = viewport_.contains(event.x, event.y);
  if (event.kind == Kind::exposed) {
    stale_ = stale_ || width != width_ || height != height_;
    panel_frames_ = std::max(panel_frames_, 1);
    return;
  }
  if (event.kind == Kind::key_release) {
    keys_.feed(event);
    return;
  }
  if (event.kind == Kind::key && keys_.is_held(event.key)) return;  // the keyboard repeats
  // The panel lights up what the pointer is over; elsewhere a move alone changes nothing.
  if (event.kind != Kind::move || !inside || was_beside_) panel_frames_ = kSettle;
  was_beside_ = !inside;
  if (event.kind == Kind::key || event.kind == Kind::press) status().message.clear();
  if (event.kind == Kind::key) {
    if (frame_.takes_keys()) return;
    if (holds(event.key)) keys_.feed(event);
    press(event.key);
    return;
  }
  if (!inside && !pointer_.held()) return;
  for (auto const& gesture : pointer_.feed(event)) point(gesture);
}

bool WindowLoop::steer(OrbitControl& control, Gesture const& gesture) {
  if (gesture.kind == Gesture::Kind::scroll) {
    control.zoom(gesture.steps);
  } else if (gesture.kind == Gesture::Kind::drag) {
    // Shares of the height, so that dragging feels the same in every size.
    double const right = gesture.dx / viewport_.height, down = gesture.dy / viewport_.height;
    if (gesture.pan) {
      control.pan(right, down);
    } else {
      control.orbit(right, down);
    }
  } else {
    return false;
  }
  moved();
  return true;
}

bool WindowLoop::obey_common(Command command) {
  switch (command) {
    case Command::quit:
      window_.close();
      return true;
    case Command::help:
      say(help());
      return true;
    case Command::toggle_panel:
      frame_.visible = !frame_.visible;
      stale_ = true;
      return true;
    case Command::save_picture:
      save_picture();
      return true;
    case Command::turntable:
      status().turning = !status().turning;
      return true;
    default:
      return false;
  }
}

void WindowLoop::save_picture() {
  if (width_ < 1 || height_ < 1) return;
  // A full disk must not end the session.
  try {
    auto const path = first_free(options_.pictures, "scanview-", ".png");
    write_file(path, encode_png(picture_to_save(width_, height_)));
    say("saved " + path.string());
  } catch (Error const& error) {
    say(error.what());
  }
}

void WindowLoop::mark(Overlay& overlay, std::optional<Eigen::Vector2d> const& pivot) const {
  if (pivot && pointer_.held()) overlay.dots.push_back({*pivot, {1, 1, 1}, ""});
}

void WindowLoop::draw_what_is_stale() {
  // Once more in full resolution a moment after the last move.
  if (!stale_ && moving_ && seconds_since(moved_) >= kRest) {
    moving_ = false;
    stale_ = coarse_;
  }
  if (stale_) render_frame();
  if (draw_beside()) panel_frames_ = std::max(panel_frames_, 1);
  if (panel_frames_ <= 0 || width_ < 1 || height_ < 1) return;
  --panel_frames_;
  window_.make_current();
  auto const start = Clock::now();
  presenter_.present(viewport_, height_);
  draw_panel();
  window_.swap();
  check_gl(gl_, "drawing the window");
  status().panel_milliseconds = 1e3 * seconds_since(start);
}

void WindowLoop::render_frame() {
  window_.size_in_pixels(width_, height_);
  stale_ = false;
  if (width_ < 1 || height_ < 1) return;
  viewport_ = picture_part(width_, height_);
  panel_frames_ = std::max(panel_frames_, 1);
  auto const start = Clock::now();
  // A slow machine turns the object in half the resolution.
  constexpr double kSlow = 0.08;
  coarse_ = moving_ && !is_flat() && options_.frames == 0 && seconds_in_full_ > kSlow && viewport_.width > 1 &&
            viewport_.height > 1;
  int const part = coarse_ ? 2 : 1;
  cv::Mat4b const picture = draw_picture(viewport_.width / part, viewport_.height / part);
  window_.make_current();
  presenter_.upload(picture);
  double const seconds = seconds_since(start);
  if (is_flat()) {
    moving_ = false;
  } else if (!coarse_) {
    seconds_in_full_ = seconds;
  }
  status().frame_milliseconds = 1e3 * seconds;
  status().half_resolution = coarse_;
}

}  // namespace scanview
