#include "base/ply.h"

#include <gtest/gtest.h>

#include "base/random.h"
#include "tests/expect_error.h"

namespace scanview {
namespace {

PlyFile sample() {
  PlyFile ply;
  ply.comments = {"made by hand"};
  ply.obj_info = {"num_cols 2"};
  PlyElement vertex{"vertex", 3, {}};
  vertex.properties.push_back(ply_scalar("x", PlyType::float32, {0.1F, -2.5, 1e-30F}));
  vertex.properties.push_back(ply_scalar("d", PlyType::float64, {0.1, 1e300, -0.0}));
  vertex.properties.push_back(ply_scalar("i", PlyType::int32, {-2147483648.0, 0, 2147483647.0}));
  vertex.properties.push_back(ply_scalar("b", PlyType::uint8, {0, 128, 255}));
  PlyElement face{"face", 2, {}};
  PlyProperty list = ply_scalar("vertex_indices", PlyType::uint32, {0, 1, 2, 4294967295.0});
  list.is_list = true;
  list.offsets = {0, 3, 4};
  face.properties.push_back(list);
  face.properties.push_back(ply_scalar("cos", PlyType::float32, {0.5, 1}));
  ply.elements = {vertex, face, PlyElement{"empty", 0, {ply_scalar("x", PlyType::int8, {})}}};
  return ply;
}

class PlyFormats : public ::testing::TestWithParam<PlyFormat> {};

TEST_P(PlyFormats, RoundTripsExactly) {
  PlyFile const ply = sample();
  PlyFile const back = parse_ply(format_ply(ply, GetParam()), "file");
  EXPECT_EQ(back.comments, ply.comments);
  EXPECT_EQ(back.obj_info, ply.obj_info);
  ASSERT_EQ(back.elements.size(), ply.elements.size());
  for (std::size_t e = 0; e < ply.elements.size(); ++e) {
    EXPECT_EQ(back.elements[e].name, ply.elements[e].name);
    ASSERT_EQ(back.elements[e].properties.size(), ply.elements[e].properties.size());
    for (std::size_t p = 0; p < ply.elements[e].properties.size(); ++p) {
      EXPECT_EQ(back.elements[e].properties[p].values, ply.elements[e].properties[p].values);
      if (ply.elements[e].rows > 0) {
        EXPECT_EQ(back.elements[e].properties[p].offsets, ply.elements[e].properties[p].offsets);
      }
    }
  }
}

TEST_P(PlyFormats, EveryTruncationIsAnErrorOrTheWholeFile) {
  std::string const bytes = format_ply(sample(), GetParam());
  for (std::size_t n = 0; n + 1 < bytes.size(); ++n) {
    // The last ASCII number may lose digits and still be a number: that much no reader can know.
    if (GetParam() == PlyFormat::ascii && n + 3 > bytes.size()) break;
    EXPECT_SCANVIEW_ERROR(parse_ply(bytes.substr(0, n), "cut.ply"), ErrorCode::bad_input, "cut.ply");
  }
}

TEST_P(PlyFormats, FlippedBytesNeverDoMoreThanThrow) {
  std::string const bytes = format_ply(sample(), GetParam());
  for (std::uint64_t trial = 0; trial < 2000; ++trial) {
    std::string damaged = bytes;
    CounterRandom random(1, trial);
    for (int k = 0; k < 3; ++k)
      damaged[random.below(static_cast<std::uint32_t>(damaged.size()))] = static_cast<char>(random.below(256));
    try {
      parse_ply(damaged, "damaged.ply");
    } catch (Error const&) {
      // Refused: as good as read.
    }
  }
}

INSTANTIATE_TEST_SUITE_P(All, PlyFormats,
                         ::testing::Values(PlyFormat::ascii, PlyFormat::binary_little_endian,
                                           PlyFormat::binary_big_endian));

TEST(Ply, ACountThatTheBytesCannotHoldIsRefusedBeforeAllocating) {
  for (char const* format : {"ascii", "binary_little_endian", "binary_big_endian"}) {
    std::string const header = std::string("ply\nformat ") + format +
                               " 1.0\nelement vertex 4000000000\nproperty float x\nproperty float y\nend_header\n1 2\n";
    EXPECT_SCANVIEW_ERROR(parse_ply(header, "big.ply"), ErrorCode::bad_input, "4000000000 rows");
  }
  std::string const list =
      "ply\nformat binary_little_endian 1.0\nelement face 1\nproperty list uint int i\nend_header\n\xff\xff\xff\xff";
  EXPECT_SCANVIEW_ERROR(parse_ply(list, "list.ply"), ErrorCode::bad_input, "promises a list");
  std::string const nothing = "ply\nformat ascii 1.0\nelement vertex 18446744073709551615\nend_header\n";
  EXPECT_SCANVIEW_ERROR(parse_ply(nothing, "nothing.ply"), ErrorCode::bad_input, "rows");
}

TEST(Ply, HeaderErrorsNameTheCause) {
  EXPECT_SCANVIEW_ERROR(parse_ply("", "e"), ErrorCode::bad_input, "not a PLY");
  EXPECT_SCANVIEW_ERROR(parse_ply("ply\nformat ascii 1.0\n", "e"), ErrorCode::bad_input, "does not end");
  EXPECT_SCANVIEW_ERROR(parse_ply("ply\nend_header\n", "e"), ErrorCode::bad_input, "no format");
  EXPECT_SCANVIEW_ERROR(parse_ply("ply\nformat ascii 1.0\nelement vertex -1\nend_header\n", "e"), ErrorCode::bad_input,
                        "bad count");
  EXPECT_SCANVIEW_ERROR(parse_ply("ply\nformat ascii 1.0\nproperty float x\nend_header\n", "e"), ErrorCode::bad_input,
                        "before any");
  EXPECT_SCANVIEW_ERROR(parse_ply("ply\nformat ascii 1.0\nelement v 1\nproperty half x\nend_header\n", "e"),
                        ErrorCode::bad_input, "half");
}

TEST(Ply, AValueItsTypeCannotHoldIsNotWritten) {
  PlyFile ply;
  ply.elements = {PlyElement{"v", 1, {ply_scalar("b", PlyType::uint8, {256})}}};
  EXPECT_THROW(format_ply(ply, PlyFormat::ascii), std::logic_error);
}

}  // namespace
}  // namespace scanview
