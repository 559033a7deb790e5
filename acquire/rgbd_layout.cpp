#include "acquire/rgbd_layout.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <utility>

#include "acquire/text_table.h"
#include "acquire/trajectory.h"
#include "base/error.h"
#include "base/image_file.h"

namespace scanview {
namespace {

namespace fs = std::filesystem;

[[noreturn]] void fail(fs::path const& path, std::string const& message) {
  throw Error(ErrorCode::bad_input, path, message);
}

std::vector<fs::path> sorted_files(fs::path const& folder) {
  std::vector<fs::path> files;
  std::error_code problem;
  for (fs::directory_iterator it(folder, problem), end; !problem && it != end; it.increment(problem))
    if (it->is_regular_file()) files.push_back(it->path());
  if (problem) throw Error(ErrorCode::io, folder, problem.message());
  std::sort(files.begin(), files.end());
  return files;
}

bool is_picture(fs::path const& path) {
  auto const ending = path.extension();
  return ending == ".png" || ending == ".jpg" || ending == ".jpeg" || ending == ".PNG" || ending == ".JPG";
}

double number(std::string const& word, fs::path const& path, std::size_t line) {
  double const value = text_number(word, path, line);
  if (!std::isfinite(value)) fail(path, fmt::format("line {}: '{}' is not finite", line, word));
  return value;
}

/// The problem of a pose with the file's name; empty where there is none.
std::string named(fs::path const& path, std::string const& problem) {
  return problem.empty() ? problem : fmt::format("{}: {}", path.string(), problem);
}

/// The size of the first of these pictures that can be read.
cv::Size picture_size(std::vector<RgbdFrame> const& frames, fs::path const& folder) {
  std::string first_problem;
  for (auto const& frame : frames) {
    try {
      return read_image(frame.color).size();
    } catch (Error const& error) {
      if (first_problem.empty()) first_problem = error.what();
    }
  }
  fail(folder, "no colour picture can be read: " + first_problem);
}

// ---- 7-Scenes

constexpr std::string_view kPrefix = "frame-";

RgbdSource read_seven_scenes(fs::path const& folder) {
  RgbdSource source;
  source.missing = {0, 65535};
  auto const files = sorted_files(folder);
  bool const posed = std::any_of(files.begin(), files.end(),
                                 [](fs::path const& file) { return file.filename().string().ends_with(".pose.txt"); });
  for (auto const& file : files) {
    std::string const name = file.filename().string();
    auto const at = name.find(".color.");
    if (!name.starts_with(kPrefix) || at == std::string::npos || !is_picture(file)) continue;
    std::string const stem = name.substr(0, at);
    RgbdFrame frame;
    frame.name = stem.substr(kPrefix.size());
    frame.color = file;
    frame.depth = folder / (stem + ".depth.png");
    if (posed) frame.pose_file = folder / (stem + ".pose.txt");
    source.frames.push_back(std::move(frame));
  }
  cv::Size const size = picture_size(source.frames, folder);
  fs::path const calibration = folder / "camera-intrinsics.txt";
  if (fs::exists(calibration)) {
    source.files.push_back(calibration);
    std::vector<double> k;
    for (auto const& [line, words] : read_text_table(calibration))
      for (auto const& word : words) k.push_back(number(word, calibration, line));
    if (k.size() < 9) fail(calibration, "intrinsics are 3 rows of 3 numbers");
    source.color.camera = Camera::perspective(size.width, size.height, k[0], k[4], k[2], k[5]);
  } else {
    if (size != cv::Size(640, 480)) fail(folder, "camera-intrinsics.txt is missing, and the pictures are not 640x480");
    source.color.camera = Camera::perspective(640, 480, 585, 585, 320, 240);
    source.warnings.push_back(folder.string() + ": no camera-intrinsics.txt; the Kinect's 585 585 320 240 are assumed");
  }
  return source;
}

// ---- TUM

struct Stamped {
  double time;
  fs::path file;
};

std::vector<Stamped> read_stamps(fs::path const& list) {
  std::vector<Stamped> stamps;
  for (auto const& [line, words] : read_text_table(list)) {
    if (words.size() < 2) fail(list, fmt::format("line {} is not 'time file'", line));
    stamps.push_back({number(words[0], list, line), list.parent_path() / words[1]});
  }
  std::stable_sort(stamps.begin(), stamps.end(), [](auto const& a, auto const& b) { return a.time < b.time; });
  return stamps;
}

constexpr double kLongestGap = 0.02;  // seconds; the TUM tools' own limit

/// Index of the entry nearest in time, or nothing within the gap. `entries` are sorted by time.
template <typename Entry>
std::optional<std::size_t> nearest_in_time(std::vector<Entry> const& entries, double time) {
  auto const after =
      std::lower_bound(entries.begin(), entries.end(), time, [](Entry const& e, double t) { return e.time < t; });
  std::optional<std::size_t> best;
  for (auto it = after == entries.begin() ? after : after - 1; it != entries.end() && it <= after; ++it)
    if (std::abs(it->time - time) <= kLongestGap &&
        (!best || std::abs(it->time - time) < std::abs(entries[*best].time - time)))
      best = static_cast<std::size_t>(it - entries.begin());
  return best;
}

LensCamera tum_intrinsics(fs::path const& folder, cv::Size size, std::vector<std::string>& warnings) {
  std::string const name = fs::absolute(folder).lexically_normal().string();
  auto const is = [&](char const* long_name, char const* short_name) {
    return name.find(long_name) != std::string::npos || name.find(short_name) != std::string::npos;
  };
  LensCamera result;
  std::string whose = "the Kinect's";
  double k[4] = {525.0, 525.0, 319.5, 239.5};
  auto const take = [&](std::string const& of, double fx, double fy, double cx, double cy, Lens lens) {
    whose = of, k[0] = fx, k[1] = fy, k[2] = cx, k[3] = cy, result.lens = lens;
  };
  if (is("freiburg1", "fr1"))
    take("freiburg1's", 517.3, 516.5, 318.6, 255.3, {0.2624, -0.9531, -0.0054, 0.0026, 1.1633});
  else if (is("freiburg2", "fr2"))
    take("freiburg2's", 520.9, 521.0, 325.1, 249.7, {0.2312, -0.7849, -0.0033, -0.0001, 0.9172});
  else if (is("freiburg3", "fr3"))
    take("freiburg3's", 535.4, 539.2, 320.1, 247.6, {});
  if (size != cv::Size(640, 480))
    fail(folder, "intrinsics are missing, and the pictures are not 640x480: write an rgbd.json");
  result.camera = Camera::perspective(size.width, size.height, k[0], k[1], k[2], k[3]);
  warnings.push_back(
      fmt::format("{}: no intrinsics; {} {} {} {} {} are assumed", folder.string(), whose, k[0], k[1], k[2], k[3]));
  return result;
}

RgbdSource read_tum(fs::path const& folder) {
  RgbdSource source;
  source.depth_unit = 1.0 / 5000;
  source.files = {folder / "rgb.txt", folder / "depth.txt"};
  auto const colors = read_stamps(folder / "rgb.txt");
  auto const depths = read_stamps(folder / "depth.txt");
  fs::path const trajectory = folder / "groundtruth.txt";
  std::optional<std::vector<TrajectoryPose>> poses;
  if (fs::exists(trajectory)) {
    source.files.push_back(trajectory);
    poses = read_tum_trajectory(trajectory);
    std::stable_sort(poses->begin(), poses->end(), [](auto const& a, auto const& b) { return a.time < b.time; });
  }
  std::size_t no_depth = 0, no_pose = 0;
  std::vector<bool> taken(depths.size(), false);
  for (std::size_t i = 0; i < colors.size(); ++i) {
    auto const depth = nearest_in_time(depths, colors[i].time);
    // A depth frame goes to one colour frame: to this one only if none later is nearer.
    bool const nearer_later =
        depth && i + 1 < colors.size() &&
        std::abs(colors[i + 1].time - depths[*depth].time) < std::abs(colors[i].time - depths[*depth].time);
    if (!depth || taken[*depth] || nearer_later) {
      ++no_depth;
      continue;
    }
    RgbdFrame frame;
    if (poses) {
      auto const pose = nearest_in_time(*poses, colors[i].time);
      if (!pose) {
        ++no_pose;
        continue;
      }
      frame.pose = (*poses)[*pose].world_from_camera;
      frame.problem = named(trajectory, (*poses)[*pose].problem);
    }
    taken[*depth] = true;
    frame.name = fmt::format("{:04d}", source.frames.size());
    frame.color = colors[i].file;
    frame.depth = depths[*depth].file;
    source.frames.push_back(std::move(frame));
  }
  if (source.frames.empty()) fail(folder, "no colour picture has a depth (and a pose) within 0.02 s");
  if (no_depth + no_pose > 0)
    source.warnings.push_back(fmt::format("{}: {} colour pictures have no depth of their own, {} no pose within 0.02 s",
                                          folder.string(), no_depth, no_pose));
  source.color = tum_intrinsics(folder, picture_size(source.frames, folder), source.warnings);
  return source;
}

// ---- Redwood, Open3D

std::optional<fs::path> redwood_color_folder(fs::path const& folder) {
  for (char const* name : {"color", "image", "rgb"})
    if (fs::is_directory(folder / name)) return folder / name;
  return std::nullopt;
}

std::vector<fs::path> pictures_in(fs::path const& folder) {
  auto files = sorted_files(folder);
  std::erase_if(files, [](fs::path const& file) { return !is_picture(file); });
  return files;
}

LensCamera read_open3d_intrinsics(fs::path const& path) {
  Json const json = read_json(path);
  auto const numbers = [&](char const* key, std::size_t count) {
    auto const found = json.find(key);
    std::vector<double> values;
    if (found != json.end() && found->is_number()) values.push_back(found->get<double>());
    if (found != json.end() && found->is_array())
      for (auto const& value : *found)
        if (value.is_number()) values.push_back(value.get<double>());
    if (values.size() != count) fail(path, fmt::format("'{}' is missing or not {} numbers", key, count));
    return values;
  };
  if (!json.is_object()) fail(path, "the file is no JSON object");
  auto const k = numbers("intrinsic_matrix", 9);  // column by column
  double const width = numbers("width", 1)[0], height = numbers("height", 1)[0];
  if (!(width >= 1 && width <= 32768 && height >= 1 && height <= 32768))
    fail(path, "'width' or 'height' is out of range");
  try {
    return {Camera::perspective(static_cast<int>(width), static_cast<int>(height), k[0], k[4], k[6], k[7]), {}};
  } catch (Error const& error) {
    fail(path, error.message());
  }
}

RgbdSource read_redwood(fs::path const& folder) {
  RgbdSource source;
  auto const colors = pictures_in(*redwood_color_folder(folder));
  auto const depths = pictures_in(folder / "depth");
  if (colors.empty()) fail(folder, "no colour pictures");
  if (colors.size() != depths.size())
    fail(folder, fmt::format("{} colour pictures but {} depth pictures", colors.size(), depths.size()));
  for (std::size_t i = 0; i < colors.size(); ++i) {
    RgbdFrame frame;
    frame.name = fmt::format("{:04d}", i);
    frame.color = colors[i];
    frame.depth = depths[i];
    source.frames.push_back(std::move(frame));
  }
  fs::path calibration;
  for (char const* name : {"camera_intrinsic.json", "intrinsic.json"})
    if (calibration.empty() && fs::exists(folder / name)) calibration = folder / name;
  if (calibration.empty()) fail(folder, "camera_intrinsic.json is missing");
  source.color = read_open3d_intrinsics(calibration);
  source.files.push_back(calibration);
  std::vector<fs::path> logs;
  for (auto const& file : sorted_files(folder))
    if (file.extension() == ".log") logs.push_back(file);
  if (logs.empty()) return source;
  auto const preferred = std::find(logs.begin(), logs.end(), folder / "trajectory.log");
  fs::path const log = preferred != logs.end() ? *preferred : logs.front();
  if (preferred == logs.end() && logs.size() > 1) fail(folder, "several .log files, none of them trajectory.log");
  auto const poses = read_redwood_trajectory(log);
  if (poses.size() != source.frames.size())
    fail(log, fmt::format("{} poses for {} pictures", poses.size(), source.frames.size()));
  source.files.push_back(log);
  for (std::size_t i = 0; i < poses.size(); ++i) {
    source.frames[i].pose = poses[i].world_from_camera;
    source.frames[i].problem = named(log, poses[i].problem);
  }
  return source;
}

}  // namespace

std::optional<std::string> recognise_rgbd_layout(fs::path const& folder) {
  if (!fs::is_directory(folder)) return std::nullopt;
  if (fs::exists(folder / "rgb.txt") && fs::exists(folder / "depth.txt")) return "TUM";
  for (auto const& file : sorted_files(folder)) {
    std::string const name = file.filename().string();
    if (name.starts_with(kPrefix) && name.find(".color.") != std::string::npos) return "7-Scenes";
  }
  if (fs::is_directory(folder / "depth") && redwood_color_folder(folder)) return "Redwood";
  return std::nullopt;
}

std::optional<RgbdSource> read_rgbd_layout(fs::path const& folder) {
  auto const layout = recognise_rgbd_layout(folder);
  if (!layout) return std::nullopt;
  if (*layout == "TUM") return read_tum(folder);
  if (*layout == "7-Scenes") return read_seven_scenes(folder);
  return read_redwood(folder);
}

}  // namespace scanview
