#include "viewer/view_based/view_library.h"

#include <gtest/gtest.h>

#include <chrono>
#include <cmath>
#include <cstring>
#include <fstream>
#include <opencv2/core.hpp>
#include <opencv2/imgcodecs.hpp>
#include <thread>

#include "acquire/scan_set_file.h"
#include "base/error.h"
#include "base/files.h"
#include "tests/temporary_folder.h"
#include "viewer/scene.h"

namespace scanview {
namespace {

namespace fs = std::filesystem;
using namespace test;
using Eigen::Isometry3d;
using Eigen::Vector3d;

Scene ball() {
  std::vector<Isometry3d> poses;
  for (auto const& eye : {Vector3d(0, 0, 4), Vector3d(2, 0.5, 3.3), Vector3d(-2, 1, 3.2), Vector3d(0.3, 2.5, 3)})
    poses.push_back(look_at(eye, Vector3d::Zero()));
  return scan(sphere(Vector3d::Zero(), 1), Camera::perspective(120, 100, 110, 110, 60, 50), poses, 0.3, 0.02);
}

Camera const kCamera = Camera::perspective(90, 80, 85, 85, 45, 40);
Isometry3d const kBetween = look_at({0.4, 0.6, 3.6}, {0, 0, 0});
constexpr std::size_t kBroken = 1;

/// The scene without one view, as a set in memory.
Frame without(Scene scene, std::size_t view, BackEnd back_end) {
  scene.set.views.erase(scene.set.views.begin() + std::ptrdiff_t(view));
  scene.meshes.erase(scene.meshes.begin() + std::ptrdiff_t(view));
  return make_renderer(back_end, std::make_shared<ViewLibrary>(scene.set, scene.meshes))->render(kCamera, kBetween);
}

bool same(Frame const& a, Frame const& b) {
  return a.color.size() == b.color.size() && std::memcmp(a.color.data, b.color.data, 4 * a.color.total()) == 0 &&
         std::memcmp(a.depth.data, b.depth.data, 4 * a.depth.total()) == 0;
}

void truncate(fs::path const& file) { fs::resize_file(file, fs::file_size(file) / 2); }

class LibraryOfAFolder : public testing::Test {
 protected:
  LibraryOfAFolder() : scene_(ball()) {
    Context context;
    write_scan_set(folder_.path(), scene_.set, context);
    for (std::size_t i = 0; i < scene_.meshes.size(); ++i) write_view_mesh(of_view(i), scene_.meshes[i]);
  }
  fs::path of_view(std::size_t i) const { return folder_.path() / view_folder(scene_.set.views[i].name); }
  std::shared_ptr<ViewLibrary> open() const {
    Context context;
    return ViewLibrary::open(folder_.path(), context);
  }
  TemporaryFolder folder_;
  Scene scene_;
};

TEST_F(LibraryOfAFolder, IsTheSetInMemory) {
  auto const library = open();
  EXPECT_TRUE(library->failures().empty());
  ViewLibrary memory(scene_.set, scene_.meshes);
  EXPECT_EQ(library->radius(), memory.radius());
  EXPECT_NEAR(library->radius(), 1, 0.02);
  for (std::size_t i = 0; i < 4; ++i) {
    cv::Mat3b const a = library->picture(i), b = memory.picture(i);
    ASSERT_EQ(a.size(), b.size());
    EXPECT_EQ(cv::norm(a, b, cv::NORM_INF), 0);
  }
  EXPECT_TRUE(same(make_renderer(BackEnd::cpu, library)->render(kCamera, kBetween),
                   make_renderer(BackEnd::cpu, std::make_shared<ViewLibrary>(scene_.set, scene_.meshes))
                       ->render(kCamera, kBetween)));
}

TEST_F(LibraryOfAFolder, AViewThatCannotBeReadIsLeftOutAndNamed) {
  struct Case {
    char const* name;
    char const* file;
    std::function<void(fs::path const&)> spoil;
    bool seen_at_once;  ///< not only when the picture is read
  };
  fs::path const view = of_view(kBroken);
  auto const remove = [](fs::path const& file) { fs::remove(file); };
  auto const empty = [](fs::path const& file) { fs::resize_file(file, 0); };
  auto const resize = [](fs::path const& file) { cv::imwrite(file.string(), cv::Mat3b(70, 90, cv::Vec3b(9, 9, 9))); };
  auto const resize_gray = [](fs::path const& file) { cv::imwrite(file.string(), cv::Mat1b(70, 90, 255)); };
  for (Case const& one :
       {Case{"no picture", "color.png", remove, true}, Case{"half a picture", "color.png", truncate, false},
        Case{"an empty picture", "color.png", empty, false},
        Case{"a picture of another size", "color.png", resize, false}, Case{"no mask", "mask.png", remove, false},
        Case{"half a mask", "mask.png", truncate, false},
        Case{"a mask of another size", "mask.png", resize_gray, false}, Case{"no mesh", "mesh.ply", remove, true},
        Case{"half a mesh", "mesh.ply", truncate, true}, Case{"an empty mesh", "mesh.ply", empty, true},
        Case{"no feather", "feather.png", remove, true}, Case{"half a feather", "feather.png", truncate, true},
        Case{"a feather of another size", "feather.png", resize_gray, true}}) {
    SCOPED_TRACE(one.name);
    std::string const kept = read_file(view / one.file);
    one.spoil(view / one.file);
    auto const library = open();
    EXPECT_EQ(library->failures().size(), one.seen_at_once ? 1U : 0U);
    for (auto const back_end : {BackEnd::cpu, BackEnd::gl}) {
      auto const renderer = make_renderer(back_end, library);
      auto const second = make_renderer(back_end, library);
      auto const frame = renderer->render(kCamera, kBetween);
      ASSERT_EQ(library->failures().size(), 1U);
      std::string const why = library->failures()[0];
      EXPECT_NE(why.find("view " + scene_.set.views[kBroken].name), std::string::npos) << why;
      EXPECT_NE(why.find(fs::path(one.file).stem().string()), std::string::npos) << why;
      EXPECT_TRUE(library->failed(kBroken));
      EXPECT_FALSE(library->failed(0));
      EXPECT_TRUE(library->picture(kBroken).empty());
      EXPECT_TRUE(library->picture_if_ready(kBroken).empty());
      EXPECT_TRUE(renderer->complete());
      EXPECT_GT(drawn_pixels(frame.color), 1000U);
      EXPECT_TRUE(same(frame, without(scene_, kBroken, back_end)));
      EXPECT_TRUE(same(frame, second->render(kCamera, kBetween)));  // made before anybody knew
      for (auto const& used : renderer->view_weights(kCamera, kBetween)) EXPECT_NE(used.view, kBroken);
    }
    write_file(view / one.file, kept);
  }
  EXPECT_TRUE(open()->failures().empty());
}

TEST_F(LibraryOfAFolder, WhereNoViewIsLeftThatIsAnError) {
  auto const expect_error = [&](auto const& act) {
    try {
      act();
      FAIL();
    } catch (Error const& error) {
      EXPECT_EQ(error.code(), ErrorCode::bad_input) << error.what();
    }
  };
  // Pictures are read late: the renderer finds out.
  for (std::size_t i = 0; i < 4; ++i) truncate(of_view(i) / "color.png");
  auto const library = open();
  for (auto const back_end : {BackEnd::cpu, BackEnd::gl}) {
    expect_error([&] { make_renderer(back_end, library)->render(kCamera, kBetween); });
  }
  EXPECT_EQ(library->failures().size(), 4U);
  // Meshes at once.
  for (std::size_t i = 0; i < 4; ++i) truncate(of_view(i) / "mesh.ply");
  expect_error([&] { open(); });
  for (std::size_t i = 0; i < 4; ++i) fs::remove(of_view(i) / "mesh.ply");
  expect_error([&] { open(); });
  fs::remove(folder_.path() / "scanset.json");
  expect_error([&] { open(); });
}

TEST_F(LibraryOfAFolder, PicturesArriveWithoutWaiting) {
  auto const library = open();
  // The first call never has it: it would have had to wait.
  for (std::size_t i = 0; i < 4; ++i) EXPECT_TRUE(library->picture_if_ready(i).empty());
  auto const deadline = std::chrono::steady_clock::now() + std::chrono::seconds(30);
  for (std::size_t i = 0; i < 4; ++i) {
    while (library->picture_if_ready(i).empty() && std::chrono::steady_clock::now() < deadline)
      std::this_thread::sleep_for(std::chrono::milliseconds(1));
    cv::Mat3b const arrived = library->picture_if_ready(i);
    ASSERT_FALSE(arrived.empty());
    EXPECT_EQ(arrived.data, library->picture(i).data);  // shared, not copied
  }
}

TEST_F(LibraryOfAFolder, AnImpatientRendererIsCompleteInTheEnd) {
  for (auto const back_end : {BackEnd::cpu, BackEnd::gl}) {
    auto const library = open();
    auto const renderer = make_renderer(back_end, library);
    renderer->set_patient(false);
    auto const first = renderer->render(kCamera, kBetween);
    EXPECT_FALSE(renderer->complete());
    EXPECT_EQ(drawn_pixels(first.color), 0U);
    auto const deadline = std::chrono::steady_clock::now() + std::chrono::seconds(30);
    Frame last = first;
    while (!renderer->complete() && std::chrono::steady_clock::now() < deadline) {
      std::this_thread::sleep_for(std::chrono::milliseconds(1));
      last = renderer->render(kCamera, kBetween);
    }
    EXPECT_TRUE(renderer->complete());
    EXPECT_TRUE(same(last, make_renderer(back_end, open())->render(kCamera, kBetween)));
  }
}

TEST_F(LibraryOfAFolder, ClosesWhilePicturesAreBeingRead) {
  for (int i = 0; i < 20; ++i) {
    auto const library = open();
    for (std::size_t view = 0; view < 4; ++view) library->picture_if_ready(view);
  }
}

TEST_F(LibraryOfAFolder, ServesSeveralRenderersAtOnce) {
  auto const alone = make_renderer(BackEnd::cpu, open())->render(kCamera, kBetween);
  auto const library = open();
  std::vector<Frame> frames(4);
  std::vector<std::thread> threads;
  for (auto& frame : frames) {
    threads.emplace_back([&frame, library] { frame = make_cpu_renderer(library)->render(kCamera, kBetween); });
  }
  auto const gl = make_renderer(BackEnd::gl, library)->render(kCamera, kBetween);
  for (auto& thread : threads) thread.join();
  for (auto const& frame : frames) EXPECT_TRUE(same(frame, alone));
  EXPECT_EQ(gl.color.size(), alone.color.size());
  // One after the other, with other options.
  auto const one = make_renderer(BackEnd::cpu, library);
  ViewBasedOptions options;
  options.excluded = {0};
  auto const other = make_renderer(BackEnd::cpu, library, options);
  auto const apart = other->render(kCamera, kBetween);
  EXPECT_TRUE(same(one->render(kCamera, kBetween), alone));
  EXPECT_TRUE(same(other->render(kCamera, kBetween), apart));
  EXPECT_FALSE(same(apart, alone));
}

TEST(ViewLibraryRadius, StrayPatchesHaveNoSay) {
  auto scene = scan(sphere(Vector3d::Zero(), 1), Camera::perspective(80, 60, 75, 75, 40, 30),
                    {around(0, 0), around(180, 0)}, 0.3, 0.02);
  double const alone = ViewLibrary(scene.set, scene.meshes).radius();
  EXPECT_NEAR(alone, 1, 0.02);
  // As many tiny triangles far away as there are on the ball.
  auto& mesh = scene.meshes[0];
  for (std::size_t i = mesh.mesh.triangles.size(); i > 0; --i) {
    int const first = static_cast<int>(mesh.mesh.vertices.size());
    for (auto const& corner : {Vector3d(0, 0, 0), Vector3d(0, 1e-3, 0), Vector3d(1e-3, 0, 0)}) {
      mesh.mesh.vertices.push_back((Vector3d(5, 5, 9) + corner).cast<float>());
    }
    mesh.mesh.triangles.emplace_back(first, first + 1, first + 2);
    mesh.cos_phi.push_back(1);
  }
  EXPECT_NEAR(ViewLibrary(scene.set, scene.meshes).radius(), alone, 0.01);
}

}  // namespace
}  // namespace scanview
