#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>
#include <limits>
#include <random>

#include "acquire/scan_set_file.h"
#include "base/error.h"
#include "base/files.h"
#include "register/pose_file.h"
#include "viewer/scene.h"
#include "viewer/window/commands.h"
#include "viewer/window/file_watch.h"
#include "viewer/window/frame_presenter.h"
#include "viewer/window/keyframes.h"
#include "viewer/window/look.h"
#include "viewer/window/marking_desk.h"
#include "viewer/window/measuring.h"
#include "viewer/window/pointer_gestures.h"
#include "viewer/window/sphere_inset.h"
#include "viewer/window/viewed_set.h"

namespace scanview {
namespace {

namespace fs = std::filesystem;
using Eigen::Isometry3d;
using Eigen::Vector2d;
using Eigen::Vector3d;

WindowEvent pointer(WindowEvent::Kind kind, double x, double y, double seconds = 0, int button = 0) {
  WindowEvent event;
  event.kind = kind;
  event.x = x;
  event.y = y;
  event.seconds = seconds;
  event.button = button;
  return event;
}
constexpr auto kPress = WindowEvent::Kind::press, kRelease = WindowEvent::Kind::release,
               kMove = WindowEvent::Kind::move;

std::vector<Gesture> feed(PointerGestures& gestures, std::vector<WindowEvent> const& events) {
  std::vector<Gesture> all;
  for (auto const& event : events) {
    for (auto const& gesture : gestures.feed(event)) all.push_back(gesture);
  }
  return all;
}

TEST(PointerGestures, AClickWithinOneSlowFrameCounts) {
  PointerGestures gestures;
  auto const all = feed(gestures, {pointer(kPress, 10, 20), pointer(kRelease, 11, 20)});
  ASSERT_EQ(all.size(), 1U);
  EXPECT_EQ(all[0].kind, Gesture::Kind::click);
  EXPECT_EQ(all[0].x, 10);
  EXPECT_FALSE(gestures.held());
}

TEST(PointerGestures, DragsAddUpToTheWholeWay) {
  PointerGestures gestures;
  // The release is further on than the last move that was reported.
  auto const all = feed(gestures, {pointer(kPress, 0, 0), pointer(kMove, 2, 1), pointer(kMove, 9, 3),
                                   pointer(kMove, 30, -4), pointer(kRelease, 40, -5)});
  double dx = 0, dy = 0;
  for (auto const& gesture : all) {
    EXPECT_EQ(gesture.kind, Gesture::Kind::drag);
    EXPECT_FALSE(gesture.pan);
    dx += gesture.dx;
    dy += gesture.dy;
  }
  EXPECT_EQ(dx, 40);
  EXPECT_EQ(dy, -5);
}

TEST(PointerGestures, DoubleClicksAreNearInTimeAndPlace) {
  using Kind = Gesture::Kind;
  auto const second = [](double x, double seconds) {
    PointerGestures gestures;
    return feed(gestures, {pointer(kPress, 10, 10, 0), pointer(kRelease, 10, 10, 0.05), pointer(kPress, x, 10, seconds),
                           pointer(kRelease, x, 10, seconds + 0.05)})
        .back()
        .kind;
  };
  EXPECT_EQ(second(12, 0.3), Kind::double_click);
  EXPECT_EQ(second(12, 0.5), Kind::click);
  EXPECT_EQ(second(30, 0.1), Kind::click);
  // The third of three quick ones begins anew.
  PointerGestures gestures;
  std::vector<WindowEvent> events;
  for (int i = 0; i < 3; ++i) {
    events.push_back(pointer(kPress, 5, 5, 0.1 * i));
    events.push_back(pointer(kRelease, 5, 5, 0.1 * i));
  }
  auto const all = feed(gestures, events);
  ASSERT_EQ(all.size(), 3U);
  EXPECT_EQ(all[0].kind, Kind::click);
  EXPECT_EQ(all[1].kind, Kind::double_click);
  EXPECT_EQ(all[2].kind, Kind::click);
}

TEST(PointerGestures, OtherButtonsAndShiftPanAndNeverClick) {
  PointerGestures gestures;
  auto all = feed(gestures, {pointer(kPress, 0, 0, 0, 1), pointer(kMove, 20, 0), pointer(kRelease, 20, 0, 0, 1)});
  ASSERT_EQ(all.size(), 1U);
  EXPECT_TRUE(all[0].pan);
  EXPECT_TRUE(feed(gestures, {pointer(kPress, 0, 0, 0, 2), pointer(kRelease, 0, 0, 0, 2)}).empty());
  auto shifted = pointer(kMove, 20, 0);
  shifted.shift = true;
  all = feed(gestures, {pointer(kPress, 0, 0), shifted});
  ASSERT_EQ(all.size(), 1U);
  EXPECT_TRUE(all[0].pan);
  // A second button while one is held changes nothing, nor does its release.
  EXPECT_TRUE(feed(gestures, {pointer(kPress, 20, 0, 0, 1), pointer(kRelease, 20, 0, 0, 1)}).empty());
  EXPECT_TRUE(gestures.held());
  // A release without a press (it was in the panel) is nothing.
  PointerGestures fresh;
  EXPECT_TRUE(feed(fresh, {pointer(kMove, 1, 1), pointer(kRelease, 9, 9)}).empty());
}

TEST(Commands, AKeyMeansWhatItsModeSays) {
  EXPECT_EQ(command_of_key('M', WindowMode::look), Command::measure);
  EXPECT_EQ(command_of_key('M', WindowMode::measure), Command::look);
  EXPECT_EQ(command_of_key('N', WindowMode::outline), Command::mark);
  constexpr int kEscape = 256, kEnter = 257, kBackspace = 259;
  EXPECT_EQ(command_of_key(kEscape, WindowMode::look), Command::quit);
  EXPECT_EQ(command_of_key(kEscape, WindowMode::mark), Command::look);
  EXPECT_EQ(command_of_key(kEnter, WindowMode::outline), Command::close_outline);
  EXPECT_FALSE(command_of_key(kEnter, WindowMode::mark));
  EXPECT_FALSE(command_of_key(kBackspace, WindowMode::look));
  EXPECT_FALSE(command_of_key(' ', WindowMode::outline));  // no turntable behind a picture
  EXPECT_EQ(view_of_key('1'), 0U);
  EXPECT_EQ(view_of_key('9'), 8U);
  EXPECT_FALSE(view_of_key('0'));
}

TEST(Look, SurvivesTheOptions) {
  ViewBasedOptions options;
  options.threshold = 0.02;
  options.excluded = {3};
  Look look = look_of(options);
  EXPECT_EQ(look_of(with_look(options, look)), look);
  look.collage = true;
  look.cosine = false;
  look.show = SoftZ::Show::winner;
  look.fill_views = 0;
  EXPECT_EQ(look_of(with_look(options, look)), look);
  EXPECT_EQ(with_look(options, look).excluded, options.excluded);
  look.soft_z = false;
  EXPECT_TRUE(std::isinf(with_look(options, look).threshold));
  EXPECT_FALSE(look_of(with_look(options, look)).soft_z);
}

ShownFrame shown_plane() {
  ShownFrame shown;
  shown.camera = Camera::perspective(40, 20, 30, 30, 19.5, 9.5);
  shown.object_from_camera = Eigen::Translation3d(1, 2, 3) * Eigen::AngleAxisd(0.5, Vector3d::UnitY());
  shown.frame.depth = cv::Mat1f(20, 40, 2.0F);
  shown.frame.depth.colRange(0, 10).setTo(kMissing);
  return shown;
}

TEST(ShownFrame, PicksThePointUnderThePixel) {
  ShownFrame const shown = shown_plane();
  // The window shows the frame at three times its size; what is placed is picked.
  std::mt19937 random(7);
  std::uniform_real_distribution<double> x(31, 119), y(0, 59);
  for (int i = 0; i < 100; ++i) {
    Vector2d const at(x(random), y(random));
    auto const p = shown.pick(at.x(), at.y(), 120, 60);
    ASSERT_TRUE(p);
    EXPECT_NEAR((shown.object_from_camera.inverse() * *p).z(), 2, 1e-12);
    auto const back = shown.place(*p, 120, 60);
    ASSERT_TRUE(back);
    EXPECT_LT((*back - at).norm(), 1e-9);
  }
}

TEST(ShownFrame, BackgroundAndOutsideAreNothing) {
  ShownFrame const shown = shown_plane();
  EXPECT_FALSE(shown.pick(5, 10, 40, 20));      // background
  EXPECT_TRUE(shown.pick(39.4, 19.4, 40, 20));  // the last pixel's far corner
  EXPECT_FALSE(shown.pick(39.6, 10, 40, 20));
  EXPECT_FALSE(shown.pick(20, -0.6, 40, 20));
  EXPECT_FALSE(shown.pick(-1e9, 1e9, 40, 20));
  EXPECT_FALSE(shown.pick(std::numeric_limits<double>::quiet_NaN(), 3, 40, 20));
  EXPECT_FALSE(shown.pick(1, 1, 0, 0));
  EXPECT_FALSE(ShownFrame().pick(0, 0, 10, 10));
  EXPECT_FALSE(ShownFrame().place({0, 0, 1}, 10, 10));
  EXPECT_FALSE(shown.place(shown.object_from_camera * Vector3d(0, 0, -1), 40, 20));  // behind the eye
}

TEST(DistanceTool, TwoPointsThenAnew) {
  DistanceTool tool;
  tool.remove_last();
  tool.click(std::nullopt);
  EXPECT_TRUE(tool.points().empty());
  tool.click(Vector3d(1, 2, 3));
  tool.click(std::nullopt);  // missed the object: the first point stays
  EXPECT_FALSE(tool.distance());
  tool.click(Vector3d(4, 6, 3));
  EXPECT_DOUBLE_EQ(*tool.distance(), 5);
  EXPECT_EQ(length_text(*tool.distance(), Unit::mm), "5 mm");
  EXPECT_EQ(length_text(0.123456, Unit::m), "0.1235 m");
  EXPECT_EQ(length_text(1, Unit::arbitrary), "1 (no known scale)");
  // The line ends at the points; one behind the eye is not drawn.
  ShownFrame const shown = shown_plane();
  EXPECT_TRUE(tool.overlay(ShownFrame(), 40, 20, Unit::m).dots.empty());
  DistanceTool seen;
  seen.click(shown.pick(12, 4, 40, 20));
  seen.click(shown.pick(31, 15, 40, 20));
  auto const overlay = seen.overlay(shown, 40, 20, Unit::m);
  ASSERT_EQ(overlay.dots.size(), 2U);
  EXPECT_LT((overlay.dots[1].at - Vector2d(31, 15)).norm(), 1e-9);
  EXPECT_EQ(overlay.dots[1].label, length_text(*seen.distance(), Unit::m));
  seen.click(Vector3d(0, 0, 0));
  seen.click(shown.object_from_camera * Vector3d(0, 0, -1));
  for (auto const& dot : seen.overlay(shown, 40, 20, Unit::m).dots) EXPECT_TRUE(dot.label.empty());
  tool.click(Vector3d(0, 0, 0));
  EXPECT_EQ(tool.points().size(), 1U);
  EXPECT_FALSE(tool.distance());
}

TEST(SphereInset, TheEyeIsInTheMiddleAndFacesThePerson) {
  // Looking along -z from (0, 0, 4) at the centre: right is x, down is -y.
  Isometry3d const pose = test::look_at({0, 0, 4}, {0, 0, 0});
  std::vector<Vector3d> const directions = {{0, 0, 1}, {1, 0, 0}, {0, 1, 0}, {0, 0, -1}, {-1, 0, 0}, {0, -1, 0}};
  std::vector<Eigen::Vector3i> const triangles = {{0, 1, 2}, {0, 2, 4}, {3, 2, 1}};
  auto const inset = sphere_inset(directions, triangles, {{0, 0.5, 1}, {1, 0.3, 1}, {2, 0.2, 1}, {4, 0, 0.5}},
                                  Vector3d::UnitZ(), pose.linear());
  EXPECT_NEAR(std::hypot(inset.eye.x, inset.eye.y), 0, 1e-12);
  EXPECT_TRUE(inset.eye.front);
  EXPECT_TRUE(inset.views[0].at.front);
  EXPECT_FALSE(inset.views[3].at.front);
  EXPECT_NEAR(inset.views[1].at.x, 1, 1e-12);
  EXPECT_NEAR(inset.views[2].at.y, -1, 1e-12);  // up is up
  EXPECT_EQ(inset.chosen.size(), 3U);
  EXPECT_TRUE(inset.views[4].drawn);
  EXPECT_EQ(inset.edges.size(), 7U);  // two of nine are shared
  int chosen = 0;
  for (auto const& edge : inset.edges) {
    chosen += edge.chosen;
    for (auto const& point : edge.arc) EXPECT_LE(std::hypot(point.x, point.y), 1 + 1e-9);
  }
  EXPECT_EQ(chosen, 3);
  // Views 0 and 3 are at the same place: the one in front is meant.
  EXPECT_EQ(inset.nearest(0.01, 0, 0.1), 0U);
  EXPECT_EQ(inset.nearest(0.5, 0.5, 0.1), directions.size());
}

TEST(SphereInset, AntipodesAndNoTrianglesWork) {
  auto const inset =
      sphere_inset({{0, 0, 1}, {0, 0, -1}}, {{0, 1, 0}}, {{0, 1, 0}}, Vector3d::UnitZ(), Eigen::Matrix3d::Identity());
  for (auto const& edge : inset.edges) {
    for (auto const& point : edge.arc) EXPECT_TRUE(std::isfinite(point.x) && std::isfinite(point.y));
  }
  EXPECT_EQ(sphere_inset({}, {}, {}, Vector3d::UnitZ(), Eigen::Matrix3d::Identity()).nearest(0, 0, 1), 0U);
}

TEST(PictureSheet, PlacesAndPixelsAgree) {
  PictureSheet sheet({640, 480}, {500, 700});
  Vector2d const middle = sheet.to_picture(249.5, 349.5);
  EXPECT_LT((middle - Vector2d(319.5, 239.5)).norm(), 1e-9);
  EXPECT_NEAR(sheet.to_window({-0.5, 0}).x(), -0.5, 1e-9);  // as wide as the window
  Vector2d const under = sheet.to_picture(100, 300);
  sheet.zoom(100, 300, 7);
  EXPECT_LT((sheet.to_picture(100, 300) - under).norm(), 1e-9);
  sheet.pan(30, -20);
  EXPECT_LT((sheet.to_picture(130, 280) - under).norm(), 1e-9);
  Vector2d const centre = sheet.to_picture(249.5, 349.5);
  sheet.resize({900, 300});
  EXPECT_LT((sheet.to_picture(449.5, 149.5) - centre).norm(), 1e-9);
  for (double const steps : {1e6, -1e6}) {
    sheet.zoom(0, 0, steps);
    EXPECT_TRUE(sheet.to_picture(3, 4).allFinite());
  }
}

TEST(PictureSheet, DrawsEveryPixelWhereItSays) {
  cv::Mat3b picture(3, 4, cv::Vec3b(0, 0, 0));
  picture(1, 2) = {10, 200, 30};
  PictureSheet sheet({4, 3}, {80, 60});
  cv::Mat4b const drawn = sheet.draw(picture);
  EXPECT_EQ(drawn.size(), cv::Size(80, 60));
  for (int y = 0; y < 60; ++y) {
    for (int x = 0; x < 80; ++x) {
      Vector2d const pixel = sheet.to_picture(x, y);
      bool const lit = std::lround(pixel.x()) == 2 && std::lround(pixel.y()) == 1;
      EXPECT_EQ(drawn(y, x)[1], lit ? 200 : 0) << x << " " << y;
    }
  }
  sheet.pan(40, 0);
  EXPECT_EQ(sheet.draw(picture)(30, 10)[3], 0);  // beside it
  EXPECT_EQ(sheet.draw({})(0, 0)[3], 0);
}

TEST(Background, KeepsOpaquePixelsAndFillsTheRest) {
  cv::Mat4b picture(40, 5, cv::Vec4b(1, 2, 3, 255)), composed;
  picture(0, 0) = {200, 100, 50, 0};
  picture(39, 0) = {200, 100, 50, 0};
  picture(5, 1) = {200, 100, 50, 128};
  compose_background(picture, composed);
  EXPECT_EQ(composed(7, 3), cv::Vec4b(1, 2, 3, 255));
  EXPECT_EQ(composed(0, 0)[3], 255);
  EXPECT_GT(composed(0, 0)[0], composed(39, 0)[0]);  // darker towards the bottom
  EXPECT_LT(composed(0, 0)[0], 80);
  EXPECT_NEAR(composed(5, 1)[0], 133, 3);
}

/// A set in a folder: four views of a ball that share points.
class WindowFolder : public testing::Test {
 protected:
  WindowFolder() {
    folder_ = fs::path(testing::TempDir()) / "scanview_window_test";
    fs::remove_all(folder_);
    fs::create_directories(folder_);
    std::vector<Isometry3d> poses;
    for (int i = 0; i < 4; ++i) {
      double const a = 0.4 * i;
      poses.push_back(test::look_at(4 * Vector3d(std::sin(a), 0.1 * i, std::cos(a)), {0, 0, 0}));
    }
    scene_ = test::scan(test::sphere({0, 0, 0}, 1), Camera::perspective(256, 192, 240, 240, 128, 96), poses, 0.1, 0.02);
    Context context;
    write_scan_set(folder_, scene_.set, context);
    for (std::size_t i = 0; i < 4; ++i)
      write_view_mesh(folder_ / view_folder(scene_.set.views[i].name), scene_.meshes[i]);
    library_ = ViewLibrary::open(folder_, context);
  }
  ~WindowFolder() override { fs::remove_all(folder_); }

  /// A click on a pixel of the view's picture, in a window of any size.
  std::string click(MarkingDesk& desk, Vector2d const& pixel) {
    Vector2d const at = desk.sheet().to_window(pixel);
    return desk.click(at.x(), at.y());
  }

  fs::path folder_;
  test::Scene scene_;
  std::shared_ptr<ViewLibrary> library_;
};

TEST_F(WindowFolder, MarksThatAreClickedRegisterTheSet) {
  MarkingDesk desk(library_, folder_);
  desk.enter(WindowMode::mark);
  std::vector<Vector3d> const points = {Vector3d(0.5, 0, 0.8).normalized(), Vector3d(0.4, 0.5, 0.8).normalized(),
                                        Vector3d(0.7, -0.4, 0.8).normalized(), Vector3d(0.3, -0.2, 0.9).normalized()};
  for (std::size_t view = 0; view < 4; ++view) {
    ASSERT_TRUE(desk.show(view));
    desk.draw(333, 517);
    auto const& seen = scene_.set.views[view];
    for (auto const& p : points)
      EXPECT_EQ(click(desk, seen.image.camera.project(seen.object_from_camera->inverse() * p)), "");
  }
  EXPECT_NE(desk.text()[3].find("enough"), std::string::npos);
  Context context;
  ScanSet set = read_scan_set(folder_, context);
  read_poses(folder_ / "marks.json", set);
  // Poses come back up to the marks' depths, which are those of pixels' centres.
  Isometry3d const first = *scene_.set.views[0].object_from_camera;
  for (std::size_t view = 0; view < 4; ++view) {
    Isometry3d const wanted = first.inverse() * *scene_.set.views[view].object_from_camera;
    EXPECT_LT((set.views[view].object_from_camera->translation() - wanted.translation()).norm(), 0.1) << view;
  }
}

TEST_F(WindowFolder, PointsNeedDepth) {
  MarkingDesk desk(library_, folder_);
  desk.enter(WindowMode::mark);
  desk.draw(640, 480);
  EXPECT_NE(click(desk, {1, 1}), "");    // background
  EXPECT_NE(click(desk, {-3, 20}), "");  // beside the picture
  EXPECT_NE(click(desk, {255.8, 191}), "");
  EXPECT_NE(click(desk, {1e8, -1e8}), "");
  EXPECT_FALSE(fs::exists(folder_ / "marks.json"));
  EXPECT_EQ(click(desk, {128, 96}), "");
  auto const marks = RegistrationMarks::from_json(read_json(folder_ / "marks.json"), {});
  ASSERT_EQ(marks.of("000").size(), 1U);
  EXPECT_EQ(marks.of("000")[0].name, "1");
  EXPECT_LT((marks.of("000")[0].pixel - Vector2d(128, 96)).norm(), 0.01);
  EXPECT_EQ(desk.obey(Command::remove_last), "");
  EXPECT_TRUE(RegistrationMarks::from_json(read_json(folder_ / "marks.json"), {}).empty());
  EXPECT_NE(desk.obey(Command::remove_last), "");  // nothing left
}

TEST_F(WindowFolder, APointThatIsPassedOverStaysPassedOver) {
  MarkingDesk desk(library_, folder_);
  desk.enter(WindowMode::mark);
  desk.draw(640, 480);
  desk.obey(Command::previous_point);  // there is none below 1
  click(desk, {128, 96});
  desk.obey(Command::next_point);  // 2 is not seen here
  click(desk, {120, 96});
  click(desk, {112, 96});
  auto const marks = RegistrationMarks::from_json(read_json(folder_ / "marks.json"), {});
  EXPECT_TRUE(marks.has("000", "1") && marks.has("000", "3") && marks.has("000", "4"));
  EXPECT_FALSE(marks.has("000", "2"));
}

TEST_F(WindowFolder, OutlinesAreWhatMeshReads) {
  MarkingDesk desk(library_, folder_);
  desk.enter(WindowMode::outline);
  desk.draw(640, 480);
  EXPECT_NE(desk.obey(Command::close_outline), "");  // empty
  EXPECT_FALSE(fs::exists(folder_ / "mesh_marks.json"));
  click(desk, {10, 10});
  click(desk, {20, 10});
  EXPECT_NE(desk.obey(Command::close_outline), "");  // two corners enclose nothing
  desk.kind = OutlineKind::cut;
  EXPECT_EQ(desk.obey(Command::close_outline), "");  // but are a line
  desk.kind = OutlineKind::keep;
  for (Vector2d const& corner : {Vector2d(5, 5), Vector2d(50, 5), Vector2d(50, 40), Vector2d(5, 400)})
    EXPECT_EQ(click(desk, corner), "");
  EXPECT_EQ(desk.obey(Command::close_outline), "");
  desk.obey(Command::next_view);
  desk.kind = OutlineKind::remove;
  for (Vector2d const& corner : {Vector2d(0, 0), Vector2d(9, 0), Vector2d(0, 9)}) click(desk, corner);
  desk.obey(Command::close_outline);

  auto const marks = mesh_marks_from_json(read_json(folder_ / "mesh_marks.json"), {});
  ASSERT_EQ(marks.at("000").keep.size(), 1U);
  ASSERT_EQ(marks.at("000").cut.size(), 1U);
  EXPECT_EQ(marks.at("000").keep[0].size(), 4U);
  EXPECT_NEAR(marks.at("000").keep[0][3].y(), 191.5, 1e-9);  // a corner beside the picture goes to its border
  EXPECT_LT((marks.at("000").cut[0][1] - Vector2d(20, 10)).norm(), 0.01);
  EXPECT_EQ(marks.at("001").remove.size(), 1U);

  // Another session goes on from the file; Backspace takes corners, then outlines.
  MarkingDesk again(library_, folder_);
  again.enter(WindowMode::outline);
  again.draw(640, 480);
  EXPECT_EQ(again.overlay().lines.size(), 3U);  // two and the open one
  click(again, {10, 10});
  again.obey(Command::remove_last);
  EXPECT_EQ(mesh_marks_from_json(read_json(folder_ / "mesh_marks.json"), {}).at("000").cut.size(), 1U);
  again.obey(Command::remove_last);
  EXPECT_TRUE(mesh_marks_from_json(read_json(folder_ / "mesh_marks.json"), {}).at("000").cut.empty());
}

TEST_F(WindowFolder, AFileThatIsNoneOfOursIsLeftAlone) {
  for (char const* text :
       {"{\"marks\": 3}", "[1, 2]", "{", "{\"marks\": {\"000\": {\"1\": [1]}}}", "{\"other\": {}}"}) {
    write_file(folder_ / "marks.json", text);
    MarkingDesk desk(library_, folder_);
    EXPECT_THROW(desk.enter(WindowMode::mark), Error) << text;
    EXPECT_EQ(read_file(folder_ / "marks.json"), text);
  }
}

TEST_F(WindowFolder, AViewWithoutItsPictureSaysSo) {
  fs::remove(folder_ / "views/001/mask.png");
  MarkingDesk desk(library_, folder_);
  desk.enter(WindowMode::mark);
  desk.obey(Command::next_view);
  EXPECT_EQ(desk.view(), 1U);
  cv::Mat4b const drawn = desk.draw(100, 100);
  EXPECT_EQ(cv::countNonZero(drawn.reshape(1)), 0);
  EXPECT_NE(desk.click(50, 50).find("mask.png"), std::string::npos);
  EXPECT_FALSE(desk.show(4));
  desk.step(-2);
  EXPECT_EQ(desk.view(), 3U);  // around
}

TEST(RegistrationMarks, SaysWhoIsNotPlaced) {
  RegistrationMarks marks;
  std::vector<std::string> const views = {"a", "b", "c"};
  EXPECT_EQ(marks.unplaced(views), views);
  for (char const* view : {"a", "b"}) {
    for (char const* name : {"1", "2", "3"}) marks.set(view, name, {1, 2});
  }
  EXPECT_EQ(marks.unplaced(views), std::vector<std::string>{"c"});
  // A chain: c shares points with b alone.
  for (char const* name : {"4", "5", "3"}) {
    marks.set("b", name, {3, 4});
    marks.set("c", name, {3, 4});
  }
  EXPECT_TRUE(marks.unplaced(views).empty());
  EXPECT_EQ(marks.next_number("a"), 4);
  EXPECT_EQ(marks.next_number("c"), 1);
  EXPECT_TRUE(marks.unplaced({}).empty());
}

TEST_F(WindowFolder, KeyframesAreReadBack) {
  Keyframes keyframes;
  keyframes.remove_last();
  keyframes.between = 5;
  for (std::size_t i = 0; i < 3; ++i) {
    auto const& view = scene_.set.views[i];
    keyframes.add({view.image.camera, *view.object_from_camera, ""});
  }
  keyframes.remove_last();
  write_file(folder_ / "scanview-path-000.json", "somebody else's");
  keyframes.save(folder_);
  keyframes.save(folder_);
  EXPECT_EQ(keyframes.file(), folder_ / "scanview-path-001.json");
  EXPECT_EQ(first_free(folder_, "scanview-path-", ".json"), folder_ / "scanview-path-002.json");
  EXPECT_EQ(read_file(folder_ / "scanview-path-000.json"), "somebody else's");
  EXPECT_THROW(Keyframes().save(folder_ / "nowhere"), Error);
  auto const path = read_camera_path(keyframes.file(), scene_.set, 256, 192);
  ASSERT_EQ(path.size(), 6U);
  EXPECT_EQ(path[0].camera, scene_.set.views[0].image.camera);
  EXPECT_TRUE(path[5].object_from_camera.isApprox(*scene_.set.views[1].object_from_camera, 1e-12));
}

TEST_F(WindowFolder, ChangesAreNoticedOnceTheyAreOver) {
  FileWatch watch(watched_files(folder_, scene_.set));
  EXPECT_FALSE(watch.changed());
  fs::path const mesh = folder_ / "views/002/mesh.ply";
  fs::last_write_time(mesh, fs::last_write_time(mesh) + std::chrono::seconds(5));
  EXPECT_FALSE(watch.changed());  // perhaps still being written
  EXPECT_TRUE(watch.changed());
  EXPECT_FALSE(watch.changed());
  fs::remove(mesh);
  EXPECT_FALSE(watch.changed());
  fs::remove(folder_ / "scanset.json");
  EXPECT_FALSE(watch.changed());  // goes on changing
  EXPECT_TRUE(watch.changed());
  EXPECT_FALSE(FileWatch().changed());
  EXPECT_TRUE(watched_files({}, scene_.set).empty());
}

/// Until the watch has seen a change twice.
ViewedSet::Reload settle(ViewedSet& viewed) {
  Context context;
  viewed.follow_files(context);
  return viewed.follow_files(context);
}

TEST_F(WindowFolder, AViewedSetFollowsItsFiles) {
  auto const gl = make_offscreen_context();
  gl->make_current();
  ViewedSet viewed(*gl, library_, folder_, {}, BackEnd::cpu, 0);
  PathCamera const eye{scene_.set.views[1].image.camera, *scene_.set.views[1].object_from_camera, ""};
  viewed.renderer().set_patient(true);
  EXPECT_GT(test::drawn_pixels(viewed.render(eye, 64, 48).frame.color), 100U);
  EXPECT_FALSE(viewed.picture_has_come());
  EXPECT_NEAR(viewed.inset().eye.x, 0, 1e-6);
  EXPECT_EQ(settle(viewed), ViewedSet::Reload::unchanged);

  // Another error budget: a threshold that nobody has touched follows it, one that was chosen stays.
  double const before = viewed.look().threshold;
  auto const rewrite = [&](double rms) {
    scene_.set.error_budget.registration = {rms, 2 * rms};
    write_manifest(folder_, scene_.set);
  };
  rewrite(0.25);
  ASSERT_EQ(settle(viewed), ViewedSet::Reload::done);
  EXPECT_GT(viewed.look().threshold, before + 0.4);
  EXPECT_EQ(viewed.look(), viewed.default_look());
  Look look = viewed.look();
  look.threshold = 0.123;
  look.cosine = false;
  viewed.set_look(look);
  rewrite(0.125001);
  ASSERT_EQ(settle(viewed), ViewedSet::Reload::done);
  EXPECT_EQ(viewed.look(), look);
  EXPECT_NEAR(viewed.default_look().threshold, before + 0.5, 0.1);

  // What cannot be read leaves everything as it was.
  auto const good = viewed.library();
  write_file(folder_ / "scanset.json", "{");
  ASSERT_EQ(settle(viewed), ViewedSet::Reload::failed);
  EXPECT_NE(viewed.problem().find("scanset.json"), std::string::npos);
  EXPECT_EQ(viewed.library(), good);
  viewed.renderer().set_patient(true);
  EXPECT_GT(test::drawn_pixels(viewed.render(eye, 64, 48).frame.color), 100U);
  rewrite(0.1);
  EXPECT_EQ(settle(viewed), ViewedSet::Reload::done);

  // One view less in the manifest, one more that cannot be drawn.
  scene_.set.views.pop_back();
  write_manifest(folder_, scene_.set);
  fs::remove(folder_ / "views/000/mesh.ply");
  ASSERT_EQ(settle(viewed), ViewedSet::Reload::done);
  EXPECT_EQ(viewed.inset().views.size(), 3U);
  EXPECT_EQ(viewed.library()->failures().size(), 1U);
}

TEST_F(WindowFolder, BothBackEndsDrawTheLook) {
  auto const gl = make_offscreen_context();
  gl->make_current();
  ViewedSet viewed(*gl, library_, folder_, {}, std::nullopt, 0);
  PathCamera const eye{scene_.set.views[1].image.camera, *scene_.set.views[1].object_from_camera, ""};
  Look look = viewed.look();
  look.show = SoftZ::Show::winner;
  viewed.set_look(look);
  for (BackEnd const back_end : viewed.back_ends()) {
    viewed.draw_with(back_end);
    EXPECT_EQ(viewed.renderer().back_end(), back_end);
    EXPECT_EQ(viewed.look(), look);
    viewed.renderer().set_patient(true);
    EXPECT_GT(test::drawn_pixels(viewed.render(eye, 64, 48).frame.color), 100U);
  }
}

}  // namespace
}  // namespace scanview
