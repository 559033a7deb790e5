#include "acquire/decode_capture.h"

#include <fmt/format.h>

#include "acquire/decode_gray.h"
#include "acquire/decode_sweep.h"
#include "acquire/frame_stream.h"
#include "base/error.h"
#include "base/image_file.h"

namespace scanview {
namespace {

namespace fs = std::filesystem;

cv::Mat read_frame(fs::path const& path, Camera const& camera) {
  cv::Mat frame = read_gray(path);
  if (frame.cols != camera.width() || frame.rows != camera.height())
    throw Error(ErrorCode::bad_input, path,
                fmt::format("is {}×{}, but the camera was calibrated at {}×{}", frame.cols, frame.rows, camera.width(),
                            camera.height()));
  return frame;
}

/// Hands every picture of a side on, in order.
template <class Use>
void stream(Capture const& capture, std::string const& view, Side side, Camera const& camera, Context& context,
            Use const& use) {
  int depth = -1;  // all have the first one's
  stream_frames(
      context, static_cast<std::size_t>(capture.frame_count()),
      [&](std::size_t i) { return read_frame(capture.frame_path(view, side, static_cast<int>(i)), camera); },
      [&](std::size_t i, cv::Mat const& frame) {
        if (depth < 0) depth = frame.depth();
        if (frame.depth() != depth)
          throw Error(ErrorCode::bad_input, capture.frame_path(view, side, static_cast<int>(i)),
                      "has another number of bits than the frames before it");
        use(i, frame);
      });
}

DecodedSide decode_gray(Capture const& capture, std::string const& view, Side side, Camera const& camera,
                        Context& context) {
  GrayDecoder decoder(capture);
  GraySoundness soundness(to_string(side), {static_cast<std::size_t>(capture.bits),
                                            static_cast<std::size_t>(capture.row_bits), capture.has_inverses()});
  for (auto const kind : {GrayFrame::Kind::white, GrayFrame::Kind::black}) {
    auto const& files = kind == GrayFrame::Kind::white ? capture.white : capture.black;
    if (!files) continue;
    cv::Mat const picture = read_frame(capture.path_of(view, (*files)[static_cast<std::size_t>(side)]), camera);
    decoder.add({kind}, picture);
    if (kind == GrayFrame::Kind::white)
      soundness.set_white(picture);
    else
      soundness.set_black(picture);
  }
  bool const in_order = capture.in_opencv_order;  // what the checks of order know
  stream(capture, view, side, camera, context, [&](std::size_t i, cv::Mat const& frame) {
    decoder.add(capture.gray[i], frame);
    if (in_order) soundness.add(frame);
  });
  DecodedSide result;
  result.image = decoder.finish();
  result.rows = decoder.rows();
  result.noise = decoder.noise();
  if (in_order) result.soundness = soundness.finish();
  return result;
}

}  // namespace

DecodedSide decode_side(Capture const& capture, std::string const& view, Side side, Camera const& camera,
                        SweepDecoder sweep_decoder, Context& context) {
  if (capture.pattern == Capture::Pattern::gray) return decode_gray(capture, view, side, camera, context);
  DecodedSide result;
  SweepSoundness soundness(to_string(side));
  SpaceTimeDecoder space_time;
  StripeDecoder stripe;
  bool const is_stripe = sweep_decoder == SweepDecoder::stripe;
  stream(capture, view, side, camera, context, [&](std::size_t, cv::Mat const& frame) {
    soundness.add(frame);
    if (is_stripe)
      stripe.add(frame);
    else
      space_time.add(frame);
  });
  result.soundness = soundness.finish();
  if (is_stripe) {
    result.image = stripe.finish();
    result.centres = stripe.centres();
    return result;
  }
  result.image = space_time.finish(context);
  auto const& figures = space_time.figures();
  result.noise = figures.noise;
  result.beam_sigma = figures.beam_sigma;
  return result;
}

}  // namespace scanview
