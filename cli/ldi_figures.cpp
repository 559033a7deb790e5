#include "cli/ldi_figures.h"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <opencv2/core.hpp>
#include <set>

#include "base/median.h"
#include "base/srgb.h"
#include "viewer/evaluate/image_quality.h"
#include "viewer/layered/image_warper.h"

namespace scanview {
namespace {

using Clock = std::chrono::steady_clock;

double elapsed_milliseconds(Clock::time_point start) {
  return std::chrono::duration<double, std::milli>(Clock::now() - start).count();
}

/// A picture as it is compared: where at least half of a pixel is drawn.
struct Compared {
  cv::Mat3b picture;
  cv::Mat1b drawn;
  explicit Compared(Frame const& frame)
      : picture(frame.color.size(), cv::Vec3b(0, 0, 0)), drawn(frame.color.size(), uchar(0)) {
    for (int y = 0; y < picture.rows; ++y)
      for (int x = 0; x < picture.cols; ++x) {
        cv::Vec4b const& pixel = frame.color(y, x);
        if (pixel[3] < 128) continue;
        drawn(y, x) = 255;
        picture(y, x) = {pixel[0], pixel[1], pixel[2]};
      }
  }
};

/// Sums over pictures.
struct QualitySum {
  double psnr_sum = 0, common = 0, coverage = 0;
  void add(Compared const& one, ReferenceFrame const& reference, cv::Mat1b const& counts, cv::Mat1b const& both) {
    coverage += double(cv::countNonZero(one.drawn & counts)) / std::max(1, cv::countNonZero(counts));
    if (reference.picture.empty()) {
      psnr_sum = common = NAN;
      return;
    }
    psnr_sum += psnr(reference.picture, one.picture, counts);
    common += psnr(reference.picture, one.picture, both);
  }
  PictureQuality mean(std::size_t count) const {
    double const n = double(std::max<std::size_t>(count, 1));
    return {psnr_sum / n, common / n, coverage / n};
  }
};

Json quality_to_json(PictureQuality const& quality) {
  return {{"psnr", json_number(quality.psnr)},
          {"psnr_common", json_number(quality.psnr_common)},
          {"uncovered", 1 - quality.coverage}};
}

}  // namespace

BuiltLdi build_ldi(std::vector<View> const& views, Unit unit, LdiOptions const& options, Context& context) {
  auto const start = Clock::now();
  LdiBuilder builder(options);
  builder.add(views, context);
  auto tree = std::make_shared<LdiTree const>(builder.build(unit, context));
  return {std::move(builder), std::move(tree), elapsed_milliseconds(start) / 1e3};
}

Json ldi_size(LdiTree const& tree) {
  std::set<int> levels;
  for (LdiCell const& cell : tree.cells) levels.insert(cell.key.level);
  return {{"cells", tree.cells.size()},
          {"bytes", tree.bytes()},
          {"input_bytes", tree.input_bytes},
          {"pixels", tree.pixel_count()},
          {"levels", levels.size()}};
}

Json LdiFigures::to_json() const {
  Json json = {{"images", images}};
  json.update(size);
  json.update({{"build_seconds", build_seconds},
               {"milliseconds", median(milliseconds)},
               {"cells_traversed", median(cells_traversed)},
               {"splats", median(splats)}});
  json.update(quality_to_json(filled));
  json["psnr_common"] = json_number(open.psnr_common);
  json["gaps_left"] = quality_to_json(open);
  json["warping"] = quality_to_json(warped);
  json["warping"]["milliseconds"] = warped_milliseconds;
  json["frames"] = {{"milliseconds", milliseconds}, {"cells_traversed", cells_traversed}, {"splats", splats}};
  return json;
}

LdiFigures measure_ldi(std::shared_ptr<LdiTree const> const& built, std::vector<View> const& views,
                       std::vector<PathCamera> const& path, std::vector<ReferenceFrame> const& references,
                       LdiRenderOptions const& options, Context& context) {
  LdiFigures figures;
  figures.images = int(views.size());
  figures.size = ldi_size(*built);
  LdiRenderer tree(built, options, context.threads);
  ImageWarper warper(views, context.threads);
  std::vector<double> warped;
  auto const faster_of_two = [](Renderer& renderer, PathCamera const& from) {
    double least = INFINITY;
    for (int turn = 0; turn < 2; ++turn) {
      auto const start = Clock::now();
      renderer.render(from.camera, from.object_from_camera);
      least = std::min(least, elapsed_milliseconds(start));
    }
    return least;
  };
  for (PathCamera const& from : path) {
    context.check_cancelled();
    figures.milliseconds.push_back(faster_of_two(tree, from));
    figures.cells_traversed.push_back(double(tree.traversed().size()));
    figures.splats.push_back(double(tree.splats()));
    warped.push_back(faster_of_two(warper, from));
  }
  figures.warped_milliseconds = median(warped);

  std::vector<ReferenceFrame> wanted = references;
  if (wanted.empty())
    for (PathCamera const& from : path) wanted.push_back({from, {}, {}});
  QualitySum open, filled, by_warping;
  for (ReferenceFrame const& reference : wanted) {
    context.check_cancelled();
    Camera const& camera = reference.from.camera;
    auto const draw = [&](Renderer& renderer) {
      return Compared(renderer.render(camera, reference.from.object_from_camera));
    };
    tree.options.gaps = LdiRenderOptions::Gaps::background;
    Compared const left = draw(tree);
    tree.options.gaps = LdiRenderOptions::Gaps::filled;
    Compared const closed = draw(tree), moved = draw(warper);
    cv::Mat1b const counts =
        reference.counts.empty() ? cv::Mat1b(camera.height(), camera.width(), uchar(255)) : reference.counts;
    cv::Mat1b const both = left.drawn & moved.drawn & counts;
    open.add(left, reference, counts, both);
    filled.add(closed, reference, counts, both);
    by_warping.add(moved, reference, counts, both);
  }
  figures.open = open.mean(wanted.size());
  figures.filled = filled.mean(wanted.size());
  figures.warped = by_warping.mean(wanted.size());
  return figures;
}

cv::Mat3b on_background(cv::Mat4b const& picture, cv::Vec3b const& background) {
  auto const& linear = linear_from_srgb8();
  cv::Mat3b result(picture.size());
  for (int y = 0; y < result.rows; ++y)
    for (int x = 0; x < result.cols; ++x) {
      cv::Vec4b const& pixel = picture(y, x);
      double const alpha = pixel[3] / 255.0;
      for (int c = 0; c < 3; ++c)
        result(y, x)[c] =
            uchar(std::lround(255 * srgb_from_linear(alpha * linear[pixel[c]] + (1 - alpha) * linear[background[c]])));
    }
  return result;
}

}  // namespace scanview
