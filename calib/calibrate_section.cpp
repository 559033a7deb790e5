#include "calib/calibrate_section.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <opencv2/imgproc.hpp>

#include "base/image_file.h"

namespace scanview {
namespace {

constexpr int kWidth = 420;              // of a board's picture
constexpr std::size_t kMostBoards = 24;  // drawn; all are in the table
constexpr int kShift = 4;                // drawing coordinates in sixteenths of a pixel

cv::Scalar const kUsed(40, 190, 40), kRejected(40, 40, 230), kResidual(230, 120, 0);

cv::Point fixed(Eigen::Vector2d const& pixel, double scale) {
  return {static_cast<int>(std::lround(((pixel.x() + 0.5) * scale - 0.5) * (1 << kShift))),
          static_cast<int>(std::lround(((pixel.y() + 0.5) * scale - 0.5) * (1 << kShift)))};
}

void draw(cv::Mat3b& canvas, std::vector<CornerResidual> const& corners, double scale, double enlarge, bool used) {
  for (CornerResidual const& corner : corners) {
    cv::Scalar const color = used && corner.used ? kUsed : kRejected;
    cv::circle(canvas, fixed(corner.pixel, scale), 2 << kShift, color, 1, cv::LINE_AA, kShift);
    if (!corner.residual.allFinite()) continue;
    // A residual is at most a fifth of the picture long: those of rejected boards would cover it.
    Eigen::Vector2d vector = enlarge * corner.residual;
    double const longest = 0.2 * canvas.cols / scale;
    if (vector.norm() > longest) vector *= longest / vector.norm();
    cv::line(canvas, fixed(corner.pixel, scale), fixed(corner.pixel + vector, scale), kResidual, 1, cv::LINE_AA,
             kShift);
  }
}

// So that the usual residual is some twelve pixels long.
double enlargement(Calibration const& calibration, double scale) {
  double const wanted = 12 / scale / std::max(1e-3, calibration.rms_px);
  double const power = std::pow(10, std::floor(std::log10(wanted)));
  return power * std::max(1.0, std::floor(wanted / power));
}

std::string board_figure(BoardFit const& board, std::vector<CornerResidual> const& corners,
                         std::filesystem::path const& path, double enlarge) {
  cv::Mat3b picture = read_color(path);
  double const scale = static_cast<double>(kWidth) / picture.cols;
  cv::resize(picture, picture, {}, scale, scale, cv::INTER_AREA);
  draw(picture, corners, scale, enlarge, board.used);
  std::string const verdict =
      board.used ? fmt::format("{} corners", corners.size()) : fmt::format("out: {}", board.why);
  return html_jpeg(picture, fmt::format("{}: {}", path.filename().string(), verdict), kWidth);
}

std::string coverage(Calibration const& calibration, Camera const& camera, bool left, double enlarge) {
  double const scale = static_cast<double>(kWidth) / camera.width();
  cv::Mat3b canvas(std::max(1, static_cast<int>(std::lround(camera.height() * scale))), kWidth,
                   cv::Vec3b(255, 255, 255));
  constexpr int kColumns = 8, kRows = 6;
  std::vector<int> cells(kColumns * kRows, 0);
  for (BoardFit const& board : calibration.boards) {
    if (!board.used) continue;
    for (CornerResidual const& corner : left ? board.left : board.right) {
      int const x = std::clamp(static_cast<int>((corner.pixel.x() + 0.5) / camera.width() * kColumns), 0, kColumns - 1);
      int const y = std::clamp(static_cast<int>((corner.pixel.y() + 0.5) / camera.height() * kRows), 0, kRows - 1);
      ++cells[static_cast<std::size_t>(y * kColumns + x)];
    }
    draw(canvas, left ? board.left : board.right, scale, enlarge, true);
  }
  auto const empty = std::count(cells.begin(), cells.end(), 0);
  cv::rectangle(canvas, cv::Rect(0, 0, canvas.cols, canvas.rows), cv::Scalar(120, 120, 120));
  return html_png(
      canvas,
      fmt::format("{} camera: all corners and their residuals, {:.0f} times enlarged; {} of {} fields of the "
                  "picture without a corner",
                  left ? "left" : "right", enlarge, empty, cells.size()),
      kWidth);
}

std::string parameter_table(Calibration const& calibration) {
  std::vector<std::vector<std::string>> rows = {{"parameter", "value", "standard deviation"}};
  for (Parameter const& p : calibration.parameters) {
    bool const angle = p.name.starts_with("rotation."), length = p.name.starts_with("translation.");
    double const unit = angle ? 180 / std::numbers::pi : 1;
    std::string name = p.name;
    if (angle) name.append(" (degrees)");
    if (length) name.append(fmt::format(" ({})", calibration.rig.unit));
    rows.push_back({name, fmt::format("{:.6g}", p.value * unit), fmt::format("{:.2g}", p.std * unit)});
  }
  std::string html = html_table(rows);
  if (calibration.held.empty()) return html;
  rows = {{"held at 0", "why"}};
  for (NamedReason const& held : calibration.held) rows.push_back({held.name, held.why});
  return html + html_table(rows);
}

std::string board_table(Calibration const& calibration) {
  std::vector<std::vector<std::string>> rows = {
      {"board", "corners left", "corners right", "RMS px", "held out: epipolar px", "why it is left out"}};
  for (BoardFit const& board : calibration.boards) {
    bool const seen = !board.left.empty() || !board.right.empty();
    rows.push_back({board.name, std::to_string(board.left.size()), std::to_string(board.right.size()),
                    seen ? fmt::format("{:.3f}", board.rms_px) : "",
                    std::isfinite(board.holdout_px) ? fmt::format("{:.3f}", board.holdout_px) : "", board.why});
  }
  return html_table(rows);
}

}  // namespace

ReportSection calibrate_section(Calibration const& calibration, std::vector<PicturePair> const& pairs) {
  Camera const& left = calibration.rig.left.camera;
  double const enlarge = enlargement(calibration, static_cast<double>(kWidth) / left.width());
  std::string html =
      fmt::format("<p>{} boards used, {} rejected; RMS of {} corners {:.3f} px.", calibration.boards_used(),
                  calibration.boards_rejected().size(), calibration.corners, calibration.rms_px);
  if (calibration.stereo)
    html.append(fmt::format(" Baseline {:.4g} {}.", calibration.rig.baseline(), calibration.rig.unit));
  if (std::isfinite(calibration.holdout_epipolar_rms_px))
    html.append(
        fmt::format(" Epipolar RMS of boards left out of the solve: {:.3f} px.", calibration.holdout_epipolar_rms_px));
  html.append("</p>").append(parameter_table(calibration)).append(board_table(calibration));
  std::vector<std::string> planes = {coverage(calibration, left, true, enlarge)};
  if (calibration.stereo) planes.push_back(coverage(calibration, calibration.rig.right.camera, false, enlarge));
  html.append("<h3>Coverage</h3>").append(html_row(planes)).append("<h3>Boards</h3>");
  html.append(fmt::format("<p>Green: used; red: rejected; blue: residual, {:.0f} times enlarged.</p>", enlarge));
  std::vector<std::string> figures;
  for (std::size_t i = 0; i < calibration.boards.size() && i < pairs.size() && i < kMostBoards; ++i) {
    BoardFit const& board = calibration.boards[i];
    if (!board.left.empty()) figures.push_back(board_figure(board, board.left, pairs[i].left, enlarge));
    if (!board.right.empty()) figures.push_back(board_figure(board, board.right, pairs[i].right, enlarge));
  }
  html.append(html_row(figures));
  return {"calibrate", "Calibration", html};
}

}  // namespace scanview
