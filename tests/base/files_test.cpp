#include "base/files.h"

#include <gtest/gtest.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include <csignal>
#include <fstream>
#include <limits>

#include "tests/expect_error.h"
#include "tests/temporary_folder.h"

namespace scanview {
namespace {

namespace fs = std::filesystem;

TEST(Files, WrittenBytesComeBack) {
  TemporaryFolder folder;
  std::string bytes("a\0b\nc", 5);
  write_file(folder.path() / "f", bytes);
  EXPECT_EQ(read_file(folder.path() / "f"), bytes);
  EXPECT_FALSE(fs::exists(folder.path() / "f.partial"));
}

TEST(Files, MissingFileAndFolderAreBadInput) {
  TemporaryFolder folder;
  EXPECT_SCANVIEW_ERROR(read_file(folder.path() / "none"), ErrorCode::bad_input, "none");
  EXPECT_SCANVIEW_ERROR(read_file(folder.path()), ErrorCode::bad_input, "is not a file");
}

/// Runs in a child whose files may have `limit` bytes; what it returns is the child's exit status.
int with_file_limit(rlim_t limit, void (*work)(fs::path const&), fs::path const& folder) {
  pid_t const child = ::fork();
  if (child == 0) {
    std::signal(SIGXFSZ, SIG_IGN);
    rlimit const size{limit, limit};
    ::setrlimit(RLIMIT_FSIZE, &size);
    try {
      work(folder);
    } catch (Error const& error) {
      ::_exit(static_cast<int>(error.code()));
    }
    ::_exit(0);
  }
  int status = 0;
  ::waitpid(child, &status, 0);
  return WEXITSTATUS(status);
}

TEST(Files, FullDiskLeavesTheOldFileAndNoOrphan) {
  TemporaryFolder folder;
  write_file(folder.path() / "f", "old");
  int const code = with_file_limit(
      1000, [](fs::path const& in) { write_file(in / "f", std::string(5000, 'x')); }, folder.path());
  EXPECT_EQ(code, static_cast<int>(ErrorCode::io));
  EXPECT_EQ(read_file(folder.path() / "f"), "old");
  EXPECT_FALSE(fs::exists(folder.path() / "f.partial"));
}

TEST(Files, FolderThatCannotBeWrittenIsAnIoError) {
  EXPECT_SCANVIEW_ERROR(write_file("/proc/scanview", "x"), ErrorCode::io, "/proc/scanview");
  EXPECT_SCANVIEW_ERROR(NewFolder("/proc/scanview/set"), ErrorCode::io, "/proc/scanview/set");
}

TEST(Files, NewFolderAppearsOnlyOnCommit) {
  TemporaryFolder folder;
  fs::path const final_path = folder.path() / "set";
  {
    NewFolder fresh(final_path);
    write_file(fresh.path() / "f", "new");
  }
  EXPECT_FALSE(fs::exists(final_path));
  EXPECT_TRUE(fs::is_empty(folder.path()));
  fs::create_directories(final_path / "old");
  NewFolder fresh(final_path);
  write_file(fresh.path() / "f", "new");
  fresh.commit();
  EXPECT_EQ(read_file(final_path / "f"), "new");
  EXPECT_FALSE(fs::exists(final_path / "old"));
}

TEST(Files, NewFolderReplacesTheOrphanOfAKilledRun) {
  TemporaryFolder folder;
  fs::create_directories(folder.path() / "set.partial");
  write_file(folder.path() / "set.partial" / "orphan", "x");
  NewFolder fresh(folder.path() / "set/");
  fresh.commit();
  EXPECT_TRUE(fs::is_empty(folder.path() / "set"));
}

TEST(Files, JsonErrorsNameFileAndLine) {
  TemporaryFolder folder;
  write_file(folder.path() / "bad.json", "{\n \"a\": 1,\n \"b\": }");
  EXPECT_SCANVIEW_ERROR(read_json(folder.path() / "bad.json"), ErrorCode::bad_input, "line 3");
}

TEST(Files, JsonNeverHoldsANumberThatIsNotFinite) {
  TemporaryFolder folder;
  Json const json = {{"a", {1.0, std::numeric_limits<double>::quiet_NaN()}}};
  EXPECT_THROW(write_json(folder.path() / "f", json), std::logic_error);
  EXPECT_TRUE(json_number(std::numeric_limits<double>::infinity()).is_null());
}

TEST(Files, HashIsThatOfTheContent) {
  TemporaryFolder folder;
  write_file(folder.path() / "f", "abc");
  EXPECT_EQ(hash_file(folder.path() / "f"), hash_bytes("abc"));
  EXPECT_NE(hash_bytes("abc"), hash_bytes("abd"));
  EXPECT_EQ(hash_bytes("abc").size(), 32U);
}

}  // namespace
}  // namespace scanview
