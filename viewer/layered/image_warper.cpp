#include "viewer/layered/image_warper.h"

#include <fmt/format.h>
#include <oneapi/tbb/info.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <limits>

#include "base/error.h"
#include "base/parallel.h"

namespace scanview {
namespace {

constexpr std::size_t kReadBeyond = 16;

/// A, which takes a pixel q = (x, y, 1) to camera coordinates: depth (A q) (perspective) or A q + (0, 0, depth).
Eigen::Matrix3d rays(Camera const& camera) {
  Eigen::Matrix3d a = Eigen::Matrix3d::Zero();
  a(0, 0) = 1 / camera.fx(), a(0, 2) = -camera.cx() / camera.fx();
  a(1, 1) = 1 / camera.fy(), a(1, 2) = -camera.cy() / camera.fy();
  if (camera.is_perspective()) a(2, 2) = 1;
  return a;
}

/// From camera coordinates to (u w, v w, z), w = z (perspective) or 1.
Eigen::Matrix<double, 3, 4> picture(Camera const& camera) {
  Eigen::Matrix<double, 3, 4> p = Eigen::Matrix<double, 3, 4>::Zero();
  int const center = camera.is_perspective() ? 2 : 3;
  p(0, 0) = camera.fx(), p(0, center) = camera.cx();
  p(1, 1) = camera.fy(), p(1, center) = camera.cy();
  p(2, 2) = 1;
  return p;
}

bool usable(float depth, Camera const& camera) {
  return std::isfinite(depth) && (!camera.is_perspective() || depth > 0);
}

std::uint32_t bgra(cv::Vec3b const& color) {
  cv::Vec4b const bytes(color[0], color[1], color[2], 255);
  std::uint32_t word = 0;
  std::memcpy(&word, bytes.val, sizeof word);
  return word;
}

}  // namespace

ImageWarper::ImageWarper(std::vector<View> const& views, int threads)
    : threads_(threads > 0 ? threads : oneapi::tbb::info::default_concurrency()) {
  for (View const& view : views) add(view);
  depths_.resize(depths_.size() + kReadBeyond, kMissing);
}

void ImageWarper::add(View const& view) {
  RangeImage const& image = view.image;
  cv::Size const size(image.camera.width(), image.camera.height());
  if (!view.object_from_camera)
    throw Error(ErrorCode::bad_input, {}, fmt::format("view {} has no pose: it cannot be warped", view.name));
  if (image.depth.size() != size || image.color.size() != size)
    throw Error(ErrorCode::bad_input, {},
                fmt::format("view {}: depth and colour must have its camera's size to be warped", view.name));
  Reference reference{image.camera, *view.object_from_camera, rows_.size()};
  for (int y = 0; y < size.height; ++y) {
    float const* const depth = image.depth[y];
    auto const has = [&](int x) { return usable(depth[x], image.camera); };
    int first = 0, end = size.width;
    while (first < end && !has(first)) ++first;
    while (first < end && !has(end - 1)) --end;
    if (first == end) continue;
    if (depths_.size() + static_cast<std::size_t>(end - first) > std::numeric_limits<std::uint32_t>::max())
      throw Error(ErrorCode::bad_input, {}, fmt::format("view {}: too many depths in all to be warped", view.name));
    rows_.push_back({static_cast<std::uint32_t>(depths_.size()), end - first, first, y});
    for (int x = first; x < end; ++x) {
      depths_.push_back(has(x) ? depth[x] : kMissing);
      colors_.push_back(bgra(image.color(y, x)));
      if (!has(x)) continue;
      ++reference.points;
      reference.farthest = std::max(reference.farthest, std::abs(depth[x]));
    }
  }
  reference.end_row = rows_.size();
  references_.push_back(reference);
}

void ImageWarper::exclude(std::vector<std::size_t> const& views) {
  for (Reference& reference : references_) reference.excluded = false;
  for (std::size_t const view : views) references_.at(view).excluded = true;
}

std::size_t ImageWarper::points() const {
  std::size_t count = 0;
  for (Reference const& reference : references_) count += reference.excluded ? 0 : reference.points;
  return count;
}

ImageWarp ImageWarper::warp_to(Camera const& camera, Eigen::Isometry3d const& object_from_camera,
                               Reference const& from) const {
  Eigen::Isometry3d const target_from_source = object_from_camera.inverse() * from.object_from_camera;
  Eigen::Matrix<double, 3, 4> const to_picture = picture(camera) * target_from_source.matrix();
  Eigen::Matrix3d m = to_picture.leftCols<3>() * rays(from.camera);
  Eigen::Vector3d b = to_picture.col(3);
  if (!from.camera.is_perspective()) {
    m.col(2) += b;
    b = to_picture.col(2);
  }
  ImageWarp warp{from.camera.is_perspective(),
                 camera.is_perspective(),
                 {},
                 static_cast<float>(0.5 * camera.fx() / from.camera.fx()),
                 static_cast<float>(0.5 * camera.fy() / from.camera.fy()),
                 -std::numeric_limits<float>::infinity()};
  for (int k = 0; k < 3; ++k) {
    for (int j = 0; j < 3; ++j) warp.m[k][j] = m(k, j);
    warp.m[k][3] = b[k];
  }
  // Nearer than that, single precision no longer tells on which side of the eye a point is.
  if (camera.is_perspective())
    warp.near = static_cast<float>(1e-6 * (from.farthest + target_from_source.translation().norm()));
  return warp;
}

/// Contiguous and ascending, about equally many depths each: a lower layer holds lower indices.
std::vector<std::vector<ImageWarper::Piece>> ImageWarper::share(std::size_t threads) const {
  std::vector<Piece> all;
  std::size_t total = 1, done = 0;
  for (std::size_t i = 0; i < references_.size(); ++i) {
    Reference const& reference = references_[i];
    if (reference.excluded) continue;
    all.push_back({i, reference.first_row, reference.end_row});
    for (std::size_t row = reference.first_row; row < reference.end_row; ++row)
      total += static_cast<std::size_t>(rows_[row].count);
  }
  std::vector<std::vector<Piece>> shares(threads);
  for (Piece const& piece : all)
    for (std::size_t row = piece.first_row; row < piece.end_row; ++row) {
      auto& pieces = shares[done * threads / total];
      if (pieces.empty() || pieces.back().warp != piece.warp) pieces.push_back({piece.warp, row, row});
      pieces.back().end_row = row + 1;
      done += static_cast<std::size_t>(rows_[row].count);
    }
  return shares;
}

void ImageWarper::compose(std::size_t layers, std::size_t begin, std::size_t end, Frame& frame) const {
  for (std::size_t i = begin; i < end; ++i) {
    float depth = layers_[0].depth[i];
    std::uint32_t index = layers_[0].index[i];
    for (std::size_t k = 1; k < layers; ++k) {
      if (!(layers_[k].depth[i] < depth)) continue;
      depth = layers_[k].depth[i];
      index = layers_[k].index[i];
    }
    bool const drawn = std::isfinite(depth);
    std::uint32_t const color = drawn ? colors_[index] : 0;
    reinterpret_cast<float*>(frame.depth.data)[i] = drawn ? depth : kMissing;
    std::memcpy(frame.color.data + 4 * i, &color, sizeof color);
  }
}

Frame ImageWarper::render(Camera const& camera, Eigen::Isometry3d const& object_from_camera) {
  Frame frame{cv::Mat4b(camera.height(), camera.width()), cv::Mat1f(camera.height(), camera.width())};
  std::size_t const pixels = frame.depth.total(), threads = static_cast<std::size_t>(threads_);
  std::vector<ImageWarp> warps;
  for (Reference const& reference : references_) warps.push_back(warp_to(camera, object_from_camera, reference));
  auto const shares = share(threads);
  layers_.resize(threads);
  Context context;
  context.threads = threads_;
  for_each_index(context, threads, [&](std::size_t k) {
    Layer& layer = layers_[k];
    layer.depth.assign(pixels, std::numeric_limits<float>::infinity());
    layer.index.resize(pixels);
    WarpTarget const target{layer.depth.data(), layer.index.data(), camera.width(), camera.height()};
    for (Piece const& piece : shares[k])
      warp_rows(warps[piece.warp], rows_.data() + piece.first_row, piece.end_row - piece.first_row, depths_.data(),
                target);
  });
  for_each_index(context, threads,
                 [&](std::size_t k) { compose(threads, k * pixels / threads, (k + 1) * pixels / threads, frame); });
  return frame;
}

}  // namespace scanview
