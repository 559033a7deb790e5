#include "acquire/acquire.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <opencv2/imgproc.hpp>

#include "acquire/code_correspondences.h"
#include "acquire/decode_capture.h"
#include "acquire/match_codes.h"
#include "acquire/rectification.h"
#include "acquire/remove_background.h"
#include "acquire/rig_shift.h"
#include "base/error.h"
#include "base/image_file.h"
#include "base/median.h"
#include "base/parallel.h"
#include "calib/relative_pose.h"

namespace scanview {
namespace {

namespace fs = std::filesystem;

constexpr double kRimShare = 0.6;     // of the light that a pixel farther in shows
constexpr double kLeastAngleDeg = 1;  // between the two rays of a point
// Codes whose lines lean less than 6° from the epipolar ones: depth would be ten times as uncertain as across them.
constexpr double kLeastAlongRows = 0.1;
constexpr double kNarrowBeam = 0.5;  // light steps
constexpr int kAngleStep = 16;       // rows and columns, of the points whose angle is looked at

using Sides = std::array<DecodedSide, 2>;

/// Where the ideal left camera and the rectified ones look in the pictures; the same for all views.
struct Geometry {
  StereoRig rig;
  Rectification rectification;
  PictureMap left_map, left_row_map, right_row_map;

  Geometry(StereoRig const& of, Context& context) : rig(of), rectification(rectify(of)) {
    for_each_index(context, 3, [&](std::size_t i) {
      if (i == 0) left_map = PictureMap(rig.left.camera, Eigen::Matrix3d::Identity(), rig.left);
      if (i == 1) left_row_map = PictureMap(rectification.left, rectification.rectified_from_left, rig.left);
      if (i == 2) right_row_map = PictureMap(rectification.right, rectification.rectified_from_right, rig.right);
    });
  }
};

/// The stage's work on one capture.
class Acquisition {
 public:
  Acquisition(Capture const& capture, AcquireOptions const& options, Context& context)
      : capture_(capture), options_(options), context_(context) {}

  AcquireResult run() {
    result_.files_read.push_back(capture_.file);
    find_rig();
    Geometry const geometry(result_.rig, context_);
    result_.set.unit = unit_from_string(result_.rig.unit, capture_.file);
    BackgroundModel const background = background_model(geometry);
    auto const names = capture_.view_names();
    result_.set.views.resize(names.size());
    result_.views.resize(names.size());
    for_each_index(
        context_, names.size(),
        [&](std::size_t v) {
          View& view = result_.set.views[v];
          AcquiredView& figures = result_.views[v];
          view.name = figures.name = names[v];
          view.image = range_of(capture_.views[v], geometry, figures);
          view.image.color = color_of(capture_.views[v], view.image.color);
          cut(view.image);
          if (options_.remove_background) figures.background_removed = remove_background(view.image, background);
          finish_figures(view.image, figures);
        },
        "acquire");
    for (View const& view : result_.set.views) view.image.check();
    warn();
    return std::move(result_);
  }

 private:
  /// From a file, or from the first view's own matches.
  void find_rig() {
    fs::path const file = !options_.rig.empty() ? options_.rig
                          : capture_.rig        ? capture_.folder / *capture_.rig
                                                : fs::path();
    if (!file.empty()) {
      auto const first = capture_.frame_path(capture_.views.front(), Side::left, 0);
      result_.rig = read_stereo_rig(file, read_gray(first).size());
      result_.files_read.push_back(file);
      return;
    }
    if (!capture_.intrinsics)
      throw Error(ErrorCode::bad_input, capture_.file,
                  "names neither a rig nor intrinsics: calibrate the cameras, then say --rig FILE");
    auto const& [left, right] = *capture_.intrinsics;
    if (capture_.pattern != Capture::Pattern::gray || capture_.row_bits == 0)
      throw Error(
          ErrorCode::no_solution, capture_.file,
          "there is no rig, and the light tells columns only: to find how the cameras stand to each other it takes "
          "row bits as well, or a calibration (--rig FILE)");
    first_view_ = decode_both(capture_.views.front(), left.camera, right.camera);
    RelativePoseOptions pose_options;
    pose_options.refine_focal = options_.refine_focal;
    RelativePoseResult const pose = solve_relative_pose(
        code_correspondences((*first_view_)[0], (*first_view_)[1], context_), left, right, pose_options, context_);
    result_.relative_pose = pose.to_json();
    if (!pose.solved()) throw Error(ErrorCode::no_solution, capture_.file, pose.reason);
    for (auto const& held : pose.held) context_.warn(held);
    result_.rig = pose.rig;
    context_.log(
        fmt::format("{} matches of the light place the cameras: {:.2f} px off the epipolar lines (median), "
                    "the scale is free",
                    pose.inliers, pose.epipolar_median_px));
  }

  Sides decode_both(std::string const& view, Camera const& left, Camera const& right) const {
    Sides sides;
    for_each_index(context_, 2,
                   [&](std::size_t s) { sides[s] = decode(view, kSides[s], kSides[s] == Side::left ? left : right); });
    return sides;
  }

  DecodedSide decode(std::string const& view, Side side, Camera const& camera) const {
    auto const decoder =
        options_.decoder == AcquireOptions::Decoder::stripe ? SweepDecoder::stripe : SweepDecoder::space_time;
    return decode_side(capture_, view, side, camera, decoder, context_);
  }

  /// Depths of a view (or of the empty scene), without colour: `color` is what the light showed, in gray.
  RangeImage range_of(std::string const& folder, Geometry const& geometry, AcquiredView& figures) {
    Sides sides;
    if (first_view_ && folder == capture_.views.front())
      sides = std::move(*first_view_);
    else
      sides = decode_both(folder, geometry.rig.left.camera, geometry.rig.right.camera);
    reconcile(sides[0].soundness, sides[1].soundness);
    for (std::size_t s = 0; s < sides.size(); ++s) {
      figures.beam_sigma[s] = sides[s].beam_sigma;
      figures.noise_read[s] = sides[s].noise.read;
      figures.noise_gain[s] = sides[s].noise.gain;
      auto const& sound = sides[s].soundness;
      figures.soundness[to_string(kSides[s])] = sound.to_json();
      figures.warnings.insert(figures.warnings.end(), sound.warnings.begin(), sound.warnings.end());
    }
    auto &left = sides[0], &right = sides[1];
    std::array<CodeLinks, 2> links;
    CodeImage ideal;
    CodeRows right_rows;
    for_each_index(context_, 2, [&](std::size_t s) {
      links[s] = link_codes(sides[s].image);
      judge_mixed(sides[s].image, links[s], s == 0 ? kRimShare : 0);
      if (s == 0)
        ideal = resample(left.image, links[s], geometry.left_map, context_);
      else
        right_rows = CodeRows(resample(right.image, links[s], geometry.right_row_map, context_), context_);
    });
    auto const left_rows = [&](int step) {
      CodeImage codes = resample(left.image, links[0], geometry.left_row_map, context_, step);
      // Samples are of pixels that count; rivals may be any.
      if (step > 1 && !left.centres.empty()) keep_centres(codes, left.centres, geometry.left_row_map, step);
      return CodeRows(std::move(codes), context_);
    };
    if (right_rows.change_along_rows() < kLeastAlongRows)
      throw Error(
          ErrorCode::no_solution, capture_.folder / folder,
          "the light runs along the epipolar lines: it cannot tell where on a line a point is (turn the light, or "
          "the line between the cameras, by 90°)");
    if (!left.centres.empty()) keep_centres(ideal, left.centres, geometry.left_map);
    MatchFigures match;
    RangeImage image = match_codes(ideal, left_rows, right_rows, geometry.rectification, geometry.rig.left.camera,
                                   left.centres.empty() ? CodeDensity::surfaces : CodeDensity::lines, match, context_);
    figures.decodable = match.decodable;
    figures.ambiguous = match.ambiguous;
    figures.sheet_scatter = match.sheet_scatter;
    if (!left.rows.empty() && !right.rows.empty()) check_rows(image, left.rows, right.rows, geometry, figures);
    measure_shift(image, sides, geometry, figures);
    cv::cvtColor(left.image.lit, image.color, cv::COLOR_GRAY2BGR);
    return image;
  }

  /// The stripe decoder's own pixels: those that the middle of a stripe is in.
  static void keep_centres(CodeImage& ideal, cv::Mat1b const& centres, PictureMap const& map, int step = 1) {
    for (int y = 0; y < ideal.code.rows; ++y)
      for (int x = 0; x < ideal.code.cols; ++x) {
        if (!ideal.has_code(x, y)) continue;
        cv::Vec2f const at = map.at(x, y * step);
        if (centres(static_cast<int>(at[1] + 0.5F), static_cast<int>(at[0] + 0.5F)) != 0) continue;
        ideal.code(y, x) = kMissing;
        ideal.classes(y, x) = static_cast<std::uint8_t>(PixelClass::no_light);
      }
  }

  /// Where a pixel's point is in the right camera's picture.
  static Eigen::Vector2d in_right(RangeImage const& image, int x, int y, Geometry const& geometry) {
    return geometry.rig.right.project(geometry.rig.right_from_left * image.point(x, y));
  }

  /// A match whose two pixels saw different rows of the projector is none.
  void check_rows(RangeImage& image, cv::Mat1i const& left, cv::Mat1i const& right, Geometry const& geometry,
                  AcquiredView& figures) const {
    cv::Rect const in_picture({0, 0}, right.size());
    for (int y = 0; y < image.depth.rows; ++y)
      for (int x = 0; x < image.depth.cols; ++x) {
        if (!image.has_depth(x, y)) continue;
        cv::Vec2f const at = geometry.left_map.at(x, y);
        int const a = left(static_cast<int>(at[1] + 0.5F), static_cast<int>(at[0] + 0.5F));
        Eigen::Vector2d const place = in_right(image, x, y, geometry);
        cv::Point const pixel(static_cast<int>(std::lround(place.x())), static_cast<int>(std::lround(place.y())));
        if (!in_picture.contains(pixel)) continue;
        int const b = right(pixel);
        if (a < 0 || b < 0) continue;
        ++figures.row_pairs;
        figures.row_off_2 += std::abs(a - b) > 2;
        figures.row_off_4 += std::abs(a - b) > 4;
        if (options_.use_rows && std::abs(a - b) > options_.row_tolerance) image.remove(x, y, PixelClass::inconsistent);
      }
  }

  /// Whether texture lies on the rows where the calibration has it.
  void measure_shift(RangeImage const& image, Sides const& sides, Geometry const& geometry, AcquiredView& figures) {
    Rectification const& r = geometry.rectification;
    Eigen::Matrix3d const left_from_rectified = r.rectified_from_left.transpose();
    cv::Rect const in_picture({0, 0}, image.depth.size());
    auto const x_right = [&](int x, int y) {
      Eigen::Vector2d const seen = image.camera.project(left_from_rectified * r.left.ray_direction(x, y));
      if (!(std::abs(seen.x()) < in_picture.width && std::abs(seen.y()) < in_picture.height)) return kMissing;
      cv::Point const pixel(static_cast<int>(std::lround(seen.x())), static_cast<int>(std::lround(seen.y())));
      if (!in_picture.contains(pixel) || !image.has_depth(pixel.x, pixel.y)) return kMissing;
      // The pixel's own match, moved by what (x, y) is beside it.
      Eigen::Vector3d const p = r.rectified_from_left * image.point(pixel.x, pixel.y);
      double const there = r.right.project(p - Eigen::Vector3d(r.baseline, 0, 0)).x();
      return static_cast<float>(there + x - r.left.project(p).x());
    };
    RigShift shift = measure_rig_shift({sides[0].image.lit, geometry.left_row_map},
                                       {sides[1].image.lit, geometry.right_row_map}, x_right, context_);
    reconcile(shift, sides[0].soundness, sides[1].soundness);
    figures.soundness["rig"] = shift.to_json();
    if (!shift.warning.empty()) figures.warnings.push_back(shift.warning);
  }

  cv::Mat3b color_of(std::string const& folder, cv::Mat3b const& otherwise) const {
    LensCamera const& left = result_.rig.left;
    cv::Mat3b color = otherwise;
    if (capture_.color) {
      auto const path = capture_.path_of(folder, *capture_.color);
      color = read_color(path);
      if (color.size() != otherwise.size())
        throw Error(ErrorCode::bad_input, path, "is not as large as the left camera's pictures");
      color = undistort_color(color, left.camera, left.lens);
    }
    return color;
  }

  void cut(RangeImage& image) const {
    for (int y = 0; y < image.depth.rows; ++y)
      for (int x = 0; x < image.depth.cols; ++x)
        if (image.has_depth(x, y) && (image.depth(y, x) < options_.min_depth || image.depth(y, x) > options_.max_depth))
          image.remove(x, y, PixelClass::cut);
  }

  BackgroundModel background_model(Geometry const& geometry) {
    BackgroundModel model;
    if (!options_.remove_background) return model;
    model.backdrop = capture_.backdrop;
    model.backdrop_tolerance = options_.backdrop_tolerance;
    if (!capture_.empty) return model;
    AcquiredView figures;
    model.empty = range_of(*capture_.empty, geometry, figures);
    model.empty_has_color = capture_.color && fs::exists(capture_.path_of(*capture_.empty, *capture_.color));
    if (model.empty_has_color) model.empty->color = color_of(*capture_.empty, model.empty->color);
    return model;
  }

  void finish_figures(RangeImage const& image, AcquiredView& figures) const {
    std::vector<double> sigmas, angles;
    Eigen::Vector3d const right_eye = result_.rig.right_from_left.inverse().translation();
    for (int y = 0; y < image.depth.rows; ++y)
      for (int x = 0; x < image.depth.cols; ++x) {
        if (!image.has_depth(x, y)) continue;
        sigmas.push_back(image.sigma(y, x));
        if (x % kAngleStep != 0 || y % kAngleStep != 0) continue;
        Eigen::Vector3d const p = image.point(x, y), q = p - right_eye;
        angles.push_back(std::atan2(p.cross(q).norm(), p.dot(q)) * 180 / std::numbers::pi);
      }
    figures.depths = sigmas.size();
    figures.sigma_median = sigmas.empty() ? 0 : median(std::move(sigmas));
    double const beam = std::min(figures.beam_sigma[0], figures.beam_sigma[1]);
    if (beam > 0 && beam < kNarrowBeam)
      figures.warnings.push_back(
          fmt::format("the beam is {:.2f} light steps wide (standard deviation), too narrow to tell where it was "
                      "between two frames "
                      "(take smaller steps, or widen the beam to 0.8 steps or more)",
                      beam));
    if (angles.empty()) return;
    figures.angle_deg = median(std::move(angles));
    if (figures.angle_deg < kLeastAngleDeg)
      figures.warnings.push_back(
          fmt::format("the two cameras see the scene under {:.2f}° only: depths are uncertain, as sigma says (move the "
                      "cameras apart)",
                      figures.angle_deg));
  }

  /// Each warning once, with the views it concerns.
  void warn() {
    std::vector<std::string> said;
    for (auto const& view : result_.views)
      for (auto const& warning : view.warnings) {
        if (std::find(said.begin(), said.end(), warning) != said.end()) continue;
        said.push_back(warning);
        context_.warn(fmt::format("{}: {}", view.name, warning));
      }
  }

  Capture const& capture_;
  AcquireOptions const& options_;
  Context& context_;
  AcquireResult result_;
  std::optional<Sides> first_view_;
};

}  // namespace

void AcquireOptions::validate() const {
  auto const require = [](bool good, char const* what) {
    if (!good) throw Error(ErrorCode::usage, {}, what);
  };
  require(row_tolerance > 0, "row_tolerance: must be positive");
  require(min_depth >= 0 && max_depth > min_depth, "min_depth, max_depth: 0 or more, and in this order");
  require(backdrop_tolerance > 0 && backdrop_tolerance < 1, "backdrop_tolerance: must be between 0 and 1");
}

AcquireResult acquire(Capture const& capture, AcquireOptions const& options, Context& context) {
  options.validate();
  return Acquisition(capture, options, context).run();
}

}  // namespace scanview
