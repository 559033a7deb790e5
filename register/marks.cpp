#include "register/marks.h"

#include <fmt/format.h>

#include <Eigen/SVD>
#include <cmath>
#include <map>
#include <set>

#include "base/error.h"

namespace scanview {
namespace fs = std::filesystem;
namespace {

[[noreturn]] void fail(fs::path const& path, std::string const& message) {
  throw Error(ErrorCode::bad_input, path, message);
}

using Marks = std::map<std::string, Eigen::Vector3d>;  // point name -> place

/// The marked points of one view, in its camera's coordinates.
Marks lift_marks(View const& view, Json const& marks, fs::path const& path) {
  Marks lifted;
  for (auto const& [name, pixel] : marks.items()) {
    std::string const where = fmt::format("mark {} of view {}", name, view.name);
    if (!pixel.is_array() || pixel.size() != 2 || !pixel[0].is_number() || !pixel[1].is_number())
      fail(path, where + " is not [u, v]");
    double const u = pixel[0].get<double>(), v = pixel[1].get<double>();
    if (!view.image.camera.contains({u, v})) fail(path, where + " lies outside the picture");
    int const x = static_cast<int>(std::lround(u)), y = static_cast<int>(std::lround(v));
    if (!view.image.has_depth(x, y)) fail(path, where + " has no depth");
    lifted[name] = view.image.camera.unproject(u, v, view.image.depth(y, x));
  }
  return lifted;
}

/// The rigid motion that carries `from` nearest to `to` (Umeyama 1991 without scale), over the points both name.
Eigen::Isometry3d fit(Marks const& from, Marks const& to, std::string const& view, fs::path const& path) {
  std::vector<std::string> common;
  for (auto const& [name, p] : from)
    if (to.contains(name)) common.push_back(name);
  if (common.size() < 3)
    fail(path, fmt::format("view {} shares fewer than three marks with the views before it", view));
  Eigen::Matrix3Xd source(3, common.size()), target(3, common.size());
  for (std::size_t i = 0; i < common.size(); ++i) {
    source.col(static_cast<Eigen::Index>(i)) = from.at(common[i]);
    target.col(static_cast<Eigen::Index>(i)) = to.at(common[i]);
  }
  Eigen::JacobiSVD<Eigen::MatrixXd> const spread(source.colwise() - source.rowwise().mean());
  if (!(spread.singularValues()(1) > 1e-3 * spread.singularValues()(0)))
    fail(path, fmt::format("the marks of view {} lie on one line", view));
  return Eigen::Isometry3d(Eigen::umeyama(source, target, false));
}

}  // namespace

void place_by_marks(fs::path const& path, Json const& marks, ScanSet& set) {
  std::map<std::string, Marks> lifted;
  for (auto const& view : set.views) {
    if (!marks.contains(view.name) || !marks[view.name].is_object())
      fail(path, fmt::format("has no marks of view {}", view.name));
    lifted[view.name] = lift_marks(view, marks[view.name], path);
  }
  Marks placed;  // object coordinates: the first view's camera
  std::set<std::string> open;
  for (auto& view : set.views) {
    view.object_from_camera.reset();
    open.insert(view.name);
  }
  // Next comes the view that shares most marks with those placed, so that a chain of views is enough.
  while (!open.empty()) {
    View* best = nullptr;
    std::size_t best_common = 0;
    for (auto& view : set.views) {
      if (!open.contains(view.name)) continue;
      std::size_t common = placed.empty() ? 1 : 0;
      for (auto const& [name, p] : lifted[view.name]) common += placed.contains(name);
      if (!best || common > best_common) best = &view, best_common = common;
      if (placed.empty()) break;
    }
    best->object_from_camera =
        placed.empty() ? Eigen::Isometry3d::Identity() : fit(lifted[best->name], placed, best->name, path);
    for (auto const& [name, p] : lifted[best->name]) placed.try_emplace(name, *best->object_from_camera * p);
    open.erase(best->name);
  }
}

}  // namespace scanview
