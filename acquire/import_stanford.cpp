#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <map>
#include <memory>

#include "acquire/archive.h"
#include "acquire/depth_resample.h"
#include "acquire/import_build.h"
#include "acquire/stanford_conf.h"
#include "base/error.h"
#include "base/ply.h"

namespace scanview {
namespace {

namespace fs = std::filesystem;

[[noreturn]] void fail(fs::path const& path, std::string const& message) {
  throw Error(ErrorCode::bad_input, path, message);
}

/// The scan's points in their grid, in scan coordinates: x right, y up, seen from +z. NaN where the grid is empty.
cv::Mat3d read_grid(PlyFile const& ply, fs::path const& path) {
  auto const header_number = [&](std::string const& key) -> long {
    for (auto const& line : ply.obj_info)
      if (line.starts_with(key + " ")) {
        long value = 0;
        auto const text = line.substr(key.size() + 1);
        auto const [end, problem] = std::from_chars(text.data(), text.data() + text.size(), value);
        if (problem == std::errc() && value > 0) return value;
      }
    fail(path, fmt::format("no positive 'obj_info {}'", key));
  };
  PlyElement const* const vertex = ply.find("vertex");
  PlyElement const* const grid = ply.find("range_grid");
  if (vertex == nullptr || grid == nullptr) fail(path, "a range scan has elements 'vertex' and 'range_grid'");
  PlyProperty const *const x = vertex->find("x"), *const y = vertex->find("y"), *const z = vertex->find("z");
  PlyProperty const* const cells = grid->find("vertex_indices");
  if (x == nullptr || y == nullptr || z == nullptr || cells == nullptr || !cells->is_list)
    fail(path, "a vertex has x, y and z, a range_grid cell a list 'vertex_indices'");
  long const rows = header_number("num_rows"), cols = header_number("num_cols");
  if (rows > 32768 || cols > 32768 || static_cast<std::uint64_t>(rows) * static_cast<std::uint64_t>(cols) != grid->rows)
    fail(path,
         fmt::format("num_rows x num_cols is {} x {}, but there are {} range_grid cells", rows, cols, grid->rows));
  cv::Mat3d points(static_cast<int>(rows), static_cast<int>(cols), cv::Vec3d::all(std::nan("")));
  for (std::uint64_t cell = 0; cell < grid->rows; ++cell) {
    auto const first = cells->offsets[cell], last = cells->offsets[cell + 1];
    if (first == last) continue;
    double const index = cells->values[first];
    if (!(index >= 0) || index >= static_cast<double>(vertex->rows))
      fail(path, fmt::format("range_grid cell {} names vertex {} of {}", cell, index, vertex->rows));
    auto const i = static_cast<std::size_t>(index);
    cv::Vec3d const p(x->values[i], y->values[i], z->values[i]);
    if (!std::isfinite(p[0]) || !std::isfinite(p[1]) || !std::isfinite(p[2])) continue;
    points(static_cast<int>(cell / static_cast<std::uint64_t>(cols)),
           static_cast<int>(cell % static_cast<std::uint64_t>(cols))) = p;
  }
  return points;
}

/// Median distance of neighbours in the grid as the camera sees them: {in x between columns, in y between rows}.
std::array<double, 2> grid_spacing(cv::Mat3d const& points, fs::path const& path) {
  std::array<double, 2> spacing{};
  for (int direction = 0; direction < 2; ++direction) {
    std::vector<double> steps;
    for (int row = 0; row + direction < points.rows; ++row)
      for (int col = 0; col + 1 - direction < points.cols; ++col) {
        cv::Vec3d const d = points(row + direction, col + 1 - direction) - points(row, col);
        double const step = std::abs(d[direction]);
        if (std::isfinite(step)) steps.push_back(step);
      }
    if (steps.size() < 10) fail(path, "fewer than 10 neighbours in the range grid");
    std::nth_element(steps.begin(), steps.begin() + static_cast<std::ptrdiff_t>(steps.size() / 2), steps.end());
    spacing[static_cast<std::size_t>(direction)] = steps[steps.size() / 2];
    if (!(spacing[static_cast<std::size_t>(direction)] > 0)) fail(path, "the range grid's points coincide");
  }
  return spacing;
}

/// The PLY without header lines that are none of the format's: some of the Stanford scans hold stray words there.
std::string clean_header(std::string const& bytes) {
  constexpr std::array known{"ply", "format", "comment", "obj_info", "element", "property", "end_header"};
  std::string clean;
  for (std::size_t at = 0; at < bytes.size();) {
    std::size_t const end = std::min(bytes.find('\n', at), bytes.size() - 1) + 1;
    std::string const line = bytes.substr(at, end - at);
    std::string const word = line.substr(0, line.find_first_of(" \r\n"));
    if (std::find(known.begin(), known.end(), word) != known.end()) clean += line;
    at = end;
    if (word == "end_header") return clean + bytes.substr(at);
  }
  return bytes;  // no header at all: for the reader to say
}

/// How far in front of a scan's points its orthographic camera stands, in diagonals of their box. Depths are then
/// positive, and the eye lies in the viewing direction as seen from the object.
constexpr double kStandOff = 4;

RawView load_scan(PlyFile const& ply, fs::path const& path) {
  cv::Mat3d points = read_grid(ply, path);
  auto const spacing = grid_spacing(points, path);
  cv::Vec3d low = cv::Vec3d::all(std::numeric_limits<double>::infinity()), high = -low;
  for (auto const& p : points)
    if (std::isfinite(p[0]))
      for (int axis = 0; axis < 3; ++axis)
        low[axis] = std::min(low[axis], p[axis]), high[axis] = std::max(high[axis], p[axis]);

  // The camera looks along -z of the scan with y up: half a turn about x from scan to camera axes.
  cv::Vec3d const middle = (low + high) / 2;
  double const stand_off = kStandOff * cv::norm(high - low);
  RawView raw;
  double const columns = std::ceil((high[0] - low[0]) / spacing[0]) + 3,
               rows = std::ceil((high[1] - low[1]) / spacing[1]) + 3;
  if (columns > 32768 || rows > 32768 || columns * rows > 64.0 * 1024 * 1024)
    fail(path, "the scan's extent is too large for the spacing of its points");
  // A pixel centre falls on the lowest corner, and so on every point of a grid that is regular.
  raw.camera = Camera::orthographic(static_cast<int>(columns), static_cast<int>(rows), spacing[0], spacing[1],
                                    1 + (middle[0] - low[0]) / spacing[0], 1 + (high[1] - middle[1]) / spacing[1]);
  raw.object_from_camera = Eigen::Translation3d(middle[0], middle[1], high[2] + stand_off) *
                           Eigen::AngleAxisd(std::acos(-1.0), Eigen::Vector3d::UnitX());
  raw.object_from_camera->linear() = Eigen::Vector3d(1, -1, -1).asDiagonal();  // exactly
  for (auto& p : points) p = {p[0] - middle[0], middle[1] - p[1], high[2] + stand_off - p[2]};
  double const noise = scanner_noise(spacing[0]).sigma(0);
  raw.depth = resample_depth(points, raw.camera, [&](Eigen::Vector3d const& a, Eigen::Vector3d const& b) {
    double const across = (a - b).head<2>().norm();
    return std::abs(a.z() - b.z()) <=
               largest_step(raw.camera, a.z(), noise, noise, std::max(1.0, across / spacing[0])) &&
           across <= 3 * std::max(spacing[0], spacing[1]);
  });
  return raw;
}

/// Where the files of a data set are: in a folder or unpacked from an archive.
struct Files {
  fs::path conf;  ///< for messages
  std::string conf_text;
  std::function<std::string(std::string const&)> read;  ///< a file that the conf names
  std::vector<fs::path> on_disk;                        ///< the conf or the archive
  std::function<fs::path(std::string const&)> path_of;  ///< for messages, and for hashes where `scattered`
  bool scattered = false;                               ///< the scans are files of their own
};

Files from_archive(fs::path const& path) {
  auto const members = std::make_shared<std::map<std::string, std::string>>(
      read_archive(path, [](std::string const& name) { return name.ends_with(".conf") || name.ends_with(".ply"); }));
  std::vector<std::string> confs;
  for (auto const& [name, bytes] : *members)
    if (name.ends_with(".conf")) confs.push_back(name);
  if (confs.empty()) fail(path, "the archive holds no .conf");
  if (confs.size() > 1)
    fail(path, fmt::format("the archive holds {} .conf files: unpack it and name one", confs.size()));
  std::string const folder = fs::path(confs.front()).parent_path().string();
  auto const member = [folder](std::string const& file) { return folder.empty() ? file : folder + "/" + file; };
  Files files;
  files.conf = path / confs.front();
  files.conf_text = members->at(confs.front());
  files.on_disk = {path};
  files.path_of = [path, member](std::string const& file) { return path / member(file); };
  files.read = [members, member, path](std::string const& file) {
    auto const found = members->find(member(file));
    if (found == members->end()) fail(path / member(file), "the archive has no such file");
    return found->second;
  };
  return files;
}

fs::path find_conf(fs::path const& path) {
  if (path.extension() == ".conf") return path;
  std::vector<fs::path> confs;
  std::error_code problem;
  for (fs::recursive_directory_iterator it(path, problem), end; !problem && it != end; it.increment(problem)) {
    if (it.depth() >= 2) it.disable_recursion_pending();
    if (it->is_regular_file() && it->path().extension() == ".conf") confs.push_back(it->path());
  }
  if (problem) throw Error(ErrorCode::io, path, problem.message());
  std::sort(confs.begin(), confs.end());
  if (confs.empty()) fail(path, fs::is_empty(path) ? "the folder is empty" : "no .conf file in the folder");
  if (confs.size() > 1)
    fail(path, fmt::format("{} .conf files, {} and {} among them: name one", confs.size(), confs[0].filename().string(),
                           confs[1].filename().string()));
  return confs.front();
}

Files from_disk(fs::path const& path) {
  Files files;
  files.conf = find_conf(path);
  files.conf_text = read_file(files.conf);
  files.on_disk = {files.conf};
  files.path_of = [folder = files.conf.parent_path()](std::string const& file) { return folder / file; };
  files.read = [path_of = files.path_of](std::string const& file) { return read_file(path_of(file)); };
  files.scattered = true;
  return files;
}

}  // namespace

ImportResult import_stanford(fs::path const& path, ImportOptions const& options, Context& context) {
  if (!fs::exists(path)) fail(path, "no such file or folder");
  bool const known = fs::is_directory(path) || path.extension() == ".conf" || is_archive(path);
  if (!known) fail(path, "neither a folder, nor a .conf, nor an archive");
  Files const files = fs::is_directory(path) || path.extension() == ".conf" ? from_disk(path) : from_archive(path);
  auto const lines = parse_conf(files.conf_text, files.conf);
  std::vector<std::string> names;
  for (auto const& line : lines) names.push_back(fs::path(line.file).stem().string());
  names = safe_view_names(names);

  BuildPlan plan;
  plan.path = path;
  plan.unit = Unit::m;
  std::vector<double> spacings(lines.size(), 0);
  for (std::size_t i = 0; i < lines.size(); ++i)
    plan.views.push_back({names[i], [&files, &line = lines[i], &spacing = spacings[i]] {
                            fs::path const file = files.path_of(line.file);
                            RawView raw = load_scan(parse_ply(clean_header(files.read(line.file)), file), file);
                            raw.object_from_camera = world_from_scan(line, files.conf) * *raw.object_from_camera;
                            spacing = 1 / raw.camera.fx();
                            return raw;
                          }});
  plan.noise = [&spacings](double) {
    std::vector<double> known_spacings;
    for (double const s : spacings)
      if (s > 0) known_spacings.push_back(s);
    std::sort(known_spacings.begin(), known_spacings.end());
    return scanner_noise(known_spacings[known_spacings.size() / 2]);
  };
  ImportResult result = build_import(plan, options, context);
  result.files_read = files.on_disk;
  if (files.scattered)
    for (std::size_t i = 0; i < lines.size(); i += static_cast<std::size_t>(options.step))
      if (fs::exists(files.path_of(lines[i].file))) result.files_read.push_back(files.path_of(lines[i].file));
  return result;
}

}  // namespace scanview
