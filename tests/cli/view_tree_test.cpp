// `scanview view` knows an LDI tree by what its file begins with, and refuses options of other kinds.

#include <cstdlib>
#include <tuple>

#include "tests/cli/command.h"
#include "viewer/layered/ldi_file.h"

namespace scanview {
namespace {

class ViewTree : public VerbTest {
 protected:
  /// A square that one camera sees, in a file whose name says nothing.
  void SetUp() override {
    View view;
    view.name = "000";
    view.object_from_camera = Eigen::Isometry3d::Identity();
    view.image = empty_range_image(Camera::perspective(48, 40, 45, 45, 23.5, 19.5));
    view.image.color.create(40, 48);
    view.image.color.setTo(cv::Scalar(60, 120, 200));
    view.image.depth.setTo(2);
    view.image.sigma.setTo(1e-3);
    view.image.classes.setTo(static_cast<int>(PixelClass::object));
    Context context;
    LdiBuilder builder{LdiOptions()};
    builder.add({view}, context);
    write_ldi(in("tree"), builder.build(Unit::m, context), builder, LdiKeep::tree_alone);
  }
};

TEST_F(ViewTree, OptionsOfOtherKindsAreRefused) {
  for (auto const& [option, value, words] :
       {std::tuple("--policy", "binary", "walkthrough"), std::tuple("--up", "z", "polygon model"),
        std::tuple("--back-end", "gl", "drawn by the processor"), std::tuple("--stamp", "0.1", "0.25 to 64"),
        std::tuple("--milliseconds", "-1", "milliseconds")}) {
    auto const result = run_scanview({"view", in("tree"), option, value});
    EXPECT_EQ(result.exit_code, 2) << option;
    EXPECT_NE(result.errors.find(words), std::string::npos) << result.errors;
  }
  write_file(in("model.ply"), "ply\n");
  auto const result = run_scanview({"view", in("model.ply"), "--stamp", "2"});
  EXPECT_EQ(result.exit_code, 2);
  EXPECT_NE(result.errors.find("--stamp is for an LDI tree"), std::string::npos) << result.errors;
}

TEST_F(ViewTree, AFileThatIsCutOffIsBadInput) {
  auto const bytes = read_file(in("tree"));
  write_file(in("tree"), bytes.substr(0, bytes.size() / 2));
  EXPECT_EQ(run_scanview({"view", in("tree")}).exit_code, 3);
}

TEST_F(ViewTree, FramesAreMeasured) {
  if (std::getenv("DISPLAY") == nullptr) {
    auto const result = run_scanview({"view", in("tree")});
    EXPECT_EQ(result.exit_code, 5);
    EXPECT_NE(result.errors.find("display"), std::string::npos) << result.errors;
    return;
  }
  Json const report = run({"view", in("tree"), "--frames", "3", "--width", "400", "--height", "300"});
  EXPECT_GT(report.at("frame_milliseconds").get<double>(), 0);
  EXPECT_GT(report.at("cells_traversed").get<double>(), 0);
  EXPECT_GT(report.at("splats").get<double>(), 0);
}

}  // namespace
}  // namespace scanview
