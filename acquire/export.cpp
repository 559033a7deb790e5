// Formats: PLY (Turk 1994); COLMAP, "Output format" and scripts/python/read_write_dense.py; nerfstudio, "Data
// conventions".
#include "acquire/export.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstring>
#include <vector>

#include "base/error.h"
#include "base/files.h"
#include "base/image_file.h"
#include "base/parallel.h"
#include "base/ply.h"
#include "base/srgb.h"

namespace scanview {
namespace {

namespace fs = std::filesystem;

constexpr double kColmapPoints = 50'000;
static_assert(std::endian::native == std::endian::little, "COLMAP's depth maps are written as they lie in memory");

void require_exportable(fs::path const& path, ScanSet const& set) {
  require_poses(path, set);
  for (View const& view : set.views)
    if (view.image.color.empty())
      throw Error(ErrorCode::bad_input, path, "cannot export view " + view.name + ": it has no colour");
}

void require_perspective(fs::path const& path, ScanSet const& set, std::string const& format) {
  for (View const& view : set.views)
    if (!view.image.camera.is_perspective())
      throw Error(ErrorCode::bad_input, path,
                  "cannot export view " + view.name + ": its camera is orthographic, and " + format +
                      " has perspective cameras only");
}

/// An earlier export may be replaced; a folder that holds anything else may not.
void require_replaceable(fs::path const& folder, char const* marker) {
  std::error_code error;
  if (!fs::exists(folder, error) || fs::exists(folder / marker, error) || fs::is_empty(folder, error)) return;
  throw Error(ErrorCode::bad_input, folder,
              fmt::format("is there already and is no earlier export (it has no {}): choose another folder", marker));
}

void make_folder(fs::path const& folder) {
  std::error_code error;
  fs::create_directories(folder, error);
  if (error) throw Error(ErrorCode::io, folder, "cannot create: " + error.message());
}

/// The view's picture with its gain.
cv::Mat3b gained_color(View const& view) {
  cv::Mat3b color = view.image.color.clone();
  if (view.gain == Eigen::Vector3d::Ones()) return color;
  std::array<std::array<uchar, 256>, 3> table;
  for (int c = 0; c < 3; ++c)
    for (int i = 0; i < 256; ++i)
      table[c][i] = cv::saturate_cast<uchar>(
          255 * srgb_from_linear(std::clamp(view.gain[2 - c] * linear_from_srgb(i / 255.0), 0.0, 1.0)));
  for (cv::Vec3b& bgr : color)
    for (int c = 0; c < 3; ++c) bgr[c] = table[c][bgr[c]];
  return color;
}

void append(std::string& bytes, double number) { fmt::format_to(std::back_inserter(bytes), " {:.17g}", number); }

/// Cameras without doubles, in order of appearance, and which one each view has.
struct Cameras {
  std::vector<Camera> distinct;
  std::vector<std::size_t> of_view;
};

Cameras distinct_cameras(ScanSet const& set) {
  Cameras cameras;
  for (View const& view : set.views) {
    auto const at = std::find(cameras.distinct.begin(), cameras.distinct.end(), view.image.camera);
    cameras.of_view.push_back(static_cast<std::size_t>(at - cameras.distinct.begin()));
    if (at == cameras.distinct.end()) cameras.distinct.push_back(view.image.camera);
  }
  return cameras;
}

std::string colmap_cameras(Cameras const& cameras) {
  std::string text = "# CAMERA_ID, MODEL, WIDTH, HEIGHT, FX, FY, CX, CY\n";
  for (std::size_t i = 0; i < cameras.distinct.size(); ++i) {
    Camera const& camera = cameras.distinct[i];
    text += fmt::format("{} PINHOLE {} {}", i + 1, camera.width(), camera.height());
    for (double number : {camera.fx(), camera.fy(), camera.cx() + 0.5, camera.cy() + 0.5}) append(text, number);
    text += "\n";
  }
  return text;
}

/// images.txt and points3D.txt, which refer to each other.
struct ColmapModel {
  std::string images, points;
};

ColmapModel colmap_model(ScanSet const& set, Cameras const& cameras) {
  std::size_t total = 0;
  for (View const& view : set.views) total += view.image.count_depths();
  int const step = std::max(1, static_cast<int>(std::ceil(std::sqrt(static_cast<double>(total) / kColmapPoints))));
  ColmapModel model;
  model.images = "# IMAGE_ID, QW, QX, QY, QZ, TX, TY, TZ, CAMERA_ID, NAME\n# X, Y, POINT3D_ID ...\n";
  model.points = "# POINT3D_ID, X, Y, Z, R, G, B, ERROR, IMAGE_ID, POINT2D_IDX\n";
  std::size_t point_id = 0;
  for (std::size_t v = 0; v < set.views.size(); ++v) {
    View const& view = set.views[v];
    Eigen::Isometry3d const camera_from_object = view.object_from_camera->inverse();
    Eigen::Quaterniond q(camera_from_object.linear());
    q.normalize();
    if (q.w() < 0) q.coeffs() *= -1;
    Eigen::Vector3d const& t = camera_from_object.translation();
    model.images += std::to_string(v + 1);
    for (double number : {q.w(), q.x(), q.y(), q.z(), t.x(), t.y(), t.z()}) append(model.images, number);
    model.images += fmt::format(" {} {}.png\n", cameras.of_view[v] + 1, view.name);
    cv::Mat3b const color = gained_color(view);
    std::size_t observations = 0;
    for (int y = step / 2; y < view.image.depth.rows; y += step)
      for (int x = step / 2; x < view.image.depth.cols; x += step) {
        if (!view.image.has_depth(x, y)) continue;
        ++point_id;
        Eigen::Vector3d const p = *view.object_from_camera * view.image.point(x, y);
        cv::Vec3b const& bgr = color(y, x);
        model.images += fmt::format("{}{} {} {}", observations == 0 ? "" : " ", x + 0.5, y + 0.5, point_id);
        model.points += std::to_string(point_id);
        for (double number : {p.x(), p.y(), p.z()}) append(model.points, number);
        model.points += fmt::format(" {} {} {} 0 {} {}\n", bgr[2], bgr[1], bgr[0], v + 1, observations++);
      }
    model.images += "\n";
  }
  return model;
}

/// COLMAP's Mat<float>: "width&height&channels&" and the values, row by row; 0 is missing.
std::string colmap_depth_map(RangeImage const& image) {
  cv::Mat1f depth = image.depth.clone();
  for (float& z : depth)
    if (!std::isfinite(z)) z = 0;
  std::string bytes = fmt::format("{}&{}&1&", depth.cols, depth.rows);
  bytes.append(reinterpret_cast<char const*>(depth.data), depth.total() * sizeof(float));
  return bytes;
}

/// The least number of two significant digits that is not below `value`.
double two_digits_up(double value) {
  double const power = std::pow(10.0, std::floor(std::log10(value)) - 1);
  return std::ceil(value / power * (1 - 1e-12)) * power;
}

/// Units a step of a 16-bit depth picture.
double depth_step(ScanSet const& set) {
  double greatest = 0;
  for (View const& view : set.views)
    for (float const z : view.image.depth)
      if (std::isfinite(z)) greatest = std::max(greatest, static_cast<double>(z));
  return greatest > 0 ? two_digits_up(greatest / 65535) : 1;
}

/// A depth nearer than half a step would read as missing: it becomes the first step.
cv::Mat depth_picture(RangeImage const& image, double step) {
  cv::Mat1w picture(image.depth.size(), static_cast<ushort>(0));
  for (int y = 0; y < picture.rows; ++y)
    for (int x = 0; x < picture.cols; ++x)
      if (image.has_depth(x, y))
        picture(y, x) = static_cast<ushort>(std::clamp(std::round(image.depth(y, x) / step), 1.0, 65535.0));
  return picture;
}

cv::Mat mask_picture(RangeImage const& image) {
  cv::Mat1b mask = image.classes.clone();
  for (uchar& value : mask) {
    auto const what = static_cast<PixelClass>(value);
    value = what == PixelClass::background || what == PixelClass::cut ? 0 : 255;
  }
  return mask;
}

void add_intrinsics(Json& json, Camera const& camera) {
  json["camera_model"] = "PINHOLE";
  json["w"] = camera.width();
  json["h"] = camera.height();
  json["fl_x"] = camera.fx();
  json["fl_y"] = camera.fy();
  json["cx"] = camera.cx() + 0.5;
  json["cy"] = camera.cy() + 0.5;
}

Json opengl_matrix(Eigen::Isometry3d const& object_from_camera) {
  Eigen::Matrix4d const matrix =
      object_from_camera.matrix() * Eigen::Vector4d(1, -1, -1, 1).asDiagonal().toDenseMatrix();
  Json rows = Json::array();
  for (int r = 0; r < 4; ++r) rows.push_back({matrix(r, 0), matrix(r, 1), matrix(r, 2), matrix(r, 3)});
  return rows;
}

}  // namespace

void require_poses(fs::path const& path, ScanSet const& set) {
  if (set.views.empty()) throw Error(ErrorCode::bad_input, path, "nothing to export: the set has no views");
  for (View const& view : set.views)
    if (!view.object_from_camera)
      throw Error(ErrorCode::bad_input, path,
                  "cannot export view " + view.name + ": it has no pose (register the set first)");
}

void export_point_cloud(fs::path const& path, ScanSet const& set, Context& context) {
  require_exportable(path, set);
  std::vector<cv::Mat3f> normals(set.views.size());
  for_each_index(
      context, set.views.size(), [&](std::size_t v) { normals[v] = estimate_normals(set.views[v].image); }, "export");
  std::array<std::vector<double>, 9> columns;
  for (std::size_t v = 0; v < set.views.size(); ++v) {
    View const& view = set.views[v];
    cv::Mat3b const color = gained_color(view);
    for (int y = 0; y < view.image.depth.rows; ++y)
      for (int x = 0; x < view.image.depth.cols; ++x) {
        if (!view.image.has_depth(x, y)) continue;
        Eigen::Vector3d const p = *view.object_from_camera * view.image.point(x, y);
        cv::Vec3f const& n = normals[v](y, x);
        Eigen::Vector3d normal = view.object_from_camera->linear() * Eigen::Vector3d(n[0], n[1], n[2]);
        if (!normal.allFinite()) normal.setZero();
        cv::Vec3b const& bgr = color(y, x);
        for (int i = 0; i < 3; ++i) {
          columns[i].push_back(p[i]);
          columns[3 + i].push_back(normal[i]);
          columns[6 + i].push_back(bgr[2 - i]);
        }
      }
  }
  PlyElement vertex{"vertex", columns[0].size(), {}};
  std::array<char const*, 9> const names = {"x", "y", "z", "nx", "ny", "nz", "red", "green", "blue"};
  for (std::size_t i = 0; i < names.size(); ++i)
    vertex.properties.push_back(ply_scalar(names[i], i < 6 ? PlyType::float32 : PlyType::uint8, std::move(columns[i])));
  PlyFile ply;
  ply.comments = {"scanview points, unit " + to_string(set.unit)};
  ply.elements.push_back(std::move(vertex));
  write_file(path, format_ply(ply, PlyFormat::binary_little_endian));
}

void export_colmap(fs::path const& folder, ScanSet const& set, Context& context) {
  require_exportable(folder, set);
  require_perspective(folder, set, "COLMAP");
  require_replaceable(folder, "sparse/points3D.txt");
  NewFolder out(folder);
  for (char const* part : {"sparse", "images", "stereo/depth_maps"}) make_folder(out.path() / part);
  Cameras const cameras = distinct_cameras(set);
  ColmapModel const model = colmap_model(set, cameras);
  write_file(out.path() / "sparse" / "cameras.txt", colmap_cameras(cameras));
  write_file(out.path() / "sparse" / "images.txt", model.images);
  write_file(out.path() / "sparse" / "points3D.txt", model.points);
  auto const write_view = [&](std::size_t v) {
    View const& view = set.views[v];
    write_file(out.path() / "images" / (view.name + ".png"), encode_png(gained_color(view)));
    write_file(out.path() / "stereo" / "depth_maps" / (view.name + ".png.geometric.bin"), colmap_depth_map(view.image));
  };
  for_each_index(context, set.views.size(), write_view, "export");
  out.commit();
}

void export_nerfstudio(fs::path const& folder, ScanSet const& set, Context& context) {
  require_exportable(folder, set);
  require_perspective(folder, set, "nerfstudio");
  require_replaceable(folder, "transforms.json");
  NewFolder out(folder);
  for (char const* part : {"images", "depths", "masks"}) make_folder(out.path() / part);
  Cameras const cameras = distinct_cameras(set);
  double const step = depth_step(set);
  Json json;
  if (cameras.distinct.size() == 1) add_intrinsics(json, cameras.distinct.front());
  json["unit"] = to_string(set.unit);
  json["depth_unit_scale_factor"] = step;
  json["frames"] = Json::array();
  for (View const& view : set.views) {
    Json frame;
    frame["file_path"] = "images/" + view.name + ".png";
    frame["depth_file_path"] = "depths/" + view.name + ".png";
    frame["mask_path"] = "masks/" + view.name + ".png";
    if (cameras.distinct.size() > 1) add_intrinsics(frame, view.image.camera);
    frame["transform_matrix"] = opengl_matrix(*view.object_from_camera);
    json["frames"].push_back(std::move(frame));
  }
  auto const write_view = [&](std::size_t v) {
    View const& view = set.views[v];
    write_file(out.path() / "images" / (view.name + ".png"), encode_png(gained_color(view)));
    write_file(out.path() / "depths" / (view.name + ".png"), encode_png(depth_picture(view.image, step)));
    write_file(out.path() / "masks" / (view.name + ".png"), encode_png(mask_picture(view.image)));
  };
  for_each_index(context, set.views.size(), write_view, "export");
  write_json(out.path() / "transforms.json", json);
  out.commit();
}

}  // namespace scanview
