#include "viewer/evaluate/image_quality.h"

#include <algorithm>
#include <cmath>
#include <opencv2/imgproc.hpp>
#include <stdexcept>

namespace scanview {
namespace {

void check_sizes(cv::Mat3b const& a, cv::Mat3b const& b, cv::Mat1b const& mask) {
  if (a.size() != b.size() || a.size() != mask.size()) throw std::logic_error("pictures of different sizes compared");
}

}  // namespace

double psnr(cv::Mat3b const& a, cv::Mat3b const& b, cv::Mat1b const& mask) {
  check_sizes(a, b, mask);
  double sum = 0;
  std::size_t count = 0;
  for (int y = 0; y < a.rows; ++y) {
    for (int x = 0; x < a.cols; ++x) {
      if (mask(y, x) == 0) continue;
      ++count;
      for (int c = 0; c < 3; ++c) {
        double const d = static_cast<double>(a(y, x)[c]) - b(y, x)[c];
        sum += d * d;
      }
    }
  }
  if (count == 0) return 0;
  if (sum == 0) return kIdenticalPsnr;
  return std::min(kIdenticalPsnr, 10 * std::log10(255.0 * 255.0 * 3.0 * static_cast<double>(count) / sum));
}

double ssim(cv::Mat3b const& a, cv::Mat3b const& b, cv::Mat1b const& mask) {
  check_sizes(a, b, mask);
  if (cv::countNonZero(mask) == 0) return 0;
  cv::Mat1d inside;
  cv::Mat(mask != 0).convertTo(inside, CV_64F, 1.0 / 255);
  auto const luminance = [&](cv::Mat3b const& picture) {
    cv::Mat1d result(picture.size());
    for (int y = 0; y < picture.rows; ++y) {
      for (int x = 0; x < picture.cols; ++x) {
        auto const& p = picture(y, x);
        result(y, x) = 0.114 * p[0] + 0.587 * p[1] + 0.299 * p[2];
      }
    }
    return result;
  };
  auto const window = [](cv::Mat const& values) {
    cv::Mat1d result;
    cv::GaussianBlur(values, result, cv::Size(11, 11), 1.5, 1.5, cv::BORDER_CONSTANT);
    return result;
  };
  cv::Mat1d const total = window(inside);
  cv::Mat1d const la = luminance(a), lb = luminance(b);
  auto const mean = [&](cv::Mat const& values) { return window(values.mul(inside)); };
  cv::Mat1d const mean_a = mean(la), mean_b = mean(lb), mean_aa = mean(la.mul(la)), mean_bb = mean(lb.mul(lb)),
                  mean_ab = mean(la.mul(lb));

  constexpr double kC1 = (0.01 * 255) * (0.01 * 255), kC2 = (0.03 * 255) * (0.03 * 255);
  double sum = 0;
  std::size_t count = 0;
  for (int y = 0; y < mask.rows; ++y) {
    for (int x = 0; x < mask.cols; ++x) {
      if (mask(y, x) == 0) continue;
      double const weight = total(y, x);  // at least the centre's own
      double const ma = mean_a(y, x) / weight, mb = mean_b(y, x) / weight;
      double const variance_a = std::max(0.0, mean_aa(y, x) / weight - ma * ma);
      double const variance_b = std::max(0.0, mean_bb(y, x) / weight - mb * mb);
      double const covariance = mean_ab(y, x) / weight - ma * mb;
      sum +=
          (2 * ma * mb + kC1) * (2 * covariance + kC2) / ((ma * ma + mb * mb + kC1) * (variance_a + variance_b + kC2));
      ++count;
    }
  }
  return sum / static_cast<double>(count);
}

}  // namespace scanview
