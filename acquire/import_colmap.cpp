#include <fmt/format.h>

#include <bit>
#include <charconv>
#include <cmath>
#include <cstring>
#include <map>

#include "acquire/import_build.h"
#include "acquire/rgbd_manifest.h"
#include "acquire/text_table.h"
#include "base/error.h"
#include "base/image_file.h"

namespace scanview {
namespace {

namespace fs = std::filesystem;

[[noreturn]] void fail(fs::path const& path, std::string const& message) {
  throw Error(ErrorCode::bad_input, path, message);
}

std::map<std::string, LensCamera> read_cameras(fs::path const& path) {
  std::map<std::string, LensCamera> cameras;
  for (auto const& [line, words] : read_text_lines(path)) {
    if (words.empty()) continue;
    if (words.size() < 5) fail(path, fmt::format("line {} is not 'id model width height parameters'", line));
    std::string const& model = words[1];
    std::vector<double> p;
    for (std::size_t i = 4; i < words.size(); ++i) p.push_back(text_number(words[i], path, line));
    static std::map<std::string, std::size_t> const counts{
        {"SIMPLE_PINHOLE", 3}, {"PINHOLE", 4}, {"SIMPLE_RADIAL", 4}, {"RADIAL", 5}, {"OPENCV", 8}};
    auto const known = counts.find(model);
    if (known == counts.end())
      fail(path,
           fmt::format("line {}: camera model '{}' is none of SIMPLE_PINHOLE, PINHOLE, SIMPLE_RADIAL, RADIAL, OPENCV",
                       line, model));
    if (p.size() != known->second)
      fail(path, fmt::format("line {}: {} has {} parameters, here are {}", line, model, known->second, p.size()));
    bool const two_focals = model == "PINHOLE" || model == "OPENCV";
    std::size_t const at = two_focals ? 2 : 1;
    LensCamera k;
    if (model == "SIMPLE_RADIAL") k.lens = {.k1 = p[3]};
    if (model == "RADIAL") k.lens = {.k1 = p[3], .k2 = p[4]};
    if (model == "OPENCV") k.lens = {.k1 = p[4], .k2 = p[5], .p1 = p[6], .p2 = p[7]};
    double const width = text_number(words[2], path, line), height = text_number(words[3], path, line);
    if (!(width >= 1 && width <= 32768 && height >= 1 && height <= 32768))
      fail(path, fmt::format("line {}: size out of range", line));
    try {
      // COLMAP's principal point counts from the picture's corner, ours from the centre of the first pixel.
      k.camera = Camera::perspective(static_cast<int>(width), static_cast<int>(height), p[0], two_focals ? p[1] : p[0],
                                     p[at] - 0.5, p[at + 1] - 0.5);
    } catch (Error const& error) {
      fail(path, fmt::format("line {}: {}", line, error.message()));
    }
    cameras[words[0]] = k;
  }
  if (cameras.empty()) fail(path, "no camera");
  return cameras;
}

struct Image {
  std::string name, camera;
  double q[4], t[3];  ///< camera_from_world, w first; checked by `pose`, so that a bad one costs one view
};

std::vector<Image> read_images(fs::path const& path) {
  std::vector<Image> images;
  bool points = false;  // every second line lists the image's points, and may be blank
  for (auto const& [line, words] : read_text_lines(path)) {
    if (points) {
      points = false;
      continue;
    }
    if (words.empty()) continue;
    if (words.size() < 10) fail(path, fmt::format("line {} is not 'id qw qx qy qz tx ty tz camera name'", line));
    Image image;
    for (std::size_t i = 0; i < 4; ++i) image.q[i] = text_number(words[1 + i], path, line);
    for (std::size_t i = 0; i < 3; ++i) image.t[i] = text_number(words[5 + i], path, line);
    image.camera = words[8];
    image.name = words[9];
    for (std::size_t i = 10; i < words.size(); ++i) image.name += " " + words[i];
    images.push_back(std::move(image));
    points = true;
  }
  if (images.empty()) fail(path, "no image");
  return images;
}

/// The views' names, in the order of the images.
std::vector<std::string> view_names(std::vector<Image> const& images) {
  std::vector<std::string> names;
  for (auto const& image : images) names.push_back(fs::path(image.name).replace_extension().string());
  return safe_view_names(names);
}

/// world_from_camera.
Eigen::Isometry3d pose(Image const& image, fs::path const& list) {
  return pose_from_quaternion({image.q[0], image.q[1], image.q[2], image.q[3]}, {image.t[0], image.t[1], image.t[2]},
                              list, "the pose of " + image.name)
      .inverse();
}

/// "width&height&channels&" and 32-bit little-endian floats, row by row; not positive where nothing is known.
cv::Mat1f read_depth_map(fs::path const& path) {
  static_assert(std::endian::native == std::endian::little);
  std::string const bytes = read_file(path);
  std::size_t at = 0;
  int size[3];
  for (int& value : size) {
    auto const [end, problem] = std::from_chars(bytes.data() + at, bytes.data() + bytes.size(), value);
    at = static_cast<std::size_t>(end - bytes.data());
    if (problem != std::errc() || at >= bytes.size() || bytes[at] != '&' || value < 1 || value > 32768)
      fail(path, "a depth map begins with 'width&height&1&'");
    ++at;
  }
  if (size[2] != 1) fail(path, "a depth map has one channel");
  std::size_t const pixels = static_cast<std::size_t>(size[0]) * static_cast<std::size_t>(size[1]);
  if (bytes.size() - at != 4 * pixels)
    fail(path, fmt::format("{}x{} depths promised, but there are {} bytes", size[0], size[1], bytes.size() - at));
  cv::Mat1f depth(size[1], size[0]);
  std::memcpy(depth.data, bytes.data() + at, 4 * pixels);
  for (float& z : depth)
    if (!(z > 0) || !std::isfinite(z)) z = kMissing;
  return depth;
}

/// The folders of a COLMAP workspace that matter.
struct Workspace {
  fs::path model, images, depths;
};

Workspace find_workspace(fs::path const& path) {
  if (!fs::is_directory(path)) fail(path, "no such folder");
  Workspace found;
  found.model = find_colmap_images(path).parent_path();
  if (found.model.empty() || !fs::exists(found.model / "cameras.txt"))
    fail(path, fs::is_empty(path) ? "the folder is empty"
                                  : "no text model (cameras.txt, images.txt) here, in sparse/ or in sparse/0/");
  found.images = path / "images";
  found.depths = path / "stereo" / "depth_maps";
  if (!fs::is_directory(found.depths)) fail(found.depths, "no depth maps: COLMAP's patch_match_stereo writes them");
  return found;
}

RawView load(Image const& image, Workspace const& workspace, fs::path const& depth_path,
             std::map<std::string, LensCamera> const& cameras) {
  fs::path const list = workspace.model / "images.txt";
  auto const k = cameras.find(image.camera);
  if (k == cameras.end())
    fail(list, fmt::format("image {} has camera {}, which is not there", image.name, image.camera));
  RawView raw;
  raw.object_from_camera = pose(image, list);
  raw.camera = k->second.camera;
  cv::Mat3b const color = read_color(workspace.images / image.name);
  cv::Mat1f const depth = read_depth_map(depth_path);
  cv::Size const size(raw.camera.width(), raw.camera.height());
  if (color.size() != size)
    fail(workspace.images / image.name,
         fmt::format("the picture is {}x{}, its camera {}x{}", color.cols, color.rows, size.width, size.height));
  if (depth.size() != size)
    fail(depth_path,
         fmt::format("the depth map is {}x{}, its camera {}x{}", depth.cols, depth.rows, size.width, size.height));
  raw.color = undistort_color(color, raw.camera, k->second.lens);
  raw.depth = undistort_depth(depth, raw.camera, k->second.lens);
  return raw;
}

}  // namespace

fs::path find_colmap_images(fs::path const& folder) {
  for (char const* model : {"sparse", "sparse/0", ".", "model"})
    if (fs::exists(folder / model / "images.txt")) return folder / model / "images.txt";
  return {};
}

ScanSet read_colmap_poses(fs::path const& path) {
  auto const images = read_images(path);
  auto const names = view_names(images);
  ScanSet set;
  set.unit = Unit::arbitrary;
  for (std::size_t i = 0; i < images.size(); ++i) {
    View view;
    view.name = names[i];
    view.object_from_camera = pose(images[i], path);
    set.views.push_back(std::move(view));
  }
  return set;
}

ImportResult import_colmap(fs::path const& path, ImportOptions const& options, Context& context) {
  Workspace const workspace = find_workspace(path);
  auto const cameras = read_cameras(workspace.model / "cameras.txt");
  auto const images = read_images(workspace.model / "images.txt");
  auto const names = view_names(images);
  std::vector<fs::path> depths;
  for (auto const& image : images) {
    // Filtered by consistency between views where it is there.
    fs::path const geometric = workspace.depths / (image.name + ".geometric.bin");
    depths.push_back(fs::exists(geometric) ? geometric : workspace.depths / (image.name + ".photometric.bin"));
  }
  BuildPlan plan;
  plan.path = path;
  plan.unit = Unit::arbitrary;
  plan.noise = [](double typical) { return sensor_noise(Unit::arbitrary, 0, typical); };
  for (std::size_t i = 0; i < images.size(); ++i)
    plan.views.push_back({names[i], [&, i] { return load(images[i], workspace, depths[i], cameras); }});
  ImportResult result = build_import(plan, options, context);
  result.files_read = {workspace.model / "cameras.txt", workspace.model / "images.txt"};
  for (std::size_t i = 0; i < images.size(); i += static_cast<std::size_t>(options.step)) {
    result.files_read.push_back(workspace.images / images[i].name);
    result.files_read.push_back(depths[i]);
  }
  std::erase_if(result.files_read, [](fs::path const& file) { return !fs::is_regular_file(file); });
  return result;
}

}  // namespace scanview
