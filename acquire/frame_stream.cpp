#include "acquire/frame_stream.h"

#include <oneapi/tbb/info.h>
#include <oneapi/tbb/parallel_pipeline.h>
#include <oneapi/tbb/task_arena.h>

#include <algorithm>
#include <exception>
#include <utility>

namespace scanview {
namespace {

struct Frame {
  std::size_t index = 0;
  cv::Mat picture;
  std::exception_ptr error;
};

}  // namespace

void stream_frames(Context& context, std::size_t count, std::function<cv::Mat(std::size_t)> const& read,
                   std::function<void(std::size_t, cv::Mat const&)> const& use) {
  int const processors = oneapi::tbb::info::default_concurrency();
  int const threads = context.threads > 0 ? std::min(context.threads, processors) : processors;
  std::size_t next = 0;
  std::exception_ptr error;
  using oneapi::tbb::filter_mode;
  auto const number = oneapi::tbb::make_filter<void, std::size_t>(
      filter_mode::serial_in_order, [&](oneapi::tbb::flow_control& control) -> std::size_t {
        if (next == count || error) control.stop();
        return next++;
      });
  auto const load = oneapi::tbb::make_filter<std::size_t, Frame>(filter_mode::parallel, [&](std::size_t i) {
    Frame frame{i, {}, {}};
    try {
      context.check_cancelled();
      frame.picture = read(i);
    } catch (...) {
      frame.error = std::current_exception();
    }
    return frame;
  });
  auto const hand_on = oneapi::tbb::make_filter<Frame, void>(filter_mode::serial_in_order, [&](Frame const& frame) {
    if (error) return;
    error = frame.error;
    try {
      if (!error) use(frame.index, frame.picture);
    } catch (...) {
      error = std::current_exception();
    }
  });
  // Isolated: a thread that waits here must not start on another view's frames, whose memory would come on top.
  oneapi::tbb::this_task_arena::isolate(
      [&] { oneapi::tbb::parallel_pipeline(static_cast<std::size_t>(threads) + 2, number & load & hand_on); });
  if (error) std::rethrow_exception(error);
}

}  // namespace scanview
