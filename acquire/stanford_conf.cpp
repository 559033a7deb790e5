#include "acquire/stanford_conf.h"

#include <fmt/format.h>

#include <cmath>
#include <sstream>

#include "base/error.h"
#include "base/files.h"

namespace scanview {

std::vector<StanfordScan> parse_stanford_conf(std::string const& text, std::filesystem::path const& name_in_errors) {
  std::vector<StanfordScan> scans;
  std::istringstream lines(text);
  for (std::string line; std::getline(lines, line);) {
    std::istringstream words(line);
    std::string kind, file;
    if (!(words >> kind) || kind != "bmesh") continue;
    double x, y, z, qx, qy, qz, qw;
    if (!(words >> file >> x >> y >> z >> qx >> qy >> qz >> qw))
      throw Error(ErrorCode::bad_input, name_in_errors, fmt::format("cannot read the line '{}'", line));
    Eigen::Quaterniond const q(qw, qx, qy, qz);
    Eigen::Vector3d const t(x, y, z);
    if (!t.allFinite() || !(std::abs(q.norm() - 1) < 0.01))
      throw Error(ErrorCode::bad_input, name_in_errors, fmt::format("the pose of {} is no rigid motion", file));
    scans.push_back({file, Eigen::Isometry3d(Eigen::Translation3d(t) * q.normalized().conjugate())});
  }
  if (scans.empty()) throw Error(ErrorCode::bad_input, name_in_errors, "has no bmesh line");
  return scans;
}

std::vector<StanfordScan> read_stanford_conf(std::filesystem::path const& path) {
  return parse_stanford_conf(read_file(path), path);
}

Eigen::Isometry3d scan_from_camera() {
  Eigen::Isometry3d pose = Eigen::Isometry3d::Identity();
  pose.linear().diagonal() << 1, -1, -1;
  return pose;
}

}  // namespace scanview
