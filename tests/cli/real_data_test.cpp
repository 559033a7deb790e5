// The real sets that lie beside the project on the builders' machines; skipped by name elsewhere.
#include <gtest/gtest.h>

#include "base/files.h"
#include "tests/cli/command.h"
#include "tests/temporary_folder.h"

namespace scanview {
namespace {

namespace fs = std::filesystem;

class RealData : public VerbTest {
 protected:
  static fs::path data(std::string const& name) {
    return fs::path(SCANVIEW_SOURCE_DIR).parent_path() / "shared/data" / name;
  }
};

/// Median over the pairs of their median distance between overlapping surfaces.
double median_distance(Json const& registered) {
  std::vector<double> distances;
  for (auto const& pair : registered["pairs"]) distances.push_back(pair["median_distance"].get<double>());
  std::sort(distances.begin(), distances.end());
  return distances.empty() ? 1e9 : distances[distances.size() / 2];
}

TEST_F(RealData, BearAlignsToTheDotsAndComesBackFromItsCameras) {
  if (!fs::exists(data("bear_rgbd"))) GTEST_SKIP() << "bear_rgbd is not here";
  Json const all = run({"run", data("bear_rgbd").string(), "-o", in("bear")});
  Json const registered = run({"register", in("bear"), "--reference", (data("bear_rgbd") / "rgbd.json").string()});
  EXPECT_LE(median_distance(registered), 0.7e-3);
  // The poses from the turntable's dots are independent of the object and known to about this much.
  EXPECT_LE(registered["reference"]["pose_max_deg"].get<double>(), 1.5);
  EXPECT_LE(registered["reference"]["pose_max_length"].get<double>(), 2e-3);
  EXPECT_GE(all["stages"]["evaluate"]["renderers"]["source_views"]["psnr_common_min"].get<double>(), 35);
}

TEST_F(RealData, BunnyComesTogetherFromNothingAsTheReadmeSays) {
  if (!fs::exists(data("bunny_range.tar.xz"))) GTEST_SKIP() << "bunny_range.tar.xz is not here";
  // A bare file name, as one types it where the file lies.
  CommandResult const imported = run_scanview({"import", "stanford", "bunny_range.tar.xz", "-o", in("bunny")},
                                              [&] { fs::current_path(data("bunny_range.tar.xz").parent_path()); });
  ASSERT_EQ(imported.exit_code, 0) << imported.errors;
  fs::copy_file(in("bunny") + "/scanset.json", in("published.json"));
  Json const registered = run({"register", in("bunny"), "--init", "auto", "--reference", in("published.json")});
  EXPECT_EQ(registered["parts"].size(), 1u);
  // The published poses are good to about 0.1 degrees and 0.1 mm each.
  EXPECT_LE(registered["reference"]["max_deg"].get<double>(), 0.3);
  EXPECT_LE(registered["reference"]["max_length"].get<double>(), 0.5e-3);
}

}  // namespace
}  // namespace scanview
