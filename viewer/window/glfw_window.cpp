#include "viewer/window/glfw_window.h"

#define GLFW_INCLUDE_NONE
#include <GLFW/glfw3.h>

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
  Events events;
  double x = 0, y = 0;

  static State& of(GLFWwindow* window) { return *static_cast<State*>(glfwGetWindowUserPointer(window)); }

  void moved(double to_x, double to_y) {
    auto const pressed = [&](int button) { return glfwGetMouseButton(window, button) == GLFW_PRESS; };
    auto const held = [&](int key) { return glfwGetKey(window, key) == GLFW_PRESS; };
    bool const left = pressed(GLFW_MOUSE_BUTTON_LEFT);
    bool const other = pressed(GLFW_MOUSE_BUTTON_RIGHT) || pressed(GLFW_MOUSE_BUTTON_MIDDLE);
    int width = 1, height = 1;
    glfwGetWindowSize(window, &width, &height);
    if ((left || other) && events.drag && height > 0) {
      bool const pan = other || held(GLFW_KEY_LEFT_SHIFT) || held(GLFW_KEY_RIGHT_SHIFT);
      events.drag((to_x - x) / height, (to_y - y) / height, pan);
    }
    x = to_x;
    y = to_y;
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
  state_->window = glfwCreateWindow(width, height, title.c_str(), nullptr, nullptr);
  if (state_->window == nullptr) {
    std::string const why = last_error();
    glfwTerminate();
    throw Error(ErrorCode::io, {}, "no window with OpenGL 3.3 can be opened: " + why);
  }
  GLFWwindow* const window = state_->window;
  glfwSetWindowUserPointer(window, state_.get());
  glfwGetCursorPos(window, &state_->x, &state_->y);
  glfwSetCursorPosCallback(window, [](GLFWwindow* w, double x, double y) { State::of(w).moved(x, y); });
  glfwSetMouseButtonCallback(window, [](GLFWwindow* w, int, int, int) {
    State& state = State::of(w);
    glfwGetCursorPos(w, &state.x, &state.y);
  });
  glfwSetScrollCallback(window, [](GLFWwindow* w, double, double steps) {
    if (State::of(w).events.scroll) State::of(w).events.scroll(steps);
  });
  glfwSetKeyCallback(window, [](GLFWwindow* w, int key, int, int action, int) {
    if (action == GLFW_PRESS && State::of(w).events.key) State::of(w).events.key(key);
  });
  glfwSetFramebufferSizeCallback(window, [](GLFWwindow* w, int, int) {
    if (State::of(w).events.redraw) State::of(w).events.redraw();
  });
  glfwSetWindowRefreshCallback(window, [](GLFWwindow* w) {
    if (State::of(w).events.redraw) State::of(w).events.redraw();
  });
  make_current();
  // Frames are drawn when something changes: waiting for the screen only adds delay, and never ends under some virtual
  // displays.
  glfwSwapInterval(0);
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

void GlfwWindow::on(Events events) { state_->events = std::move(events); }

void GlfwWindow::poll(double seconds) {
  if (seconds > 0) {
    glfwWaitEventsTimeout(seconds);
  } else {
    glfwPollEvents();
  }
}

bool GlfwWindow::should_close() const { return glfwWindowShouldClose(state_->window) == GLFW_TRUE; }

void GlfwWindow::close() { glfwSetWindowShouldClose(state_->window, GLFW_TRUE); }

void GlfwWindow::size_in_pixels(int& width, int& height) const {
  glfwGetFramebufferSize(state_->window, &width, &height);
}

void GlfwWindow::set_title(std::string const& title) { glfwSetWindowTitle(state_->window, title.c_str()); }

void GlfwWindow::swap() { glfwSwapBuffers(state_->window); }

}  // namespace scanview
