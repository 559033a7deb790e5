#include "viewer/window/model_window.h"

#include <fmt/format.h>

#include <cmath>
#include <string>
#include <utility>
#include <vector>

#include "base/error.h"
#include "base/median.h"
#include "viewer/window/keyframes.h"
#include "viewer/window/model_panel.h"
#include "viewer/window/viewed_model.h"
#include "viewer/window/window_loop.h"

namespace scanview {
namespace {

/// A step aside and above the axis that comes after up: most models face along it.
OrbitFrame frame_about(ViewedModel const& viewed, Eigen::Vector3d const& up) {
  OrbitFrame frame;
  frame.up = up;
  frame.radius = viewed.radius();
  frame.distance = 4 * frame.radius;
  Eigen::Vector3d const front(up.z(), up.x(), up.y());
  frame.start = (front + 0.5 * up.cross(front) + 0.25 * up).normalized();
  return frame;
}

Keyframes read_cameras(std::filesystem::path const& file, Eigen::Vector3d const& center, OrbitFrame const& frame,
                       BasicWindowOptions const& options) {
  Keyframes cameras;
  cameras.between = 1;
  if (file.empty() || !std::filesystem::exists(file)) return cameras;
  ScanSet set;
  set.center = center;
  for (auto const& camera : read_camera_path(file, set, frame, options.width, options.height)) cameras.add(camera);
  return cameras;
}

class ModelWindow final : public WindowLoop {
 public:
  ModelWindow(PolygonModel model, std::optional<VisibilityField> field, ModelWindowOptions const& options,
              Context& context)
      : WindowLoop(options, context),
        viewed_(std::move(model), std::move(field), context.threads),
        up_(options.up),
        control_(viewed_.center(), frame_about(viewed_, up_direction(up_))),
        cameras_(read_cameras(options.cameras, viewed_.center(), frame_about(viewed_, up_direction(up_)), options)),
        camera_file_(options.cameras) {
    content_.set_name = options.title;
    content_.polygons = viewed_.polygons();
    content_.triangles = viewed_.triangles();
    if (VisibilityField const* const known = viewed_.field()) {
      content_.has_visibility = true;
      content_.patches = known->patches.count();
      auto const* const sphere = std::get_if<SphereLookup>(&known->lookup);
      if (sphere != nullptr && !sphere->shells.empty()) content_.nearest_sample = sphere->shells.front();
    }
  }
  ~ModelWindow() override { window_.make_current(); }

  ModelWindowResult show() {
    ModelWindowResult result;
    if (options_.frames == 0) {
      run();
      return result;
    }
    result.times = measure();
    if (selects_.empty()) return result;
    for (double const rate : culling_rates_) result.culling_rate += rate / static_cast<double>(culling_rates_.size());
    result.select_microseconds = median(selects_);
    return result;
  }

 private:
  std::string help() const override { return model_window_help(); }
  PanelStatus& status() override { return content_; }
  PanelStatus const& status() const override { return content_; }
  Viewport picture_part(int width, int height) const override { return frame_.viewport(width, height); }
  void turn(double degrees) override { control_.turn(degrees); }

  Eigen::Vector3d choosing_eye() const {
    return frozen_ ? *frozen_ : Eigen::Vector3d(control_.current().object_from_camera.translation());
  }

  ShownFrame const& render(int width, int height) {
    auto const& eye = control_.current();
    return viewed_.render(fit_camera(eye.camera, width, height), eye.object_from_camera, content_.look, choosing_eye());
  }

  cv::Mat4b draw_picture(int width, int height) override {
    cv::Mat4b const picture = render(width, height).frame.color;
    ModelFigures const& figures = viewed_.figures();
    content_.figures = figures;
    content_.distance = (choosing_eye() - viewed_.center()).norm() / viewed_.radius();
    if (options_.frames > 0) {
      selects_.push_back(figures.select_microseconds);
      culling_rates_.push_back(1 - static_cast<double>(figures.triangles) / static_cast<double>(viewed_.triangles()));
    }
    return picture;
  }

  cv::Mat4b picture_to_save(int width, int height) override {
    cv::Mat4b const picture = render(width, height).frame.color;
    change();  // what is picked in is of that size now
    return picture;
  }

  void draw_panel() override {
    content_.frozen = frozen_.has_value();
    content_.cameras = cameras_.size();
    content_.camera_file = cameras_.file().string();
    Overlay overlay;
    auto const place = [&](Eigen::Vector3d const& p) {
      return viewed_.shown().place(p, viewport_.width, viewport_.height);
    };
    mark(overlay, place(control_.pivot()));
    if (frozen_) {
      if (auto const at = place(*frozen_)) overlay.dots.push_back({*at, {1, 0.85F, 0.2F}, "frozen eye"});
    }
    for (Command const command : draw_model_panel(frame_, content_, overlay, viewport_)) obey(command);
  }

  void point(Gesture const& gesture) override {
    if (steer(control_, gesture) || gesture.kind != Gesture::Kind::double_click) return;
    auto const p =
        viewed_.shown().pick(gesture.x - viewport_.x, gesture.y - viewport_.y, viewport_.width, viewport_.height);
    if (p) control_.set_pivot(*p);
    say(p ? "turning about that point" : "the object is not there");
  }

  void press(int key) override {
    if (auto const command = model_command_of_key(key)) obey(*command);
  }

  void obey(Command command) {
    if (obey_common(command)) return;
    ModelLook& look = content_.look;
    change();
    switch (command) {
      case Command::reset:
        content_.turning = false;
        control_.reset();
        return;
      case Command::next_up:
        up_ = static_cast<UpAxis>((static_cast<int>(up_) + 1) % kUpAxes);
        control_ = OrbitControl(viewed_.center(), frame_about(viewed_, up_direction(up_)));
        return;
      case Command::toggle_lines:
        look.lines = !look.lines;
        return;
      case Command::add_camera:
        add_camera();
        return;
      default:
        break;
    }
    if (!content_.has_visibility) {
      say("nothing is known about what can be seen: scanview view MODEL --visibility FILE");
      return;
    }
    switch (command) {
      case Command::freeze_eye:
        if (frozen_) {
          frozen_.reset();
        } else {
          frozen_ = choosing_eye();
        }
        say(frozen_ ? "frozen: what is drawn stays what this eye can see" : "what is drawn follows the eye");
        return;
      case Command::toggle_visibility:
        look.visibility = !look.visibility;
        return;
      case Command::toggle_facing:
        look.facing = !look.facing;
        return;
      case Command::toggle_culled:
        look.culled = !look.culled;
        return;
      default:
        return;
    }
  }

  void add_camera() {
    if (viewport_.width < 1) return;  // before the first picture
    auto const& eye = control_.current();
    cameras_.add({fit_camera(eye.camera, viewport_.width, viewport_.height), eye.object_from_camera, ""});
    // A full disk must not end the session.
    try {
      if (camera_file_.empty()) {
        cameras_.save(options_.pictures);
      } else {
        cameras_.save_as(camera_file_);
      }
      say(fmt::format("{} cameras in {}", cameras_.size(), cameras_.file().string()));
    } catch (Error const& error) {
      say(error.what());
    }
  }

  ViewedModel viewed_;
  UpAxis up_;
  OrbitControl control_;
  Keyframes cameras_;
  std::filesystem::path camera_file_;
  ModelPanelContent content_;
  std::optional<Eigen::Vector3d> frozen_;
  std::vector<double> selects_, culling_rates_;  ///< of the frames that are measured
};

}  // namespace

Eigen::Vector3d up_direction(UpAxis axis) {
  int const index = static_cast<int>(axis);
  return (index < 3 ? 1.0 : -1.0) * Eigen::Vector3d::Unit(index % 3);
}

ModelWindowResult view_model(PolygonModel model, std::optional<VisibilityField> field,
                             ModelWindowOptions const& options, Context& context) {
  options.validate();
  return ModelWindow(std::move(model), std::move(field), options, context).show();
}

}  // namespace scanview
