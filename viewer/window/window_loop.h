#pragma once
#include <chrono>
#include <map>
#include <opencv2/core/mat.hpp>
#include <optional>
#include <string>

#include "base/context.h"
#include "viewer/window/commands.h"
#include "viewer/window/frame_presenter.h"
#include "viewer/window/glfw_window.h"
#include "viewer/window/held_keys.h"
#include "viewer/window/keyframes.h"
#include "viewer/window/orbit_control.h"
#include "viewer/window/panel_frame.h"
#include "viewer/window/pointer_gestures.h"
#include "viewer/window/window_options.h"

namespace scanview {

/// A window around whatever is looked at: what a person does, in its order; a picture that is drawn again only where
/// something has changed, and in half the resolution while a slow one moves; the panel around it. What is looked at,
/// and what keys mean, is for the class that is derived from it.
///
/// Throws Error{io} where there is no display or the OpenGL context is lost. On the main thread.
class WindowLoop {
 public:
  virtual ~WindowLoop();
  WindowLoop(WindowLoop const&) = delete;
  WindowLoop& operator=(WindowLoop const&) = delete;

  /// Until the person closes it.
  void run();
  /// A full turn of BasicWindowOptions::frames frames; nothing where the person closed the window before the first.
  std::optional<FrameTimes> measure();

 protected:
  WindowLoop(BasicWindowOptions options, Context& context);

  virtual std::string help() const = 0;  ///< window_help()
  virtual PanelStatus& status() = 0;
  virtual PanelStatus const& status() const = 0;
  /// The part of a framebuffer of that size that the picture takes.
  virtual Viewport picture_part(int width, int height) const = 0;
  /// BGRA, straight alpha, of that size. OpenGL's context may be another one.
  virtual cv::Mat4b draw_picture(int width, int height) = 0;
  /// A picture to keep, of all the window's size.
  virtual cv::Mat4b picture_to_save(int width, int height) = 0;
  /// Around the picture, and what its buttons ask for.
  virtual void draw_panel() = 0;
  virtual void press(int key) = 0;
  /// Keys that do something for as long as they are held; press() is called for them once, without repeats.
  virtual bool holds(int) const { return false; }
  /// Before each frame while such keys are held: for how many seconds each was since the last time.
  virtual void hold(std::map<int, double> const&) {}
  virtual void point(Gesture const& gesture) = 0;
  virtual void turn(double degrees) = 0;          ///< the turntable
  virtual bool is_flat() const { return false; }  ///< what is shown does not turn, and is never drawn coarsely
  /// Before each frame: what has happened elsewhere.
  virtual void look_around() {}
  /// Draws what is beside the picture where it is due, and whether it was. The context may be another one afterwards.
  virtual bool draw_beside() { return false; }
  /// Seconds for which nothing may happen before look_around() is to be called.
  virtual double patience() const { return moving_ ? kRest : 0.5; }

  /// Shows a message until something is done.
  void say(std::string const& message);
  /// Writes them beside the pictures, where there are any, and says where, or why not: a full disk must not end the
  /// session.
  void save(Keyframes& keyframes);
  /// The panel has something new to show.
  void refresh() { panel_frames_ = kSettle; }
  /// The eye has moved.
  void moved();
  /// Something else has changed in the picture.
  void change() { stale_ = true; }
  bool is_moving() const { return moving_; }
  /// Turns, pans and zooms; false for clicks.
  bool steer(OrbitControl& control, Gesture const& gesture);
  /// Commands that mean the same everywhere; false for others.
  bool obey_common(Command command);
  /// Where the pivot is, while a button is held.
  void mark(Overlay& overlay, std::optional<Eigen::Vector2d> const& pivot) const;
  double seconds_since_start() const;

  static constexpr double kRest = 0.15;  ///< seconds after which what moved has come to rest

  BasicWindowOptions options_;
  Context& context_;
  GlfwWindow window_;
  GlFunctions gl_;
  PanelFrame frame_;
  Viewport viewport_;  ///< of the picture that is shown

 private:
  using Clock = std::chrono::steady_clock;
  static constexpr int kSettle = 3;  ///< frames that the panel takes until it shows all that a click has changed

  double idle_seconds() const;
  void handle(WindowEvent const& event);
  void save_picture();
  void draw_what_is_stale();
  void render_frame();

  FramePresenter presenter_;
  PointerGestures pointer_;
  HeldKeys keys_;
  Clock::time_point const started_ = Clock::now();
  Clock::time_point moved_;
  int width_ = 0, height_ = 0;
  bool stale_ = true, moving_ = false, coarse_ = false, was_beside_ = true;
  int panel_frames_ = kSettle;
  double seconds_in_full_ = 0;
};

}  // namespace scanview
