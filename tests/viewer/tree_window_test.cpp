#include "viewer/window/tree_window.h"

#include <gtest/gtest.h>

#include <cmath>
#include <cstdlib>
#include <numbers>
#include <random>
#include <set>

#include "base/error.h"
#include "viewer/layered/ldi_builder.h"
#include "viewer/scene.h"
#include "viewer/window/commands.h"
#include "viewer/window/tree_eye.h"
#include "viewer/window/tree_panel.h"

namespace scanview {
namespace {

using Eigen::Isometry3d;
using Eigen::Vector2d;
using Eigen::Vector3d;

constexpr int kSize = 96;
Camera const kCamera = Camera::perspective(160, 120, 150, 150, 79.5, 59.5);

std::shared_ptr<LdiTree> tree_of_views(std::vector<View> const& views) {
  LdiOptions options;
  options.resolution = 16;
  LdiBuilder builder(options);
  Context context;
  builder.add(views, context);
  return std::make_shared<LdiTree>(builder.build(Unit::m, context));
}

/// A ball of radius 1, from six sides.
std::shared_ptr<LdiTree> ball() {
  Camera const camera = Camera::perspective(kSize, kSize, 180, 180, 47.5, 47.5);
  std::vector<View> views;
  for (int i = 0; i < 6; ++i) {
    Isometry3d const pose = test::around(60 * i, i % 2 == 0 ? 20 : -20);
    views.push_back(test::capture(test::sphere({0, 0, 0}, 1), camera, pose, "00" + std::to_string(i)));
  }
  return tree_of_views(views);
}

/// The inside of a ball of radius 5, from eyes about its middle that look around.
std::shared_ptr<LdiTree> hall() {
  auto const inside = [](Vector3d const& o, Vector3d const& d) -> std::optional<test::Hit> {
    double const a = d.squaredNorm(), b = o.dot(d), c = o.squaredNorm() - 25;
    double const t = (-b + std::sqrt(b * b - a * c)) / a;
    return test::Hit{t, test::paint(0.2 * (o + t * d))};
  };
  Camera const camera = Camera::perspective(kSize, kSize, 48, 48, 47.5, 47.5);
  std::vector<View> views;
  for (int i = 0; i < 6; ++i) {
    double const angle = i * std::numbers::pi / 3;
    Vector3d const eye(0.5 * i - 1, 0.3, 0), way(std::sin(angle), 0.25 * (i % 3 - 1), std::cos(angle));
    views.push_back(test::capture(inside, camera, test::look_at(eye, eye + way), "00" + std::to_string(i)));
  }
  return tree_of_views(views);
}

bool same_picture(cv::Mat4b const& a, cv::Mat4b const& b) {
  return a.size() == b.size() && std::equal(a.begin(), a.end(), b.begin());
}

TEST(TreeCommands, KeysMeanWhatTheHelpSays) {
  std::set<Command> commands;
  for (char const key : std::string("OCVGTPKHRNB ")) {
    auto const command = tree_command_of_key(key);
    ASSERT_TRUE(command) << key;
    EXPECT_TRUE(commands.insert(*command).second) << key;
    EXPECT_FALSE(walk_step_of_key(key)) << key;
    EXPECT_FALSE(view_of_key(key)) << key;
    if (std::string("RNB ").find(key) != std::string::npos) continue;
    EXPECT_NE(("\n" + tree_window_help()).find(std::string("\n") + key + ": "), std::string::npos) << key;
  }
  constexpr int kEscape = 256, kTab = 258, kHome = 268;
  EXPECT_EQ(tree_command_of_key(kEscape), Command::quit);
  EXPECT_EQ(tree_command_of_key(kTab), Command::toggle_panel);
  EXPECT_EQ(tree_command_of_key(kHome), Command::reset);
  EXPECT_FALSE(tree_command_of_key('W'));
}

TEST(TreeLook, KeysGoThroughAllThereIs) {
  LdiRenderOptions options;
  options.covered = 0.7;
  options.stamp_px = 1.2;  // not one of those that the key chooses
  TreeLook look = tree_look_of(options);
  EXPECT_EQ(look.gaps, TreeGaps::filled);
  EXPECT_EQ(with_tree_look(options, look).covered, 0.7);
  std::set<double> sizes;
  for (std::size_t i = 0; i < std::size(kStampSizes); ++i) {
    EXPECT_TRUE(change_tree_look(look, Command::next_detail));
    sizes.insert(look.stamp_px);
    EXPECT_EQ(with_tree_look(options, look).stamp_px, look.stamp_px);
    with_tree_look(options, look).validate();
  }
  EXPECT_EQ(sizes, std::set<double>(std::begin(kStampSizes), std::end(kStampSizes)));
  EXPECT_EQ(look.stamp_px, 1);  // the next one above 1.2 was 1.4
  std::set<std::string> words;
  for (int i = 0; i < 3; ++i) {
    words.insert(*change_tree_look(look, Command::next_gaps));
    words.insert(*change_tree_look(look, Command::next_cells));
    bool const fills = with_tree_look(options, look).gaps == LdiRenderOptions::Gaps::filled;
    EXPECT_EQ(fills, look.gaps == TreeGaps::filled);
  }
  EXPECT_EQ(words.size(), 6U);
  EXPECT_EQ(look.gaps, TreeGaps::filled);
  EXPECT_TRUE(change_tree_look(look, Command::toggle_levels));
  EXPECT_TRUE(look.levels);
  EXPECT_FALSE(change_tree_look(look, Command::save_picture));
}

TEST(TreeLook, MagentaShowsWhatIsAGapToTheRenderer) {
  cv::Mat4b picture(1, 3, cv::Vec4b(1, 2, 3, 255));
  picture(0, 1)[3] = 127;
  picture(0, 2)[3] = 128;
  paint_gaps(picture, 0.5);
  EXPECT_EQ(picture(0, 0), cv::Vec4b(1, 2, 3, 255));
  EXPECT_EQ(picture(0, 1), cv::Vec4b(255, 0, 255, 255));
  EXPECT_EQ(picture(0, 2), cv::Vec4b(1, 2, 3, 128));
}

TEST(TreeEye, GoesAroundObjectsAndWalksInScenes) {
  auto const object = ball(), scene = hall();
  TreeEye around(*object), within(*scene);
  EXPECT_EQ(around.mode(), TreeEye::Mode::orbit);
  EXPECT_EQ(within.mode(), TreeEye::Mode::walk);
  // The object is framed: its middle in the middle, from where cameras were.
  PathCamera const eye = around.current();
  Vector3d const middle = eye.object_from_camera.inverse() * object->center;
  EXPECT_NEAR(middle.x(), 0, 1e-9);
  EXPECT_NEAR(middle.y(), 0, 1e-9);
  EXPECT_NEAR(middle.z(), 4, 0.1);
  // The scene begins at its first view.
  Isometry3d const& first = *scene->views[0].object_from_camera;
  Isometry3d const start = within.current().object_from_camera;
  EXPECT_TRUE(start.isApprox(first, 1e-9));
  within.walk({0.1, 0, 0, 30});
  EXPECT_NEAR((within.current().object_from_camera.translation() - first.translation()).norm(), 0.1 * scene->radius,
              0.01 * scene->radius);
  std::size_t const nearest = *within.middle_view();
  for (View const& view : scene->views)
    EXPECT_LE((scene->views[nearest].eye() - scene->center).norm(), (view.eye() - scene->center).norm());
  within.reset();
  EXPECT_TRUE(within.current().object_from_camera.isApprox(start, 1e-12));
}

TEST(TreeEye, ChangesItsModeWhereItStands) {
  auto const scene = hall();
  TreeEye eye(*scene);
  eye.walk({0.1, 0.05, 0.02, 77});
  Isometry3d const before = eye.current().object_from_camera;
  Vector3d const pivot(1, 0, -4);
  eye.change_mode(pivot);
  EXPECT_EQ(eye.mode(), TreeEye::Mode::orbit);
  EXPECT_TRUE(eye.current().object_from_camera.isApprox(before, 1e-9));
  EXPECT_EQ(eye.orbit().pivot(), pivot);
  eye.turn(90);
  EXPECT_NEAR((eye.current().object_from_camera.translation() - pivot).norm(), (before.translation() - pivot).norm(),
              1e-9);
  Isometry3d const turned = eye.current().object_from_camera;
  eye.change_mode(pivot);
  EXPECT_EQ(eye.mode(), TreeEye::Mode::walk);
  EXPECT_TRUE(eye.current().object_from_camera.translation().isApprox(turned.translation(), 1e-9));
  EXPECT_NEAR(eye.current().object_from_camera.linear().col(2).dot(turned.linear().col(2)), 1, 1e-9);
}

TEST(TreeEye, JumpsFromViewToView) {
  auto const object = ball();
  TreeEye eye(*object);
  EXPECT_EQ(eye.view_after(1), 0U);
  EXPECT_EQ(eye.view_after(-1), 5U);
  for (std::size_t view = 0; view < 6; ++view) {
    ASSERT_TRUE(eye.jump(view));
    EXPECT_TRUE(eye.current().object_from_camera.isApprox(*object->views[view].object_from_camera, 1e-12));
    EXPECT_EQ(eye.current().camera, object->views[view].image.camera);
    EXPECT_EQ(eye.view_after(1), (view + 1) % 6);
  }
  EXPECT_FALSE(eye.jump(6));
  eye.reset();
  EXPECT_EQ(eye.view_after(1), 0U);
}

TEST(TreeEye, KnowsWhatIsUpHoweverFewViewsLookWhichWay) {
  std::mt19937 random(5);
  auto const number = [&](double low, double high) {
    return std::uniform_real_distribution<double>(low, high)(random);
  };
  // Level cameras that look steeply up, all around: their upward axes point anywhere.
  Vector3d const up = Vector3d(0.5, 1, 0.3).normalized();
  Ground const ground(up);
  std::vector<View> views;
  for (int i = 0; i < 9; ++i) {
    double const heading = number(0, 3), pitch = number(0.9, 1.3);
    Vector3d const level = std::sin(heading) * ground.east + std::cos(heading) * ground.north;
    View view;
    view.object_from_camera =
        test::look_at({1, 2, 3}, Vector3d(1, 2, 3) + std::cos(pitch) * level + std::sin(pitch) * up, up);
    views.push_back(view);
  }
  EXPECT_NEAR(up_of_views(views).dot(up), 1, 1e-9);
  // One alone says it by its upward axis; what is nearly an axis is that axis.
  views.resize(1);
  views[0].object_from_camera = test::look_at({0, 0, 0}, {0, 0.05, 1}, {0.03, 1, 0});
  EXPECT_EQ(up_of_views(views), Vector3d::UnitY());
  EXPECT_EQ(up_of_views({}), Vector3d::UnitY());
}

TEST(CellEdges, AreTheBoxesOfTheCellsThatAreDrawn) {
  auto const tree = ball();
  ViewedTree viewed(tree, {}, 2);
  Isometry3d const pose = test::around(20, 10, 3);
  viewed.render(kCamera, pose, {}, 0);
  auto const& traversed = viewed.traversed();
  CellEdges const edges = cell_edges(*tree, traversed, ShownCells::drawn);
  ASSERT_EQ(edges.lines.size(), edges.colors.size());
  using Point = std::array<float, 3>;
  auto const point = [](Eigen::Vector3f const& p) { return Point{p.x(), p.y(), p.z()}; };
  std::set<std::pair<Point, Point>> lines;
  for (auto const& line : edges.lines) {
    auto const a = point(edges.vertices[static_cast<std::size_t>(line[0])]);
    auto const b = point(edges.vertices[static_cast<std::size_t>(line[1])]);
    EXPECT_TRUE(lines.emplace(std::min(a, b), std::max(a, b)).second);
  }
  // Brute force: every box's twelve edges, and no others.
  std::set<std::pair<Point, Point>> expected;
  for (TraversedCell const& at : traversed) {
    if (at.descended) continue;
    auto const box = tree->box(tree->cells[static_cast<std::size_t>(at.cell)]);
    for (int corner = 0; corner < 8; ++corner)
      for (int axis = 0; axis < 3; ++axis) {
        if ((corner & 1 << axis) != 0) continue;
        using Corner = Eigen::AlignedBox3d::CornerType;
        auto const a = point(box.corner(static_cast<Corner>(corner)).cast<float>());
        auto const b = point(box.corner(static_cast<Corner>(corner | 1 << axis)).cast<float>());
        expected.emplace(std::min(a, b), std::max(a, b));
      }
  }
  EXPECT_EQ(lines.size(), expected.size());
  auto const near = [](Point const& a, Point const& b) {
    return std::abs(a[0] - b[0]) + std::abs(a[1] - b[1]) + std::abs(a[2] - b[2]) < 1e-5F;
  };
  auto other = expected.begin();
  for (auto const& line : lines) {
    EXPECT_TRUE(near(line.first, other->first) && near(line.second, other->second));
    ++other;
  }
  EXPECT_GT(cell_edges(*tree, traversed, ShownCells::traversed).lines.size(), lines.size());
  EXPECT_TRUE(cell_edges(*tree, traversed, ShownCells::none).lines.empty());
}

TEST(CellEdges, AreDrawnWhereTheCameraSeesThem) {
  auto const tree = ball();
  ViewedTree viewed(tree, {}, 2);
  Isometry3d const pose = test::around(20, 10, 3);
  cv::Mat4b const plain = viewed.render(kCamera, pose, {}, 0);
  TreeLook look;
  look.cells = ShownCells::drawn;
  cv::Mat4b const boxes = viewed.render(kCamera, pose, look, 0);
  // Beside the ball nothing hides a corner; what is drawn is near an edge of a box.
  std::size_t corners = 0;
  for (TraversedCell const& at : viewed.traversed()) {
    if (at.descended) continue;
    auto const box = tree->box(tree->cells[static_cast<std::size_t>(at.cell)]);
    for (int corner = 0; corner < 8; ++corner) {
      Vector3d const p = box.corner(static_cast<Eigen::AlignedBox3d::CornerType>(corner));
      Vector2d const pixel = kCamera.project(pose.inverse() * p);
      int const x = static_cast<int>(std::lround(pixel.x())), y = static_cast<int>(std::lround(pixel.y()));
      if (x < 1 || y < 1 || x > 158 || y > 118) continue;
      if (test::drawn_pixels(plain(cv::Rect(x - 1, y - 1, 3, 3))) > 0) continue;
      EXPECT_GT(test::drawn_pixels(boxes(cv::Rect(x - 1, y - 1, 3, 3))), 0U) << x << " " << y;
      ++corners;
    }
  }
  EXPECT_GT(corners, 10U);
  EXPECT_FALSE(same_picture(plain, boxes));
  EXPECT_TRUE(same_picture(viewed.render(kCamera, pose, {}, 0), plain));
}

TEST(TreeLevels, PixelsHaveTheColourOfTheirCells) {
  auto const tree = ball();
  ViewedTree viewed(tree, {}, 2);
  Isometry3d const pose = test::around(20, 10, 3);
  TreeLook look;
  look.levels = true;
  look.stamp_px = 4;  // one level for nearly all
  look.gaps = TreeGaps::background;
  cv::Mat4b const tinted = viewed.render(kCamera, pose, look, 0);
  auto const counts = count_levels(*tree, viewed.traversed());
  std::set<int> drawn_levels;
  for (auto const& count : counts)
    if (count.drawn > 0) drawn_levels.insert(count.level);
  std::size_t pixels = 0, unknown = 0;
  for (cv::Vec4b const& pixel : tinted) {
    if (pixel[3] == 0) continue;
    ++pixels;
    Eigen::Vector3f const color =
        Eigen::Vector3f(pixel[2], pixel[1], pixel[0]) / std::max({pixel[0], pixel[1], pixel[2]});
    bool known = false;
    for (int const level : drawn_levels) known = known || (color - level_color(*tree, level)).norm() < 0.05F;
    unknown += !known;
  }
  EXPECT_LT(unknown, pixels / 200);  // on the border of a cell
  EXPECT_GT(pixels, 1000U);
  EXPECT_GT(
      (level_color(*tree, tree->cells.front().key.level) - level_color(*tree, tree->cells.back().key.level)).norm(),
      0.5F);
}

TEST(CellMap, ShowsCellsAndViewsFromAbove) {
  auto const tree = hall();
  TreeEye eye(*tree);
  ViewedTree viewed(tree, {}, 2);
  PathCamera const at = eye.current();
  viewed.render(kCamera, at.object_from_camera, {}, 0);
  CellMap const map = cell_map(*tree, viewed.traversed(), Vector3d(0.1, 1, 0), kCamera, at.object_from_camera);
  ASSERT_EQ(map.views.size(), 6U);
  EXPECT_NEAR((map.eye - map.views[0].at).norm(), 0, 1e-9);
  double const unit = (map.views[1].at.x() - map.views[0].at.x()) / 0.5;  // x is east
  EXPECT_GT(unit, 0);
  EXPECT_NEAR(map.bar * unit, map.bar_width, 1e-9);
  EXPECT_GT(map.cells.size(), 10U);
  double width = 1;
  for (CellMap::Cell const& cell : map.cells) {
    Vector2d const size = cell.high - cell.low;
    EXPECT_NEAR(size.x(), size.y(), 1e-9);
    EXPECT_LE(size.x(), width + 1e-9);  // coarser first
    width = size.x();
  }
  // The first view looks along + z, which is south.
  EXPECT_GT(0.5 * (map.view[0] + map.view[1]).y(), map.eye.y());
  EXPECT_EQ(map.nearest(map.views[3].at + Vector2d(0.005, 0), 0.05), 3U);
  EXPECT_FALSE(map.nearest({0, 0}, 0.01));
  // From far away the eye is at the rim.
  CellMap const far = cell_map(*tree, {}, Vector3d::UnitY(), kCamera, test::look_at({0, 0, 99}, {0, 0, 0}));
  EXPECT_LT(far.eye.y(), GroundMap::kHeight);
  EXPECT_GT(far.eye.y(), 0.9 * GroundMap::kHeight);
}

TEST(ViewedTree, StepsEndWithTheWholePicture) {
  auto const tree = hall();
  ViewedTree viewed(tree, {}, 2);
  Camera const camera = Camera::perspective(320, 240, 200, 200, 159.5, 119.5);
  Isometry3d const pose = test::look_at({0, 0.3, 0}, {1, 0.2, 0.4});
  TreeLook const look;
  constexpr double kOneStep = 1e-6;
  viewed.render(camera, pose, look, kOneStep);
  std::size_t const first = viewed.figures().cells;
  ASSERT_FALSE(viewed.is_complete());
  int steps = 1;
  for (; !viewed.is_complete() && steps < 20; ++steps) viewed.render(camera, pose, look, kOneStep);
  EXPECT_TRUE(viewed.is_complete());
  EXPECT_GT(steps, 2);
  EXPECT_GT(viewed.figures().cells, first);
  cv::Mat4b const in_steps = viewed.shown().frame.color.clone();
  double const spent = viewed.figures().milliseconds;
  viewed.render(camera, pose, look, kOneStep);
  EXPECT_EQ(viewed.figures().milliseconds, spent);  // nothing is left to do
  std::size_t const cells = viewed.figures().cells;
  cv::Mat4b const at_once = viewed.render_at_once(camera, pose, look);
  EXPECT_EQ(viewed.figures().cells, cells);
  std::size_t other = 0;
  for (int y = 0; y < at_once.rows; ++y)
    for (int x = 0; x < at_once.cols; ++x) other += test::greatest_difference(at_once(y, x), in_steps(y, x)) > 8;
  EXPECT_LT(other, at_once.total() / 100);
  // Another camera, or another look, begins anew.
  viewed.render(camera, test::look_at({0, 0.3, 0}, {1, 0.2, 0.5}), look, kOneStep);
  EXPECT_FALSE(viewed.is_complete());
  viewed.render(camera, pose, look, 0);
  EXPECT_TRUE(viewed.is_complete());
}

TEST(ViewedTree, GapsLookAsTheyAreToLook) {
  auto const tree = hall();
  ViewedTree viewed(tree, {}, 2);
  Isometry3d const pose = test::look_at({3, 0.3, 0}, {4, 0.3, -0.6});
  TreeLook look;
  look.stamp_px = 0.7;
  look.gaps = TreeGaps::magenta;
  cv::Mat4b const magenta = viewed.render(kCamera, pose, look, 0);
  std::size_t const count =
      static_cast<std::size_t>(std::count(magenta.begin(), magenta.end(), cv::Vec4b(255, 0, 255, 255)));
  EXPECT_EQ(count, static_cast<std::size_t>(std::lround(viewed.figures().gaps * static_cast<double>(magenta.total()))));
  EXPECT_EQ(viewed.figures().uncovered, viewed.figures().gaps);
  look.gaps = TreeGaps::filled;
  viewed.render(kCamera, pose, look, 0);
  EXPECT_LE(viewed.figures().uncovered, viewed.figures().gaps);
}

/// A tree one of whose finest cells is not what was written.
std::shared_ptr<LdiTree> damaged(LdiTree const& whole) {
  auto tree = std::make_shared<LdiTree>(whole);
  tree->path = "hall.ldi";
  tree->checked = std::make_shared<std::vector<std::uint8_t>>(tree->cells.size(), std::uint8_t{1});
  tree->checked->back() = 0;
  tree->cells.back().hash ^= 1;
  return tree;
}

TEST(ViewedTree, ADamagedCellIsLeftOutAndNamedOnce) {
  auto const whole = hall();
  auto const tree = damaged(*whole);
  ViewedTree viewed(tree, {}, 2);
  Vector3d const at = tree->box(tree->cells.back()).center();
  Camera const camera = Camera::perspective(320, 240, 200, 200, 159.5, 119.5);
  for (int i = 0; i < 3; ++i) {
    Isometry3d const pose = test::look_at(0.5 * at, at + Vector3d(0.01 * i, 0, 0));
    constexpr double kOneStep = 1e-6;
    int steps = 0;
    do viewed.render(camera, pose, {}, kOneStep);
    while (!viewed.is_complete() && ++steps < 20);
    EXPECT_TRUE(viewed.is_complete());
    EXPECT_TRUE(viewed.has_failed());
    ASSERT_EQ(viewed.failures().size(), 1U);
    EXPECT_NE(viewed.failures()[0].find("hall.ldi"), std::string::npos);
    EXPECT_NE(viewed.failures()[0].find("damaged"), std::string::npos);
    EXPECT_GT(test::drawn_pixels(viewed.shown().frame.color), camera.width() * camera.height() / 2U);
  }
  viewed.render_at_once(camera, test::look_at(0.5 * at, at), {});
  EXPECT_TRUE(viewed.has_failed());
  EXPECT_EQ(viewed.failures().size(), 1U);
  // Where it is not seen, nothing is missing.
  viewed.render(camera, test::look_at(0.5 * at, -at), {}, 0);
  EXPECT_FALSE(viewed.has_failed());
  EXPECT_GT(viewed.figures().cells, 0U);
  EXPECT_EQ(viewed.failures().size(), 1U);
}

TEST(TreePanel, SaysWhatThePictureIsMadeOf) {
  EXPECT_EQ(level_text({-4, 12, 3}, Unit::m), "0.0625 m: 12 drawn, 3 above");
  EXPECT_EQ(level_text({1, 5, 0}, Unit::arbitrary), "2: 5 drawn");
  TreePanelContent content;
  content.cells = 200;
  content.bytes = 5 << 20;
  content.figures.cells = 34;
  content.figures.splats = 1'250'000;
  content.figures.gaps = 0.0123;
  content.figures.uncovered = 0.001;
  content.figures.milliseconds = 31.26;
  std::vector<std::string> const expected = {"refining, 31.3 ms", "34 cells traversed, 1.25 M splats",
                                             "gaps 1.23 %, uncovered 0.1 %", "tree: 200 cells, 5.0 MB"};
  EXPECT_EQ(tree_frame_text(content), expected);
  content.progress = TreePanelContent::Progress::complete;
  EXPECT_EQ(tree_frame_text(content)[0], "complete, 31.3 ms");
  content.progress = TreePanelContent::Progress::damaged;
  EXPECT_EQ(tree_frame_text(content)[0], "complete but for damage, 31.3 ms");
}

bool has_display() { return std::getenv("DISPLAY") != nullptr || std::getenv("WAYLAND_DISPLAY") != nullptr; }

TEST(TreeWindow, WithoutADisplaySaysSo) {
  if (has_display()) GTEST_SKIP() << "a display is there";
  Context context;
  try {
    view_ldi_tree(ball(), {}, context);
    FAIL();
  } catch (Error const& error) {
    EXPECT_EQ(error.code(), ErrorCode::io);
    EXPECT_NE(error.message().find("display"), std::string::npos);
  }
}

TEST(TreeWindow, MeasuresAFullTurn) {
  if (!has_display()) GTEST_SKIP() << "no display is there";
  TreeWindowOptions options;
  options.width = 500;
  options.height = 300;
  options.frames = 6;
  Context context;
  auto const scene = hall();
  for (auto const& tree : {ball(), scene}) {
    TreeWindowResult const result = view_ldi_tree(tree, options, context);
    ASSERT_TRUE(result.times);
    EXPECT_GT(result.times->width, 100);
    EXPECT_GT(result.times->frame_milliseconds, 0);
    EXPECT_GT(result.cells, 5);
    EXPECT_GT(result.splats, 1000);
    EXPECT_TRUE(result.failures.empty());
  }
  auto const broken = damaged(*scene);
  broken->checked->assign(broken->cells.size(), 0);
  for (LdiCell& cell : broken->cells) cell.hash ^= 1;
  TreeWindowResult const of_broken = view_ldi_tree(broken, options, context);
  EXPECT_EQ(of_broken.failures.size(), 1U);
  EXPECT_EQ(of_broken.uncovered, 1);
  EXPECT_EQ(context.warnings().size(), 1U);
  options.milliseconds = -1;
  EXPECT_THROW(view_ldi_tree(scene, options, context), Error);
}

}  // namespace
}  // namespace scanview
