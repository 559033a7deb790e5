// Our calibration beside OpenCV's calls on the same pictures in the same run: RMS, epipolar RMS under leave-one-out,
// seconds. bench_calibrate FOLDER [COLUMNSxROWS [SQUARE]]: FOLDER holds left*.jpg, right*.jpg (Debian's opencv-doc by
// default).
#include <fmt/format.h>

#include <chrono>
#include <cmath>
#include <iostream>
#include <opencv2/calib3d.hpp>
#include <opencv2/imgproc.hpp>

#include "base/error.h"
#include "base/image_file.h"
#include "calib/board_pictures.h"

namespace scanview {
namespace {

using Corners = std::vector<std::vector<cv::Point2f>>;

double seconds_since(std::chrono::steady_clock::time_point start) {
  return std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
}

// What OpenCV's samples do: the classic finder, then cornerSubPix with a window of 2 half + 1 pixels (0: none).
std::vector<cv::Point2f> classic_corners(cv::Mat const& gray, cv::Size size, int half) {
  std::vector<cv::Point2f> corners;
  if (!cv::findChessboardCorners(gray, size, corners, cv::CALIB_CB_ADAPTIVE_THRESH | cv::CALIB_CB_NORMALIZE_IMAGE))
    return {};
  if (half > 0)
    cv::cornerSubPix(gray, corners, {half, half}, {-1, -1},
                     {cv::TermCriteria::COUNT + cv::TermCriteria::EPS, 100, 1e-4});
  return corners;
}

std::vector<cv::Point2f> sector_corners(cv::Mat const& gray, cv::Size size) {
  std::vector<cv::Point2f> corners;
  if (!cv::findChessboardCornersSB(gray, size, corners, cv::CALIB_CB_EXHAUSTIVE | cv::CALIB_CB_ACCURACY)) return {};
  return corners;
}

struct OpenCvRig {
  StereoRig rig;
  double rms = 0;
};

OpenCvRig solve_opencv(Corners const& left, Corners const& right, std::vector<cv::Point3f> const& board,
                       cv::Size size) {
  std::vector<std::vector<cv::Point3f>> const boards(left.size(), board);
  cv::Mat m[2], d[2], r, t, e, f;
  std::vector<cv::Mat> rotations, translations;
  cv::calibrateCamera(boards, left, size, m[0], d[0], rotations, translations);
  cv::calibrateCamera(boards, right, size, m[1], d[1], rotations, translations);
  OpenCvRig result;
  result.rms =
      cv::stereoCalibrate(boards, left, right, m[0], d[0], m[1], d[1], size, r, t, e, f, cv::CALIB_USE_INTRINSIC_GUESS,
                          {cv::TermCriteria::COUNT + cv::TermCriteria::EPS, 100, 1e-6});
  for (int side = 0; side < 2; ++side) {
    LensCamera& camera = side == 0 ? result.rig.left : result.rig.right;
    cv::Mat1d const k = m[side], lens = d[side];
    camera.camera = Camera::perspective(size.width, size.height, k(0, 0), k(1, 1), k(0, 2), k(1, 2));
    camera.lens = {lens(0), lens(1), lens(2), lens(3), lens(4)};
  }
  for (int i = 0; i < 3; ++i) {
    for (int j = 0; j < 3; ++j) result.rig.right_from_left.linear()(i, j) = r.at<double>(i, j);
    result.rig.right_from_left.translation()[i] = t.at<double>(i);
  }
  return result;
}

// Each pair's corners judged by the rig of all other pairs, over the pairs that both finders found.
double hold_out_opencv(Corners const& left, Corners const& right, std::vector<cv::Point3f> const& board,
                       cv::Size size) {
  double sum = 0, count = 0;
  for (std::size_t out = 0; out < left.size(); ++out) {
    Corners l = left, r = right;
    l.erase(l.begin() + static_cast<std::ptrdiff_t>(out));
    r.erase(r.begin() + static_cast<std::ptrdiff_t>(out));
    StereoRig const rig = solve_opencv(l, r, board, size).rig;
    for (std::size_t k = 0; k < left[out].size(); ++k) {
      auto const at = [](cv::Point2f const& p) {
        return Eigen::Vector2d(static_cast<double>(p.x), static_cast<double>(p.y));
      };
      double const distance = epipolar_distance(rig, at(left[out][k]), at(right[out][k]));
      sum += distance * distance;
      count += 1;
    }
  }
  return std::sqrt(sum / count);
}

void print(std::string const& name, std::size_t pairs, double rms, double hold_out, double baseline, double seconds) {
  std::cout << fmt::format("{:<44}{:>6}{:>10.4f}{:>12.4f}{:>12.4f}{:>10.2f}\n", name, pairs, rms, hold_out, baseline,
                           seconds);
}

int run(int argc, char** argv) {
  std::string const folder = argc > 1 ? argv[1] : "/usr/share/doc/opencv-doc/examples/data";
  BoardDescription const board = parse_board(argc > 2 ? argv[2] : "9x6", argc > 3 ? std::stod(argv[3]) : 25.0, 0, "");
  auto const pairs =
      pair_pictures(find_pictures({folder + "/left*.jpg"}), find_pictures({folder + "/right*.jpg"})).pairs;
  std::vector<cv::Point3f> points;
  for (int id = 0; id < board.corner_count(); ++id)
    points.emplace_back(static_cast<float>(board.corner(id).x()), static_cast<float>(board.corner(id).y()), 0.0F);
  std::vector<cv::Mat> pictures[2];
  for (PicturePair const& pair : pairs) {
    if (pair.left.empty() || pair.right.empty()) continue;
    for (int side = 0; side < 2; ++side) {
      cv::Mat gray;
      cv::cvtColor(read_color(side == 0 ? pair.left : pair.right), gray, cv::COLOR_BGR2GRAY);
      pictures[side].push_back(gray);
    }
  }
  if (pictures[0].empty()) throw Error(ErrorCode::bad_input, folder, "no pairs of pictures there");
  cv::Size const size = pictures[0].front().size(), count(board.columns, board.rows);
  std::cout << fmt::format("{:<44}{:>6}{:>10}{:>12}{:>12}{:>10}\n", "", "pairs", "RMS px", "held out px", "baseline",
                           "seconds");
  struct Method {
    std::string name;
    int half;  // of cornerSubPix; -1: sector corners
  };
  for (Method const& method : std::vector<Method>{{"OpenCV, classic corners as found", 0},
                                                  {"OpenCV, classic, cornerSubPix 11 (its sample)", 11},
                                                  {"OpenCV, classic, cornerSubPix 5", 5},
                                                  {"OpenCV, sector corners", -1}}) {
    auto const start = std::chrono::steady_clock::now();
    Corners left, right;
    for (std::size_t i = 0; i < pictures[0].size(); ++i) {
      auto const find = [&](cv::Mat const& gray) {
        return method.half < 0 ? sector_corners(gray, count) : classic_corners(gray, count, method.half);
      };
      auto l = find(pictures[0][i]), r = find(pictures[1][i]);
      if (l.empty() || r.empty()) continue;
      left.push_back(std::move(l));
      right.push_back(std::move(r));
    }
    if (left.size() < 4) continue;
    OpenCvRig const solved = solve_opencv(left, right, points, size);
    double const seconds = seconds_since(start);
    print(method.name, left.size(), solved.rms, hold_out_opencv(left, right, points, size), solved.rig.baseline(),
          seconds);
  }
  Context context;
  auto const start = std::chrono::steady_clock::now();
  BoardPictures const found = detect_boards(pairs, board, context);
  CalibrateOptions options;
  options.board = found.board;
  options.left_size = found.left_size;
  options.right_size = found.right_size;
  calibrate(found.views, options, context);
  double const seconds = seconds_since(start);
  options.holdout = CalibrateOptions::Holdout::on;
  Calibration const ours = calibrate(found.views, options, context);
  print("scanview calibrate", ours.boards_used(), ours.rms_px, ours.holdout_epipolar_rms_px, ours.rig.baseline(),
        seconds);
  return 0;
}

}  // namespace
}  // namespace scanview

int main(int argc, char** argv) {
  try {
    return scanview::run(argc, argv);
  } catch (scanview::Error const& error) {
    std::cerr << "bench_calibrate: " << error.what() << '\n';
    return static_cast<int>(error.code());
  }
}
