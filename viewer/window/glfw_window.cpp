#include "viewer/window/glfw_window.h"

#define GLFW_INCLUDE_NONE
#include <GLFW/glfw3.h>

#include <algorithm>
#include <utility>

#include "base/error.h"
#include "viewer/gl/current_context.h"

namespace scanview {
namespace {

std::string last_error() {
  char const* text = nullptr;
  glfwGetError(&text);
  return text == nullptr ? "unknown cause" : text;
}

}  // namespace

struct GlfwWindow::State {
  GLFWwindow* window = nullptr;
  std::vector<WindowEvent> events;
  double x = 0, y = 0;  ///< of the pointer, in the framebuffer's pixels
  double poll_began = 0, poll_ended = 0;
  unsigned (*reset_status)() = nullptr;

  static State& of(GLFWwindow* window) { return *static_cast<State*>(glfwGetWindowUserPointer(window)); }

  WindowEvent& add(WindowEvent::Kind kind) {
    WindowEvent event;
    event.kind = kind;
    event.x = x;
    event.y = y;
    event.shift = holds_shift();
    // What is there as soon as polling begins may have waited since the last time.
    constexpr double kAtOnce = 0.002;
    double const now = glfwGetTime();
    event.seconds = now - poll_began < kAtOnce ? poll_ended : now;
    events.push_back(event);
    return events.back();
  }

  bool holds_shift() const {
    return glfwGetKey(window, GLFW_KEY_LEFT_SHIFT) == GLFW_PRESS ||
           glfwGetKey(window, GLFW_KEY_RIGHT_SHIFT) == GLFW_PRESS;
  }

  void point_at(double screen_x, double screen_y) {
    double const scale = pixels_per_unit();
    x = (screen_x + 0.5) * scale - 0.5;
    y = (screen_y + 0.5) * scale - 0.5;
  }

  double pixels_per_unit() const {
    int pixels = 0, units = 0, ignored = 0;
    glfwGetFramebufferSize(window, &pixels, &ignored);
    glfwGetWindowSize(window, &units, &ignored);
    return pixels > 0 && units > 0 ? static_cast<double>(pixels) / units : 1;
  }
};

GlfwWindow::GlfwWindow(int width, int height, std::string const& title) : state_(std::make_unique<State>()) {
  if (glfwInit() == GLFW_FALSE) {
    throw Error(ErrorCode::io, {},
                "no window can be opened: " + last_error() +
                    " (is a display there, and DISPLAY set?); `scanview render` needs none");
  }
  glfwWindowHint(GLFW_CONTEXT_VERSION_MAJOR, 3);
  glfwWindowHint(GLFW_CONTEXT_VERSION_MINOR, 3);
  glfwWindowHint(GLFW_OPENGL_PROFILE, GLFW_OPENGL_CORE_PROFILE);
  glfwWindowHint(GLFW_OPENGL_FORWARD_COMPAT, GLFW_TRUE);
  // Where the driver can, it tells that it was reset instead of drawing nothing from then on.
  glfwWindowHint(GLFW_CONTEXT_ROBUSTNESS, GLFW_LOSE_CONTEXT_ON_RESET);
  state_->window = glfwCreateWindow(width, height, title.c_str(), nullptr, nullptr);
  if (state_->window == nullptr) {
    std::string const why = last_error();
    glfwTerminate();
    throw Error(ErrorCode::io, {}, "no window with OpenGL 3.3 can be opened: " + why);
  }
  GLFWwindow* const window = state_->window;
  glfwSetWindowUserPointer(window, state_.get());
  using Kind = WindowEvent::Kind;
  glfwSetCursorPosCallback(window, [](GLFWwindow* w, double x, double y) {
    State::of(w).point_at(x, y);
    State::of(w).add(Kind::move);
  });
  glfwSetMouseButtonCallback(window, [](GLFWwindow* w, int button, int action, int) {
    State::of(w).add(action == GLFW_PRESS ? Kind::press : Kind::release).button = button;
  });
  glfwSetScrollCallback(window,
                        [](GLFWwindow* w, double, double steps) { State::of(w).add(Kind::scroll).steps = steps; });
  glfwSetKeyCallback(window, [](GLFWwindow* w, int key, int, int action, int) {
    State::of(w).add(action == GLFW_RELEASE ? Kind::key_release : Kind::key).key = key;
  });
  glfwSetFramebufferSizeCallback(window, [](GLFWwindow* w, int, int) { State::of(w).add(Kind::exposed); });
  glfwSetWindowRefreshCallback(window, [](GLFWwindow* w) { State::of(w).add(Kind::exposed); });
  make_current();
  // Frames are drawn when something changes: waiting for the screen only adds delay, and never ends under some virtual
  // displays.
  glfwSwapInterval(0);
  if (glfwExtensionSupported("GL_ARB_robustness") == GLFW_TRUE)
    state_->reset_status = reinterpret_cast<unsigned (*)()>(get_proc("glGetGraphicsResetStatusARB"));
}

GlfwWindow::~GlfwWindow() {
  release();
  glfwDestroyWindow(state_->window);
  glfwTerminate();
}

void GlfwWindow::make_current() {
  if (!begin_make_current(this)) return;
  glfwMakeContextCurrent(state_->window);
  set_current_context(this);
}

void GlfwWindow::release() {
  if (current_context() != this) return;
  glfwMakeContextCurrent(nullptr);
  set_current_context(nullptr);
}

GlContext::Function GlfwWindow::get_proc(char const* name) const { return glfwGetProcAddress(name); }

std::vector<WindowEvent> GlfwWindow::poll(double seconds) {
  state_->poll_began = glfwGetTime();
  if (seconds > 0) {
    glfwWaitEventsTimeout(seconds);
  } else {
    glfwPollEvents();
  }
  state_->poll_ended = glfwGetTime();
  return std::exchange(state_->events, {});
}

double GlfwWindow::seconds() const { return glfwGetTime(); }

bool GlfwWindow::holds_shift() const { return state_->holds_shift(); }

bool GlfwWindow::should_close() const { return glfwWindowShouldClose(state_->window) == GLFW_TRUE; }

void GlfwWindow::close() { glfwSetWindowShouldClose(state_->window, GLFW_TRUE); }

void GlfwWindow::size_in_pixels(int& width, int& height) const {
  glfwGetFramebufferSize(state_->window, &width, &height);
}

double GlfwWindow::pixels_per_unit() const { return state_->pixels_per_unit(); }

double GlfwWindow::content_scale() const {
  float x = 1, y = 1;
  glfwGetWindowContentScale(state_->window, &x, &y);
  return std::clamp(static_cast<double>(y), 1.0, 4.0);
}

void GlfwWindow::set_title(std::string const& title) { glfwSetWindowTitle(state_->window, title.c_str()); }

void GlfwWindow::swap() {
  glfwSwapBuffers(state_->window);
  if (state_->reset_status != nullptr && state_->reset_status() != 0) {
    throw Error(ErrorCode::io, {},
                "the graphics driver was reset and has lost the window's pictures: start `scanview view` again");
  }
}

GLFWwindow* GlfwWindow::handle() const { return state_->window; }

}  // namespace scanview
