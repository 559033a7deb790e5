#include "base/stage_record.h"

#include <gtest/gtest.h>

#include "tests/expect_error.h"
#include "tests/temporary_folder.h"

namespace scanview {
namespace {

class StageRecords : public ::testing::Test {
 protected:
  void SetUp() override {
    write_file(folder_.path() / "out.bin", "result");
    record_ = {"mesh",
               {{"tolerance", 3}},
               {{"in", "hash"}},
               {{"out.bin", hash_bytes("result")}, {"scanset.json#x", "y"}},
               {{"rms", 1.5}}};
    write_stage_record(folder_.path(), record_);
  }
  TemporaryFolder folder_;
  StageRecord record_;
};

TEST_F(StageRecords, RoundTrip) {
  StageRecord const back = read_stage_record(folder_.path(), "mesh");
  EXPECT_EQ(back.options, record_.options);
  EXPECT_EQ(back.inputs, record_.inputs);
  EXPECT_EQ(back.outputs, record_.outputs);
  EXPECT_EQ(back.figures, record_.figures);
}

TEST_F(StageRecords, EveryChangeMakesItStale) {
  EXPECT_TRUE(is_up_to_date(folder_.path(), record_));
  StageRecord other = record_;
  other.options["tolerance"] = 4;
  EXPECT_FALSE(is_up_to_date(folder_.path(), other));
  other = record_;
  other.inputs["in"] = "another";
  EXPECT_FALSE(is_up_to_date(folder_.path(), other));
  write_file(folder_.path() / "out.bin", "damaged");
  EXPECT_FALSE(is_up_to_date(folder_.path(), record_));
  std::filesystem::remove(folder_.path() / "out.bin");
  EXPECT_FALSE(is_up_to_date(folder_.path(), record_));
}

TEST_F(StageRecords, ADamagedRecordIsNone) {
  for (std::string const text : {"", "{", "[]", "{\"version\": 1}"}) {
    write_file(folder_.path() / "mesh.json", text);
    EXPECT_FALSE(is_up_to_date(folder_.path(), record_));
    EXPECT_SCANVIEW_ERROR(read_stage_record(folder_.path(), "mesh"), ErrorCode::bad_input, "mesh.json");
  }
}

}  // namespace
}  // namespace scanview
