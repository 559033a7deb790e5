#include "acquire/match_codes.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>

#include "acquire/light_sheets.h"
#include "base/parallel.h"

namespace scanview {
namespace {

constexpr int kBandRows = 16;
constexpr float kJoin = 2;                   // pixels: places on neighbouring rows that are one line of the light
constexpr int kSampleStep = 3;               // rows and columns, of the matches that tell of the light,
constexpr std::size_t kMostSamples = 20000;  // and how many of them: seven parameters and 25 knots have enough
constexpr float kLeastDisparity = 0.5F;      // pixels; beyond that depth means nothing
constexpr float kSelf = 1.5F;                // pixels: a partner's partner within this is the pixel itself
constexpr float kNear = 2;                   // pixels of disparity from what the surroundings agree on
constexpr int kAround = 3;                   // pixels each way: the surroundings
constexpr int kLeastAround = 5;              // of them with one partner
constexpr int kSupport = 3;                  // of eight neighbours; at an edge five are of the same surface,
constexpr int kThinSupport = 2;              // along a stripe two
constexpr float kOneRow = 0.25F;             // pixels a row that a line of light may lean, where only one row has it
constexpr float kShared = 0.25F;             // correlation of neighbours after bilinear resampling (mean over phases)
constexpr double kMostLeap = 40;             // median changes of the code from pixel to pixel
constexpr double kLeapReach = 0.7;           // pixels each way, in which a leap is set right
constexpr float kLeapSigma = 0.29F;          // pixels: anywhere between two
constexpr int kMostBuckets = 1 << 15;        // of codes on a row

/// Variance of a linear interpolation between two values that share noise.
float between_variance(float a, float b, float share) {
  float const wa = (1 - share) * a, wb = share * b;
  return wa * wa + wb * wb + 2 * kShared * wa * wb;
}

/// A place on the epipolar line, between two rows.
struct Partner {
  float x = 0;
  float sigma_x = 0;  // from the noise of the code there, in pixels
  float slope = 1;    // |d code / dx|
  float bias = 0;     // what x may be off by besides, in pixels
  bool is_leap = false;
};
struct Partners {
  std::array<Partner, CodeRows::kMostPlaces> partner;
  int count = 0;
  bool overflow = false;

  /// Keeps those that `test` accepts; it may mend them.
  template <class Test>
  void keep_if(Test const& test) {
    int kept = 0;
    for (int i = 0; i < count; ++i) {
      Partner p = partner[static_cast<std::size_t>(i)];
      if (test(p)) partner[static_cast<std::size_t>(kept++)] = p;
    }
    count = kept;
  }
  /// `lean`: doubt of x where one row alone has the place, in pixels.
  void add(float x, float code_sigma, float code_bias, float slope, float lean, bool is_leap) {
    if (count == CodeRows::kMostPlaces) {
      overflow = true;
      return;
    }
    partner[static_cast<std::size_t>(count++)] = {
        x, code_sigma / slope, slope, std::sqrt(code_bias * code_bias / (slope * slope) + lean * lean), is_leap};
  }
};

/// Where a code is at height y, which may lie between two rows.
Partners find_partners(CodeRows const& rows, float y, float code) {
  Partners result;
  int const upper = static_cast<int>(std::floor(y));
  float const share = y - static_cast<float>(upper);
  auto const above = upper >= 0 && upper < rows.rows() ? rows.find(upper, code) : CodeRows::Places{};
  auto const below = upper >= -1 && upper + 1 < rows.rows() ? rows.find(upper + 1, code) : CodeRows::Places{};
  result.overflow = above.overflow || below.overflow;
  std::array<bool, CodeRows::kMostPlaces> used = {};
  for (int i = 0; i < above.count; ++i) {
    CodePlace const& a = above.place[static_cast<std::size_t>(i)];
    int best = -1;
    float least = kJoin;
    for (int j = 0; j < below.count; ++j) {
      float const distance = std::abs(below.place[static_cast<std::size_t>(j)].x - a.x);
      if (!used[static_cast<std::size_t>(j)] && distance < least) least = distance, best = j;
    }
    if (best < 0) {
      result.add(a.x, a.sigma, a.bias, a.slope, kOneRow * share, a.is_leap);
      continue;
    }
    used[static_cast<std::size_t>(best)] = true;
    CodePlace const& b = below.place[static_cast<std::size_t>(best)];
    result.add(a.x + share * (b.x - a.x), std::sqrt(between_variance(a.sigma, b.sigma, share)),
               a.bias + share * (b.bias - a.bias), a.slope + share * (b.slope - a.slope), 0, a.is_leap || b.is_leap);
  }
  for (int j = 0; j < below.count; ++j) {
    CodePlace const& b = below.place[static_cast<std::size_t>(j)];
    if (!used[static_cast<std::size_t>(j)]) result.add(b.x, b.sigma, b.bias, b.slope, kOneRow * (1 - share), b.is_leap);
  }
  return result;
}

}  // namespace

CodeRows::CodeRows(CodeImage rectified, Context& context) : image_(std::move(rectified)) {
  CodeLinks links = link_codes(image_);
  linked_ = links.across;
  change_along_rows_ =
      links.down_change > 0 ? links.across_change / links.down_change : std::numeric_limits<double>::infinity();
  float low = std::numeric_limits<float>::infinity(), high = -low;
  for (float const code : image_.code)
    if (std::isfinite(code)) low = std::min(low, code), high = std::max(high, code);
  if (!(high >= low)) low = high = 0;
  // About two pixels a bucket.
  double const wanted = (high - low) / std::max(2 * links.slope, 1e-6) + 1;
  most_leap_ = static_cast<float>(kMostLeap * links.slope);
  buckets_ = static_cast<int>(std::clamp(wanted, 1.0, static_cast<double>(kMostBuckets)));
  low_ = low;
  buckets_per_code_ = high > low ? static_cast<float>(buckets_) / (high - low) : 1;
  rows_.resize(static_cast<std::size_t>(image_.code.rows));
  std::size_t const bands = (rows_.size() + kBandRows - 1) / kBandRows;
  for_each_index(context, bands, [&](std::size_t band) {
    std::size_t const end = std::min(rows_.size(), (band + 1) * kBandRows);
    for (std::size_t y = band * kBandRows; y < end; ++y) rows_[y] = index_row(static_cast<int>(y));
  });
}

CodeRows::Ends CodeRows::ends(int row, Piece piece) const {
  float const* const code = image_.code[row] + piece.x;
  float const x = piece.x;
  if (piece.kind == Kind::before) return {x - 0.5F, x, code[0] - 0.5F * (code[1] - code[0]), code[0]};
  if (piece.kind == Kind::after) return {x, x + 0.5F, code[0], code[0] + 0.5F * (code[0] - code[-1])};
  return {x, x + 1, code[0], code[1]};
}

CodeRows::Row CodeRows::index_row(int y) const {
  std::vector<Piece> pieces;
  std::uint8_t const* const linked = linked_[y];
  int const cols = image_.code.cols;
  for (int x = 0; x < cols; ++x) {
    bool const before = x > 0 && linked[x - 1], after = linked[x];
    auto const at = static_cast<std::uint16_t>(x);
    if (after && !before) pieces.push_back({at, Kind::before});
    if (after) pieces.push_back({at, Kind::between});
    if (before && !after) pieces.push_back({at, Kind::after});
    if (!after && x + 1 < cols && std::abs(image_.code(y, x + 1) - image_.code(y, x)) < most_leap_)
      pieces.push_back({at, Kind::leap});
  }
  // Counting sort by bucket; a piece that spans several stands in each.
  Row row;
  row.first.assign(static_cast<std::size_t>(buckets_) + 1, 0);
  auto const span = [&](Piece piece) {
    Ends const e = ends(y, piece);
    auto const bucket = [&](float code) {
      return static_cast<std::size_t>(
          std::clamp((code - low_) * buckets_per_code_, 0.0F, static_cast<float>(buckets_ - 1)));
    };
    return std::array{bucket(std::min(e.code_from, e.code_to)), bucket(std::max(e.code_from, e.code_to))};
  };
  for (Piece const piece : pieces)
    for (auto [b, last] = span(piece); b <= last; ++b) ++row.first[b + 1];
  for (std::size_t b = 1; b < row.first.size(); ++b) row.first[b] += row.first[b - 1];
  row.pieces.resize(row.first.back());
  std::vector<std::uint32_t> next(row.first.begin(), row.first.end() - 1);
  for (Piece const piece : pieces)
    for (auto [b, last] = span(piece); b <= last; ++b) row.pieces[next[b]++] = piece;
  return row;
}

CodeRows::Places CodeRows::find(int row, float code) const {
  Places result;
  float const position = (code - low_) * buckets_per_code_;
  if (!(position > -1 && position < static_cast<float>(buckets_) + 1)) return result;
  auto const bucket = static_cast<std::size_t>(std::clamp(position, 0.0F, static_cast<float>(buckets_ - 1)));
  Row const& index = rows_[static_cast<std::size_t>(row)];
  float const* const sigma = image_.sigma[row];
  for (std::uint32_t i = index.first[bucket]; i < index.first[bucket + 1]; ++i) {
    Piece const piece = index.pieces[i];
    Ends const e = ends(row, piece);
    float const change = e.code_to - e.code_from;
    if ((code - e.code_from) * (code - e.code_to) > 0 || change == 0) continue;
    float const share = (code - e.code_from) / change;
    float const x = e.from + share * (e.to - e.from);
    // The end of one piece is the start of the next.
    if (result.count > 0 && x - result.place[static_cast<std::size_t>(result.count - 1)].x < 0.01F) continue;
    if (result.count == kMostPlaces) {
      result.overflow = true;
      break;
    }
    float const slope = std::abs(change) / (e.to - e.from);
    float const* const bias = image_.bias[row];
    CodePlace place{x, slope, sigma[piece.x] * 1.5F, bias[piece.x], piece.kind == Kind::leap};
    if (piece.kind == Kind::leap) place.bias = kLeapSigma * slope;
    if (piece.kind == Kind::between) {
      float const bend = share * (1 - share) *
                         std::max(excess_bend(image_.code[row], sigma, piece.x, image_.code.cols),
                                  excess_bend(image_.code[row], sigma, piece.x + 1, image_.code.cols));
      place.sigma = std::sqrt(between_variance(sigma[piece.x], sigma[piece.x + 1], share));
      float const inherited = (1 - share) * bias[piece.x] + share * bias[piece.x + 1];
      place.bias = std::sqrt(bend * bend + inherited * inherited);
    }
    result.place[static_cast<std::size_t>(result.count++)] = place;
  }
  return result;
}

namespace {

/// The work of match_codes, row by row.
class Matcher {
 public:
  Matcher(CodeImage const& left, CodeRows const& right_rows, Rectification const& rectification, Camera const& camera,
          CodeDensity density)
      : left_(left),
        least_support_(density == CodeDensity::lines ? kThinSupport : kSupport),
        right_rows_(right_rows),
        rectification_(rectification),
        camera_(camera),
        image_(empty_range_image(camera)),
        disparity_(image_.depth),
        sigma_(image_.sigma) {
    left.classes.copyTo(image_.classes);
  }

  struct Doubt {
    int x, y;
    Partners partners;
  };

  /// Sampled pixels of row `i` of the left rectified rows (every kSampleStep-th of the picture) that have one
  /// partner and no rival: what tells of the light.
  void sample_row(CodeRows const& left_rows, int i, std::vector<LightSheets::Match>& matches) const {
    int const y = i * kSampleStep;
    if (y >= right_rows_.rows()) return;
    CodeImage const& codes = left_rows.image();
    // A tenth of the pixels looked at suffices where half of them have no partner that is alone.
    int const step = std::max(kSampleStep, static_cast<int>(codes.code.total() / (10 * kMostSamples)));
    for (int x = i % step; x < codes.code.cols; x += step) {
      float const code = codes.code(i, x);
      if (std::isnan(code)) continue;
      Eigen::Vector2d const at = rectification_.left.ray_direction(x, y).head<2>();
      CodeRows::Places const there = right_rows_.find(y, code);
      if (there.count != 1 || there.overflow || there.place[0].is_leap) continue;
      CodePlace const& partner = there.place[0];
      float const d = disparity(at.x(), partner.x);
      if (!(d > kLeastDisparity) || has_rivals(left_rows, i, static_cast<float>(x), code)) continue;
      matches.push_back({at.x(), at.y(), d, code, std::hypot(codes.sigma(i, x), partner.sigma)});
    }
  }

  /// Disparities of what has one partner; pixels with several go to `doubts`.
  /// `left_rows`: all of them, needed only where the sheets are not usable.
  void match_row(int y, LightSheets const& sheets, CodeRows const& left_rows, std::vector<Doubt>& doubts) {
    for (int x = 0; x < camera_.width(); ++x) {
      if (std::isnan(left_.code(y, x))) continue;
      Eigen::Vector2d const at = rectified(x, y);
      Partners partners = partners_of(x, y, at);
      set_class(x, y, PixelClass::no_partner);
      if (partners.count == 0) continue;
      bool in_doubt = partners.overflow;
      if (sheets.usable()) {
        partners.keep_if([&](Partner& partner) { return agrees(x, y, at, sheets, partner); });
      } else {
        partners.keep_if([](Partner const& partner) { return !partner.is_leap; });
        auto const self = static_cast<float>(rectification_.left.fx() * at.x() + rectification_.left.cx());
        in_doubt = in_doubt || has_rivals(left_rows, row_of(at), self, left_.code(y, x));
      }
      if (partners.count == 1 && !in_doubt) {
        take(x, y, partners.partner[0], at.x());
        continue;
      }
      set_class(x, y, PixelClass::inconsistent);
      if (partners.count > 0) doubts.push_back({x, y, partners});
    }
  }

  /// The partner of a doubtful pixel that agrees with the pixels around; none where none does.
  std::optional<Partner> settle(Doubt const& doubt) const {
    std::vector<float> around;
    for (int y = std::max(0, doubt.y - kAround); y <= std::min(disparity_.rows - 1, doubt.y + kAround); ++y)
      for (int x = std::max(0, doubt.x - kAround); x <= std::min(disparity_.cols - 1, doubt.x + kAround); ++x)
        if (std::isfinite(disparity_(y, x))) around.push_back(disparity_(y, x));
    if (around.size() < kLeastAround) return {};
    auto const middle = around.begin() + static_cast<std::ptrdiff_t>(around.size() / 2);
    std::nth_element(around.begin(), middle, around.end());
    std::optional<Partner> best;
    float least = kNear;
    double const a = rectified(doubt.x, doubt.y).x();
    for (int i = 0; i < doubt.partners.count; ++i) {
      Partner const& partner = doubt.partners.partner[static_cast<std::size_t>(i)];
      float const distance = std::abs(disparity(a, partner.x) - *middle);
      if (distance < least) least = distance, best = partner;
    }
    return best;
  }
  void take(int x, int y, Partner const& partner) { take(x, y, partner, rectified(x, y).x()); }

  /// A disparity is the object's where enough around it support it.
  void judge_row(int y) {
    for (int x = 0; x < camera_.width(); ++x)
      if (!std::isnan(disparity_(y, x)))
        set_class(x, y, is_supported(x, y) ? PixelClass::object : PixelClass::inconsistent);
  }

  /// Depth from disparity, once all rows are judged; what is not the object's has none.
  void triangulate_row(int y) {
    double const scale = rectification_.right.fx() * rectification_.baseline;
    for (int x = 0; x < camera_.width(); ++x) {
      float const disparity = disparity_(y, x);
      if (std::isnan(disparity)) continue;
      if (image_.classes(y, x) != static_cast<std::uint8_t>(PixelClass::object)) {
        image_.depth(y, x) = image_.sigma(y, x) = kMissing;
        continue;
      }
      double const rectified_depth = scale / disparity;
      double const depth = rectified_depth / (rectification_.rectified_from_left * camera_.ray_direction(x, y)).z();
      image_.sigma(y, x) = static_cast<float>(depth * sigma_(y, x) / disparity);
      image_.depth(y, x) = static_cast<float>(depth);
    }
  }

  RangeImage result() { return std::move(image_); }

 private:
  bool is_supported(int x, int y) const {
    int support = 0;
    for (int dy = -1; dy <= 1; ++dy)
      for (int dx = -1; dx <= 1; ++dx) {
        int const u = x + dx, v = y + dy;
        if ((dx == 0 && dy == 0) || u < 0 || v < 0 || u >= disparity_.cols || v >= disparity_.rows) continue;
        support += std::abs(disparity_(v, u) - disparity_(y, x)) <= kNear + 4 * sigma_(y, x);
      }
    return support >= least_support_;
  }
  /// Direction of a pixel in the rectified frame, z = 1.
  Eigen::Vector2d rectified(int x, int y) const {
    return (rectification_.rectified_from_left * camera_.ray_direction(x, y)).hnormalized();
  }
  float disparity(double a, float x_right) const {
    return static_cast<float>(rectification_.right.fx() * a - (x_right - rectification_.right.cx()));
  }
  float row_of(Eigen::Vector2d const& at) const {
    return static_cast<float>(rectification_.left.fy() * at.y() + rectification_.left.cy());
  }
  /// All that may be a pixel's partner: not behind the cameras.
  Partners partners_of(int x, int y, Eigen::Vector2d const& at) const {
    Partners partners = find_partners(right_rows_, row_of(at), left_.code(y, x));
    partners.keep_if([&](Partner const& partner) { return disparity(at.x(), partner.x) > kLeastDisparity; });
    return partners;
  }
  /// Whether the left camera sees the same code elsewhere on the epipolar line than at x = `self`.
  static bool has_rivals(CodeRows const& left_rows, float row, float self, float code) {
    Partners const own = find_partners(left_rows, row, code);
    bool rivals = own.overflow;
    for (int i = 0; i < own.count; ++i) rivals |= std::abs(own.partner[static_cast<std::size_t>(i)].x - self) > kSelf;
    return rivals;
  }
  static bool has_rivals(CodeRows const& left_rows, int row, float self, float code) {
    CodeRows::Places const own = left_rows.find(row, code);
    bool rivals = own.overflow;
    for (int i = 0; i < own.count; ++i) rivals |= std::abs(own.place[static_cast<std::size_t>(i)].x - self) > kSelf;
    return rivals;
  }
  LightSheets::Match place(int x, int y, Eigen::Vector2d const& at, Partner const& partner) const {
    float const right = partner.sigma_x * partner.slope;
    return {at.x(), at.y(), disparity(at.x(), partner.x), left_.code(y, x),
            std::sqrt(left_.sigma(y, x) * left_.sigma(y, x) + right * right)};
  }
  /// Whether a partner is on the sheet of light that its code names. A leap is set right where it is: the two pixels of
  /// the right camera tell only that the surface passes between them, the sheet tells where.
  bool agrees(int x, int y, Eigen::Vector2d const& at, LightSheets const& sheets, Partner& partner) const {
    LightSheets::Match match = place(x, y, at, partner);
    if (!partner.is_leap) return std::abs(sheets.residual(match)) <= sheets.tolerance(match);
    LightSheets::Match const before = {match.a, match.b, match.q + kLeapReach, match.code, left_.sigma(y, x)};
    LightSheets::Match const after = {match.a, match.b, match.q - kLeapReach, match.code, left_.sigma(y, x)};
    double const low = sheets.residual(before), high = sheets.residual(after);
    if (!(low * high < 0)) return false;
    double const change = (high - low) / (2 * kLeapReach);  // codes a pixel
    partner.x += static_cast<float>(-0.5 * (low + high) / change);
    partner.slope = static_cast<float>(std::abs(change));
    partner.sigma_x = static_cast<float>(sheets.residual_sigma() / std::abs(change));
    partner.bias = 0;
    return true;
  }
  void take(int x, int y, Partner const& partner, double a) {
    disparity_(y, x) = disparity(a, partner.x);
    float const own = left_.sigma(y, x) / partner.slope, own_bias = left_.bias(y, x) / partner.slope;
    sigma_(y, x) =
        std::sqrt(partner.sigma_x * partner.sigma_x + own * own + partner.bias * partner.bias + own_bias * own_bias);
  }
  void set_class(int x, int y, PixelClass what) { image_.classes(y, x) = static_cast<std::uint8_t>(what); }

  CodeImage const& left_;
  int least_support_;
  CodeRows const& right_rows_;
  Rectification const& rectification_;
  Camera const& camera_;
  RangeImage image_;
  cv::Mat1f disparity_, sigma_;  // in pixels of the rectified right picture; depth and its sigma take their place
};

std::vector<LightSheets::Match> sample_matches(Matcher const& matcher, CodeRows const& left_rows, Context& context) {
  std::vector<std::vector<LightSheets::Match>> samples(
      static_cast<std::size_t>((left_rows.rows() + kBandRows - 1) / kBandRows));
  for_each_index(context, samples.size(), [&](std::size_t band) {
    int const first = static_cast<int>(band) * kBandRows;
    for (int i = first; i < std::min(first + kBandRows, left_rows.rows()); ++i)
      matcher.sample_row(left_rows, i, samples[band]);
  });
  std::vector<LightSheets::Match> matches;
  for (auto const& part : samples) matches.insert(matches.end(), part.begin(), part.end());
  if (matches.size() <= kMostSamples) return matches;
  std::vector<LightSheets::Match> thinned;
  for (std::size_t k = 0; k < kMostSamples; ++k) thinned.push_back(matches[k * matches.size() / kMostSamples]);
  return thinned;
}

}  // namespace

RangeImage match_codes(CodeImage const& left, std::function<CodeRows(int step)> const& left_rows,
                       CodeRows const& right_rows, Rectification const& rectification, Camera const& camera,
                       CodeDensity density, MatchFigures& figures, Context& context) {
  Matcher matcher(left, right_rows, rectification, camera, density);
  auto const bands = static_cast<std::size_t>((camera.height() + kBandRows - 1) / kBandRows);
  auto const for_each_row = [&](auto const& work) {
    for_each_index(context, bands, [&](std::size_t band) {
      int const first = static_cast<int>(band) * kBandRows;
      for (int y = first; y < std::min(first + kBandRows, camera.height()); ++y) work(band, y);
    });
  };
  LightSheets const sheets(sample_matches(matcher, left_rows(kSampleStep), context));
  CodeRows const all_left = sheets.usable() ? CodeRows() : left_rows(1);
  figures.sheet_scatter = sheets.usable() ? sheets.scatter() : 0;
  std::vector<std::vector<Matcher::Doubt>> doubts(bands);
  for_each_row([&](std::size_t band, int y) { matcher.match_row(y, sheets, all_left, doubts[band]); });
  std::vector<std::vector<std::optional<Partner>>> settled(bands);
  for_each_index(context, bands, [&](std::size_t band) {
    for (auto const& doubt : doubts[band]) settled[band].push_back(matcher.settle(doubt));
  });
  for (std::size_t band = 0; band < bands; ++band) {
    figures.ambiguous += doubts[band].size();
    for (std::size_t i = 0; i < doubts[band].size(); ++i)
      if (settled[band][i]) matcher.take(doubts[band][i].x, doubts[band][i].y, *settled[band][i]);
  }
  for_each_row([&](std::size_t, int y) { matcher.judge_row(y); });
  for_each_row([&](std::size_t, int y) { matcher.triangulate_row(y); });
  for (std::uint8_t const what : left.classes)
    figures.decodable += what == static_cast<std::uint8_t>(PixelClass::object);
  return matcher.result();
}

}  // namespace scanview
