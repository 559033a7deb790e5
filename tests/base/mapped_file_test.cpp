#include "base/mapped_file.h"

#include <gtest/gtest.h>
#include <unistd.h>

#include <cstring>
#include <string>

#include "base/error.h"
#include "base/files.h"
#include "tests/expect_error.h"
#include "tests/temporary_folder.h"

namespace scanview {
namespace {

std::string text_of(MappedFile const& file) {
  auto const bytes = file.bytes();
  return {reinterpret_cast<char const*>(bytes.data()), bytes.size()};
}

TEST(MappedFile, HasTheFilesBytesOfAnySize) {
  TemporaryFolder const folder;
  auto const page = static_cast<std::size_t>(::sysconf(_SC_PAGESIZE));
  for (std::size_t const size : {std::size_t{1}, page - 1, page, page + 1, 3 * page + 7}) {
    std::string written(size, '\0');
    for (std::size_t i = 0; i < size; ++i) written[i] = static_cast<char>(i * 31);
    write_file(folder.path() / "file", written);
    EXPECT_EQ(text_of(MappedFile(folder.path() / "file")), written);
  }
}

TEST(MappedFile, AnEmptyFileHasNoBytes) {
  TemporaryFolder const folder;
  write_file(folder.path() / "file", "");
  EXPECT_TRUE(MappedFile(folder.path() / "file").bytes().empty());
}

TEST(MappedFile, LivesOnWhenTheFileIsReplaced) {
  TemporaryFolder const folder;
  write_file(folder.path() / "file", "old");
  MappedFile const file(folder.path() / "file");
  write_file(folder.path() / "file", "new and longer");
  EXPECT_EQ(text_of(file), "old");
}

TEST(MappedFile, WhatIsMissingOrNoFileIsBadInput) {
  TemporaryFolder const folder;
  EXPECT_SCANVIEW_ERROR(MappedFile(folder.path() / "none"), ErrorCode::bad_input, "none");
  EXPECT_SCANVIEW_ERROR(MappedFile{folder.path()}, ErrorCode::bad_input, "is not a file");
}

}  // namespace
}  // namespace scanview
