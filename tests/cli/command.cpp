#include "tests/cli/command.h"

#include <fcntl.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>

#include "base/files.h"

namespace scanview {
namespace fs = std::filesystem;

CommandResult run_scanview(std::vector<std::string> const& arguments, std::function<void()> const& before_exec,
                           std::function<void(int)> const& while_running) {
  static int next = 0;
  fs::path const base =
      fs::temp_directory_path() / ("scanview_command_" + std::to_string(::getpid()) + "_" + std::to_string(next++));
  fs::path const output = base.string() + ".out", errors = base.string() + ".err";
  std::vector<std::string> words = {SCANVIEW_COMMAND};
  words.insert(words.end(), arguments.begin(), arguments.end());
  std::vector<char*> raw;
  for (auto& word : words) raw.push_back(word.data());
  raw.push_back(nullptr);

  pid_t const child = ::fork();
  if (child == 0) {
    int const out = ::open(output.c_str(), O_WRONLY | O_CREAT | O_TRUNC, 0600),
              err = ::open(errors.c_str(), O_WRONLY | O_CREAT | O_TRUNC, 0600);
    ::dup2(out, STDOUT_FILENO);
    ::dup2(err, STDERR_FILENO);
    if (before_exec) before_exec();
    ::execv(raw[0], raw.data());
    ::_exit(127);
  }
  if (while_running) while_running(child);
  int status = 0;
  rusage usage{};
  ::wait4(child, &status, 0, &usage);
  CommandResult result;
  result.exit_code = WIFEXITED(status) ? WEXITSTATUS(status) : -1;
  result.output = read_file(output);
  result.errors = read_file(errors);
  result.peak_mb = static_cast<double>(usage.ru_maxrss) / 1024;
  fs::remove(output);
  fs::remove(errors);
  return result;
}

std::vector<std::pair<std::string, std::string>> folder_hashes(fs::path const& folder) {
  std::vector<std::pair<std::string, std::string>> hashes;
  for (auto const& entry : fs::recursive_directory_iterator(folder)) {
    std::string const name = entry.path().lexically_relative(folder).generic_string();
    if (entry.is_regular_file() && name != "report.html" && name != "timings.json")
      hashes.emplace_back(name, hash_file(entry.path()));
  }
  std::sort(hashes.begin(), hashes.end());
  return hashes;
}

Json VerbTest::run(std::vector<std::string> arguments) {
  fs::path const report = folder_.path() / "report.json";
  std::string const verb = arguments.front();
  for (std::string const& more : {std::string("--quiet"), std::string("--report"), report.string()})
    arguments.push_back(more);
  CommandResult const result = run_scanview(arguments);
  EXPECT_EQ(result.exit_code, 0) << verb << ": " << result.errors;
  return result.exit_code == 0 ? read_json(report) : Json::object();
}

}  // namespace scanview
