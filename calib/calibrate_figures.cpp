#include <cmath>
#include <numbers>
#include <opencv2/core.hpp>

#include "calib/calibrate.h"

namespace scanview {

std::size_t Calibration::boards_used() const {
  std::size_t count = 0;
  for (BoardFit const& board : boards) count += board.used ? 1 : 0;
  return count;
}

std::vector<NamedReason> Calibration::boards_rejected() const {
  std::vector<NamedReason> rejected;
  for (BoardFit const& board : boards)
    if (!board.used) rejected.push_back({board.name, board.why});
  return rejected;
}

Json Calibration::to_json() const {
  auto const list = [](std::vector<NamedReason> const& reasons) {
    Json array = Json::array();
    for (NamedReason const& r : reasons) array.push_back({{"name", r.name}, {"why", r.why}});
    return array;
  };
  Json json = {{"status", to_string(status)}};
  if (!reason.empty()) json["reason"] = reason;
  json["boards_used"] = boards_used();
  json["boards_rejected"] = list(boards_rejected());
  if (!solved()) return json;
  std::size_t common = 0;
  for (BoardFit const& board : boards) common += board.used && !board.left.empty() && !board.right.empty() ? 1 : 0;
  if (stereo) json["boards_in_both"] = common;
  json["corners"] = corners;
  json["corners_rejected"] = corners_rejected;
  json["rms_px"] = rms_px;
  if (std::isfinite(holdout_epipolar_rms_px)) json["holdout_epipolar_rms_px"] = holdout_epipolar_rms_px;
  if (stereo) {
    json["baseline"] = rig.baseline();
    json["unit"] = rig.unit;
  }
  json["noise_px"] = {{"left", noise_left_px}};
  if (stereo) json["noise_px"]["right"] = noise_right_px;
  json["parameters"] = Json::object();
  for (Parameter const& p : parameters) {
    // Angles leave the program in degrees.
    double const unit = p.name.starts_with("rotation.") ? 180 / std::numbers::pi : 1;
    json["parameters"][p.name] = {{"value", p.value * unit}, {"std", json_number(p.std * unit)}};
  }
  json["held"] = list(held);
  json["board_rms_px"] = Json::object();
  for (BoardFit const& board : boards)
    if (!board.left.empty() || !board.right.empty()) json["board_rms_px"][board.name] = json_number(board.rms_px);
  if (std::isfinite(holdout_epipolar_rms_px)) {
    json["board_holdout_px"] = Json::object();
    for (BoardFit const& board : boards)
      if (std::isfinite(board.holdout_px)) json["board_holdout_px"][board.name] = board.holdout_px;
  }
  return json;
}

void write_calibration(std::filesystem::path const& path, Calibration const& calibration) {
  if (calibration.stereo) return write_stereo_rig(path, calibration.rig);
  Camera const& camera = calibration.rig.left.camera;
  Lens const& lens = calibration.rig.left.lens;
  cv::FileStorage file(".yml", cv::FileStorage::WRITE | cv::FileStorage::MEMORY);
  file.writeComment("one camera, calibrated alone: not a stereo rig");
  file << "image_width" << camera.width() << "image_height" << camera.height();
  file << "M1" << cv::Mat(cv::Matx33d(camera.fx(), 0, camera.cx(), 0, camera.fy(), camera.cy(), 0, 0, 1));
  file << "D1" << cv::Mat(cv::Matx<double, 1, 5>(lens.k1, lens.k2, lens.p1, lens.p2, lens.k3));
  file << "standard_deviations"
       << "{";
  for (auto const& [dotted, value] : calibration.rig.standard_deviations) {
    std::string name = dotted;
    if (auto const at = name.find('.'); at != std::string::npos) name.replace(at, 1, 2, '_');
    file << name << value;
  }
  file << "}";
  write_file(path, file.releaseAndGetString());
}

std::string to_string(Calibration::Status status) {
  switch (status) {
    case Calibration::Status::solved:
      return "solved";
    case Calibration::Status::too_few_boards:
      return "too_few_boards";
    case Calibration::Status::parallel_boards:
      return "parallel_boards";
    case Calibration::Status::inconsistent:
      return "inconsistent";
  }
  return "unknown";
}

}  // namespace scanview
