#include "viewer/view_based/picture_pyramid.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <opencv2/imgproc.hpp>

#include "base/srgb.h"

namespace scanview {
namespace {

cv::Mat3f linear_light(cv::Mat3b const& picture) {
  auto const& table = linear_from_srgb8();
  cv::Mat3f linear(picture.size());
  for (int y = 0; y < picture.rows; ++y) {
    for (int x = 0; x < picture.cols; ++x) {
      for (int c = 0; c < 3; ++c) linear(y, x)[c] = static_cast<float>(table[picture(y, x)[c]]);
    }
  }
  return linear;
}

/// The nearest 8-bit value by the middles between values.
class Encoder {
 public:
  Encoder() {
    for (std::size_t i = 0; i < kSize; ++i) {
      table_[i] = static_cast<std::uint8_t>(
          std::lround(255 * srgb_from_linear(static_cast<double>(i) / static_cast<double>(kSize - 1))));
    }
  }
  std::uint8_t operator()(float linear) const {
    return table_[static_cast<std::size_t>(std::clamp(linear, 0.0F, 1.0F) * static_cast<float>(kSize - 1) + 0.5F)];
  }

 private:
  static constexpr std::size_t kSize = 1 << 14;  // the steepest step, 1/255/12.92, is five entries long
  std::array<std::uint8_t, kSize> table_{};
};

cv::Mat3b encoded(cv::Mat3f const& linear) {
  static Encoder const encode;
  cv::Mat3b picture(linear.size());
  for (int y = 0; y < linear.rows; ++y) {
    for (int x = 0; x < linear.cols; ++x) {
      for (int c = 0; c < 3; ++c) picture(y, x)[c] = encode(linear(y, x)[c]);
    }
  }
  return picture;
}

/// What bilinear sampling reads anywhere on the mesh. (The feather is 0 along its boundary and says less.)
cv::Rect area_under(ViewMesh const& view_mesh) {
  Eigen::AlignedBox2d box;
  for (auto const& vertex : view_mesh.mesh.vertices) box.extend(view_mesh.camera.project(vertex.cast<double>()));
  cv::Rect const all(0, 0, view_mesh.camera.width(), view_mesh.camera.height());
  Eigen::Vector2d const low = box.min().array().max(0.0).floor(), high = box.max().array().ceil() + 1;
  cv::Rect const area = cv::Rect(cv::Point2d(low.x(), low.y()), cv::Point2d(std::min<double>(high.x(), all.width),
                                                                            std::min<double>(high.y(), all.height))) &
                        all;
  return area.empty() ? all : area;
}

}  // namespace

std::vector<cv::Mat3b> picture_levels(cv::Mat3b const& picture, std::size_t most) {
  std::vector<cv::Mat3b> levels = {picture};
  cv::Mat3f linear = linear_light(picture);
  while (levels.size() < most && (linear.rows > 1 || linear.cols > 1)) {
    cv::Mat3f half;
    cv::resize(linear, half, cv::Size(std::max(1, linear.cols / 2), std::max(1, linear.rows / 2)), 0, 0,
               cv::INTER_AREA);
    linear = half;
    levels.push_back(encoded(linear));
  }
  return levels;
}

PicturePyramid picture_pyramid(cv::Mat3b const& padded, ViewMesh const& view_mesh) {
  PicturePyramid pyramid;
  pyramid.area = area_under(view_mesh);
  constexpr std::size_t kAll = 32;
  pyramid.levels = picture_levels(padded(pyramid.area).clone(), kAll);
  pyramid.feather.create(pyramid.area.size());
  std::array<std::uint8_t, 256> root{};
  for (std::size_t i = 0; i < root.size(); ++i) {
    root[i] = static_cast<std::uint8_t>(std::lround(std::sqrt(255.0 * static_cast<double>(i))));
  }
  for (int y = 0; y < pyramid.area.height; ++y) {
    for (int x = 0; x < pyramid.area.width; ++x) {
      pyramid.feather(y, x) = root[view_mesh.feather(pyramid.area.y + y, pyramid.area.x + x)];
    }
  }
  return pyramid;
}

std::vector<std::uint16_t> cosine_labels(ViewMesh const& view_mesh) {
  std::vector<std::uint16_t> labels;
  for (float const cosine : view_mesh.cos_phi) {
    labels.push_back(static_cast<std::uint16_t>(std::lround(65535 * std::clamp(cosine, 0.0F, 1.0F))));
  }
  return labels;
}

}  // namespace scanview
