#include "acquire/trajectory.h"

#include <fmt/format.h>

#include "acquire/text_table.h"
#include "base/error.h"
#include "calib/camera.h"

namespace scanview {
namespace {

namespace fs = std::filesystem;

[[noreturn]] void fail(fs::path const& path, std::string const& message) {
  throw Error(ErrorCode::bad_input, path, message);
}

/// What `pose` gives, or what it throws as the entry's problem.
template <typename Pose>
TrajectoryPose judged(double time, Pose const& pose) {
  TrajectoryPose entry;
  entry.time = time;
  try {
    entry.world_from_camera = pose();
  } catch (Error const& error) {
    entry.problem = error.message();
  }
  return entry;
}

}  // namespace

std::vector<TrajectoryPose> read_tum_trajectory(fs::path const& path) {
  std::vector<TrajectoryPose> poses;
  for (auto const& [line, words] : read_text_table(path)) {
    if (words.size() < 8) fail(path, fmt::format("line {} is not 'time tx ty tz qx qy qz qw'", line));
    double v[8];
    for (std::size_t i = 0; i < 8; ++i) v[i] = text_number(words[i], path, line);
    if (!std::isfinite(v[0])) fail(path, fmt::format("line {}: the time is not finite", line));
    poses.push_back(judged(v[0], [&, line = line] {
      return pose_from_quaternion({v[7], v[4], v[5], v[6]}, {v[1], v[2], v[3]}, path,
                                  fmt::format("the pose of line {}", line));
    }));
  }
  return poses;
}

std::vector<TrajectoryPose> read_redwood_trajectory(fs::path const& path) {
  std::vector<TrajectoryPose> poses;
  auto const rows = read_text_table(path);
  for (std::size_t block = 0; block < rows.size(); block += 5) {
    std::size_t const first = rows[block].number;
    if (rows[block].words.size() != 3) fail(path, fmt::format("line {} is not three integers", first));
    if (rows.size() - block < 5) fail(path, fmt::format("ends within the pose of line {}", first));
    Eigen::Matrix4d matrix;
    for (Eigen::Index row = 0; row < 4; ++row) {
      auto const& [line, words] = rows[block + 1 + static_cast<std::size_t>(row)];
      if (words.size() != 4) fail(path, fmt::format("line {} is not 4 numbers", line));
      for (Eigen::Index col = 0; col < 4; ++col)
        matrix(row, col) = text_number(words[static_cast<std::size_t>(col)], path, line);
    }
    poses.push_back(judged(static_cast<double>(poses.size()),
                           [&] { return pose_from_matrix(matrix, path, fmt::format("the pose of line {}", first)); }));
  }
  return poses;
}

}  // namespace scanview
