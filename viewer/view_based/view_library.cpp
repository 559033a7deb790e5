#include "viewer/view_based/view_library.h"

#include <algorithm>
#include <condition_variable>
#include <deque>
#include <functional>
#include <mutex>
#include <thread>

#include "acquire/scan_set_file.h"
#include "base/error.h"
#include "base/image_file.h"
#include "base/parallel.h"
#include "mesh/padded_texture.h"

namespace scanview {
namespace fs = std::filesystem;
namespace {

/// By surface as the views saw it: stray patches have few pixels, but many vertices.
double radius_of(ScanSet const& set, std::vector<ViewMesh> const& meshes) {
  struct Piece {
    double distance, size;
  };
  std::vector<Piece> pieces;
  double all = 0;
  for (std::size_t i = 0; i < meshes.size(); ++i) {
    Eigen::Isometry3d const pose = Eigen::Translation3d(-set.center) * *set.views[i].object_from_camera;
    TriangleMesh const& mesh = meshes[i].mesh;
    auto const corner = [&](int k) { return mesh.vertices[static_cast<std::size_t>(k)].cast<double>(); };
    for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
      auto const& triangle = mesh.triangles[t];
      Eigen::Vector3d const a = corner(triangle[0]), b = corner(triangle[1]), c = corner(triangle[2]);
      double const size = (b - a).cross(c - a).norm() * meshes[i].cos_phi[t];
      pieces.push_back({(pose * ((a + b + c) / 3)).norm(), size});
      all += size;
    }
  }
  std::sort(pieces.begin(), pieces.end(), [](Piece const& a, Piece const& b) { return a.distance < b.distance; });
  double within = 0, radius = 0;
  for (auto const& piece : pieces) {
    radius = piece.distance;
    within += piece.size;
    if (within >= 0.99 * all) break;
  }
  return radius > 0 ? radius : 1;
}

bool nothing_to_draw(std::vector<ViewMesh> const& meshes) {
  return std::all_of(meshes.begin(), meshes.end(), [](ViewMesh const& m) { return m.mesh.triangles.empty(); });
}

/// The image with what padded_texture() reads: picture and classes.
cv::Mat3b read_picture(fs::path const& folder, View const& view, ViewMesh const& mesh) {
  fs::path const color = folder / view_folder(view.name) / "color.png", mask = color.parent_path() / "mask.png";
  RangeImage image;
  image.camera = view.image.camera;
  image.color = read_color(color);
  cv::Mat const classes = read_gray(mask);
  cv::Size const size(image.camera.width(), image.camera.height());
  if (image.color.size() != size) throw Error(ErrorCode::bad_input, color, "does not have its camera's size");
  if (classes.size() != size || classes.type() != CV_8UC1)
    throw Error(ErrorCode::bad_input, mask, "does not have its camera's size and 8 bits");
  image.classes = classes;
  return padded_texture(image, mesh);
}

}  // namespace

struct ViewLibrary::State {
  ScanSet set;
  std::vector<ViewMesh> meshes;
  double radius = 1;
  std::function<cv::Mat3b(std::size_t)> read;

  std::mutex mutex;
  std::condition_variable changed;
  enum class Stage { unread, wanted, reading, ready, failed };
  std::vector<Stage> stages;
  std::vector<cv::Mat3b> pictures;
  std::vector<std::string> failures;  ///< of each view; empty: none
  std::deque<std::size_t> queue;
  bool stop = false;
  std::thread reader;

  ~State() {
    {
      std::lock_guard const lock(mutex);
      stop = true;
    }
    changed.notify_all();
    if (reader.joinable()) reader.join();
  }

  /// Reads the picture of a view whose stage the caller has set to `reading`.
  void read_now(std::size_t view) {
    cv::Mat3b picture;
    std::string why;
    try {
      picture = read(view);
    } catch (std::exception const& error) {
      why = "view " + set.views[view].name + ": " + error.what();
    }
    std::lock_guard const lock(mutex);
    pictures[view] = picture;
    failures[view] = why;
    stages[view] = why.empty() ? Stage::ready : Stage::failed;
    changed.notify_all();
  }

  void read_what_is_wanted() {
    std::unique_lock lock(mutex);
    for (;;) {
      changed.wait(lock, [&] { return stop || !queue.empty(); });
      if (stop) return;
      std::size_t const view = queue.front();
      queue.pop_front();
      if (stages[view] != Stage::wanted) continue;
      stages[view] = Stage::reading;
      lock.unlock();
      read_now(view);
      lock.lock();
    }
  }

  void start(std::function<cv::Mat3b(std::size_t)> how) {
    if (nothing_to_draw(meshes)) throw Error(ErrorCode::bad_input, {}, "no view with a mesh is left to render from");
    read = std::move(how);
    radius = radius_of(set, meshes);
    stages.assign(meshes.size(), Stage::unread);
    pictures.resize(meshes.size());
    failures.resize(meshes.size());
  }
};

ViewLibrary::ViewLibrary(std::unique_ptr<State> state) : state_(std::move(state)) {}
ViewLibrary::~ViewLibrary() = default;

ViewLibrary::ViewLibrary(ScanSet const& set, std::vector<ViewMesh> const& meshes) : state_(std::make_unique<State>()) {
  if (!set.has_poses()) throw Error(ErrorCode::bad_input, {}, "the set has views without a pose: register it first");
  if (meshes.size() != set.views.size())
    throw Error(ErrorCode::bad_input, {}, "the set does not have one mesh a view: mesh it first");
  for (std::size_t i = 0; i < meshes.size(); ++i) {
    auto const refuse = [&](std::string const& why) {
      throw Error(ErrorCode::bad_input, {}, "view " + set.views[i].name + ": " + why);
    };
    if (meshes[i].mesh.triangles.empty()) continue;
    if (meshes[i].cos_phi.size() != meshes[i].mesh.triangles.size()) refuse("a mesh without one cosine a triangle");
    meshes[i].mesh.check();
    cv::Size const size(meshes[i].camera.width(), meshes[i].camera.height());
    auto const& image = set.views[i].image;
    if (image.color.size() != size || image.classes.size() != size || meshes[i].feather.size() != size)
      refuse("picture, mask or feather does not have its mesh's camera's size");
  }
  state_->set = set;
  state_->meshes = meshes;
  state_->start([state = state_.get()](std::size_t view) {
    return padded_texture(state->set.views[view].image, state->meshes[view]);
  });
}

std::shared_ptr<ViewLibrary> ViewLibrary::open(fs::path const& folder, Context& context) {
  auto state = std::make_unique<State>();
  state->set = read_manifest(folder);
  auto const& views = state->set.views;
  if (!state->set.has_poses())
    throw Error(ErrorCode::bad_input, folder, "has views without a pose (run 'scanview register' first)");
  state->meshes.resize(views.size());
  std::vector<std::string> why(views.size());
  bool any = false;
  for (auto const& view : views) any = any || fs::exists(folder / view_folder(view.name) / "mesh.ply");
  if (!any) throw Error(ErrorCode::bad_input, folder, "has no meshes yet (run 'scanview mesh' first)");
  for_each_index(context, views.size(), [&](std::size_t i) {
    fs::path const in = folder / view_folder(views[i].name);
    try {
      state->meshes[i] = read_view_mesh(in, views[i].image.camera);
      if (!fs::exists(in / "color.png")) throw Error(ErrorCode::bad_input, in / "color.png", "does not exist");
    } catch (Error const& error) {
      why[i] = "view " + views[i].name + ": " + error.what();
      state->meshes[i] = ViewMesh();
    }
  });
  auto const first = std::find_if(why.begin(), why.end(), [](std::string const& text) { return !text.empty(); });
  if (nothing_to_draw(state->meshes) && first != why.end()) throw Error(ErrorCode::bad_input, folder, *first);
  state->start([raw = state.get(), folder](std::size_t view) {
    return read_picture(folder, raw->set.views[view], raw->meshes[view]);
  });
  for (std::size_t i = 0; i < why.size(); ++i) {
    if (why[i].empty()) continue;
    state->failures[i] = why[i];
    state->stages[i] = State::Stage::failed;
  }
  return std::shared_ptr<ViewLibrary>(new ViewLibrary(std::move(state)));
}

ScanSet const& ViewLibrary::set() const { return state_->set; }
std::vector<ViewMesh> const& ViewLibrary::meshes() const { return state_->meshes; }
double ViewLibrary::radius() const { return state_->radius; }

cv::Mat3b ViewLibrary::picture(std::size_t view) {
  State& state = *state_;
  std::unique_lock lock(state.mutex);
  using Stage = State::Stage;
  if (state.stages.at(view) == Stage::unread || state.stages[view] == Stage::wanted) {
    state.stages[view] = Stage::reading;
    lock.unlock();
    state.read_now(view);
    lock.lock();
  }
  state.changed.wait(lock, [&] { return state.stages[view] == Stage::ready || state.stages[view] == Stage::failed; });
  return state.pictures[view];
}

cv::Mat3b ViewLibrary::picture_if_ready(std::size_t view) {
  State& state = *state_;
  std::lock_guard const lock(state.mutex);
  if (state.stages.at(view) == State::Stage::unread) {
    state.stages[view] = State::Stage::wanted;
    state.queue.push_back(view);
    if (!state.reader.joinable()) state.reader = std::thread([&state] { state.read_what_is_wanted(); });
    state.changed.notify_all();
  }
  return state.pictures[view];
}

std::vector<std::string> ViewLibrary::failures() const {
  std::lock_guard const lock(state_->mutex);
  std::vector<std::string> result;
  for (auto const& why : state_->failures) {
    if (!why.empty()) result.push_back(why);
  }
  return result;
}

bool ViewLibrary::failed(std::size_t view) const {
  std::lock_guard const lock(state_->mutex);
  return state_->stages.at(view) == State::Stage::failed;
}

}  // namespace scanview
