#include "acquire/capture.h"

#include <gtest/gtest.h>

#include <functional>

#include "tests/expect_error.h"
#include "tests/temporary_folder.h"

namespace scanview {
namespace {

namespace fs = std::filesystem;

Json sweep() {
  return {{"pattern", "sweep"},
          {"views", Json::array({"view_{:03d}", 0, 2})},
          {"left", "left/{:04d}.png"},
          {"right", "right/{}.png"},
          {"first", 0},
          {"last", 95},
          {"rig", "rig.yml"}};
}
Json gray() {
  Json json = sweep();
  json["pattern"] = "gray";
  json["bits"] = 3;
  json["last"] = 5;
  return json;
}
Json camera() { return {{"width", 96}, {"height", 72}, {"fx", 110}, {"fy", 111}, {"cx", 47}, {"cy", 35}}; }

/// 'key', as messages have it.
std::string quoted(char const* key) {
  std::string text = "'";
  return text.append(key).append("'");
}

class CaptureFile : public ::testing::Test {
 protected:
  Capture read(Json const& json) const {
    write_json(folder_.path() / "capture.json", json);
    return read_capture(folder_.path() / "capture.json", folder_.path());
  }
  /// The base with one change is refused in words that hold the text.
  void expect_refused(Json json, std::function<void(Json&)> const& change, std::string const& text) const {
    change(json);
    SCOPED_TRACE(json.dump());
    EXPECT_SCANVIEW_ERROR(read(json), ErrorCode::bad_input, text);
    EXPECT_SCANVIEW_ERROR(read(json), ErrorCode::bad_input, "capture.json");
  }
  TemporaryFolder folder_;
};

/// "c2 c2i white": the order of a capture, in the words of its own file.
std::string in_words(std::vector<GrayFrame> const& frames) {
  std::string text;
  for (GrayFrame const& frame : frames) {
    if (!text.empty()) text += ' ';
    if (frame.kind == GrayFrame::Kind::white) text += "white";
    if (frame.kind == GrayFrame::Kind::black) text += "black";
    if (frame.kind == GrayFrame::Kind::skip) text += "skip";
    if (frame.kind != GrayFrame::Kind::bit) continue;
    text += frame.is_row ? 'r' : 'c';
    text += std::to_string(frame.bit);
    if (frame.inverse) text += 'i';
  }
  return text;
}

TEST_F(CaptureFile, EveryKeyOfASweepIsRead) {
  Json json = sweep();
  json["first"] = 10;
  json["last"] = 33;
  json["color"] = "left_color.png";
  json["empty"] = "nothing";
  json["backdrop"] = "#3050a0";
  json["white"] = "{side}/white.png";
  json["black"] = Json::array({"l_black.png", "r_black.png"});
  Capture const capture = read(json);
  EXPECT_EQ(capture.pattern, Capture::Pattern::sweep);
  EXPECT_EQ(capture.views, (std::vector<std::string>{"view_000", "view_001", "view_002"}));
  EXPECT_EQ(capture.view_names(), (std::vector<std::string>{"000", "001", "002"}));
  EXPECT_EQ(capture.frame_count(), 24);
  EXPECT_EQ(capture.frame_path("view_001", Side::left, 0), folder_.path() / "view_001/left/0010.png");
  EXPECT_EQ(capture.frame_path("view_001", Side::right, 23), folder_.path() / "view_001/right/33.png");
  EXPECT_EQ(capture.path_of("view_002", *capture.color), folder_.path() / "view_002/left_color.png");
  EXPECT_EQ(capture.rig, "rig.yml");
  EXPECT_EQ(capture.empty, "nothing");
  EXPECT_EQ(*capture.backdrop, Eigen::Vector3d(0x30, 0x50, 0xa0));
  EXPECT_EQ((*capture.white)[0], "left/white.png");
  EXPECT_EQ((*capture.white)[1], "right/white.png");
  EXPECT_EQ((*capture.black)[1], "r_black.png");
  EXPECT_FALSE(capture.intrinsics);
}

TEST_F(CaptureFile, WhatIsOptionalMayBeNullOrLeftOut) {
  Json json = sweep();
  json.erase("rig");
  for (char const* key : {"white", "black", "color", "empty", "backdrop", "intrinsics", "bits", "row_bits",
                          "rows_first", "projector_columns", "projector_rows"})
    json[key] = nullptr;
  for (Json const& each : {json, sweep()}) {
    Capture const capture = read(each);
    EXPECT_FALSE(capture.white || capture.black || capture.color || capture.empty || capture.backdrop ||
                 capture.intrinsics || capture.projector_columns || capture.projector_rows);
  }
  EXPECT_FALSE(read(json).rig);
}

TEST_F(CaptureFile, TheFolderOfThePicturesMayBeAnother) {
  write_json(folder_.path() / "elsewhere.json", gray());
  Capture const capture = read_capture(folder_.path() / "elsewhere.json", "/pictures");
  EXPECT_EQ(capture.frame_path("view_000", Side::right, 1), "/pictures/view_000/right/1.png");
  EXPECT_FALSE(is_capture(folder_.path()));
  write_json(folder_.path() / "capture.json", gray());
  EXPECT_TRUE(is_capture(folder_.path()));
}

TEST_F(CaptureFile, ViewsAreAListOfFoldersOrARange) {
  auto const views = [&](Json const& value) {
    Json json = sweep();
    json["views"] = value;
    return read(json);
  };
  EXPECT_EQ(views(Json::array({"."})).view_names(), std::vector<std::string>{"000"});
  EXPECT_EQ(views(Json::array({"front", "side/12", "back"})).views,
            (std::vector<std::string>{"front", "side/12", "back"}));
  // The number at a folder's end names its view, else its place in the list does.
  EXPECT_EQ(views(Json::array({"front", "side/12", "back"})).view_names(),
            (std::vector<std::string>{"000", "12", "002"}));
  // Two folders that would give two views one name: all are counted.
  EXPECT_EQ(views(Json::array({"a/7", "b/7"})).view_names(), (std::vector<std::string>{"000", "001"}));
  EXPECT_EQ(views(Json::array({"v{}", 9, 11})).views, (std::vector<std::string>{"v9", "v10", "v11"}));
  EXPECT_EQ(views(Json::array({"v{}", 4, 4})).views, std::vector<std::string>{"v4"});
}

TEST_F(CaptureFile, ViewsThatMakeNoSenseAreRefused) {
  auto const refused = [&](Json const& value, std::string const& text) {
    expect_refused(
        sweep(), [&](Json& json) { json["views"] = value; }, text);
  };
  refused("view_{:03d}", "'views' is no list");
  refused(Json::array(), "'views' is no list");
  refused(Json::array({"a", "b", "a"}), "'views' names one twice");
  refused(Json::array({"a", 3}), "'views' is no text");
  refused(Json::array({"v{}", 3, 2}), "'views' is no integer in 3 ..");
  refused(Json::array({"v{}", 0.5, 2}), "'views' is no integer");
  refused(Json::array({"v", 0, 2}), "'v' must have one {}");
}

TEST_F(CaptureFile, UnknownKeysAreNamedAllAtOnce) {
  expect_refused(
      sweep(), [](Json& json) { json["frist"] = 1, json["Left"] = "l"; }, "unknown key 'frist', 'Left'");
  expect_refused(
      sweep(), [](Json& json) { json["intrinsics"] = camera(), json["intrinsics"]["skew"] = 0; },
      "unknown key 'skew' in 'intrinsics'");
  expect_refused(
      sweep(),
      [](Json& json) {
        json["intrinsics"] = {{"left", camera()}, {"right", camera()}, {"middle", camera()}};
      },
      "unknown key 'middle' in 'intrinsics'");
}

TEST_F(CaptureFile, MissingKeysAreNamed) {
  for (char const* key : {"pattern", "views", "left", "right", "first", "last", "bits"})
    expect_refused(
        gray(), [&](Json& json) { json.erase(key); }, quoted(key) + " is missing");
  expect_refused(
      sweep(),
      [](Json& j) {
        j["intrinsics"] = {{"left", camera()}};
      },
      "'right' is missing");
}

TEST_F(CaptureFile, ValuesOfTheWrongKindAreNamed) {
  for (char const* key : {"pattern", "left", "order", "color", "rig", "empty", "backdrop", "white", "black"})
    expect_refused(
        gray(), [&](Json& json) { json[key] = 7; }, quoted(key));
  for (char const* key : {"first", "last", "bits", "row_bits", "rows_first", "projector_columns", "projector_rows"})
    for (Json const& value : {Json("five"), Json(2.5), Json(-1), Json(1e12), Json(true)})
      expect_refused(
          gray(),
          [&](Json& json) {
            if (key == std::string("row_bits")) json["rows_first"] = 6;
            json[key] = value;
          },
          quoted(key) + " is no integer");
  expect_refused(
      gray(), [](Json& json) { json["inverse"] = "yes"; }, "'inverse' is neither true nor false");
  expect_refused(
      gray(), [](Json& json) { json["pattern"] = "grey"; }, "'pattern' is neither");
  expect_refused(
      gray(), [](Json& json) { json["order"] = "mine"; }, "'order' is neither");
  expect_refused(
      gray(), [](Json& json) { json["intrinsics"] = 3; }, "'intrinsics' is no JSON object");
  for (char const* color : {"", "#", "3050a0", "#3050a", "#3050a0f", "#3050ag", "blue", "#-050a0"})
    expect_refused(
        gray(), [&](Json& json) { json["backdrop"] = color; }, "'backdrop' is no colour");
}

TEST_F(CaptureFile, PatternsHaveOnePlaceForTheNumber) {
  for (char const* pattern :
       {"left/0.png", "left/{}_{}.png", "left/{:4d}.png", "left/{:0d}.png", "left/{side}.png", "left/{", "left/}{"})
    expect_refused(
        gray(), [&](Json& json) { json["left"] = pattern; }, pattern);
  for (char const* key : {"white", "black"}) {
    expect_refused(
        gray(), [&](Json& json) { json[key] = "white.png"; }, "has no {side}");
    expect_refused(
        gray(),
        [&](Json& json) {
          json[key] = Json::array({"a", "b", "c"});
        },
        "is not [left, right]");
  }
}

TEST_F(CaptureFile, OpenCvsOrderIsColumnsFromTheMostSignificantBitEachBeforeItsInverse) {
  Capture const capture = read(gray());
  EXPECT_EQ(in_words(capture.gray), "c2 c2i c1 c1i c0 c0i");
  EXPECT_TRUE(capture.in_opencv_order);
  EXPECT_TRUE(capture.has_inverses());
  EXPECT_EQ(capture.bits, 3);
  EXPECT_EQ(capture.row_bits, 0);
  Json json = gray();
  json["order"] = "opencv";
  EXPECT_EQ(in_words(read(json).gray), in_words(capture.gray));
}

TEST_F(CaptureFile, RowsFollowTheColumns) {
  Json json = gray();
  json["rows_first"] = 6;
  EXPECT_EQ(in_words(read(json).gray), "c2 c2i c1 c1i c0 c0i r2 r2i r1 r1i r0 r0i");
  EXPECT_EQ(read(json).frame_path("v", Side::left, 11), folder_.path() / "v/left/0011.png");
  json["row_bits"] = 2;
  json["projector_columns"] = 6;
  json["projector_rows"] = 4;
  Capture const capture = read(json);
  EXPECT_EQ(in_words(capture.gray), "c2 c2i c1 c1i c0 c0i r1 r1i r0 r0i");
  EXPECT_EQ(capture.row_bits, 2);
  EXPECT_EQ(capture.projector_columns, 6);
  EXPECT_EQ(capture.projector_rows, 4);
}

TEST_F(CaptureFile, WithoutInversesItTakesWhiteAndBlack) {
  auto const plain = [](Json& json) { json["inverse"] = false, json["last"] = 2; };
  expect_refused(gray(), plain, "column bit 0 has no inverse, and there are no white and black pictures");
  Json json = gray();
  plain(json);
  json["white"] = "{side}/w.png";
  json["black"] = "{side}/b.png";
  EXPECT_EQ(in_words(read(json).gray), "c2 c1 c0");
  EXPECT_FALSE(read(json).has_inverses());
}

TEST_F(CaptureFile, AnOrderOfOnesOwnIsTakenAsItIs) {
  Json json = gray();
  json.erase("bits");
  json["order"] = {"white", "black", "skip", "c0", "c1", "c1i", "r0i", "r0"};
  json["last"] = 7;
  Capture const capture = read(json);
  EXPECT_EQ(in_words(capture.gray), "white black skip c0 c1 c1i r0i r0");
  EXPECT_FALSE(capture.in_opencv_order);
  EXPECT_EQ(capture.bits, 2);
  EXPECT_EQ(capture.row_bits, 1);
  EXPECT_EQ(capture.frame_count(), 8);
}

TEST_F(CaptureFile, AnOrderOfOnesOwnThatMakesNoSenseIsRefused) {
  auto const refused = [&](Json const& order, std::string const& text) {
    expect_refused(
        gray(),
        [&](Json& json) {
          json.erase("bits");
          json["order"] = order;
          json["last"] = static_cast<int>(order.size()) - 1;
        },
        text);
  };
  for (char const* name : {"x1", "c", "ci", "c16", "c-1", "c1j", "column 1", "", "C1", "c1ii", "whites"})
    refused({"c0", "c0i", name}, quoted(name) + " is none of white, black, skip");
  refused({"c0", "c0i", 3}, "'order' is no text");
  refused({"c0", "c0i", "c0"}, "column bit 0 twice");
  refused({"c0", "c0i", "c2", "c2i"}, "column bit 1 has no picture");
  refused({"c0", "c0i", "r1", "r1i"}, "row bit 0 has no picture");
  refused({"c0", "c0i", "c1", "white"}, "column bit 1 has no inverse");
  refused({"r0", "r0i"}, "there are no column bits");
  expect_refused(
      gray(),
      [](Json& json) {
        json["order"] = {"c0", "c0i"};
      },
      "'order' names 2 pictures, 'first' to 'last' are 6");
}

TEST_F(CaptureFile, KeysThatContradictEachOtherAreNamed) {
  expect_refused(
      gray(), [](Json& json) { json["first"] = 6; }, "'last' (5) is less than 'first' (6)");
  expect_refused(
      gray(), [](Json& json) { json["bits"] = 4; }, "6 pictures, but 4 bits with inverses make 8");
  expect_refused(
      gray(), [](Json& json) { json["inverse"] = false; }, "6 pictures, but 3 bits without inverses make 3");
  expect_refused(
      gray(), [](Json& json) { json["rows_first"] = 7; }, "'rows_first' is not the picture after 'last'");
  expect_refused(
      gray(), [](Json& json) { json["row_bits"] = 2; }, "'row_bits' without 'rows_first'");
  expect_refused(
      sweep(), [](Json& json) { json["last"] = 2; }, "a sweep of 3 light positions");
  expect_refused(
      sweep(), [](Json& json) { json["bits"] = 7; }, "'bits' belongs to pattern \"gray\"");
  expect_refused(
      sweep(), [](Json& json) { json["order"] = "opencv"; }, "'order' belongs to pattern \"gray\"");
  auto const own_order = [](Json& json) { json["order"] = {"c2", "c2i", "c1", "c1i", "c0", "c0i"}; };
  expect_refused(
      gray(),
      [&](Json& json) {
        own_order(json);
        json["bits"] = 4;
      },
      "'bits' is 4, but 'order' has 3");
  expect_refused(
      gray(),
      [&](Json& json) {
        own_order(json);
        json["rows_first"] = 6;
      },
      "'rows_first' belongs to OpenCV's order");
  Json json = gray();
  own_order(json);
  EXPECT_EQ(read(json).bits, 3);
}

TEST_F(CaptureFile, IntrinsicsAreOfBothCamerasOrOfEach) {
  Json json = gray();
  json["rig"] = nullptr;
  json["intrinsics"] = camera();
  json["intrinsics"]["distortion"] = {0.1, 0, 0, 0};
  Capture const both = read(json);
  EXPECT_EQ((*both.intrinsics)[0].camera, Camera::perspective(96, 72, 110, 111, 47, 35));
  EXPECT_EQ((*both.intrinsics)[1].camera, (*both.intrinsics)[0].camera);
  EXPECT_EQ((*both.intrinsics)[1].lens.k1, 0.1);
  Json other = camera();
  other["fx"] = 120;
  json["intrinsics"] = {{"left", camera()}, {"right", other}};
  Capture const each = read(json);
  EXPECT_EQ((*each.intrinsics)[0].camera.fx(), 110);
  EXPECT_EQ((*each.intrinsics)[1].camera.fx(), 120);
}

TEST_F(CaptureFile, WhatIsNoJsonObjectIsRefused) {
  for (char const* text : {"", "[]", "{\"pattern\": ", "7"}) {
    write_file(folder_.path() / "capture.json", text);
    EXPECT_SCANVIEW_ERROR(read_capture(folder_.path() / "capture.json", folder_.path()), ErrorCode::bad_input,
                          "capture.json");
  }
  EXPECT_SCANVIEW_ERROR(read_capture(folder_.path() / "none.json", folder_.path()), ErrorCode::bad_input, "none.json");
}

}  // namespace
}  // namespace scanview
