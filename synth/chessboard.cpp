#include "synth/chessboard.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <numeric>
#include <opencv2/imgproc.hpp>

#include "base/parallel.h"
#include "base/random.h"

namespace scanview {
namespace {

using Eigen::AngleAxisd;
using Eigen::Isometry3d;
using Eigen::Vector2d;
using Eigen::Vector3d;

constexpr double kMargin = 0.8;  // white around the squares, squares
constexpr float kWhite = 0.80f, kBlack = 0.05f, kBehind = 0.22f;
constexpr double kMaxTilt = 40, kMaxRoll = 30;
constexpr double kLensBlur = 0.5;  // standard deviation, pixels
constexpr int kTries = 400;
constexpr int kEdgeSamples = 256;                   // in a pixel that an edge crosses
constexpr std::uint64_t kBoardItem = 0x626f617264;  // keys the boards' random numbers

double radians(double degrees) { return degrees * std::numbers::pi / 180; }

/// Evenly spread over the unit square (the R2 sequence of Roberts 2018), their mean in its centre.
std::array<Vector2d, kEdgeSamples> spread_samples() {
  constexpr double kPlastic = 1.32471795724474602596;
  std::array<Vector2d, kEdgeSamples> samples;
  for (int i = 0; i < kEdgeSamples; ++i) {
    double const a = 0.5 + (i + 1) / kPlastic, b = 0.5 + (i + 1) / (kPlastic * kPlastic);
    samples[i] = {a - std::floor(a), b - std::floor(b)};
  }
  Vector2d const mean = std::accumulate(samples.begin(), samples.end(), Vector2d(0, 0)) / kEdgeSamples;
  for (auto& sample : samples) sample -= mean;
  return samples;
}

/// All of the board with its margin is in the picture.
bool is_in_picture(LensCamera const& camera, Chessboard const& board, Isometry3d const& camera_from_board) {
  double const m = 1 + kMargin;
  for (auto const& [x, y] : {std::pair{-m, -m},
                             {board.columns - 1 + m, -m},
                             {-m, board.rows - 1 + m},
                             {board.columns - 1 + m, board.rows - 1 + m}}) {
    Vector3d const p = camera_from_board * (board.square * Vector3d(x, y, 0));
    if (!(p.z() > 0) || !camera.camera.contains(camera.project(p))) return false;
  }
  return true;
}

/// Where a camera's rays meet the board's plane.
class BoardPlane {
 public:
  BoardPlane(LensCamera const& camera, Isometry3d const& camera_from_board)
      : camera_(camera), board_from_camera_(camera_from_board.inverse()) {}
  Vector2d at(Vector2d const& pixel) const {
    Vector3d const origin = board_from_camera_.translation();
    Vector3d const ray = board_from_camera_.linear() * camera_.ray(pixel);
    return (origin - origin.z() / ray.z() * ray).head<2>();
  }

 private:
  LensCamera const& camera_;
  Isometry3d board_from_camera_;
};

}  // namespace

float Chessboard::reflectance(double x, double y) const {
  double const column = x / square + 1, row = y / square + 1;  // squares from the upper left outer corner
  if (column < -kMargin || row < -kMargin || column > columns + 1 + kMargin || row > rows + 1 + kMargin) return -1;
  if (column < 0 || row < 0 || column > columns + 1 || row > rows + 1) return kWhite;
  bool const dark = (static_cast<int>(std::floor(column)) + static_cast<int>(std::floor(row))) % 2 == 0;
  return dark ? kBlack : kWhite;
}

BoardPoses make_board_poses(StereoRig const& rig, double distance, int count, std::uint64_t seed) {
  BoardPoses result;
  Camera const& camera = rig.left.camera;
  double const across = distance * std::min(camera.width() / camera.fx(), 4.0 / 3 * camera.height() / camera.fy());
  result.board.square = std::max(0.1, std::round(10 * 0.5 * across / (result.board.columns + 1)) / 10);

  int const columns = std::max(1, static_cast<int>(std::ceil(std::sqrt(4.0 / 3 * count))));
  int const rows = std::max(1, (count + columns - 1) / columns);
  // Boards face the middle between the cameras.
  Vector3d const between = 0.5 * rig.right_from_left.inverse().translation();
  for (int i = 0; i < count; ++i) {
    CounterRandom random(seed, kBoardItem, static_cast<std::uint64_t>(i));
    auto const signed_uniform = [&] { return 2 * random.uniform() - 1; };
    for (int attempt = 0; attempt < kTries; ++attempt) {
      // The cells of a grid over the picture in turn; what does not fit moves towards the middle.
      double const out = 0.75 * (1 - static_cast<double>(attempt) / kTries);
      double const u = ((i % columns + 0.5 + 0.3 * signed_uniform()) / columns - 0.5) * out + 0.5;
      double const v = ((i / columns + 0.5 + 0.3 * signed_uniform()) / rows - 0.5) * out + 0.5;
      double const z = distance * (1 + 0.18 * signed_uniform());
      Vector3d const middle = z * rig.left.ray(Vector2d(u * camera.width(), v * camera.height()));
      double const axis = std::numbers::pi * signed_uniform(), tilt = radians(kMaxTilt) * std::sqrt(random.uniform());
      Vector3d const towards = (middle - between).normalized();
      Eigen::Quaterniond const facing = Eigen::Quaterniond::FromTwoVectors(Vector3d::UnitZ(), towards);
      Isometry3d const pose = Eigen::Translation3d(middle) * facing *
                              AngleAxisd(tilt, Vector3d(std::cos(axis), std::sin(axis), 0)) *
                              AngleAxisd(radians(kMaxRoll) * signed_uniform(), Vector3d::UnitZ()) *
                              Eigen::Translation3d(-result.board.center());
      if (!is_in_picture(rig.left, result.board, pose) ||
          !is_in_picture(rig.right, result.board, rig.right_from_left * pose))
        continue;
      result.left_from_board.push_back(pose);
      break;
    }
  }
  return result;
}

std::array<cv::Mat, 2> take_board(StereoRig const& rig, BoardPoses const& poses, std::size_t index,
                                  Sensor const& sensor, Context& context) {
  static auto const samples = spread_samples();
  Chessboard const& board = poses.board;
  std::array<cv::Mat, 2> pictures;
  for (int side = 0; side < 2; ++side) {
    LensCamera const& camera = side == 0 ? rig.left : rig.right;
    Isometry3d const pose = (side == 0 ? Isometry3d::Identity() : rig.right_from_left) * poses.left_from_board[index];
    BoardPlane const view(camera, pose);
    int const width = camera.camera.width(), height = camera.camera.height();
    cv::Mat1f picture(height, width);
    for_each_index(context, static_cast<std::size_t>(height), [&](std::size_t row) {
      int const y = static_cast<int>(row);
      for (int x = 0; x < width; ++x) {
        std::array<Vector2d, 4> const corners = {view.at({x - 0.5, y - 0.5}), view.at({x + 0.5, y - 0.5}),
                                                 view.at({x - 0.5, y + 0.5}), view.at({x + 0.5, y + 0.5})};
        auto const light_at = [&](Vector2d const& p) {
          float const reflected = board.reflectance(p.x(), p.y());
          // The lamp is not quite even: a tenth brighter on one side.
          return reflected < 0 ? kBehind
                               : reflected * static_cast<float>(1 + 0.1 * (p.x() - board.center().x()) /
                                                                        (board.square * board.columns));
        };
        // A pixel is smaller than a square, so an edge in it shows at its corners or where two edges cross.
        float sum = 0;
        std::array<float, 4> seen;
        for (int c = 0; c < 4; ++c) seen[c] = light_at(corners[c]);
        auto const [least, most] = std::minmax_element(seen.begin(), seen.end());
        if (*most - *least < 0.02f) {
          sum = 0.25f * (seen[0] + seen[1] + seen[2] + seen[3]);
        } else {
          for (auto const& s : samples) {
            double const u = s.x() + 0.5, v = s.y() + 0.5;
            sum += light_at((1 - v) * ((1 - u) * corners[0] + u * corners[1]) +
                            v * ((1 - u) * corners[2] + u * corners[3])) /
                   kEdgeSamples;
          }
        }
        picture(y, x) = sum;
      }
    });
    cv::GaussianBlur(picture, picture, {7, 7}, kLensBlur, kLensBlur, cv::BORDER_REPLICATE);
    pictures[side].create(height, width, sensor.type());
    for (int y = 0; y < height; ++y)
      sensor.expose(picture[y], width,
                    CounterRandom(context.seed, kBoardItem + 1 + 2 * index + static_cast<std::size_t>(side),
                                  static_cast<std::uint64_t>(y)),
                    pictures[side].ptr(y));
  }
  return pictures;
}

}  // namespace scanview
