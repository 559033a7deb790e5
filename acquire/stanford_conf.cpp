#include "acquire/stanford_conf.h"

#include <fmt/format.h>

#include <charconv>
#include <limits>
#include <sstream>

#include "base/error.h"
#include "calib/camera.h"

namespace scanview {

std::vector<ConfLine> parse_conf(std::string const& text, std::filesystem::path const& path) {
  constexpr double kNone = std::numeric_limits<double>::quiet_NaN();
  std::vector<ConfLine> lines;
  std::istringstream stream(text);
  for (std::string line; std::getline(stream, line);) {
    std::istringstream words(line);
    std::string word;
    if (!(words >> word) || word != "bmesh") continue;
    ConfLine entry;
    words >> entry.file;
    while (words >> word) {
      double value = kNone;
      auto const [end, problem] = std::from_chars(word.data(), word.data() + word.size(), value);
      entry.numbers.push_back(problem != std::errc() || end != word.data() + word.size() ? kNone : value);
    }
    lines.push_back(std::move(entry));
  }
  if (lines.empty()) throw Error(ErrorCode::bad_input, path, "no 'bmesh FILE tx ty tz qx qy qz qw' line");
  return lines;
}

Eigen::Isometry3d world_from_scan(ConfLine const& line, std::filesystem::path const& path) {
  auto const& n = line.numbers;
  if (n.size() != 7)
    throw Error(ErrorCode::bad_input, path,
                fmt::format("the line of {} has {} numbers instead of 7", line.file, n.size()));
  return pose_from_quaternion(Eigen::Quaterniond(n[6], n[3], n[4], n[5]).conjugate(), {n[0], n[1], n[2]}, path,
                              "the pose of " + line.file);
}

std::string format_conf_line(std::string const& file, Eigen::Isometry3d const& world_from_scan) {
  Eigen::Quaterniond const q = Eigen::Quaterniond(world_from_scan.linear()).normalized().conjugate();
  Eigen::Vector3d const& t = world_from_scan.translation();
  return fmt::format("bmesh {} {:.17g} {:.17g} {:.17g} {:.17g} {:.17g} {:.17g} {:.17g}\n", file, t.x(), t.y(), t.z(),
                     q.x(), q.y(), q.z(), q.w());
}

}  // namespace scanview
