#include "viewer/select/camera_path.h"

#include <fmt/format.h>

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <numbers>

#include "base/error.h"
#include "base/median.h"
#include "viewer/select/view_selection.h"

namespace scanview {
namespace {

using Eigen::Isometry3d;
using Eigen::Vector3d;

double angle_between(Vector3d const& a, Vector3d const& b) { return std::atan2(a.cross(b).norm(), a.dot(b)); }

std::vector<Vector3d> view_directions(ScanSet const& set) {
  std::vector<Vector3d> result;
  for (auto const& view : set.views) {
    result.push_back(direction_to_eye(view.image.camera, *view.object_from_camera, set.center));
  }
  return result;
}

/// The axis of the circle that the eyes' directions lie on, turned to the side of `up`; `up` where they lie on none.
Vector3d circle_axis(std::vector<Vector3d> const& directions, Vector3d const& up) {
  if (directions.size() < 3) return up;
  Vector3d mean = Vector3d::Zero();
  for (auto const& d : directions) mean += d / static_cast<double>(directions.size());
  Eigen::Matrix3d scatter = Eigen::Matrix3d::Zero();
  for (auto const& d : directions) scatter += (d - mean) * (d - mean).transpose();
  scatter /= static_cast<double>(directions.size());
  Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> const solver(scatter);
  Vector3d const variance = solver.eigenvalues();
  // Off the circle by a few degrees at most, and along it far enough that its plane is sure.
  if (std::sqrt(std::max(0.0, variance[0])) > 0.05 || std::sqrt(std::max(0.0, variance[1])) < 0.2) return up;
  Vector3d const axis = solver.eigenvectors().col(0);
  // A great circle seen edge-on by upright cameras; one that cameras see from above or below has no say here.
  if (std::abs(axis.dot(up)) < 0.5) return up;
  return axis.dot(up) < 0 ? Vector3d(-axis) : axis;
}

/// Rotates `direction` towards `other` by the share t of the angle between them.
Vector3d along_arc(Vector3d const& direction, Vector3d const& other, double t, Vector3d const& up) {
  Vector3d axis = direction.cross(other);
  // Antipodes: by way of the horizon.
  if (axis.norm() < 1e-9) axis = std::abs(direction.dot(up)) < 0.999 ? up : direction.unitOrthogonal();
  return Eigen::AngleAxisd(t * angle_between(direction, other), axis.normalized()) * direction;
}

/// Between two cameras that look at the centre: eye on the arc about it, orientation by slerp.
Isometry3d between_poses(Isometry3d const& a, Isometry3d const& b, double t, Vector3d const& center,
                         Vector3d const& up) {
  Vector3d const to_a = a.translation() - center, to_b = b.translation() - center;
  Isometry3d pose = Isometry3d::Identity();
  pose.linear() = Eigen::Quaterniond(a.linear()).slerp(t, Eigen::Quaterniond(b.linear())).toRotationMatrix();
  if (to_a.norm() > 0 && to_b.norm() > 0) {
    pose.translation() =
        center + ((1 - t) * to_a.norm() + t * to_b.norm()) * along_arc(to_a.normalized(), to_b.normalized(), t, up);
  } else {
    pose.translation() = (1 - t) * a.translation() + t * b.translation();
  }
  return pose;
}

Isometry3d between_straight(Isometry3d const& a, Isometry3d const& b, double t) {
  Isometry3d pose = Isometry3d::Identity();
  pose.linear() = Eigen::Quaterniond(a.linear()).slerp(t, Eigen::Quaterniond(b.linear())).toRotationMatrix();
  pose.translation() = (1 - t) * a.translation() + t * b.translation();
  return pose;
}

void check_size(int width, int height) {
  if (width < 1 || height < 1) throw Error(ErrorCode::usage, {}, "a picture needs at least one pixel");
}

}  // namespace

Camera fit_camera(Camera const& camera, int width, int height) {
  double const scale =
      std::min(static_cast<double>(width) / camera.width(), static_cast<double>(height) / camera.height());
  double const cx = (camera.cx() + 0.5) * scale - 0.5 + (width - scale * camera.width()) / 2;
  double const cy = (camera.cy() + 0.5) * scale - 0.5 + (height - scale * camera.height()) / 2;
  if (camera.is_perspective()) {
    return Camera::perspective(width, height, camera.fx() * scale, camera.fy() * scale, cx, cy);
  }
  return Camera::orthographic(width, height, 1 / (camera.fx() * scale), 1 / (camera.fy() * scale), cx, cy);
}

Isometry3d look_at(Vector3d const& eye, Vector3d const& target, Vector3d const& up) {
  Vector3d forward = target - eye;
  forward = forward.norm() > 0 ? Vector3d(forward.normalized()) : Vector3d::UnitZ();
  Vector3d right = forward.cross(up);
  right = right.norm() > 1e-9 * (up.norm() + 1e-300) ? Vector3d(right.normalized()) : forward.unitOrthogonal();
  Isometry3d pose = Isometry3d::Identity();
  pose.linear() << right, forward.cross(right), forward;
  pose.translation() = eye;
  return pose;
}

OrbitFrame orbit_frame(ScanSet const& set) { return orbit_frame(set, set.radius()); }

OrbitFrame orbit_frame(ScanSet const& set, double radius) {
  if (!set.has_poses()) throw Error(ErrorCode::bad_input, {}, "the set has views without a pose: register it first");
  auto const directions = view_directions(set);
  OrbitFrame frame;
  frame.up = Vector3d::Zero();
  std::vector<double> distances;
  for (auto const& view : set.views) {
    frame.up -= view.object_from_camera->linear().col(1);
    double const distance = (view.eye() - set.center).norm();
    if (view.image.camera.is_perspective() && distance > 0) distances.push_back(distance);
  }
  // Cameras that hang every way round have no up: the first one's then.
  if (frame.up.norm() < 0.1 * static_cast<double>(set.views.size())) {
    frame.up = -set.views.front().object_from_camera->linear().col(1);
  }
  frame.up = circle_axis(directions, frame.up.normalized());

  frame.radius = radius;
  if (!(frame.radius > 0)) frame.radius = distances.empty() ? 1 : 0.5 * median(distances);
  // Four radii away: nearly parallel, like the orthographic cameras it stands in for.
  frame.distance = distances.empty() ? 4 * frame.radius : median(distances);

  std::vector<double> heights;
  for (auto const& d : directions) heights.push_back(std::clamp(d.dot(frame.up), -1.0, 1.0));
  double const elevation = std::asin(median(heights));
  Vector3d horizontal = directions.front() - directions.front().dot(frame.up) * frame.up;
  horizontal = horizontal.norm() > 1e-6 ? Vector3d(horizontal.normalized()) : frame.up.unitOrthogonal();
  frame.start = std::cos(elevation) * horizontal + std::sin(elevation) * frame.up;
  return frame;
}

PathCamera framing_camera(ScanSet const& set, OrbitFrame const& frame, Vector3d const& direction, int width,
                          int height) {
  check_size(width, height);
  double const sine = 1.1 * frame.radius / frame.distance;
  double const half_angle = sine < 0.9 ? std::asin(sine) : std::numbers::pi / 6;
  double const focal = 0.5 * std::min(width, height) / std::tan(half_angle);
  return {Camera::perspective(width, height, focal, focal, 0.5 * (width - 1), 0.5 * (height - 1)),
          look_at(set.center + frame.distance * direction, set.center, frame.up),
          {}};
}

std::vector<PathCamera> orbit_path(ScanSet const& set, OrbitFrame const& frame, int count, int width, int height) {
  if (count < 1) throw Error(ErrorCode::usage, {}, "an orbit needs at least one frame");
  std::vector<PathCamera> path;
  for (int i = 0; i < count; ++i) {
    Eigen::AngleAxisd const turn(2 * std::numbers::pi * i / count, frame.up);
    path.push_back(framing_camera(set, frame, turn * frame.start, width, height));
    path.back().name = fmt::format("{:03}", i);
  }
  return path;
}

PathCamera camera_like(ScanSet const& set, std::string const& view_name, int width, int height) {
  check_size(width, height);
  for (auto const& view : set.views) {
    if (view.name != view_name) continue;
    if (!view.object_from_camera) throw Error(ErrorCode::bad_input, {}, "view " + view_name + " has no pose");
    return {fit_camera(view.image.camera, width, height), *view.object_from_camera, view_name};
  }
  throw Error(ErrorCode::usage, {}, "the set has no view named '" + view_name + "'");
}

std::vector<PathCamera> halfway_path(ScanSet const& set, OrbitFrame const& frame, int width, int height) {
  check_size(width, height);
  auto const directions = view_directions(set);
  std::size_t const count = directions.size();
  std::vector<std::pair<std::size_t, std::size_t>> gaps;
  std::vector<double> angles;
  for (std::size_t i = 0; i + 1 < count; ++i) {
    gaps.emplace_back(i, i + 1);
    angles.push_back(angle_between(directions[i], directions[i + 1]));
  }
  if (count > 2 && angle_between(directions.back(), directions.front()) <= 1.5 * median(angles)) {
    gaps.emplace_back(count - 1, 0);
  }
  std::vector<PathCamera> path;
  for (auto const& [a, b] : gaps) {
    View const& first = set.views[a];
    View const& second = set.views[b];
    if (first.image.camera.is_perspective() && second.image.camera.is_perspective()) {
      path.push_back({fit_camera(first.image.camera, width, height),
                      between_poses(*first.object_from_camera, *second.object_from_camera, 0.5, set.center, frame.up),
                      {}});
    } else {
      path.push_back(framing_camera(set, frame, along_arc(directions[a], directions[b], 0.5, frame.up), width, height));
    }
    path.back().name = first.name + "-" + second.name;
  }
  return path;
}

std::vector<PathCamera> path_through_views(ScanSet const& set, OrbitFrame const& frame, int count, int width,
                                           int height) {
  check_size(width, height);
  if (std::any_of(set.views.begin(), set.views.end(),
                  [](View const& view) { return !view.image.camera.is_perspective(); }))
    return orbit_path(set, frame, count, width, height);
  bool const around = frame.distance > frame.radius;
  std::vector<PathCamera> path;
  for (int i = 0; i < count; ++i) {
    double const at = count > 1 ? static_cast<double>(i) * static_cast<double>(set.views.size() - 1) / (count - 1) : 0;
    std::size_t const from = static_cast<std::size_t>(at), to = std::min(from + 1, set.views.size() - 1);
    double const t = at - static_cast<double>(from);
    Isometry3d const &a = *set.views[from].object_from_camera, &b = *set.views[to].object_from_camera;
    path.push_back({fit_camera(set.views[t < 0.5 ? from : to].image.camera, width, height),
                    around ? between_poses(a, b, t, set.center, frame.up) : between_straight(a, b, t),
                    fmt::format("{:03}", i)});
  }
  return path;
}

std::vector<PathCamera> read_camera_path(std::filesystem::path const& file, ScanSet const& set, OrbitFrame const& frame,
                                         int width, int height, PathMotion motion) {
  check_size(width, height);
  Json const json = read_json(file);
  auto const refuse = [&](std::string const& why) { throw Error(ErrorCode::bad_input, file, why); };
  if (!json.is_object()) refuse("a camera path is an object");
  int between = 1;
  for (auto const& [key, value] : json.items()) {
    if (key == "format") {
      if (value != 1) refuse("format is not 1");
    } else if (key == "between") {
      if (!value.is_number_integer() || value < 1 || value > 100000) refuse("between is no count from 1 to 100000");
      between = value.get<int>();
    } else if (key != "keyframes") {
      refuse("unknown key '" + key + "'");
    }
  }
  if (!json.contains("keyframes") || !json["keyframes"].is_array() || json["keyframes"].empty()) {
    refuse("keyframes is no list of cameras");
  }
  std::vector<PathCamera> keys;
  for (auto const& entry : json["keyframes"]) {
    std::string const what = fmt::format("keyframe {}", keys.size());
    if (!entry.is_object() || !entry.contains("object_from_camera")) refuse(what + " has no object_from_camera");
    for (auto const& [key, value] : entry.items()) {
      if (key != "camera" && key != "object_from_camera") refuse(what + ": unknown key '" + key + "'");
    }
    PathCamera key = framing_camera(set, frame, frame.start, width, height);
    if (entry.contains("camera")) key.camera = fit_camera(Camera::from_json(entry["camera"], file), width, height);
    key.object_from_camera = pose_from_json(entry["object_from_camera"], file, what);
    keys.push_back(std::move(key));
  }
  std::vector<PathCamera> path;
  for (std::size_t i = 0; i < keys.size(); ++i) {
    int const steps = i + 1 < keys.size() ? between : 1;
    for (int step = 0; step < steps; ++step) {
      PathCamera camera = keys[i];
      if (step > 0) {
        Eigen::Isometry3d const &from = keys[i].object_from_camera, &to = keys[i + 1].object_from_camera;
        double const t = static_cast<double>(step) / steps;
        camera.object_from_camera = motion == PathMotion::straight ? between_straight(from, to, t)
                                                                   : between_poses(from, to, t, set.center, frame.up);
      }
      camera.name = fmt::format("{:03}", path.size());
      path.push_back(std::move(camera));
    }
  }
  return path;
}

ReportSection render_section(std::vector<PathCamera> const& path, std::vector<Frame> const& frames) {
  // A dozen pictures of a longer path are enough to see it.
  std::size_t const shown = std::min<std::size_t>(frames.size(), 12);
  std::vector<std::string> figures;
  for (std::size_t i = 0; i < shown; ++i) {
    std::size_t const at = i * frames.size() / shown;
    cv::Mat3b picture(frames[at].color.size(), cv::Vec3b(255, 255, 255));
    for (int y = 0; y < picture.rows; ++y) {
      for (int x = 0; x < picture.cols; ++x) {
        auto const& pixel = frames[at].color(y, x);
        if (pixel[3] != 0) picture(y, x) = {pixel[0], pixel[1], pixel[2]};
      }
    }
    figures.push_back(html_jpeg(picture, path.at(at).name, 240));
  }
  return {"render", "From any side",
          fmt::format("<p>{} of {} frames, each blended from the views around the eye.</p>", shown, frames.size()) +
              html_row(figures)};
}

}  // namespace scanview
