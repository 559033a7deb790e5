#include "viewer/window/view_window.h"

#include <chrono>

#define GLFW_INCLUDE_NONE
#include <GLFW/glfw3.h>
#include <fmt/format.h>

#include "base/error.h"
#include "base/files.h"
#include "base/image_file.h"
#include "viewer/window/frame_presenter.h"
#include "viewer/window/glfw_window.h"
#include "viewer/window/orbit_control.h"

namespace scanview {
namespace {

using Clock = std::chrono::steady_clock;

class ViewWindow {
 public:
  ViewWindow(ScanSet const& set, std::vector<ViewMesh> const& meshes, WindowOptions const& options, Context& context)
      : options_(options),
        context_(context),
        control_(set),
        window_(options.width, options.height, options.title),
        gl_(load_gl_functions(window_)),
        presenter_(gl_),
        renderer_(make_gl_renderer(window_, std::make_shared<ViewLibrary>(set, meshes), options.rendering)) {
    GlfwWindow::Events events;
    events.drag = [this](double right, double down, bool pan) {
      if (pan) {
        control_.pan(right, down);
      } else {
        control_.orbit(right, down);
      }
      moved();
    };
    events.scroll = [this](double steps) {
      control_.zoom(steps);
      moved();
    };
    events.key = [this](int key) { press(key); };
    events.redraw = [this] { stale_ = true; };
    window_.on(std::move(events));
  }
  // Presenter and renderer delete their OpenGL objects, which needs the window's context.
  ~ViewWindow() { window_.make_current(); }

  void run() {
    context_.log(window_help());
    auto last = Clock::now();
    while (!window_.should_close()) {
      context_.check_cancelled();
      // While something moves, as fast as it draws; then a moment later once more in full resolution; then only on
      // demand.
      window_.poll(turning_ || stale_ ? 0 : coarse_ ? 0.15 : 0.1);
      auto const now = Clock::now();
      if (turning_) {
        constexpr double kDegreesASecond = 30;
        control_.turn(kDegreesASecond * std::chrono::duration<double>(now - last).count());
        moved();
      }
      last = now;
      if (!stale_ && coarse_) {
        moving_ = false;
        stale_ = true;
      }
      if (stale_) draw();
    }
  }

 private:
  void moved() { moving_ = stale_ = true; }

  void draw() {
    int width = 0, height = 0;
    window_.size_in_pixels(width, height);
    stale_ = false;
    if (width < 1 || height < 1) return;
    // A slow machine turns the object in half the resolution.
    constexpr double kSlow = 0.08;
    coarse_ = moving_ && seconds_in_full_ > kSlow && width > 1 && height > 1;
    auto const start = Clock::now();
    Frame const frame = coarse_ ? render(width / 2, height / 2) : render(width, height);
    double const seconds = std::chrono::duration<double>(Clock::now() - start).count();
    if (!coarse_) seconds_in_full_ = seconds;
    window_.make_current();
    presenter_.present(frame, width, height);
    window_.swap();
    window_.set_title(fmt::format("{}  |  {:.0f} ms{}  |  H: help", options_.title, 1000 * seconds,
                                  coarse_ ? " (half resolution)" : ""));
  }

  Frame render(int width, int height) {
    return renderer_->render(fit_camera(control_.current().camera, width, height),
                             control_.current().object_from_camera);
  }

  void press(int key) {
    if (key == GLFW_KEY_ESCAPE) {
      window_.close();
    } else if (key == GLFW_KEY_H) {
      context_.log(window_help());
    } else if (key == GLFW_KEY_SPACE) {
      turning_ = !turning_;
    } else if (key == GLFW_KEY_R) {
      turning_ = false;
      control_.reset();
      stale_ = true;
    } else if (key == GLFW_KEY_P) {
      save();
    } else if (key >= GLFW_KEY_1 && key <= GLFW_KEY_9) {
      turning_ = false;
      stale_ = control_.jump(static_cast<std::size_t>(key - GLFW_KEY_1));
    }
  }

  void save() {
    int width = 0, height = 0;
    window_.size_in_pixels(width, height);
    if (width < 1 || height < 1) return;
    std::filesystem::path path;
    for (int number = 0; path.empty() || std::filesystem::exists(path); ++number) {
      path = options_.pictures / fmt::format("scanview-{:03}.png", number);
    }
    // A full disk must not end the session.
    try {
      write_file(path, encode_png(render(width, height).color));
      context_.log("saved " + path.string());
    } catch (Error const& error) {
      context_.warn(error.what());
    }
  }

  WindowOptions options_;
  Context& context_;
  OrbitControl control_;
  GlfwWindow window_;
  GlFunctions gl_;
  FramePresenter presenter_;
  std::unique_ptr<ViewBasedRenderer> renderer_;
  bool stale_ = true, turning_ = false, moving_ = false, coarse_ = false;
  double seconds_in_full_ = 0;
};

}  // namespace

void WindowOptions::validate() const {
  rendering.validate();
  if (width < 1 || height < 1) throw Error(ErrorCode::usage, {}, "a window needs at least one pixel");
}

std::string window_help() {
  return "left drag: turn\nright or shift drag: pan\nwheel: nearer, further\n1-9: from the place of a view\n"
         "space: turntable\nR: back to the start\nP: save a picture\nH: this help\nEsc: quit";
}

void view_window(ScanSet const& set, std::vector<ViewMesh> const& meshes, WindowOptions const& options,
                 Context& context) {
  options.validate();
  ViewWindow(set, meshes, options, context).run();
}

}  // namespace scanview
