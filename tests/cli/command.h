#pragma once
#include <gtest/gtest.h>

#include <filesystem>
#include <functional>
#include <string>
#include <vector>

#include "base/files.h"
#include "tests/temporary_folder.h"

namespace scanview {

/// How the command ended and what it said.
struct CommandResult {
  int exit_code = -1;  ///< -1 where a signal ended it
  std::string output, errors;
  double peak_mb = 0;
};

/// Runs the scanview of this build. `before_exec` runs in the child (limits); `while_running` in the parent with the
/// child's process id, before it is waited for.
CommandResult run_scanview(std::vector<std::string> const& arguments, std::function<void()> const& before_exec = {},
                           std::function<void(int)> const& while_running = {});

/// Relative path -> content hash of every file below a folder, but for report.html and timings.json: what two equal
/// runs must share.
std::vector<std::pair<std::string, std::string>> folder_hashes(std::filesystem::path const& folder);

/// Tests that run verbs which must succeed, in a folder of their own.
class VerbTest : public ::testing::Test {
 protected:
  /// The verb's report; the test fails where the verb does.
  Json run(std::vector<std::string> arguments);
  /// A path in the test's folder.
  std::string in(std::string const& name) const { return (folder_.path() / name).string(); }

 private:
  TemporaryFolder folder_;
};

}  // namespace scanview
