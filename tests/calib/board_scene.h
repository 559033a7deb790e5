#pragma once
#include <cmath>
#include <functional>
#include <numbers>
#include <opencv2/imgproc.hpp>
#include <vector>

#include "base/random.h"
#include "calib/calibrate.h"

namespace scanview {

/// Two cameras of 640 × 480 with lenses, 8 degrees turned towards each other.
inline StereoRig true_rig() {
  StereoRig rig;
  rig.left = {Camera::perspective(640, 480, 610, 612, 322, 236), {-0.22, 0.08, 0.0008, -0.0005, -0.01}};
  rig.right = {Camera::perspective(640, 480, 603, 604, 315, 244), {-0.25, 0.11, -0.0004, 0.0007, -0.02}};
  rig.right_from_left.linear() =
      Eigen::AngleAxisd(-0.14, Eigen::Vector3d(0.05, 1, 0.02).normalized()).toRotationMatrix();
  rig.right_from_left.translation() = Eigen::Vector3d(-90, 1.5, 6);
  return rig;
}

inline BoardDescription chessboard() { return parse_board("9x6", 25, 0, ""); }

/// A board before the left camera, somewhere in both pictures, tilted by up to `tilt` radians about each axis.
inline Eigen::Isometry3d random_pose(CounterRandom& random, double tilt) {
  auto const symmetric = [&] { return 2 * random.uniform() - 1; };
  Eigen::Isometry3d pose = Eigen::Isometry3d::Identity();
  pose.linear() = (Eigen::AngleAxisd(0.5 * symmetric(), Eigen::Vector3d::UnitZ()) *
                   Eigen::AngleAxisd(tilt * symmetric(), Eigen::Vector3d::UnitX()) *
                   Eigen::AngleAxisd(tilt * symmetric(), Eigen::Vector3d::UnitY()))
                      .toRotationMatrix();
  // The middle of the board: in a cone that both cameras see.
  double const depth = 330 + 170 * random.uniform();
  Eigen::Vector3d const middle(depth * (0.1 + 0.2 * symmetric()), depth * 0.2 * symmetric(), depth);
  pose.translation() = middle - pose.linear() * Eigen::Vector3d(100, 62.5, 0);
  return pose;
}

/// Whether the whole board, with a white rim, is in the picture: what the detectors ask for.
inline bool is_in_picture(LensCamera const& camera, BoardDescription const& board,
                          Eigen::Isometry3d const& camera_from_board) {
  for (double const u : {-2.0, board.columns + 1.0})
    for (double const v : {-2.0, board.rows + 1.0}) {
      Eigen::Vector3d const corner(u * board.square, v * board.square, 0);
      if (!camera.camera.contains(camera.project(camera_from_board * corner))) return false;
    }
  return true;
}

/// Corners of a board as a camera sees them, with normal noise; corners outside of the picture are left out.
inline std::vector<BoardCorner> see(LensCamera const& camera, Eigen::Isometry3d const& camera_from_board,
                                    BoardDescription const& board, double noise_px, CounterRandom& random) {
  std::vector<BoardCorner> corners;
  for (int id = 0; id < board.corner_count(); ++id) {
    Eigen::Vector2d const p = board.corner(id);
    Eigen::Vector2d pixel = camera.project(camera_from_board * Eigen::Vector3d(p.x(), p.y(), 0));
    if (!camera.camera.contains(pixel)) continue;
    pixel += noise_px * Eigen::Vector2d(random.normal(), random.normal());
    corners.push_back({id, pixel, noise_px});
  }
  return corners;
}

struct BoardScene {
  StereoRig rig = true_rig();
  std::vector<Eigen::Isometry3d> poses;
  std::vector<BoardView> views;
  CalibrateOptions options;
};

inline BoardScene board_scene(std::uint64_t seed, int boards = 12, double tilt = 0.6, double noise_px = 0.08) {
  BoardScene scene;
  scene.options.board = chessboard();
  scene.options.left_size = scene.options.right_size = {640, 480};
  for (int i = 0; i < boards; ++i) {
    CounterRandom random(seed, static_cast<std::uint64_t>(i));
    scene.poses.push_back(random_pose(random, tilt));
    BoardView view;
    view.name = "board" + std::to_string(i);
    view.left = see(scene.rig.left, scene.poses.back(), scene.options.board, noise_px, random);
    view.right =
        see(scene.rig.right, scene.rig.right_from_left * scene.poses.back(), scene.options.board, noise_px, random);
    scene.views.push_back(std::move(view));
  }
  return scene;
}

struct PictureNoise {
  double blur_px = 0.8, sigma = 2;  ///< of the lens; of each value, 8 bits
};

/// A picture of what `shade` (0 to 1) gives on the board's plane: 7 × 7 rays a pixel, blur, noise, 8 bits.
inline cv::Mat1b render_board(LensCamera const& camera, Eigen::Isometry3d const& camera_from_board,
                              std::function<double(Eigen::Vector2d const&)> const& shade, PictureNoise const& noise,
                              std::uint64_t seed) {
  constexpr int kRays = 7;
  cv::Mat1f picture(camera.camera.height(), camera.camera.width());
  Eigen::Isometry3d const board_from_camera = camera_from_board.inverse();
  Eigen::Vector3d const eye = board_from_camera.translation();
  for (int y = 0; y < picture.rows; ++y)
    for (int x = 0; x < picture.cols; ++x) {
      // The lens is smooth: one inverse a pixel, and its slope from neighbours.
      Eigen::Vector3d const ray = camera.ray({x, y});
      Eigen::Vector3d const right = camera.ray({x + 0.5, y}) - ray, down = camera.ray({x, y + 0.5}) - ray;
      double sum = 0;
      for (int v = 0; v < kRays; ++v)
        for (int u = 0; u < kRays; ++u) {
          double const du = 2 * ((u + 0.5) / kRays - 0.5), dv = 2 * ((v + 0.5) / kRays - 0.5);
          Eigen::Vector3d const d = board_from_camera.linear() * (ray + du * right + dv * down);
          Eigen::Vector3d const p = eye - eye.z() / d.z() * d;
          sum += shade(p.head<2>());
        }
      picture(y, x) = static_cast<float>(40 + 170 * sum / (kRays * kRays));
    }
  if (noise.blur_px > 0) cv::GaussianBlur(picture, picture, {}, noise.blur_px);
  cv::Mat1b result(picture.size());
  for (int y = 0; y < picture.rows; ++y) {
    CounterRandom random(seed, static_cast<std::uint64_t>(y));
    for (int x = 0; x < picture.cols; ++x)
      result(y, x) = cv::saturate_cast<uchar>(static_cast<double>(picture(y, x)) + noise.sigma * random.normal());
  }
  return result;
}

/// Dark outside corner 0, white around the board.
inline double chessboard_shade(BoardDescription const& board, Eigen::Vector2d const& p) {
  double const u = p.x() / board.square + 1, v = p.y() / board.square + 1;
  if (u < 0 || v < 0 || u >= board.columns + 1 || v >= board.rows + 1) return 1;
  return (static_cast<int>(u) + static_cast<int>(v)) % 2 == 0 ? 0 : 1;
}

}  // namespace scanview
