#include "acquire/section_pictures.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <opencv2/imgproc.hpp>

#include "base/html.h"

namespace scanview {
namespace {

constexpr int kWidth = 200;   // CSS pixels of one picture
constexpr int kPixels = 400;  // so that it is sharp on a fine screen

cv::Mat small(cv::Mat const& image, int interpolation) {
  if (image.cols <= kPixels) return image;
  cv::Mat result;
  cv::resize(image, result, {kPixels, std::max(1, image.rows * kPixels / image.cols)}, 0, 0, interpolation);
  return result;
}

/// Green around what has a depth.
cv::Mat3b outlined(cv::Mat3b const& color, cv::Mat1b const& classes) {
  cv::Mat1b const object = classes == static_cast<int>(PixelClass::object);
  cv::Mat1b border;
  cv::morphologyEx(object, border, cv::MORPH_GRADIENT, cv::getStructuringElement(cv::MORPH_CROSS, {3, 3}));
  cv::Mat3b picture = color.clone();
  picture.setTo(cv::Scalar(60, 220, 60), border);
  return picture;
}

/// `values` between low and high through a colour map; gray where missing.
cv::Mat3b colored(cv::Mat1f const& values, double low, double high) {
  cv::Mat1b scaled(values.size(), static_cast<std::uint8_t>(0)), missing(values.size(), static_cast<std::uint8_t>(0));
  for (int y = 0; y < values.rows; ++y)
    for (int x = 0; x < values.cols; ++x) {
      // Not `values != values`: OpenCV compares NaN with itself as equal where it uses AVX.
      missing(y, x) = std::isfinite(values(y, x)) ? 0 : 255;
      if (missing(y, x) == 0)
        scaled(y, x) = cv::saturate_cast<std::uint8_t>(high > low ? 255 * (values(y, x) - low) / (high - low) : 128);
    }
  cv::Mat3b picture;
  cv::applyColorMap(scaled, picture, cv::COLORMAP_TURBO);
  picture.setTo(cv::Scalar::all(40), missing);
  return picture;
}

cv::Vec3b class_color(std::uint8_t value) {
  switch (static_cast<PixelClass>(value)) {
    case PixelClass::object:
      return {240, 240, 240};
    case PixelClass::background:
      return {40, 40, 40};
    case PixelClass::cut:
      return {150, 90, 40};
    case PixelClass::outlier:
      return {40, 40, 220};
    case PixelClass::no_depth:
      return {40, 170, 230};
    case PixelClass::no_light:
      return {90, 60, 60};
    case PixelClass::saturated:
      return {120, 240, 250};
    case PixelClass::several_peaks:
      return {200, 60, 200};
    case PixelClass::no_partner:
      return {200, 140, 40};
    case PixelClass::inconsistent:
      return {60, 200, 90};
  }
  return {255, 0, 255};
}

cv::Mat3b class_picture(cv::Mat1b const& classes) {
  cv::Mat3b picture(classes.size());
  for (int y = 0; y < classes.rows; ++y)
    for (int x = 0; x < classes.cols; ++x) picture(y, x) = class_color(classes(y, x));
  return picture;
}

}  // namespace

cv::Rect object_box(RangeImage const& image) {
  cv::Rect const all({0, 0}, image.depth.size());
  cv::Mat1b const object = image.classes == static_cast<int>(PixelClass::object);
  if (cv::countNonZero(object) == 0) return all;
  cv::Rect box = cv::boundingRect(object);
  int const margin = std::max(8, std::max(box.width, box.height) / 10);
  return cv::Rect(box.x - margin, box.y - margin, box.width + 2 * margin, box.height + 2 * margin) & all;
}

std::string color_swatch(cv::Vec3b const& color) {
  return fmt::format(
      "<span style=\"display:inline-block;width:1em;height:1em;border:1px solid "
      "#888;background:rgb({},{},{})\"></span>",
      color[2], color[1], color[0]);
}

Quantiles quantiles(cv::Mat1f const& values) {
  std::vector<float> finite;
  for (float const value : values)
    if (std::isfinite(value)) finite.push_back(value);
  if (finite.empty()) return {};
  std::sort(finite.begin(), finite.end());
  auto const at = [&](double share) {
    return finite[static_cast<std::size_t>(share * static_cast<double>(finite.size() - 1))];
  };
  return {at(0.01), at(0.5), at(0.99)};
}

std::string view_row(View const& view, std::string const& unit) {
  auto const& image = view.image;
  auto const depth = quantiles(image.depth), sigma = quantiles(image.sigma);
  cv::Rect const frame = object_box(image);
  return html_row({html_jpeg(small(outlined(image.color(frame), image.classes(frame)), cv::INTER_AREA),
                             fmt::format("view {}", view.name), kWidth),
                   html_png(small(colored(image.depth(frame), depth.low, depth.high), cv::INTER_NEAREST),
                            fmt::format("depth {:.4g} .. {:.4g}{}", depth.low, depth.high, unit), kWidth),
                   html_png(small(class_picture(image.classes(frame)), cv::INTER_NEAREST), "mask", kWidth),
                   html_png(small(colored(image.sigma(frame), 0, 2 * sigma.middle), cv::INTER_NEAREST),
                            fmt::format("sigma 0 .. {:.3g}{}", 2 * sigma.middle, unit), kWidth)});
}

std::string class_legend(std::vector<ClassName> const& names) {
  std::string html = "<p>Mask: ";
  for (auto const& [pixel, meaning] : names)
    html += fmt::format("{} {} &nbsp; ", color_swatch(class_color(static_cast<std::uint8_t>(pixel))), meaning);
  return html + "</p>\n";
}

std::size_t count_class(RangeImage const& image, PixelClass pixel) {
  return static_cast<std::size_t>(cv::countNonZero(image.classes == static_cast<int>(pixel)));
}

std::string unit_suffix(Unit unit) {
  return unit == Unit::arbitrary ? std::string() : fmt::format(" {}", to_string(unit));
}

}  // namespace scanview
