#include "bench/register_trials.h"

#include <fmt/format.h>

#include <array>
#include <numbers>
#include <sstream>

#include "acquire/archive.h"
#include "acquire/import.h"
#include "base/error.h"
#include "base/files.h"
#include "base/random.h"
#include "mesh/triangle_mesh.h"
#include "synth/centered_model.h"
#include "synth/scanner.h"

namespace scanview {
namespace {

namespace fs = std::filesystem;

constexpr double kMillimetres = 1000;  // a metre
constexpr double kSynthSigma = 0.1;    // mm
constexpr double kSynthSize = 156;     // mm, of the bunny's model

struct Archive {
  char const *set, *file, *conf;
};
constexpr std::array kArchives = {Archive{"bunny", "bunny_range.tar.xz", "bun.conf"},
                                  Archive{"dragon", "dragon_range.tar.xz", "dragonStandRight.conf"}};

View in_millimetres(View view) {
  RangeImage& image = view.image;
  image.depth = cv::Mat1f(image.depth * kMillimetres);
  image.sigma = cv::Mat1f(image.sigma * kMillimetres);
  Camera const& c = image.camera;
  if (!c.is_perspective())
    image.camera =
        Camera::orthographic(c.width(), c.height(), kMillimetres / c.fx(), kMillimetres / c.fy(), c.cx(), c.cy());
  image.color.release();  // shading
  if (view.object_from_camera) view.object_from_camera->translation() *= kMillimetres;
  return view;
}

/// world_from_scan of every `bmesh` line, mm.
std::map<std::string, Eigen::Isometry3d> conf_poses(fs::path const& archive, std::string const& conf) {
  auto const files = read_archive(archive, [&](std::string const& name) { return name.ends_with("/" + conf); });
  if (files.empty()) throw Error(ErrorCode::bad_input, archive, "has no " + conf);
  std::map<std::string, Eigen::Isometry3d> poses;
  std::istringstream text(files.begin()->second);
  for (std::string line; std::getline(text, line);) {
    std::istringstream words(line);
    std::string kind, file;
    Eigen::Vector3d t;
    Eigen::Quaterniond q;
    if (!(words >> kind >> file >> t.x() >> t.y() >> t.z() >> q.x() >> q.y() >> q.z() >> q.w()) || kind != "bmesh")
      continue;
    poses[fs::path(file).stem().string()] = Eigen::Translation3d(kMillimetres * t) * q.normalized().conjugate();
  }
  return poses;
}

void add_synthetic(fs::path const& archive, std::map<std::string, View>& views, Context& context) {
  auto const files = read_archive(archive, [](std::string const& name) { return name.ends_with("bun_zipper.ply"); });
  NewFolder const folder(fs::temp_directory_path() / "scanview_bench_register");
  fs::path const file = folder.path() / "bun_zipper.ply";
  write_file(file, files.begin()->second);
  TriangleMesh model = read_triangle_mesh(file);
  for (auto& vertex : model.vertices) vertex *= static_cast<float>(kMillimetres);
  double const radius = centered(model).radius;
  int count = 0;
  auto const take = [&](double elevation_rad, int of, int first, int step) {
    SynthOptions options;
    options.layout = SynthOptions::Layout::circle;
    options.views = of;
    options.elevation_deg = elevation_rad * 180 / std::numbers::pi;
    options.width = 512;
    options.height = 400;
    options.distance = 4 * kSynthSize / radius;
    options.noise.depth_sigma = kSynthSigma / radius;
    SynthResult const result = synthesize(model, options, context);
    for (int i = first; i < of; i += step) {
      View view = result.set.views[static_cast<std::size_t>(i)];
      view.object_from_camera = result.true_poses[static_cast<std::size_t>(i)];
      view.image.color.release();
      int const number = of > 1 ? i : 8 + count;
      view.name = fmt::format("syn{:02}", number);
      views[view.name] = view;
      count += of > 1 ? 0 : 1;
    }
  };
  take(0, 8, 0, 2);
  take(0.25, 8, 1, 2);
  take(1.2, 1, 0, 1);
  take(-1.2, 1, 0, 1);
}

/// What a trial names, or why it cannot be run.
template <class Value>
Value const& named(std::map<std::string, Value> const& values, std::string const& name) {
  auto const at = values.find(name);
  if (at == values.end())
    throw Error(ErrorCode::bad_input, {}, fmt::format("a trial names {}, which is not there", name));
  return at->second;
}

Eigen::Isometry3d read_transform(std::istream& words) {
  Eigen::Isometry3d result = Eigen::Isometry3d::Identity();
  for (int r = 0; r < 3; ++r)
    for (int c = 0; c < 4; ++c) words >> result.matrix()(r, c);
  result.linear() = Eigen::Quaterniond(result.linear()).normalized().toRotationMatrix();
  return result;
}

Eigen::Vector3d random_direction(CounterRandom& random) {
  return Eigen::Vector3d(random.normal(), random.normal(), random.normal()).normalized();
}

/// Share of from's depths within 1 mm of to's surface.
double share_one_way(RangeImage const& from, RangeImage const& to, Eigen::Isometry3d const& to_from_from) {
  constexpr double kWithin = 1;  // mm
  double asked = 0, met = 0;
  for (int y = 0; y < from.depth.rows; y += 2)
    for (int x = 0; x < from.depth.cols; x += 2) {
      if (!from.has_depth(x, y)) continue;
      ++asked;
      Eigen::Vector3d const p = to_from_from * from.point(x, y);
      Eigen::Vector2d const at = to.camera.project(p);
      if (!to.camera.contains(at)) continue;
      int const u = static_cast<int>(std::lround(at.x())), v = static_cast<int>(std::lround(at.y()));
      if (to.has_depth(u, v) && (to.point(u, v) - p).norm() < kWithin) ++met;
    }
  return met / std::max(asked, 1.0);
}

}  // namespace

Eigen::Vector3d centroid_of(RangeImage const& image) {
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  double count = 0;
  for (int y = 0; y < image.depth.rows; ++y)
    for (int x = 0; x < image.depth.cols; ++x)
      if (image.has_depth(x, y)) sum += image.point(x, y), ++count;
  return sum / std::max(count, 1.0);
}

std::map<std::string, View> read_synthetic_views(fs::path const& data, Context& context) {
  std::map<std::string, View> views;
  add_synthetic(data / kArchives[0].file, views, context);
  return views;
}

Eigen::Isometry3d disturbed(Eigen::Isometry3d const& target_from_camera, RangeImage const& image, double degrees,
                            double length, std::uint64_t seed, std::size_t number) {
  CounterRandom random(seed, number);
  Eigen::Vector3d const centre = centroid_of(image);
  return target_from_camera * Eigen::Translation3d(centre + length * random_direction(random)) *
         Eigen::AngleAxisd(degrees * std::numbers::pi / 180, random_direction(random)) * Eigen::Translation3d(-centre);
}

double shared_share(RangeImage const& a, RangeImage const& b, Eigen::Isometry3d const& b_from_a) {
  return std::max(share_one_way(a, b, b_from_a), share_one_way(b, a, b_from_a.inverse()));
}

TrialViews read_trial_views(fs::path const& data, Context& context) {
  TrialViews views;
  for (Archive const& archive : kArchives) {
    ScanSet const set = import_stanford(data / archive.file, {}, context).set;
    for (View const& view : set.views) views[archive.set][view.name] = in_millimetres(view);
  }
  add_synthetic(data / kArchives[0].file, views["synth"], context);
  return views;
}

std::vector<RegisterTrial> read_trials(fs::path const& file, fs::path const& data, TrialViews const& views,
                                       std::uint64_t seed) {
  std::map<std::string, std::map<std::string, Eigen::Isometry3d>> confs;
  for (Archive const& archive : kArchives) confs[archive.set] = conf_poses(data / archive.file, archive.conf);
  std::vector<RegisterTrial> trials;
  std::istringstream text(read_file(file));
  for (std::string line; std::getline(text, line);) {
    std::istringstream words(line);
    RegisterTrial trial;
    std::string resolution;
    if (!(words >> trial.set >> resolution >> trial.b >> trial.a >> trial.angle_deg >> trial.percent >> trial.size))
      continue;
    Eigen::Isometry3d const start = read_transform(words), truth = read_transform(words);
    View const &a = named(named(views, trial.set), trial.a), &b = named(named(views, trial.set), trial.b);
    if (trial.set == "synth") {
      trial.truth = b.object_from_camera->inverse() * *a.object_from_camera;
      trial.start =
          disturbed(trial.truth, a.image, trial.angle_deg, trial.percent / 100 * trial.size, seed, trials.size());
    } else {
      auto const& conf = named(confs, trial.set);
      Eigen::Isometry3d const a_scan_from_camera = named(conf, trial.a).inverse() * *a.object_from_camera;
      Eigen::Isometry3d const b_scan_from_camera = named(conf, trial.b).inverse() * *b.object_from_camera;
      trial.start = b_scan_from_camera.inverse() * start * a_scan_from_camera;
      trial.truth = b_scan_from_camera.inverse() * truth * a_scan_from_camera;
    }
    trials.push_back(trial);
  }
  return trials;
}

}  // namespace scanview
