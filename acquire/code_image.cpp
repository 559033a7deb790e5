#include "acquire/code_image.h"

#include <algorithm>
#include <cmath>
#include <vector>

#include "base/median.h"
#include "base/parallel.h"

namespace scanview {
namespace {

constexpr int kBandRows = 16;
constexpr int kRowStride = 4;
constexpr double kMostChanges = 1e5;  // pixels whose changes tell the usual one
constexpr float kGentle = 3;
constexpr float kSteep = 12;
constexpr float kSigmas = 4;
constexpr float kBendSigmas = 3;
// A pixel whose paint changes by a share g from side to side has its light's middle off its own by g / 12 where paint
// changes evenly, by up to g / 4 where it changes at once.
constexpr float kPaintShift = 1.0F / 6;
constexpr float kLeastFall = 0.3F;  // of the light, from one pixel to the next by the surface's turning away

/// Changes code(p + step) - code(p) at evenly spread pixels: with 1e5 of them a median is known to 0.4 % of their
/// spread.
std::vector<double> changes(CodeImage const& image, int dx, int dy) {
  std::vector<double> result;
  int const stride =
      std::max(1, static_cast<int>(static_cast<double>(image.code.total()) / (kRowStride * kMostChanges)));
  for (int y = 0; y + dy < image.code.rows; y += kRowStride)
    for (int x = y / kRowStride % stride; x + dx < image.code.cols; x += stride) {
      double const change = image.code(y + dy, x + dx) - image.code(y, x);
      if (std::isfinite(change)) result.push_back(change);
    }
  return result;
}

double median_size(std::vector<double> values) {
  for (double& value : values) value = std::abs(value);
  return values.empty() ? 0 : median(std::move(values));
}

/// Whether the change from p to q is one of a surface; `before` and `after` are the changes on both sides of it (NaN
/// where there are none).
bool is_linked(float before, float change, float after, float noise, float typical) {
  float const size = std::abs(change);
  if (size <= kGentle * typical + noise) return true;
  if (!(size <= kSteep * typical + noise)) return false;  // also NaN
  float const alike = 0.5f * size + noise;
  return std::abs(change - before) <= alike || std::abs(change - after) <= alike;
}

/// What a second difference is beyond noise (whose standard deviation in it is sqrt(6) sigma).
float beyond_noise(float before, float here, float after, float sigma) {
  float const bend = std::abs(before - 2 * here + after) - kBendSigmas * sigma;
  return bend > 0 ? bend : 0;  // also where one is missing
}

float excess_bend_down(CodeImage const& image, int x, int y) {
  if (y < 1 || y + 1 >= image.code.rows) return 0;
  return beyond_noise(image.code(y - 1, x), image.code(y, x), image.code(y + 1, x), image.sigma(y, x));
}

}  // namespace

float excess_bend(float const* code, float const* sigma, int x, int count) {
  if (x < 1 || x + 1 >= count) return 0;
  return beyond_noise(code[x - 1], code[x], code[x + 1], sigma[x]);
}

CodeLinks link_codes(CodeImage const& image) {
  CodeLinks links;
  int const rows = image.code.rows, cols = image.code.cols;
  links.across = cv::Mat1b(rows, cols, std::uint8_t{0});
  links.down = cv::Mat1b(rows, cols, std::uint8_t{0});
  auto const across = changes(image, 1, 0), down = changes(image, 0, 1);
  auto const typical = static_cast<float>(std::max(median_size(across), median_size(down)));
  links.across_change = across.empty() ? 0 : std::abs(median(across));
  links.down_change = down.empty() ? 0 : std::abs(median(down));
  links.slope = typical;
  for (int y = 0; y < rows; ++y) {
    float const *const here = image.code[y], *const sigma = image.sigma[y];
    for (int x = 0; x + 1 < cols; ++x)
      links.across(y, x) =
          is_linked(x > 0 ? here[x] - here[x - 1] : kMissing, here[x + 1] - here[x],
                    x + 2 < cols ? here[x + 2] - here[x + 1] : kMissing, kSigmas * (sigma[x] + sigma[x + 1]), typical);
    if (y + 1 == rows) break;
    float const *const below = image.code[y + 1], *const sigma_below = image.sigma[y + 1];
    float const* const above = y > 0 ? image.code[y - 1] : nullptr;
    float const* const far = y + 2 < rows ? image.code[y + 2] : nullptr;
    for (int x = 0; x < cols; ++x)
      links.down(y, x) = is_linked(above ? here[x] - above[x] : kMissing, below[x] - here[x],
                                   far ? far[x] - below[x] : kMissing, kSigmas * (sigma[x] + sigma_below[x]), typical);
  }
  return links;
}

void judge_mixed(CodeImage& image, CodeLinks& links, double share) {
  int const rows = image.code.rows, cols = image.code.cols;
  cv::Mat1b drop(rows, cols, std::uint8_t{0});
  // What is left is known no better than paint is even. Of a pixel that a surface covers from a part to the whole, all
  // alike likely, the covered part's middle is off by (1 - part) / 2 / sqrt(3), RMS. Where less than half is covered
  // the pixel's centre is another surface's.
  float const least_shift = 0.5F * (1 - std::min(static_cast<float>(share), 0.5F)) / std::sqrt(3.0F);
  for (int y = 2; y + 2 < rows; ++y)
    for (int x = 2; x + 2 < cols; ++x) {
      if (!image.has_code(x, y)) continue;
      float least = 1;
      // Along one axis, (dx, dy) its step: how far the light's middle is off the pixel's, times the code's slope.
      auto const shift = [&](bool before, bool after, int dx, int dy) -> float {
        float const here = image.lit(y, x);
        if (before && after) {
          float const change = 0.5F * (image.lit(y + dy, x + dx) - image.lit(y - dy, x - dx));
          float const slope = 0.5F * (image.code(y + dy, x + dx) - image.code(y - dy, x - dx));
          return kPaintShift * std::min(std::abs(change) / std::max(here, 1.0F), 1.0F) * std::abs(slope);
        }
        if (before == after) return 0;
        int const sign = after ? 1 : -1;  // into the surface
        float const near = image.lit(y + sign * dy, x + sign * dx),
                    far = image.lit(y + 2 * sign * dy, x + 2 * sign * dx);
        float const expected = std::max(near + std::min(near - far, 0.0F), kLeastFall * near);
        float const left = expected > 0 ? std::min(here / expected, 1.0F) : 1;
        least = std::min(least, left);
        float const slope = std::abs(image.code(y, x) - image.code(y + sign * dy, x + sign * dx));
        return std::max(0.5F * (1 - left), least_shift) * std::max(slope, static_cast<float>(links.slope));
      };
      float const along = shift(links.across(y, x - 1) != 0, links.across(y, x) != 0, 1, 0);
      float const down = shift(links.down(y - 1, x) != 0, links.down(y, x) != 0, 0, 1);
      drop(y, x) = least < share;
      image.bias(y, x) = std::sqrt(image.bias(y, x) * image.bias(y, x) + along * along + down * down);
    }
  for (int y = 1; y + 1 < rows; ++y)
    for (int x = 1; x + 1 < cols; ++x) {
      if (!drop(y, x)) continue;
      image.code(y, x) = image.sigma(y, x) = image.bias(y, x) = kMissing;
      image.classes(y, x) = static_cast<std::uint8_t>(PixelClass::several_peaks);
      links.across(y, x - 1) = links.across(y, x) = links.down(y - 1, x) = links.down(y, x) = 0;
    }
}

namespace {

/// What resample makes of one place (u, v) in the image.
class Resampler {
 public:
  Resampler(CodeImage const& image, CodeLinks const& links)
      : image_(image),
        links_(links),
        rows_(image.code.rows),
        cols_(image.code.cols),
        unknown_slope_(static_cast<float>(links.slope)) {}

  struct Sample {
    float code = kMissing, sigma = kMissing, bias = kMissing;
    std::uint8_t what = static_cast<std::uint8_t>(PixelClass::no_depth);
  };

  Sample at(float u, float v) const {
    Sample result;
    if (!(u >= -0.5F && v >= -0.5F && u < static_cast<float>(cols_) - 0.5F && v < static_cast<float>(rows_) - 0.5F))
      return result;
    int const nx = static_cast<int>(u + 0.5F), ny = static_cast<int>(v + 0.5F);
    result.what = image_.classes(ny, nx);
    if (result.what != static_cast<std::uint8_t>(PixelClass::object)) return result;
    float const du = u - static_cast<float>(nx), dv = v - static_cast<float>(ny);
    int const i = du < 0 ? nx - 1 : nx, j = dv < 0 ? ny - 1 : ny;  // the upper left of the four around
    if (i >= 0 && j >= 0 && i + 1 < cols_ && j + 1 < rows_ && links_.across(j, i) && links_.across(j + 1, i) &&
        links_.down(j, i) && links_.down(j, i + 1))
      between(u, v, i, j, nx, ny, result);
    else
      beside(du, dv, nx, ny, result);
    return result;
  }

 private:
  void between(float u, float v, int i, int j, int nx, int ny, Sample& result) const {
    float const a = u - static_cast<float>(i), b = v - static_cast<float>(j);
    float const w[4] = {(1 - a) * (1 - b), a * (1 - b), (1 - a) * b, a * b};
    float const *c0 = image_.code[j] + i, *c1 = image_.code[j + 1] + i;
    float const *s0 = image_.sigma[j] + i, *s1 = image_.sigma[j + 1] + i;
    float const *b0 = image_.bias[j] + i, *b1 = image_.bias[j + 1] + i;
    result.code = w[0] * c0[0] + w[1] * c0[1] + w[2] * c1[0] + w[3] * c1[1];
    float const noise = w[0] * w[0] * s0[0] * s0[0] + w[1] * w[1] * s0[1] * s0[1] + w[2] * w[2] * s1[0] * s1[0] +
                        w[3] * w[3] * s1[1] * s1[1];
    // Where the surface bends, as at a crease, the plane through four codes is off by a quarter of a second difference
    // times a (1 - a).
    float const bend_x = a * (1 - a) * excess_bend(image_.code[ny], image_.sigma[ny], nx, cols_);
    float const bend_y = b * (1 - b) * excess_bend_down(image_, nx, ny);
    float const inherited = w[0] * b0[0] + w[1] * b0[1] + w[2] * b1[0] + w[3] * b1[1];
    result.sigma = std::sqrt(noise);
    result.bias = std::sqrt(inherited * inherited + bend_x * bend_x + bend_y * bend_y);
  }

  /// From the nearest pixel along its slopes.
  void beside(float du, float dv, int nx, int ny, Sample& result) const {
    float const code = image_.code(ny, nx);
    // The change along one axis: towards the place where that side is linked, else from the other side.
    auto const step = [&](bool linked_after, bool linked_before, float after, float before, float distance) {
      bool const ahead = distance >= 0 ? linked_after : !linked_before && linked_after;
      if (ahead) return (after - code) * distance;
      return linked_before ? (code - before) * distance : kMissing;
    };
    float const along =
        step(nx + 1 < cols_ && links_.across(ny, nx), nx > 0 && links_.across(ny, nx - 1),
             nx + 1 < cols_ ? image_.code(ny, nx + 1) : kMissing, nx > 0 ? image_.code(ny, nx - 1) : kMissing, du);
    float const down =
        step(ny + 1 < rows_ && links_.down(ny, nx), ny > 0 && links_.down(ny - 1, nx),
             ny + 1 < rows_ ? image_.code(ny + 1, nx) : kMissing, ny > 0 ? image_.code(ny - 1, nx) : kMissing, dv);
    float const doubt = (std::isnan(along) ? std::abs(du) : 0) + (std::isnan(down) ? std::abs(dv) : 0);
    result.code = code + (std::isnan(along) ? 0 : along) + (std::isnan(down) ? 0 : down);
    result.sigma = image_.sigma(ny, nx) * (1 + std::abs(du) + std::abs(dv));
    result.bias = std::hypot(image_.bias(ny, nx), doubt * unknown_slope_);
  }

  CodeImage const& image_;
  CodeLinks const& links_;
  int rows_, cols_;
  float unknown_slope_;
};

}  // namespace

CodeImage resample(CodeImage const& image, CodeLinks const& links, PictureMap const& map, Context& context, int step) {
  cv::Size const size(map.size().width, (map.size().height + step - 1) / step);
  CodeImage result{cv::Mat1f(size), cv::Mat1f(size), cv::Mat1f(size), cv::Mat1b(size), {}};
  Resampler const resampler(image, links);
  auto const bands = static_cast<std::size_t>((size.height + kBandRows - 1) / kBandRows);
  for_each_index(context, bands, [&](std::size_t band) {
    std::vector<cv::Vec2f> places;
    int const first = static_cast<int>(band) * kBandRows;
    for (int y = first; y < std::min(first + kBandRows, size.height); ++y) {
      map.row(y * step, places);
      float *const code = result.code[y], *const sigma = result.sigma[y], *const bias = result.bias[y];
      std::uint8_t* const classes = result.classes[y];
      for (int x = 0; x < size.width; ++x) {
        cv::Vec2f const& place = places[static_cast<std::size_t>(x)];
        Resampler::Sample const sample = resampler.at(place[0], place[1]);
        code[x] = sample.code, sigma[x] = sample.sigma, bias[x] = sample.bias, classes[x] = sample.what;
      }
    }
  });
  return result;
}

}  // namespace scanview
