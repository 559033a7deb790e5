#include "viewer/walkthrough/walkthrough_file.h"

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <filesystem>

#include "base/error.h"
#include "mesh/node_mesh_file.h"
#include "tests/expect_error.h"
#include "tests/temporary_folder.h"
#include "viewer/rooms.h"

namespace scanview::test {
namespace {

namespace fs = std::filesystem;
using Eigen::Vector3d;

NodeMesh small_node() {
  Surface const scene = together({room(2, by_direction(4)), sphere({0.8, 0.2, 0.5}, 0.3)});
  NodeMeshOptions options;
  options.max_triangles = 200;
  return mesh_of(capture_cube(scene, {0.1, 0.2, -0.3}, 16), options);
}

TEST(NodeMeshFile, RoundTripsBitByBit) {
  TemporaryFolder const folder;
  NodeMesh node = small_node();
  // Rotations that are no permutations.
  CapturedNode turned{"000", {1e3, 1.0 / 3, -1e-9}, {}};
  Eigen::Isometry3d pose = look_at(turned.position, turned.position + Vector3d(0.3, 0.1, -1));
  turned.sides.push_back(node_side(room(1e4, by_direction(4)), square_camera(20, 17.3), pose));
  for (NodeMesh const& written : {node, mesh_of(turned)}) {
    write_node_mesh(folder.path() / "node", written);
    NodeMesh const read = read_node_mesh(folder.path() / "node");
    EXPECT_EQ(read.position, written.position);
    EXPECT_EQ(read.vertices, written.vertices);
    EXPECT_EQ(read.triangles, written.triangles);
    EXPECT_EQ(read.quality, written.quality);
    EXPECT_EQ(read.parallax_px, written.parallax_px);
    ASSERT_EQ(read.sides.size(), written.sides.size());
    for (std::size_t s = 0; s < read.sides.size(); ++s) {
      EXPECT_EQ(read.sides[s].camera, written.sides[s].camera);
      EXPECT_EQ(read.sides[s].node_from_camera, written.sides[s].node_from_camera);
      EXPECT_EQ(read.sides[s].first, written.sides[s].first);
      EXPECT_EQ(read.sides[s].end, written.sides[s].end);
      EXPECT_EQ(cv::norm(read.sides[s].color, written.sides[s].color, cv::NORM_INF), 0);
      EXPECT_EQ(cv::norm(read.sides[s].feather, written.sides[s].feather, cv::NORM_INF), 0);
    }
  }
}

/// What a damaged node may do: be refused by an Error that names a file of it, or be whole.
void expect_refused_or_whole(fs::path const& folder, std::string const& how) {
  try {
    read_node_mesh(folder).check();
  } catch (Error const& error) {
    EXPECT_EQ(error.code(), ErrorCode::bad_input) << how << ": " << error.what();
    EXPECT_NE(std::string(error.what()).find(folder.filename().string()), std::string::npos) << how << error.what();
  } catch (std::exception const& other) {
    ADD_FAILURE() << how << ": no Error: " << other.what();
  }
}

TEST(NodeMeshFile, TruncatedAtAnyLengthIsRefusedByName) {
  TemporaryFolder const folder;
  fs::path const node = folder.path() / "node";
  write_node_mesh(node, small_node());
  for (char const* const name : {"node.json", "mesh.ply", "color_0.png", "feather_5.png"}) {
    std::string const whole = read_file(node / name);
    std::size_t const step = std::max<std::size_t>(1, whole.size() / 97);
    // The last bytes of a PNG (its end mark) and the line's end of JSON say nothing about the node.
    std::size_t const needed = whole.size() - (name[0] == 'n' ? 3 : name[0] == 'm' ? 0 : 20);
    for (std::size_t length = 0; length < whole.size(); length += step) {
      write_file(node / name, std::string_view(whole).substr(0, length));
      if (length < needed) {
        EXPECT_SCANVIEW_ERROR(read_node_mesh(node), ErrorCode::bad_input, name);
      } else {
        expect_refused_or_whole(node, fmt::format("{} of {} bytes", name, length));
      }
    }
    fs::remove(node / name);
    EXPECT_SCANVIEW_ERROR(read_node_mesh(node), ErrorCode::bad_input, name);
    write_file(node / name, whole);
  }
  EXPECT_NO_THROW(read_node_mesh(node));
}

TEST(NodeMeshFile, FlippedBytesAreRefusedOrHarmless) {
  TemporaryFolder const folder;
  fs::path const node = folder.path() / "node";
  write_node_mesh(node, small_node());
  CounterRandom random(77, 0);
  for (char const* const name : {"node.json", "mesh.ply", "color_0.png", "feather_5.png"}) {
    std::string const whole = read_file(node / name);
    for (int i = 0; i < 400; ++i) {
      std::string damaged = whole;
      std::size_t const at = random.below(std::uint32_t(whole.size()));
      damaged[at] = char(std::uint8_t(damaged[at]) ^ std::uint8_t(1 + random.below(255)));
      write_file(node / name, damaged);
      expect_refused_or_whole(node, fmt::format("{} byte {} is {}", name, at, int(std::uint8_t(damaged[at]))));
    }
    write_file(node / name, whole);
  }
}

TEST(NodeMeshFile, PartsThatDoNotFitAreRefused) {
  TemporaryFolder const folder;
  fs::path const node = folder.path() / "node";
  write_node_mesh(node, small_node());
  Json const whole = read_json(node / "node.json");
  auto const refused = [&](char const* text, auto change) {
    Json json = whole;
    change(json);
    write_file(node / "node.json", json.dump());
    EXPECT_SCANVIEW_ERROR(read_node_mesh(node), ErrorCode::bad_input, text);
  };
  refused("colour", [](Json& j) { j["colour"] = 1; });
  refused("format", [](Json& j) { j["format"] = 2; });
  refused("position", [](Json& j) { j["position"] = {1, 2}; });
  refused("sides", [](Json& j) { j["sides"] = Json::array(); });
  refused("sides", [](Json& j) { j["sides"] = {1, 2}; });
  refused("triangles", [](Json& j) { j["sides"][2]["triangles"] = -1; });
  refused("triangles", [](Json& j) { j["sides"][2]["triangles"] = 1; });
  refused("node_from_camera", [](Json& j) { j["sides"][1]["node_from_camera"][4] = 2; });
  refused("color_0.png", [](Json& j) { j["sides"][0]["camera"]["width"] = 8; });
}

WalkthroughManifest manifest() {
  WalkthroughManifest m;
  m.unit = Unit::mm;
  m.walking_radius = 1.0 / 3;
  m.focal_length = 123.456;
  m.up = Vector3d(0, 0, 1);
  m.walk = Eigen::AlignedBox3d(Vector3d(0, 1, 2), Vector3d(3, 1, 5));
  m.nodes = {{"000", {0.1, 0.2, 0.3}, 12, 0.25, {"nodes/000/0", "nodes/000/1"}}, {"b", {1, 2, 3}, 0, 0, {"b"}}};
  return m;
}

TEST(WalkthroughFile, ManifestRoundTrips) {
  TemporaryFolder const folder;
  EXPECT_FALSE(is_walkthrough(folder.path()));
  WalkthroughManifest const written = manifest();
  write_walkthrough(folder.path(), written);
  EXPECT_TRUE(is_walkthrough(folder.path()));
  WalkthroughManifest const read = read_walkthrough(folder.path());
  EXPECT_EQ(read.unit, written.unit);
  EXPECT_EQ(read.walking_radius, written.walking_radius);
  EXPECT_EQ(read.focal_length, written.focal_length);
  EXPECT_EQ(read.up, written.up);
  EXPECT_EQ(read.walk->min(), written.walk->min());
  EXPECT_EQ(read.walk->max(), written.walk->max());
  ASSERT_EQ(read.nodes.size(), 2U);
  for (std::size_t i = 0; i < 2; ++i) {
    EXPECT_EQ(read.nodes[i].name, written.nodes[i].name);
    EXPECT_EQ(read.nodes[i].position, written.nodes[i].position);
    EXPECT_EQ(read.nodes[i].triangles, written.nodes[i].triangles);
    EXPECT_EQ(read.nodes[i].parallax_px, written.nodes[i].parallax_px);
    EXPECT_EQ(read.nodes[i].levels, written.nodes[i].levels);
  }
}

TEST(WalkthroughFile, WhatAManifestMayNotSayIsRefusedByName) {
  TemporaryFolder const folder;
  fs::path const path = folder.path() / "walkthrough.json";
  write_walkthrough(folder.path(), manifest());
  Json const whole = read_json(path);
  auto const refused = [&](char const* text, auto change) {
    Json json = whole;
    change(json);
    write_file(path, json.dump());
    SCOPED_TRACE(text);
    EXPECT_SCANVIEW_ERROR(read_walkthrough(folder.path()), ErrorCode::bad_input, text);
  };
  refused("wolking_radius", [](Json& j) { j["wolking_radius"] = 1; });
  refused("format", [](Json& j) { j["format"] = 7; });
  refused("unit", [](Json& j) { j["unit"] = "furlong"; });
  for (char const* const key : {"walking_radius", "focal_length"})
    for (Json const& value : {Json(0), Json(-1), Json("1"), Json(nullptr)})
      refused(key, [&](Json& j) { j[key] = value; });
  refused("up", [](Json& j) { j["up"] = {0, 0, 0}; });
  refused("walk", [](Json& j) { j["walk"]["low"] = {9, 9, 9}; });
  refused("walk", [](Json& j) { j["walk"] = 3; });
  refused("nodes", [](Json& j) { j["nodes"] = Json::array(); });
  refused("nodes[1]", [](Json& j) { j["nodes"][1] = 5; });
  refused("nodes[1]", [](Json& j) { j["nodes"][1]["color"] = 5; });
  refused("nodes[0].position", [](Json& j) { j["nodes"][0]["position"] = {1, 2, "3"}; });
  refused("nodes[0].triangles", [](Json& j) { j["nodes"][0]["triangles"] = -1; });
  refused("nodes[0].levels", [](Json& j) { j["nodes"][0]["levels"] = Json::array(); });
  for (char const* const outside : {"/etc", "../x", "a/../../x", ".."})
    refused("nodes[0].levels", [&](Json& j) { j["nodes"][0]["levels"][1] = outside; });
  for (std::size_t length = 0; length < whole.dump().size(); length += 17) {
    write_file(path, whole.dump().substr(0, length));
    EXPECT_SCANVIEW_ERROR(read_walkthrough(folder.path()), ErrorCode::bad_input, "walkthrough.json");
  }
}

}  // namespace
}  // namespace scanview::test
