#pragma once
#include <memory>
#include <string>
#include <vector>

#include "viewer/gl/gl_context.h"
#include "viewer/window/window_event.h"

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

  /// All that has happened since the last call, in its order: also what began and ended between two calls. Waits up to
  /// `seconds` for something to happen (0: does not wait).
  std::vector<WindowEvent> poll(double seconds);
  double seconds() const;  ///< now, on the clock of WindowEvent::seconds
  bool holds_shift() const;
  bool should_close() const;
  void close();
  void size_in_pixels(int& width, int& height) const;
  /// Pixels of the framebuffer a unit of the screen: more than 1 on some dense screens.
  double pixels_per_unit() const;
  /// By how much larger than usual a person wants letters to be.
  double content_scale() const;
  void set_title(std::string const& title);
  /// Shows what was drawn. Throws Error{io} where the graphics driver was reset and the context is lost with all it
  /// held.
  void swap();
  GLFWwindow* handle() const;  ///< for libraries that know GLFW

 private:
  struct State;
  std::unique_ptr<State> state_;
};

}  // namespace scanview
