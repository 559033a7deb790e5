#include "acquire/light_sheets.h"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <cstddef>
#include <limits>

#include "base/median.h"

namespace scanview {
namespace {

constexpr std::size_t kLeastMatches = 300;
constexpr int kRounds = 12;
constexpr std::size_t kKnots = 25;       // of the light's motion
constexpr std::size_t kLeastAtKnot = 5;  // matches
constexpr double kMostScatter = 0.03;    // of the range of codes
constexpr double kSigmas = 5;

}  // namespace

LightSheets::LightSheets(std::vector<Match> const& matches) {
  if (matches.size() < kLeastMatches) return;
  auto const coordinate = [](Match const& m, int k) { return k == 0 ? m.a : k == 1 ? m.b : m.q; };
  for (int k = 0; k < 3; ++k) {
    std::vector<double> values;
    for (auto const& m : matches) values.push_back(coordinate(m, k));
    middle_(k) = median(values);
    for (double& value : values) value = std::abs(value - middle_(k));
    spread_(k) = std::max(median(values), 1e-9);
  }
  std::vector<double> codes;
  for (auto const& m : matches) codes.push_back(m.code);
  auto const [low, high] = std::minmax_element(codes.begin(), codes.end());
  low_ = *low, high_ = *high;
  if (!(high_ > low_)) return;
  for (std::size_t i = 0; i < kKnots; ++i) motion_.push_back(2.0 * static_cast<double>(i) / (kKnots - 1) - 1);

  std::vector<double> weights(matches.size(), 1.0);
  double scatter = 0;
  for (int round = 0; round < kRounds; ++round) {
    fit_source(matches, weights);
    if (round >= 3) fit_motion(matches, weights);
    std::vector<double> sizes;
    for (auto const& m : matches) sizes.push_back(std::abs(residual(m)));
    scatter = median(sizes) / 0.6745;
    if (!std::isfinite(scatter)) return;
    // Tukey's weights: narrow while wrong matches bend the source and widen the scatter themselves, then wide while the
    // light's motion is not fitted yet, then as is usual.
    double const cut = std::max(scatter, 1e-6 * (high_ - low_)) * (round < 2 ? 3 : round < 6 ? 8 : 5);
    for (std::size_t i = 0; i < sizes.size(); ++i) {
      double const u = sizes[i] / cut;
      weights[i] = u < 1 ? (1 - u * u) * (1 - u * u) : 0;
    }
  }
  std::vector<double> expected;
  for (auto const& m : matches) expected.push_back(0.25 * m.sigma * m.sigma);
  scatter_ = std::max(std::sqrt(std::max(scatter * scatter - median(expected), 0.0)), 0.1 * scatter);
  residual_sigma_ = scatter;
  usable_ = scatter <= kMostScatter * (high_ - low_);
}

Eigen::Vector4d LightSheets::normalised(Match const& m) const {
  return {(m.a - middle_.x()) / spread_.x(), (m.b - middle_.y()) / spread_.y(), 1, (m.q - middle_.z()) / spread_.z()};
}

double LightSheets::ratio(Match const& match) const {
  Eigen::Vector4d const v = normalised(match);
  return above_.dot(v) / below_.dot(v);
}

/// The code whose h is a ratio; h is monotone, and goes on straight beyond its ends.
double LightSheets::code_of(double ratio) const {
  bool const rises = motion_.back() > motion_.front();
  auto const after = [&](double value, double h) { return rises ? h > value : h < value; };
  auto const i = static_cast<std::size_t>(std::upper_bound(motion_.begin() + 1, motion_.end() - 1, ratio, after) -
                                          motion_.begin());
  double const step = (high_ - low_) / static_cast<double>(kKnots - 1);
  return low_ + step * (static_cast<double>(i - 1) + (ratio - motion_[i - 1]) / (motion_[i] - motion_[i - 1]));
}

double LightSheets::tolerance(Match const& match) const { return kSigmas * std::hypot(0.5 * match.sigma, scatter_); }

double LightSheets::residual(Match const& match) const {
  double const value = code_of(ratio(match)) - match.code;
  return std::isfinite(value) ? value : std::numeric_limits<double>::infinity();
}

/// h(c) p2·v - p1·v = 0 is linear in both; dividing by the last round's p2·v makes it a difference of ratios.
void LightSheets::fit_source(std::vector<Match> const& matches, std::vector<double> const& weights) {
  using Row = Eigen::Matrix<double, 8, 1>;
  Eigen::Matrix<double, 8, 8> normal = Eigen::Matrix<double, 8, 8>::Zero();
  bool const is_first = below_.isZero();
  double const step = (high_ - low_) / static_cast<double>(kKnots - 1);
  for (std::size_t i = 0; i < matches.size(); ++i) {
    if (weights[i] == 0) continue;
    Eigen::Vector4d const v = normalised(matches[i]);
    double const place = std::clamp((matches[i].code - low_) / step, 0.0, static_cast<double>(kKnots - 1));
    auto const k = std::min(static_cast<std::size_t>(place), kKnots - 2);
    double const h = motion_[k] + (place - static_cast<double>(k)) * (motion_[k + 1] - motion_[k]);
    double const scale = is_first ? 1 : below_.dot(v);
    if (std::abs(scale) < 1e-9) continue;
    Row row;
    row << -v / scale, h * v / scale;
    normal.noalias() += weights[i] * row * row.transpose();
  }
  Eigen::SelfAdjointEigenSolver<Eigen::Matrix<double, 8, 8>> const solver(normal);
  above_ = solver.eigenvectors().col(0).head<4>();
  below_ = solver.eigenvectors().col(0).tail<4>();
}

/// h at each knot: the weighted mean of what its matches' ratios say, kept where too few say anything, or where it
/// would no longer be monotone.
void LightSheets::fit_motion(std::vector<Match> const& matches, std::vector<double> const& weights) {
  double const step = (high_ - low_) / static_cast<double>(kKnots - 1);
  std::vector<double> sum(kKnots, 0.0), weight(kKnots, 0.0);
  std::vector<std::size_t> count(kKnots, 0);
  for (std::size_t i = 0; i < matches.size(); ++i) {
    if (weights[i] == 0) continue;
    double const place = (matches[i].code - low_) / step;
    auto const k = std::min(static_cast<std::size_t>(place + 0.5), kKnots - 1);
    auto const j = std::min(static_cast<std::size_t>(place), kKnots - 2);
    // What h is at the match, moved to the knot along h as it is.
    double const slope = motion_[j + 1] - motion_[j];
    double const away = place - static_cast<double>(k);
    double const w = weights[i] * (1 - std::abs(away));
    sum[k] += w * (ratio(matches[i]) - slope * away);
    weight[k] += w;
    ++count[k];
  }
  std::vector<double> moved = motion_;
  for (std::size_t k = 0; k < kKnots; ++k)
    if (count[k] >= kLeastAtKnot && weight[k] > 0) moved[k] = sum[k] / weight[k];
  double const direction = motion_.back() > motion_.front() ? 1 : -1;
  for (std::size_t k = 1; k < kKnots; ++k)
    if (!(direction * (moved[k] - moved[k - 1]) > 0)) return;
  motion_ = moved;
}

}  // namespace scanview
