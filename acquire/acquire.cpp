#include "acquire/acquire.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <opencv2/imgproc.hpp>

#include "acquire/decode_gray.h"
#include "acquire/decode_sweep.h"
#include "acquire/frame_stream.h"
#include "acquire/match_codes.h"
#include "acquire/rectification.h"
#include "base/error.h"
#include "base/image_file.h"
#include "base/parallel.h"

namespace scanview {
namespace {

namespace fs = std::filesystem;

/// One camera's pictures of one view, decoded.
struct Decoded {
  CodeImage image;
  cv::Mat1i rows;     // of the projector; may be empty
  cv::Mat1b centres;  // of stripes; may be empty
  PixelNoise noise;
  double beam_sigma = 0;
};

cv::Mat read_frame(fs::path const& path, Camera const& camera) {
  cv::Mat frame = read_gray(path);
  if (frame.cols != camera.width() || frame.rows != camera.height())
    throw Error(ErrorCode::bad_input, path,
                fmt::format("is {}×{}, but the camera was calibrated at {}×{}", frame.cols, frame.rows, camera.width(),
                            camera.height()));
  return frame;
}

class Decoders {
 public:
  Decoders(Capture const& capture, AcquireOptions const& options) : capture_(capture), options_(options) {}

  Decoded decode(std::string const& view, Side side, Camera const& camera, Context& context) const {
    auto const read = [&](std::size_t i) {
      return read_frame(capture_.frame_path(view, side, static_cast<int>(i)), camera);
    };
    auto const count = static_cast<std::size_t>(capture_.frame_count());
    // All frames of a view have one depth: the first one's.
    int depth = -1;
    auto const check = [&](std::size_t i, cv::Mat const& frame) {
      if (depth < 0) depth = frame.depth();
      if (frame.depth() != depth)
        throw Error(ErrorCode::bad_input, capture_.frame_path(view, side, static_cast<int>(i)),
                    "has another number of bits than the frames before it");
    };
    Decoded result;
    if (capture_.pattern == Capture::Pattern::gray) {
      GrayDecoder decoder(capture_);
      auto const level = [&](std::optional<std::array<std::string, 2>> const& files, GrayFrame::Kind kind) {
        if (!files) return;
        auto const path = capture_.path_of(view, (*files)[static_cast<std::size_t>(side)]);
        decoder.add({kind}, read_frame(path, camera));
      };
      level(capture_.white, GrayFrame::Kind::white);
      level(capture_.black, GrayFrame::Kind::black);
      stream_frames(context, count, read, [&](std::size_t i, cv::Mat const& frame) {
        check(i, frame);
        decoder.add(capture_.gray[i], frame);
      });
      result.image = decoder.finish();
      result.rows = decoder.rows();
      result.noise = decoder.noise();
    } else if (options_.decoder == AcquireOptions::Decoder::space_time) {
      SpaceTimeDecoder decoder;
      stream_frames(context, count, read, [&](std::size_t i, cv::Mat const& frame) {
        check(i, frame);
        decoder.add(frame);
      });
      result.image = decoder.finish(context);
      result.noise = decoder.figures().noise;
      result.beam_sigma = decoder.figures().beam_sigma;
    } else {
      StripeDecoder decoder;
      stream_frames(context, count, read, [&](std::size_t i, cv::Mat const& frame) {
        check(i, frame);
        decoder.add(frame);
      });
      result.image = decoder.finish();
      result.centres = decoder.centres();
    }
    return result;
  }

 private:
  Capture const& capture_;
  AcquireOptions const& options_;
};

/// Where the ideal left camera and the rectified ones look in the pictures; the same for all views.
struct Geometry {
  StereoRig rig;
  Rectification rectification;
  cv::Mat2f left_map, left_row_map, right_row_map;

  explicit Geometry(StereoRig const& of) : rig(of), rectification(rectify(of)) {
    left_map = picture_map(rig.left.camera, Eigen::Matrix3d::Identity(), rig.left);
    left_row_map = picture_map(rectification.left, rectification.rectified_from_left, rig.left);
    right_row_map = picture_map(rectification.right, rectification.rectified_from_right, rig.right);
  }
};

constexpr double kRimShare = 0.6;  // of the light that a pixel farther in shows

double median(std::vector<float>& values) {
  if (values.empty()) return 0;
  auto const middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  return *middle;
}

RangeImage range_of_view(Geometry const& geometry, Decoded& left, Decoded& right, AcquiredView& figures,
                         Context& context) {
  CodeLinks left_links = link_codes(left.image);
  CodeLinks right_links = link_codes(right.image);
  judge_mixed(left.image, left_links, kRimShare);
  judge_mixed(right.image, right_links, 0);
  CodeImage ideal = resample(left.image, left_links, geometry.left_map);
  CodeRows const left_rows(resample(left.image, left_links, geometry.left_row_map), context);
  CodeRows const right_rows(resample(right.image, right_links, geometry.right_row_map), context);
  if (!left.centres.empty())
    for (int y = 0; y < ideal.code.rows; ++y)
      for (int x = 0; x < ideal.code.cols; ++x) {
        int const u = static_cast<int>(std::lround(geometry.left_map(y, x)[0])),
                  v = static_cast<int>(std::lround(geometry.left_map(y, x)[1]));
        if (!std::isfinite(ideal.code(y, x)) || left.centres(v, u) != 0) continue;
        ideal.code(y, x) = kMissing;
        ideal.classes(y, x) = static_cast<std::uint8_t>(PixelClass::no_light);
      }
  MatchFigures match;
  RangeImage image =
      match_codes(ideal, left_rows, right_rows, geometry.rectification, geometry.rig.left.camera, match, context);
  figures.decodable = match.decodable;
  figures.ambiguous = match.ambiguous;
  figures.sheet_scatter = match.sheet_scatter;
  return image;
}

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
  AcquireResult result;
  fs::path const rig_path = !options.rig.empty() ? options.rig
                            : capture.rig        ? capture.folder / *capture.rig
                                                 : fs::path();
  if (rig_path.empty())
    throw Error(ErrorCode::bad_input, capture.file, "there is no rig: calibrate, then say --rig FILE");
  cv::Size const size = read_gray(capture.frame_path(capture.views.front(), Side::left, 0)).size();
  result.rig = read_stereo_rig(rig_path, size);
  result.files_read = {capture.file, rig_path};
  Geometry const geometry(result.rig);
  Decoders const decoders(capture, options);
  auto const names = capture.view_names();
  result.set.unit = unit_from_string(result.rig.unit, rig_path);
  result.set.views.resize(capture.views.size());
  result.views.resize(capture.views.size());
  for_each_index(
      context, capture.views.size(),
      [&](std::size_t v) {
        std::string const& folder = capture.views[v];
        AcquiredView& figures = result.views[v];
        figures.name = names[v];
        std::array<Decoded, 2> sides;
        for (Side const side : kSides) {
          LensCamera const& camera = side == Side::left ? result.rig.left : result.rig.right;
          auto const s = static_cast<std::size_t>(side);
          sides[s] = decoders.decode(folder, side, camera.camera, context);
          figures.beam_sigma[s] = sides[s].beam_sigma;
          figures.noise_read[s] = sides[s].noise.read;
          figures.noise_gain[s] = sides[s].noise.gain;
        }
        View& view = result.set.views[v];
        view.name = names[v];
        view.image = range_of_view(geometry, sides[0], sides[1], figures, context);
        cv::Mat3b color;
        if (capture.color)
          color = read_color(capture.path_of(folder, *capture.color));
        else
          cv::cvtColor(sides[0].image.lit, color, cv::COLOR_GRAY2BGR);
        view.image.color = undistort_color(color, result.rig.left.camera, result.rig.left.lens).clone();
        std::vector<float> sigmas;
        for (float const sigma : view.image.sigma)
          if (std::isfinite(sigma)) sigmas.push_back(sigma);
        figures.depths = sigmas.size();
        figures.sigma_median = median(sigmas);
      },
      "acquire");
  for (View const& view : result.set.views) view.image.check();
  return result;
}

}  // namespace scanview
