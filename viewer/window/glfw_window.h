#pragma once
#include <functional>
#include <memory>
#include <string>

#include "viewer/gl/gl_context.h"

struct GLFWwindow;

namespace scanview {

/// A window with an OpenGL 3.3 core context. Throws Error{io} where there is no display or no such OpenGL. One at a
/// time, on the main thread.
class GlfwWindow final : public GlContext {
 public:
  GlfwWindow(int width, int height, std::string const& title);
  ~GlfwWindow() override;
  GlfwWindow(GlfwWindow const&) = delete;
  GlfwWindow& operator=(GlfwWindow const&) = delete;

  void make_current() override;
  void release() override;
  Function get_proc(char const* name) const override;

  /// What the person does. Positions are shares of the window's height. Unset functions are not called.
  struct Events {
    std::function<void(double right, double down, bool pan)> drag;  ///< since the last call; pan: other button or shift
    std::function<void(double steps)> scroll;
    std::function<void(int key)> key;  ///< GLFW_KEY_..., when pressed
    std::function<void()> redraw;      ///< resized or uncovered
  };
  void on(Events events);
  /// Handles what has happened; waits up to `seconds` for something to happen (0: does not wait).
  void poll(double seconds);
  bool should_close() const;
  void close();
  void size_in_pixels(int& width, int& height) const;
  void set_title(std::string const& title);
  void swap();

 private:
  struct State;
  std::unique_ptr<State> state_;
};

}  // namespace scanview
