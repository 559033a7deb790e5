#include <gtest/gtest.h>

#include <random>

#include "base/error.h"
#include "mesh/polygon_model.h"
#include "tests/mesh/model_files.h"

namespace scanview {
namespace {

/// Reads or refuses; what is read holds together.
void expect_read_or_refused(std::string const& bytes, char const* name) {
  try {
    PolygonModel const model = parse_polygon_model(bytes, name);
    EXPECT_NO_THROW(model.mesh.check());
    std::size_t const count = model.mesh.triangles.size();
    EXPECT_TRUE(model.polygons.empty() || model.polygons.size() == count);
    EXPECT_TRUE(model.transparent.empty() || model.transparent.size() == count);
  } catch (Error const& error) {
    EXPECT_EQ(error.code(), ErrorCode::bad_input);
    EXPECT_NE(std::string(error.what()).find(name), std::string::npos) << error.what();
  }
}

TEST(DamagedModel, EveryLengthIsRefusedOrRead) {
  for (ModelFile const& format : kModelFiles) {
    std::string const whole = format.bytes();
    for (std::size_t n = 0; n < whole.size(); ++n) expect_read_or_refused(whole.substr(0, n), format.name);
  }
}

TEST(DamagedModel, BinaryFilesThatAreCutOffAreRefused) {
  for (ModelFile const& format : kModelFiles) {
    std::string const name = format.name, whole = format.bytes();
    if (!name.starts_with("binary") && name != "lh.cube" && name != "cube.glb") continue;
    for (std::size_t n = 0; n < whole.size(); ++n)
      EXPECT_THROW(parse_polygon_model(whole.substr(0, n), name), Error) << name << " " << n;
  }
}

TEST(DamagedModel, FlippedBitsAndSwappedBytesAreRefusedOrRead) {
  constexpr unsigned kSeed = 20;
  std::mt19937 random(kSeed);
  auto const below = [&random](std::size_t n) { return std::size_t(random()) % n; };
  for (ModelFile const& format : kModelFiles) {
    std::string const whole = format.bytes();
    for (int trial = 0; trial < 3000; ++trial) {
      std::string bytes = whole;
      for (std::size_t k = 1 + below(4); k > 0; --k) {
        if (below(2) == 0)
          bytes[below(bytes.size())] ^= char(1 << below(8));
        else
          bytes[below(bytes.size())] = bytes[below(bytes.size())];
      }
      SCOPED_TRACE(fmt::format("{}, trial {} of seed {}", format.name, trial, kSeed));
      expect_read_or_refused(bytes, format.name);
    }
  }
}

}  // namespace
}  // namespace scanview
