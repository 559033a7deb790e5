#include "synth/capture_files.h"

#include <fmt/format.h>

#include <opencv2/imgcodecs.hpp>

#include "acquire/scan_set_file.h"
#include "base/error.h"
#include "base/files.h"
#include "base/image_file.h"
#include "base/parallel.h"
#include "synth/chessboard.h"

namespace scanview {
namespace fs = std::filesystem;
namespace {

char const* name(CaptureSide side) { return side == CaptureSide::left ? "left" : "right"; }

std::string view_name(std::size_t view) { return fmt::format("{:03d}", view); }

/// Noise does not compress: the fastest level is two per cent larger than the best.
std::string encode_frame(cv::Mat const& frame) {
  std::vector<unsigned char> bytes;
  if (!cv::imencode(".png", frame, bytes, {cv::IMWRITE_PNG_COMPRESSION, 1}))
    throw std::logic_error("a frame that cannot be encoded");
  return {bytes.begin(), bytes.end()};
}

Json manifest(CaptureRig const& rig) {
  CaptureOptions const& options = rig.options();
  bool const gray = options.light.pattern == LightOptions::Pattern::gray;
  Json json = {{"pattern", gray ? "gray" : "sweep"},
               {"views", {"view_{:03d}", 0, options.views - 1}},
               {"left", "left/{:04d}.png"},
               {"right", "right/{:04d}.png"},
               {"first", 0}};
  if (gray) {
    int bits = 0;
    while ((1 << bits) < options.light.projector_width) ++bits;
    json["last"] = 2 * bits - 1;
    json["white"] = "{side}/white.png";
    json["black"] = "{side}/black.png";
    json["bits"] = bits;
    json["rows_first"] = options.light.rows ? Json(2 * bits) : Json();
    json["inverse"] = true;
    json["order"] = "opencv";
  } else {
    json["last"] = rig.light().frames() - 1;
  }
  json["color"] = "left_color.png";
  json["rig"] = "rig.yml";
  json["empty"] = options.scene.stage ? Json("empty") : Json();
  json["backdrop"] = options.scene.stage ? Json(options.scene.backdrop) : Json();
  return json;
}

void write_pictures(fs::path const& folder, CaptureRig const& rig, int view, CaptureSide side, Context& context) {
  fs::create_directories(folder / name(side));
  CapturePictures const pictures = rig.take(view, side, context);
  for_each_index(context, pictures.frames.size() + 1, [&](std::size_t i) {
    if (i == pictures.frames.size())
      write_file(folder / fmt::format("{}_color.png", name(side)), encode_png(pictures.color));
    else
      write_file(folder / name(side) / (rig.light().frame_name(static_cast<int>(i)) + ".png"),
                 encode_frame(pictures.frames[i]));
  });
}

/// boards/{left,right}/NN.png and boards.json with their true poses.
void write_boards(fs::path const& folder, CaptureRig const& rig, Context& context) {
  StereoRig const& stereo = rig.layout().rig;
  double const distance = (rig.layout().room_from_left.translation() - rig.layout().target).norm();
  BoardPoses const poses = make_board_poses(stereo, distance, rig.options().boards, context.seed);
  if (static_cast<int>(poses.left_from_board.size()) < rig.options().boards)
    context.warn(fmt::format("boards: only {} of {} fit into both pictures", poses.left_from_board.size(),
                             rig.options().boards));
  Json list = Json::array();
  for (auto const side : {CaptureSide::left, CaptureSide::right}) fs::create_directories(folder / name(side));
  for (std::size_t i = 0; i < poses.left_from_board.size(); ++i) {
    std::string const file = fmt::format("{:02d}.png", i);
    auto const pictures = take_board(stereo, poses, i, rig.sensor(), context);
    for (auto const side : {CaptureSide::left, CaptureSide::right})
      write_file(folder / name(side) / file, encode_frame(pictures[static_cast<std::size_t>(side)]));
    list.push_back({{"file", file}, {"left_from_board", pose_to_json(poses.left_from_board[i])}});
  }
  write_json(folder / "boards.json", {{"board", fmt::format("{}x{}", poses.board.columns, poses.board.rows)},
                                      {"square", poses.board.square},
                                      {"unit", "mm"},
                                      {"left", "left/{:02d}.png"},
                                      {"right", "right/{:02d}.png"},
                                      {"poses", list}});
}

void write_truth(fs::path const& folder, TriangleMesh const& model, CaptureRig const& rig, Context& context) {
  fs::create_directories(folder);
  ScanSet set;
  set.unit = Unit::mm;
  for (std::size_t v = 0; v < static_cast<std::size_t>(rig.options().views); ++v) {
    View view;
    view.name = view_name(v);
    view.image.camera = ideal_left_camera(rig.layout().rig_in_use);
    view.object_from_camera = rig.layout().object_from_left(v);
    set.views.push_back(std::move(view));
    CaptureTruth const truth = rig.truth(static_cast<int>(v), context);
    write_depth_exr(folder / (view_name(v) + ".exr"), truth.depth);
    write_file(folder / fmt::format("visible_{}.png", view_name(v)), encode_png(truth.visible));
  }
  set.center = rig.center();
  write_manifest(folder, set);
  write_triangle_mesh(folder / "model.ply", model);
  write_stereo_rig(folder / "rig.yml", rig.layout().rig_in_use);
}

}  // namespace

void write_capture(fs::path const& folder, TriangleMesh const& model, CaptureRig const& rig, Context& context) {
  int const first = rig.options().scene.stage ? -1 : 0, views = rig.options().views;
  auto const total = static_cast<std::size_t>(2 * (views - first));
  std::size_t done = 0;
  for (int view = first; view < views; ++view)
    for (auto const side : {CaptureSide::left, CaptureSide::right}) {
      write_pictures(folder / (view < 0 ? "empty" : "view_" + view_name(static_cast<std::size_t>(view))), rig, view,
                     side, context);
      context.progress("capture", ++done, total);
    }
  if (rig.options().boards > 0) write_boards(folder / "boards", rig, context);
  write_truth(folder / "truth", model, rig, context);
  write_stereo_rig(folder / "rig.yml", rig.layout().rig);
  write_json(folder / "capture.json", manifest(rig));
}

}  // namespace scanview
