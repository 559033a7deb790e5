#include "viewer/layered/ldi_file.h"

#define XXH_INLINE_ALL
#include <fmt/format.h>
#include <gtest/gtest.h>
#include <xxhash.h>

#include <cstring>
#include <fstream>
#include <limits>

#include "base/error.h"
#include "base/files.h"
#include "base/random.h"
#include "tests/expect_error.h"
#include "tests/temporary_folder.h"
#include "viewer/layered/ldi_sums_coding.h"
#include "viewer/ldi_scenes.h"

namespace scanview::test {
namespace {

namespace fs = std::filesystem;
using Eigen::Vector3d;

// Where things are in the file (ldi_file.cpp).
constexpr std::size_t kHash = 16, kHashed = 24, kTextBytes = 24, kCells = 32, kContentBytes = 40, kSumsBytes = 48,
                      kSumsHash = 56, kText = 64, kRecord = 56;

/// A few views of a slanted plane: several levels, some hundred pixels; a hole in each, with a rim.
std::vector<View> views(int count = 3, int size = 12) {
  std::vector<View> all;
  for (int i = 0; i < count; ++i) {
    Vector3d const eye(0.4 * i - 0.5, 0.2 * i, 1 + 0.7 * i);
    all.push_back(plane_view(fmt::format("{:03}", i), square_view(size), toward(eye, Vector3d(0.1, -0.2, -1)),
                             Vector3d(0.2, -0.3, 0.9).normalized(), -0.8, wavy_paint(0.7)));
    all.back().image.depth(size / 2, size / 2) = kMissing;
    all.back().gain = {1 + 0.1 * i, 1, 1.0 / 3};
  }
  return all;
}

LdiOptions small_options() {
  LdiOptions options;
  options.resolution = 8;
  return options;
}

void write(fs::path const& path, std::vector<View> const& all, LdiKeep keep,
           LdiOptions const& options = small_options()) {
  Context context;
  LdiBuilder const builder = builder_of(all, options);
  write_ldi(path, builder.build(Unit::mm, context), builder, keep);
}

/// Without the waiting for the disk that makes write_file durable.
void put_file(fs::path const& path, std::string_view bytes) {
  std::ofstream(path, std::ios::binary).write(bytes.data(), static_cast<std::streamsize>(bytes.size()));
}

template <typename Value>
Value number_at(std::string const& bytes, std::size_t at) {
  Value value;
  std::memcpy(&value, bytes.data() + at, sizeof value);
  return value;
}
template <typename Value>
void put(std::string& bytes, std::size_t at, Value value) {
  std::memcpy(bytes.data() + at, &value, sizeof value);
}
std::size_t table_of(std::string const& bytes) { return kText + number_at<std::uint64_t>(bytes, kTextBytes); }
std::size_t content_of(std::string const& bytes) {
  return (table_of(bytes) + kRecord * number_at<std::uint64_t>(bytes, kCells) + 63) / 64 * 64;
}
std::size_t sums_of(std::string const& bytes) {
  return content_of(bytes) + number_at<std::uint64_t>(bytes, kContentBytes) + kLdiPadding;
}
/// As somebody who means harm would make it.
void make_hash_fit(std::string& bytes) {
  std::size_t const end = std::min(bytes.size(), content_of(bytes));
  put<std::uint64_t>(bytes, kHash, XXH3_64bits(bytes.data() + kHashed, end - kHashed));
}

void touch_all(LdiTree const& tree) {
  for (LdiCell const& cell : tree.cells) tree.blocks(cell);
}

bool equal(LdiTree const& a, LdiTree const& b) {
  if (a.options != b.options || a.unit != b.unit || a.center != b.center || a.radius != b.radius ||
      a.input_pixels != b.input_pixels || a.input_bytes != b.input_bytes || a.roots != b.roots ||
      a.cells.size() != b.cells.size() || a.views.size() != b.views.size() ||
      !std::equal(a.content.begin(), a.content.end(), b.content.begin(), b.content.end()))
    return false;
  for (std::size_t i = 0; i < a.cells.size(); ++i) {
    LdiCell const &c = a.cells[i], &d = b.cells[i];
    if (c.key != d.key || c.children != d.children || c.pixels != d.pixels || c.blocks_of_kind != d.blocks_of_kind ||
        c.offset != d.offset || c.hash != d.hash)
      return false;
  }
  for (std::size_t i = 0; i < a.views.size(); ++i) {
    View const &v = a.views[i], &w = b.views[i];
    if (v.name != w.name || v.gain != w.gain || !(v.image.camera == w.image.camera) ||
        v.object_from_camera->matrix() != w.object_from_camera->matrix())
      return false;
  }
  return true;
}

TEST(LdiFile, RoundTripsBitByBit) {
  TemporaryFolder const folder;
  Context context;
  for (int const resolution : {1, 5, 64}) {
    LdiOptions options;
    options.resolution = resolution;
    options.coarseness = 4.0 / 3;
    options.depth_error = 1e-3;
    options.normals = resolution == 5 ? LdiOptions::Normals::facing : LdiOptions::Normals::measured;
    LdiBuilder const builder = builder_of(views(), options);
    bool has_rims = false;
    for (auto const& [key, sums] : builder.sums())
      for (int face = kLdiFaces; face < LdiSums::kFaces; ++face) has_rims = has_rims || sums->has_face(face);
    EXPECT_TRUE(has_rims);
    LdiTree const written = builder.build(Unit::arbitrary, context);
    fs::path const path = folder.path() / "tree.ldi", again = folder.path() / "again.ldi";
    for (LdiKeep const keep : {LdiKeep::sums, LdiKeep::tree_alone}) {
      write_ldi(path, written, builder, keep);
      EXPECT_TRUE(is_ldi(path));
      LdiTree const read = read_ldi(path);
      EXPECT_TRUE(equal(read, written)) << resolution;
      EXPECT_EQ(read.path, path);
      touch_all(read);
      EXPECT_EQ(reinterpret_cast<std::uintptr_t>(read.content.data()) % 64, 0U);
      write_ldi(again, read, builder, keep);
      EXPECT_EQ(read_file(again), read_file(path));
    }
  }
}

TEST(LdiFile, ImagesAddedLaterGiveTheBytesOfAllAtOnce) {
  TemporaryFolder const folder;
  Context context;
  fs::path const path = folder.path() / "some.ldi", all_path = folder.path() / "all.ldi";
  std::vector<View> const all = views(5, 20);
  for (int const resolution : {1, 8, 64}) {
    LdiOptions options;
    options.resolution = resolution;
    write(all_path, all, LdiKeep::sums, options);
    for (std::size_t const first : {1, 3}) {
      write(path, {all.begin(), all.begin() + static_cast<std::ptrdiff_t>(first)}, LdiKeep::sums, options);
      LdiBuilder builder = read_ldi_builder(path);
      EXPECT_EQ(builder.options(), options);
      builder.add({all.begin() + static_cast<std::ptrdiff_t>(first), all.end()}, context);
      write_ldi(path, builder.build(Unit::mm, context), builder, LdiKeep::sums);
      EXPECT_EQ(read_file(path), read_file(all_path)) << resolution << " after " << first;
    }
  }
}

TEST(LdiFile, NothingCanBeAddedToATreeAlone) {
  TemporaryFolder const folder;
  fs::path const path = folder.path() / "tree.ldi";
  write(path, views(), LdiKeep::tree_alone);
  touch_all(read_ldi(path));
  EXPECT_SCANVIEW_ERROR(read_ldi_builder(path), ErrorCode::bad_input, "without its sums");
}

TEST(LdiFile, OtherFilesAreNotTaken) {
  TemporaryFolder const folder;
  fs::path const path = folder.path() / "file";
  EXPECT_FALSE(is_ldi(path));
  EXPECT_FALSE(is_ldi(folder.path()));
  EXPECT_SCANVIEW_ERROR(read_ldi(path), ErrorCode::bad_input, "cannot open");
  for (char const* const text : {"", "scanview", "scanview visibility 1\n{}", "ply\n"}) {
    put_file(path, text);
    EXPECT_FALSE(is_ldi(path));
    EXPECT_SCANVIEW_ERROR(read_ldi(path), ErrorCode::bad_input, "not an LDI tree");
    EXPECT_SCANVIEW_ERROR(read_ldi_builder(path), ErrorCode::bad_input, "not an LDI tree");
  }
  put_file(path, "scanview ldi 2\n\n of the future");
  EXPECT_TRUE(is_ldi(path));
  EXPECT_SCANVIEW_ERROR(read_ldi(path), ErrorCode::bad_input, "of this version");
}

TEST(LdiFile, TruncatedAtAnyLengthIsRefused) {
  TemporaryFolder const folder;
  fs::path const path = folder.path() / "tree.ldi", cut = folder.path() / "cut.ldi";
  write(path, views(1, 4), LdiKeep::sums);
  std::string const whole = read_file(path);
  put_file(cut, whole + '\0');
  EXPECT_SCANVIEW_ERROR(read_ldi(cut), ErrorCode::bad_input, "cut");
  // Cut in place, one byte at a time: a new file for each length would take long.
  for (std::size_t length = whole.size(); length-- > 0;) {
    fs::resize_file(cut, length);
    EXPECT_SCANVIEW_ERROR(read_ldi(cut), ErrorCode::bad_input, "cut.ldi");
    EXPECT_SCANVIEW_ERROR(read_ldi_builder(cut), ErrorCode::bad_input, "cut.ldi");
  }
}

/// What is read of a damaged file: refused by an Error that names it, or whole.
struct Outcome {
  bool tree_is_whole = false, sums_are_whole = false;
};
Outcome outcome(fs::path const& path, LdiTree const& whole, std::string const& sums, std::string const& how) {
  Outcome result;
  auto const attempt = [&](auto const& read) {
    try {
      return read();
    } catch (Error const& error) {
      EXPECT_EQ(error.code(), ErrorCode::bad_input) << how << ": " << error.what();
      EXPECT_EQ(error.path(), path) << how;
    } catch (std::exception const& other) {
      ADD_FAILURE() << how << ": no Error: " << other.what();
    }
    return false;
  };
  result.tree_is_whole = attempt([&] {
    LdiTree const tree = read_ldi(path);
    touch_all(tree);
    EXPECT_TRUE(equal(tree, whole)) << how;
    return true;
  });
  result.sums_are_whole = attempt([&] {
    EXPECT_EQ(encode_sums(read_ldi_builder(path).sums()), sums) << how;
    return true;
  });
  return result;
}

TEST(LdiFile, FlippedBitsAreFoundOrDoNotMatter) {
  TemporaryFolder const folder;
  fs::path const path = folder.path() / "tree.ldi", bad = folder.path() / "bad.ldi";
  write(path, views(2, 8), LdiKeep::sums);
  std::string const whole = read_file(path);
  LdiTree const tree = read_ldi(path);
  std::size_t const content = content_of(whole), sums = sums_of(whole);
  constexpr std::uint64_t kSeed = 20260726;
  constexpr int kFlips = 3000;
  put_file(bad, whole);
  std::fstream file(bad, std::ios::binary | std::ios::in | std::ios::out);
  auto const set = [&](std::size_t at, char byte) { file.seekp(static_cast<std::streamoff>(at)).put(byte).flush(); };
  int trees = 0, builders = 0;
  for (int i = 0; i < kFlips; ++i) {
    CounterRandom random(kSeed, static_cast<std::uint64_t>(i));
    // Half of them in what describes the tree.
    std::size_t const at = random.below(static_cast<std::uint32_t>(i % 2 == 0 ? whole.size() : content));
    std::uint32_t const bit = random.below(8);
    set(at, static_cast<char>(whole[at] ^ 1 << bit));
    Outcome const result =
        outcome(bad, tree, whole.substr(sums), fmt::format("seed {}: bit {} of byte {}", kSeed, bit, at));
    if (at < content) {
      EXPECT_FALSE(result.tree_is_whole) << at;
      EXPECT_FALSE(result.sums_are_whole) << at;
    } else if (at >= sums) {
      EXPECT_TRUE(result.tree_is_whole) << at;
      EXPECT_FALSE(result.sums_are_whole) << at;
    }
    trees += result.tree_is_whole;
    builders += result.sums_are_whole;
    set(at, whole[at]);
  }
  EXPECT_GT(trees, 0);     // flips in the sums
  EXPECT_GT(builders, 0);  // flips in the content
}

TEST(LdiFile, ValuesThatCannotBeAreRefusedThoughTheHashFits) {
  TemporaryFolder const folder;
  fs::path const path = folder.path() / "tree.ldi", bad = folder.path() / "bad.ldi";
  write(path, views(2, 8), LdiKeep::sums);
  std::string const whole = read_file(path);
  std::size_t const table = table_of(whole), cells = number_at<std::uint64_t>(whole, kCells);
  ASSERT_GT(cells, 3U);
  auto const expect_refused = [&](auto const& change, std::string const& how) {
    std::string bytes = whole;
    change(bytes);
    make_hash_fit(bytes);
    put_file(bad, bytes);
    SCOPED_TRACE(how);
    EXPECT_SCANVIEW_ERROR(touch_all(read_ldi(bad)), ErrorCode::bad_input, "bad.ldi");
  };
  expect_refused([](std::string& b) { put<std::uint64_t>(b, kCells, 0); }, "no cells");
  for (std::size_t const at : {kTextBytes, kCells, kContentBytes, kSumsBytes})
    for (std::uint64_t const value :
         {~std::uint64_t{0}, std::uint64_t{1} << 63, std::uint64_t{1} << 40, number_at<std::uint64_t>(whole, at) + 1,
          number_at<std::uint64_t>(whole, at) - 1, std::uint64_t(whole.size())})
      expect_refused(
          [&](std::string& b) {
            put(b, at, value);
            if (value > whole.size()) put<std::uint64_t>(b, kHash, 0);
          },
          fmt::format("size at {}: {}", at, value));
  // Cells: level, counts of pixels and of each kind's blocks, nothing, indices, hash.
  for (std::size_t cell = 0; cell < cells; cell += std::max<std::size_t>(1, cells / 5)) {
    std::size_t const at = table + cell * kRecord;
    for (std::int32_t const level : {-2147483647 - 1, 2147483647, 201, -201, 0x7fff})
      expect_refused([&](std::string& b) { put(b, at, level); }, fmt::format("level {} of cell {}", level, cell));
    for (std::size_t const field : {4, 8, 12, 16}) {
      auto const here = number_at<std::uint32_t>(whole, at + field);
      for (std::uint32_t const count : {0U, 1U << 31, ~0U, here + 1})
        if (count != here)
          expect_refused([&](std::string& b) { put(b, at + field, count); }, fmt::format("count {}", count));
    }
    // As many blocks, one of them of another kind.
    for (std::size_t const from : {8, 12, 16})
      for (std::size_t const to : {8, 12, 16}) {
        if (from == to || number_at<std::uint32_t>(whole, at + from) == 0) continue;
        expect_refused(
            [&](std::string& b) {
              put(b, at + from, number_at<std::uint32_t>(b, at + from) - 1);
              put(b, at + to, number_at<std::uint32_t>(b, at + to) + 1);
            },
            fmt::format("a block of kind {} as one of {}", from, to));
      }
    expect_refused([&](std::string& b) { put<std::uint32_t>(b, at + 20, 1); }, "what is unused");
    for (std::int64_t const index :
         {std::numeric_limits<std::int64_t>::min(), std::numeric_limits<std::int64_t>::max(), std::int64_t{1} << 50})
      expect_refused([&](std::string& b) { put(b, at + 24, index); }, fmt::format("index {}", index));
  }
  expect_refused([&](std::string& b) { std::memcpy(b.data() + table, whole.data() + table + kRecord, kRecord); },
                 "a cell twice");
  // Blocks: their cell's hash fits too.
  std::size_t const content = content_of(whole);
  auto const expect_block_refused = [&](std::size_t offset, auto value, std::string const& how) {
    expect_refused(
        [&](std::string& b) {
          put(b, content + offset, value);
          LdiCell first;
          first.pixels = number_at<std::uint32_t>(whole, table + 4);
          for (std::size_t k = 0; k < 3; ++k)
            first.blocks_of_kind[k] = number_at<std::uint32_t>(whole, table + 8 + 4 * k);
          put<std::uint64_t>(b, table + 48, XXH3_64bits(b.data() + content, LdiTree::content_bytes(first)));
        },
        how);
  };
  expect_block_refused(0, ~std::uint32_t{0}, "first of a block");
  expect_block_refused(0, number_at<std::uint32_t>(whole, table + 4), "first behind the last");
  expect_block_refused(4, std::uint16_t{0}, "no pixels");
  expect_block_refused(4, std::uint16_t{0xffff}, "count of a block");
  expect_block_refused(6, std::uint8_t{6}, "face");
  for (std::uint8_t const kind : {0, 1, 2, 3, 255})
    if (kind != number_at<std::uint8_t>(whole, content + 7)) expect_block_refused(7, kind, "kind");
  for (std::size_t k = 0; k < 3; ++k) {
    expect_block_refused(8 + k, std::uint8_t{255}, "low");
    expect_block_refused(11 + k, std::uint8_t{8}, "high");
  }
}

TEST(LdiFile, TextThatCannotBeIsRefusedThoughTheHashFits) {
  TemporaryFolder const folder;
  fs::path const path = folder.path() / "tree.ldi", bad = folder.path() / "bad.ldi";
  write(path, views(2, 8), LdiKeep::sums);
  std::string const whole = read_file(path);
  std::size_t const table = table_of(whole);
  Json const good = Json::parse(whole.substr(kText, table - kText));
  auto const written_with = [&](std::string const& text) {
    std::string bytes = whole.substr(0, kText) + text + whole.substr(table, content_of(whole) - table);
    put<std::uint64_t>(bytes, kTextBytes, text.size());
    bytes.resize(content_of(bytes));
    bytes += whole.substr(content_of(whole));
    make_hash_fit(bytes);
    put_file(bad, bytes);
  };
  written_with(good.dump());
  touch_all(read_ldi(bad));
  auto const expect_refused = [&](std::string const& text) {
    SCOPED_TRACE(text.substr(0, 300));
    written_with(text);
    EXPECT_SCANVIEW_ERROR(read_ldi(bad), ErrorCode::bad_input, "bad.ldi");
    EXPECT_SCANVIEW_ERROR(read_ldi_builder(bad), ErrorCode::bad_input, "bad.ldi");
  };
  for (std::string const& text : {std::string(), std::string("{"), std::string("[]"), std::string("null"),
                                  std::string("\xff\xfe"), std::string(100000, '[')})
    expect_refused(text);
  Json const wrong = Json::array({nullptr, "x", -1, 1e300, Json::array(), Json::object(), true});
  for (auto const& [key, value] : good.items()) {
    Json without = good;
    without.erase(key);
    expect_refused(without.dump());
    for (Json const& other : wrong) {
      if (other.type() == value.type() && !value.is_number_integer() && key != "unit") continue;
      if (other.is_number() && key == "radius" && other > 0) continue;
      Json changed = good;
      changed[key] = other;
      expect_refused(changed.dump());
    }
  }
  for (auto const& [key, value] : good["options"].items())
    for (Json const& other : wrong) {
      if (other.is_number() && other > 0 && (key == "smallest_feature" || key == "depth_error")) continue;
      Json changed = good;
      changed["options"][key] = other;
      if (other.is_number() && other > 1e30) continue;
      expect_refused(changed.dump());
    }
  for (char const* const key : {"name", "camera", "object_from_camera", "gain"}) {
    Json changed = good;
    changed["views"][0].erase(key);
    expect_refused(changed.dump());
    changed["views"][0][key] = 7;
    expect_refused(changed.dump());
  }
  Json changed = good;
  changed["more"] = 1;
  expect_refused(changed.dump());
  std::string text = good.dump();
  expect_refused(text.replace(text.find("\"radius\":") + 9, 1, "1e999"));
}

TEST(LdiFile, SumsLieInBinsThatTheCellHas) {
  LdiOptions options;
  options.resolution = 7;
  options.depth_error = 2;
  ASSERT_EQ(options.bin_shift(0), 1);
  for (std::uint32_t const bin : {0U, 3U, 4U, 6U}) {
    // Of bins of one step, as they would be without errors of depth.
    auto sums = std::make_unique<LdiSums>(options.resolution);
    sums->at(2, 1, 5, bin).weight = 9;
    LdiSumCells cells;
    cells.emplace(LdiCellKey{}, std::move(sums));
    std::string const bytes = encode_sums(cells);
    if (bin < 4) {
      EXPECT_EQ(encode_sums(decode_sums(bytes, options, "a.ldi")), bytes);
    } else {
      EXPECT_SCANVIEW_ERROR(decode_sums(bytes, options, "a.ldi"), ErrorCode::bad_input, "sums");
    }
  }
}

TEST(LdiFile, SumsThatCannotBeAreRefusedThoughTheHashFits) {
  TemporaryFolder const folder;
  fs::path const path = folder.path() / "tree.ldi", bad = folder.path() / "bad.ldi";
  write(path, views(1, 6), LdiKeep::sums);
  std::string const whole = read_file(path);
  std::size_t const sums = sums_of(whole);
  auto const with_sums = [&](std::string const& coded) {
    std::string bytes = whole.substr(0, sums) + coded;
    put<std::uint64_t>(bytes, kSumsBytes, coded.size());
    put<std::uint64_t>(bytes, kSumsHash, XXH3_64bits(coded.data(), coded.size()));
    make_hash_fit(bytes);
    put_file(bad, bytes);
  };
  std::string const good = whole.substr(sums);
  with_sums(good);
  EXPECT_EQ(read_ldi_builder(bad).sums().size(), read_ldi_builder(path).sums().size());
  for (std::size_t length = 1; length < good.size(); length += 1 + length / 16) {
    with_sums(good.substr(0, length));
    EXPECT_SCANVIEW_ERROR(read_ldi_builder(bad), ErrorCode::bad_input, "bad.ldi");
  }
  with_sums(good + '\0');
  EXPECT_SCANVIEW_ERROR(read_ldi_builder(bad), ErrorCode::bad_input, "bad.ldi");
  with_sums(std::string(9, '\xff') + '\x7f');
  EXPECT_SCANVIEW_ERROR(read_ldi_builder(bad), ErrorCode::bad_input, "bad.ldi");
  // Whatever is taken can be built and written.
  constexpr std::uint64_t kSeed = 4711;
  int taken = 0;
  for (int i = 0; i < 1000; ++i) {
    CounterRandom random(kSeed, static_cast<std::uint64_t>(i));
    std::string changed = good;
    for (std::uint32_t k = 1 + random.below(2); k > 0; --k)
      changed[random.below(static_cast<std::uint32_t>(good.size()))] = static_cast<char>(random.below(256));
    with_sums(changed);
    try {
      Context context;
      LdiBuilder const builder = read_ldi_builder(bad);
      LdiTree const tree = builder.build(Unit::m, context);
      for (PlacedPixel const& pixel : pixels_of(tree)) ASSERT_TRUE(pixel.at.allFinite());
      ++taken;
    } catch (Error const& error) {
      EXPECT_EQ(error.code(), ErrorCode::bad_input) << "seed " << kSeed << ", " << i << ": " << error.what();
    }
  }
  EXPECT_GT(taken, 0);
}

}  // namespace
}  // namespace scanview::test
