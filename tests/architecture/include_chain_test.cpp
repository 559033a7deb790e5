// base ← calib ← acquire ← {register, mesh} ← {synth, viewer} ← cli: nobody includes what stands beside or after it.
#include <gtest/gtest.h>

#include <filesystem>
#include <map>
#include <regex>
#include <set>
#include <sstream>

#include "base/files.h"

namespace scanview {
namespace {

namespace fs = std::filesystem;

std::map<std::string, std::set<std::string>> const kMayInclude = {
    {"base", {}},
    {"calib", {"base"}},
    {"acquire", {"base", "calib"}},
    {"register", {"base", "calib", "acquire"}},
    {"mesh", {"base", "calib", "acquire"}},
    {"synth", {"base", "calib", "acquire", "mesh"}},
    {"viewer", {"base", "calib", "acquire", "mesh", "register"}},
    {"cli", {"base", "calib", "acquire", "mesh", "register", "synth", "viewer"}},
};

TEST(Architecture, FoldersIncludeOnlyWhatStandsBeforeThem) {
  std::regex const include("^#include \"([a-z_]+)/[^\"]+\"");
  for (auto const& [folder, allowed] : kMayInclude)
    for (auto const& entry : fs::recursive_directory_iterator(fs::path(SCANVIEW_SOURCE_DIR) / folder)) {
      std::string const ending = entry.path().extension().string();
      if (ending != ".h" && ending != ".cpp") continue;
      std::istringstream text(read_file(entry.path()));
      std::smatch match;
      for (std::string line; std::getline(text, line);)
        if (std::regex_search(line, match, include)) {
          EXPECT_TRUE(match[1] == folder || allowed.contains(match[1])) << entry.path() << ": " << line;
        }
    }
}

// So that compiling the source tells whether the header includes all it needs.
TEST(Architecture, SourcesIncludeTheirOwnHeaderFirst) {
  std::regex const include("#include (\\S+)");
  for (auto const& [folder, allowed] : kMayInclude)
    for (auto const& entry : fs::recursive_directory_iterator(fs::path(SCANVIEW_SOURCE_DIR) / folder)) {
      fs::path header = entry.path();
      if (header.extension() != ".cpp" || !fs::exists(header.replace_extension(".h"))) continue;
      std::string const text = read_file(entry.path());
      std::smatch first;
      ASSERT_TRUE(std::regex_search(text, first, include)) << entry.path();
      EXPECT_EQ(first[1], '"' + header.lexically_relative(SCANVIEW_SOURCE_DIR).string() + '"') << entry.path();
    }
}

// One header is for PCL's own users, who have PCL anyway; no other shows it.
TEST(Architecture, PublicHeadersKeepHeavyLibrariesOut) {
  constexpr char const* kForPcl = "register/pcl_parts.h";
  for (auto const& [folder, allowed] : kMayInclude)
    for (auto const& entry : fs::recursive_directory_iterator(fs::path(SCANVIEW_SOURCE_DIR) / folder)) {
      if (entry.path().extension() != ".h") continue;
      std::string const text = read_file(entry.path());
      if (entry.path().generic_string().ends_with(kForPcl)) continue;
      EXPECT_EQ(text.find(kForPcl), std::string::npos) << entry.path() << " shows its users PCL";
      for (char const* library : {"#include <pcl/", "#include <CGAL/", "#include <ceres/"})
        EXPECT_EQ(text.find(library), std::string::npos) << entry.path() << " shows its users " << library;
    }
}

TEST(Architecture, FoldersHaveNamesThatSayWhatTheyHold) {
  for (auto const& entry : fs::recursive_directory_iterator(SCANVIEW_SOURCE_DIR)) {
    std::string const name = entry.path().filename().string(), path = entry.path().string();
    if (!entry.is_directory() || path.find("/build") != std::string::npos || path.find("/.git") != std::string::npos)
      continue;
    for (char const* empty : {"common", "utils", "util", "misc", "core"}) EXPECT_NE(name, empty) << entry.path();
  }
}

}  // namespace
}  // namespace scanview
