#include "cli/walkthrough_report.h"

#include <fmt/format.h>

#include <algorithm>
#include <numeric>

#include "base/error.h"
#include "viewer/blend/supersampling.h"

namespace scanview {
namespace {

constexpr int kPicture = 300;

std::string color_of(MergePolicy policy) {
  static char const* const colors[] = {"#999999", "#cc7722", "#2277cc", "#117733"};
  return colors[static_cast<std::size_t>(policy)];
}

cv::Mat3b opaque(cv::Mat4b const& picture) {
  cv::Mat3b result(picture.size());
  for (int y = 0; y < result.rows; ++y)
    for (int x = 0; x < result.cols; ++x) {
      cv::Vec4b const& from = picture(y, x);
      result(y, x) = from[3] == 0 ? cv::Vec3b(255, 0, 255) : cv::Vec3b(from[0], from[1], from[2]);
    }
  return result;
}

/// Frames from all along the way, drawn by the policy that the renderer has, above what they should look like.
std::string film_strip(WalkthroughRenderer& renderer, std::vector<ReferenceFrame> const& frames, int samples_side) {
  constexpr std::size_t kShown = 5;
  std::vector<std::string> drawn, wanted;
  for (std::size_t k = 0; k < std::min(kShown, frames.size()); ++k) {
    ReferenceFrame const& frame = frames[k * (frames.size() - 1) / std::max<std::size_t>(kShown - 1, 1)];
    Camera const& camera = frame.from.camera;
    Frame const picture =
        box_filtered(renderer.render(camera.resized(samples_side * camera.width(), samples_side * camera.height()),
                                     frame.from.object_from_camera),
                     samples_side);
    drawn.push_back(html_jpeg(opaque(picture.color), frame.from.name, kPicture));
    wanted.push_back(html_jpeg(frame.picture, "reference", kPicture));
  }
  return html_row(drawn) + html_row(wanted);
}

}  // namespace

WalkthroughReport walkthrough_report(WalkthroughRenderer& renderer, std::vector<ReferenceFrame> const& frames,
                                     int samples_side, Context& context) {
  if (frames.empty())
    throw Error(ErrorCode::bad_input, {},
                "nothing to compare with: a model is ray traced; of a set, views must be held out (--hold-out)");
  std::vector<PolicyFigures> const all =
      measure_policies(renderer, frames, {kMergePolicies.begin(), kMergePolicies.end()}, samples_side, context);
  WalkthroughReport report;
  std::vector<std::vector<std::string>> table = {
      {"policy", "squared error", "PSNR (dB)", "first, last frame (dB)", "ms a frame", "uncovered"}};
  std::vector<PlotCurve> errors, speed;
  for (PolicyFigures const& one : all) {
    std::string const name = to_string(one.policy);
    auto const decibel = [](double error) { return -10 * std::log10(std::max(error, 1e-10)); };
    double const uncovered =
        std::accumulate(one.uncovered.begin(), one.uncovered.end(), 0.0) / double(one.uncovered.size());
    table.push_back({name, fmt::format("{:.6f}", one.mean_error()), fmt::format("{:.2f}", one.psnr()),
                     fmt::format("{:.1f}, {:.1f}", decibel(one.error.front()), decibel(one.error.back())),
                     fmt::format("{:.2f}", one.median_milliseconds()), fmt::format("{:.5f}", uncovered)});
    PlotCurve curve{name, {}, color_of(one.policy), false};
    for (std::size_t f = 0; f < one.error.size(); ++f) curve.points.emplace_back(double(f), one.error[f]);
    errors.push_back(curve);
    speed.push_back({name, {{one.median_milliseconds(), one.mean_error()}}, color_of(one.policy), true});
    report.figures["policies"][name] = {{"error", one.mean_error()},
                                        {"psnr", one.psnr()},
                                        {"milliseconds", one.median_milliseconds()},
                                        {"uncovered", uncovered},
                                        {"errors", one.error}};
    report.figures["uncovered"] = uncovered;
  }
  for (auto const& row : table)
    report.text +=
        fmt::format("{:12} {:>14} {:>10} {:>24} {:>11} {:>10}\n", row[0], row[1], row[2], row[3], row[4], row[5]);
  PlotOptions of_errors, of_speed;
  of_errors.x_label = "frame";
  of_errors.y_label = "mean squared difference of R, G, B";
  of_errors.width = 640;
  of_speed.x_label = "ms a frame";
  of_speed.y_label = of_errors.y_label;
  report.section = {"walkthrough", "Ways to merge nodes",
                    fmt::format("<p>{} frames, against references that no node was made of.</p>", frames.size()) +
                        html_table(table) + "<h3>Error in each frame</h3>" + svg_plot(errors, of_errors) +
                        "<h3>Error against time</h3>" + svg_plot(speed, of_speed) + "<h3>Along the way</h3>" +
                        film_strip(renderer, frames, samples_side)};
  return report;
}

}  // namespace scanview
