#include "acquire/pixel_noise.h"

#include <Eigen/Cholesky>
#include <Eigen/Core>
#include <algorithm>
#include <cmath>
#include <cstddef>
#include <numbers>

namespace scanview {
namespace {

constexpr std::size_t kLeastInBin = 50, kLeast = 200;

}  // namespace

void NoiseFit::add(double brightness, double residual) {
  double const bin = std::max(brightness, 0.0) / full_scale_ * kBins;
  if (bin < kBins) bins_[static_cast<std::size_t>(bin)].push_back(static_cast<float>(std::abs(residual)));
}

void NoiseFit::add(NoiseFit const& other) {
  for (std::size_t i = 0; i < bins_.size(); ++i)
    bins_[i].insert(bins_[i].end(), other.bins_[i].begin(), other.bins_[i].end());
}

PixelNoise NoiseFit::solve(PixelNoise const& otherwise) const {
  constexpr double kQuantisation = 1.0 / 12;
  Eigen::Matrix2d normal = Eigen::Matrix2d::Zero();
  Eigen::Vector2d right = Eigen::Vector2d::Zero();
  std::size_t total = 0;
  for (std::size_t bin = 0; bin < bins_.size(); ++bin) {
    auto values = bins_[bin];
    if (values.size() < kLeastInBin) continue;
    total += values.size();
    auto const middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
    std::nth_element(values.begin(), middle, values.end());
    // Differences of whole levels are whole, and their median with them; a mean is not. A half-normal distribution that
    // is cut at three times its median (2.02 sigma) has a mean of 0.9105 times the uncut one's, sqrt(2 / pi) sigma.
    double const cut = 3 * std::max(static_cast<double>(*middle), 0.5);
    double sum = 0;
    std::size_t count = 0;
    for (float const value : values)
      if (value <= cut) sum += value, ++count;
    double const mean = sum / static_cast<double>(std::max<std::size_t>(count, 1));
    double const sigma = mean / 0.9105 / std::sqrt(2 / std::numbers::pi);
    double const variance = sigma * sigma;
    double const level = (static_cast<double>(bin) + 0.5) / kBins * full_scale_;
    // The relative error of each bin's variance is about sqrt(2 / count).
    double const weight = static_cast<double>(values.size()) / (variance * variance + kQuantisation * kQuantisation);
    Eigen::Vector2d const row(1, level);
    normal += weight * row * row.transpose();
    right += weight * variance * row;
  }
  if (total < kLeast) return otherwise;
  Eigen::Vector2d fit = normal.ldlt().solve(right);
  if (!fit.allFinite() || fit.y() < 0) fit = {right.x() / normal(0, 0), 0};
  if (fit.x() < kQuantisation)
    fit = {kQuantisation, std::max(0.0, (right.y() - kQuantisation * normal(0, 1)) / normal(1, 1))};
  return {fit.x(), fit.y()};
}

}  // namespace scanview
