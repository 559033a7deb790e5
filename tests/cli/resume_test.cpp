// A run that was interrupted, repeated, or made with another number of threads ends in equal bytes.
#include <gtest/gtest.h>
#include <signal.h>
#include <sys/wait.h>
#include <unistd.h>

#include "base/files.h"
#include "base/random.h"
#include "tests/cli/command.h"
#include "tests/temporary_folder.h"

namespace scanview {
namespace {

namespace fs = std::filesystem;

class Resume : public ::testing::Test {
 protected:
  static void SetUpTestSuite() {
    folder_ = new TemporaryFolder;
    CommandResult const synth =
        run_scanview({"synth", "statuette", "--pattern", "range", "-o", scan().string(), "--views", "8", "--layout",
                      "circle", "--size", "120x90", "--noise", "0.002", "--disturb", "1:0.5"});
    ASSERT_EQ(synth.exit_code, 0) << synth.errors;
    ASSERT_EQ(run(reference()).exit_code, 0);
  }
  static void TearDownTestSuite() {
    delete folder_;
    folder_ = nullptr;
  }
  static fs::path scan() { return folder_->path() / "scan"; }
  static fs::path reference() { return folder_->path() / "reference" / "set"; }
  static CommandResult run(fs::path const& output, std::vector<std::string> const& more = {},
                           std::function<void(int)> const& meanwhile = {}) {
    fs::create_directories(output.parent_path());
    std::vector<std::string> arguments = {"run", scan().string(), "-o", output.string(), "--quiet"};
    arguments.insert(arguments.end(), more.begin(), more.end());
    return run_scanview(arguments, {}, meanwhile);
  }
  inline static TemporaryFolder* folder_ = nullptr;
};

TEST_F(Resume, ThreadsDoNotChangeAByte) {
  for (char const* threads : {"1", "2"}) {
    fs::path const set = folder_->path() / (std::string("threads") + threads) / "set";
    ASSERT_EQ(run(set, {"--threads", threads}).exit_code, 0);
    EXPECT_EQ(folder_hashes(set), folder_hashes(reference()));
  }
}

TEST_F(Resume, KilledRunsFinishInEqualBytes) {
  // Killed at ten random moments, each time a little further; then left alone.
  fs::path const set = folder_->path() / "killed" / "set";
  CounterRandom random(1, 0);
  for (int kill = 0; kill < 10; ++kill)
    run(set, {}, [&](int child) {
      ::usleep(static_cast<useconds_t>(20'000 + random.below(900'000)));
      ::kill(child, SIGKILL);
    });
  CommandResult const last = run(set);
  ASSERT_EQ(last.exit_code, 0) << last.errors;
  EXPECT_EQ(folder_hashes(set), folder_hashes(reference()));
  EXPECT_FALSE(fs::exists(set.string() + ".partial"));
}

TEST_F(Resume, ControlCExitsWith130AndResumes) {
  fs::path const set = folder_->path() / "interrupted" / "set";
  CommandResult const result = run(set, {}, [&](int child) {
    // Once there is something half-made.
    for (int i = 0; i < 2000 && !fs::exists(set.string() + ".partial"); ++i) ::usleep(5'000);
    ::kill(child, SIGINT);
  });
  EXPECT_EQ(result.exit_code, 130);
  EXPECT_NE(result.errors.find("interrupted"), std::string::npos);
  ASSERT_EQ(run(set).exit_code, 0);
  EXPECT_EQ(folder_hashes(set), folder_hashes(reference()));
}

TEST_F(Resume, NothingIsDoneTwice) {
  CommandResult const dry = run(reference(), {"--dry-run"});
  EXPECT_EQ(dry.exit_code, 0);
  EXPECT_EQ(dry.output.find("would run"), std::string::npos) << dry.output;
  auto const before = fs::last_write_time(reference() / "mesh.json");
  ASSERT_EQ(run(reference()).exit_code, 0);
  EXPECT_EQ(fs::last_write_time(reference() / "mesh.json"), before);
}

TEST_F(Resume, AChangedOptionRunsItsStageAndThoseAfterIt) {
  CommandResult const dry = run(reference(), {"--dry-run", "--tolerance", "5sigma"});
  EXPECT_NE(dry.output.find("import     is up to date"), std::string::npos) << dry.output;
  EXPECT_NE(dry.output.find("register   is up to date"), std::string::npos) << dry.output;
  EXPECT_NE(dry.output.find("mesh       would run"), std::string::npos) << dry.output;
  EXPECT_NE(dry.output.find("evaluate   would run"), std::string::npos) << dry.output;
}

TEST_F(Resume, DamagedOutputIsMadeAnew) {
  fs::path const set = folder_->path() / "damaged" / "set";
  ASSERT_EQ(run(set).exit_code, 0);
  write_file(set / "views/000/mesh.ply", "damaged");
  ASSERT_EQ(run(set).exit_code, 0);
  EXPECT_EQ(folder_hashes(set), folder_hashes(reference()));
}

TEST_F(Resume, FromAndToBoundTheStages) {
  fs::path const set = folder_->path() / "bounded" / "set";
  ASSERT_EQ(run(set, {"--to", "register"}).exit_code, 0);
  EXPECT_TRUE(fs::exists(set / "register.json"));
  EXPECT_FALSE(fs::exists(set / "mesh.json"));
  ASSERT_EQ(run(set, {"--from", "mesh", "--to", "mesh"}).exit_code, 0);
  EXPECT_TRUE(fs::exists(set / "mesh.json"));
  EXPECT_FALSE(fs::exists(set / "evaluate.json"));
  EXPECT_EQ(run(set, {"--from", "mesh", "--to", "import"}).exit_code, 2);
}

}  // namespace
}  // namespace scanview
