#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <cmath>
#include <iostream>
#include <memory>

#include "base/error.h"
#include "calib/board_pictures.h"
#include "calib/calibrate_section.h"
#include "cli/session.h"

namespace scanview {
namespace {

namespace fs = std::filesystem;

struct CalibrateArguments {
  std::vector<std::string> left, right;
  std::string board, dictionary, layout = "auto";
  double square = 0, marker = 0;
  fs::path output;
  bool holdout = false;
  CalibrateOptions options;
};

BoardDescription describe(CalibrateArguments const& arguments) {
  BoardDescription board = parse_board(arguments.board, arguments.square, arguments.marker, arguments.dictionary);
  if (arguments.layout == "old") board.layout = BoardDescription::Layout::old;
  if (arguments.layout == "current") board.layout = BoardDescription::Layout::current;
  return board;
}

// Nothing was found at all: the description is wrong, most likely. The first reason says what the pictures show.
void refuse_without_boards(BoardPictures const& pictures) {
  std::size_t found = 0;
  for (BoardView const& view : pictures.views) found += !view.left.empty() || !view.right.empty() ? 1 : 0;
  if (found > 0) return;
  std::string why;
  for (auto const* const side : {&pictures.left_why, &pictures.right_why})
    if (why.empty() && !side->empty()) why = fmt::format(" ({}: {})", side->front().name, side->front().why);
  throw Error(ErrorCode::no_solution, {},
              fmt::format("no picture shows a board of {}{}; does --board count {}?", pictures.board.name(), why,
                          pictures.board.kind == BoardDescription::Kind::charuco ? "squares" : "inner corners"));
}

// Which picture lacks a board is worth a warning; a rejected board says why in the report.
void report_missing(BoardPictures const& pictures, Context& context) {
  for (auto const* const side : {&pictures.left_why, &pictures.right_why})
    for (NamedReason const& picture : *side) context.warn(fmt::format("{}: {}", picture.name, picture.why));
}

// Boards that were found in no picture of a pair say so in the words of the detector.
void explain_missing(Calibration& calibration, BoardPictures const& pictures) {
  for (BoardFit& board : calibration.boards) {
    if (board.used || !board.left.empty() || !board.right.empty()) continue;
    for (auto const* const side : {&pictures.left_why, &pictures.right_why})
      for (NamedReason const& picture : *side)
        if (picture.name == board.name) board.why = picture.why;
    if (board.why.empty()) board.why = "the board was not found";
  }
}

void run(CalibrateArguments const& arguments, Session& session) {
  Context& context = session.context;
  BoardDescription const board = describe(arguments);
  CalibrateOptions options = arguments.options;
  apply_settings(
      session.settings, "calibrate",
      {number_setting("board_limit", options.board_limit), number_setting("corner_limit", options.corner_limit),
       number_setting("distortion_limit_px", options.distortion_limit_px),
       number_setting("focal_limit", options.focal_limit)});
  check_settings(session.settings, {"calibrate"});
  options.board = board;
  options.holdout = arguments.holdout ? CalibrateOptions::Holdout::on : CalibrateOptions::Holdout::off;
  options.validate();

  PicturePairs const paired =
      pair_pictures(find_pictures(arguments.left),
                    arguments.right.empty() ? std::vector<fs::path>{} : find_pictures(arguments.right));
  for (std::string const& line : paired.unpaired) context.warn(line);
  BoardPictures const pictures = detect_boards(paired.pairs, board, context);
  report_missing(pictures, context);
  refuse_without_boards(pictures);
  options.board = pictures.board;
  options.left_size = pictures.left_size;
  options.right_size = pictures.right_size;
  if (!arguments.right.empty() && options.right_size.empty())
    throw Error(ErrorCode::no_solution, {}, "no right picture shows the board: a rig needs at least 3");
  if (board.kind == BoardDescription::Kind::charuco) {
    bool const both = board.rows % 2 == 1;
    session.report["layout"] = both                                                     ? "both"
                               : pictures.board.layout == BoardDescription::Layout::old ? "old"
                                                                                        : "current";
    context.log(fmt::format("ChArUco layout: {}", both ? "old and current alike" : to_string(pictures.board.layout)));
  }

  Calibration calibration = calibrate(pictures.views, options, context);
  explain_missing(calibration, pictures);
  session.report.update(calibration.to_json());
  if (!calibration.solved()) throw Error(ErrorCode::no_solution, {}, calibration.reason);
  for (NamedReason const& out : calibration.boards_rejected())
    context.warn(fmt::format("board {} is left out: {}", out.name, out.why));
  for (NamedReason const& held : calibration.held)
    context.warn(fmt::format("{} is held at 0: {}", held.name, held.why));

  fs::path page = arguments.output;
  page.replace_extension(".html");
  write_file(page, html_page(fmt::format("Calibration {}", arguments.output.filename().string()), "",
                             {calibrate_section(calibration, paired.pairs)}));
  write_calibration(arguments.output, calibration);
  session.report["output"] = arguments.output.string();
  std::cout << fmt::format("{} of {} boards, {} corners, RMS {:.3f} px", calibration.boards_used(),
                           calibration.boards.size(), calibration.corners, calibration.rms_px);
  if (calibration.stereo)
    std::cout << fmt::format(", baseline {:.4g} {}", calibration.rig.baseline(), calibration.rig.unit);
  if (std::isfinite(calibration.holdout_epipolar_rms_px))
    std::cout << fmt::format(", held-out epipolar RMS {:.3f} px", calibration.holdout_epipolar_rms_px);
  std::cout << '\n';
}

}  // namespace

void add_calibrate(CLI::App& app, Session& session) {
  auto arguments = std::make_shared<CalibrateArguments>();
  CLI::App* verb = app.add_subcommand("calibrate", "Pictures of a board become a calibrated stereo rig");
  verb->add_option("--left", arguments->left, "Left pictures: pattern, folder or files")->required();
  verb->add_option("--right", arguments->right, "Right pictures; without them the left camera is calibrated alone");
  verb->add_option("--board", arguments->board, "9x6 (inner corners) or charuco:25x18 (squares)")->required();
  verb->add_option("--square", arguments->square, "Side of a square, in the unit")->required();
  verb->add_option("--marker", arguments->marker, "Side of a ChArUco marker, in the unit");
  verb->add_option("--dictionary", arguments->dictionary, "Of ChArUco markers, as DICT_5X5_1000");
  verb->add_option("--layout", arguments->layout, "ChArUco layout of OpenCV up to 4.5 (old) or since (current)")
      ->check(CLI::IsMember({"auto", "old", "current"}));
  verb->add_option("--unit", arguments->options.unit, "Of --square, --marker and the rig")
      ->check(CLI::IsMember({"mm", "m"}));
  verb->add_flag("--holdout", arguments->holdout, "Epipolar error of every board left out of the solve");
  verb->add_option("-o,--output", arguments->output, "The rig to write (OpenCV YAML)")->required();
  verb->callback([arguments, &session] {
    session.verb = "calibrate";
    session.work = [arguments, &session] { run(*arguments, session); };
  });
}

}  // namespace scanview
