#include "acquire/scan_set_file.h"
#include "base/error.h"
#include "base/image_file.h"
#include "cli/stages.h"
#include "viewer/blend/supersampling.h"
#include "viewer/select/camera_path.h"
#include "viewer/view_based/view_based_renderer.h"

namespace scanview {
namespace fs = std::filesystem;
namespace {

constexpr int kOrbitFrames = 12;
constexpr int kFrameWidth = 320, kFrameHeight = 240;

}  // namespace

StageOutcome render_stage(fs::path const& folder, StageMode mode, Context& context) {
  ScanSet const manifest = read_manifest(folder);
  StageRecord record{"render",
                     {{"orbit", kOrbitFrames}, {"width", kFrameWidth}, {"height", kFrameHeight}},
                     picture_inputs(folder, manifest),
                     {},
                     {}};
  return run_stage(folder, std::move(record), mode, context, [&](StageRecord& out) {
    ScanSet const set = read_scan_set(folder, context);
    auto const renderer = make_cpu_renderer(std::make_shared<ViewLibrary>(set, read_view_meshes(folder, set, context)),
                                            {}, context.threads);
    auto const path = orbit_path(set, kOrbitFrames, kFrameWidth, kFrameHeight);
    SupersamplingRenderer smooth(*renderer, 2);
    std::vector<Frame> frames;
    for (auto const& camera : path) {
      context.check_cancelled();
      context.progress("render", frames.size(), path.size());
      frames.push_back(smooth.render(camera.camera, camera.object_from_camera));
    }
    out.figures["frames"] = frames.size();
    out.figures["back_end"] = "cpu";
    return render_section(path, frames);
  });
}

}  // namespace scanview
