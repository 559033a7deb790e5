#pragma once
#include <gtest/gtest.h>
#include <unistd.h>

#include <filesystem>
#include <string>

namespace scanview {

/// An empty folder of the running test's own, removed afterwards.
class TemporaryFolder {
 public:
  TemporaryFolder() {
    auto const* test = ::testing::UnitTest::GetInstance()->current_test_info();  // none while a suite is set up
    std::string name = "scanview_";
    name.append(test ? test->test_suite_name() : "suite").append("_").append(test ? test->name() : "set_up");
    name.append("_").append(std::to_string(::getpid())).append("_").append(std::to_string(next_++));
    for (char& c : name)
      if (c == '/') c = '_';
    path_ = std::filesystem::temp_directory_path() / name;
    std::filesystem::remove_all(path_);
    std::filesystem::create_directories(path_);
  }
  ~TemporaryFolder() {
    std::error_code ignored;
    std::filesystem::remove_all(path_, ignored);
  }
  TemporaryFolder(TemporaryFolder const&) = delete;
  TemporaryFolder& operator=(TemporaryFolder const&) = delete;
  std::filesystem::path const& path() const { return path_; }

 private:
  inline static int next_ = 0;
  std::filesystem::path path_;
};

}  // namespace scanview
