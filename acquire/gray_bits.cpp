#include "acquire/gray_bits.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <opencv2/core.hpp>
#include <vector>

namespace scanview {
namespace {

constexpr float kDoubtSigmas = 3.5F;   // a bit whose |d| is less is doubtful
constexpr float kLightSigmas = 8;      // the least contrast of a pixel that the light reached,
constexpr float kLeastLevels = 4;      // and in levels: quantisation is no noise
constexpr int kWidestColumn = 24;      // pixels; borders farther apart are not interpolated
constexpr int kMostBorders = 4;        // between two neighbouring pixels of one surface
constexpr float kUniform = 0.288675F;  // standard deviation of a uniform distribution of width 1

std::int16_t size_of(std::int16_t d) { return static_cast<std::int16_t>(d < 0 ? -d : d); }

int binary_from_gray(unsigned word) {
  for (unsigned shift = 8; shift > 0; shift >>= 1) word ^= word >> shift;
  return static_cast<int>(word);
}

/// Flipping this Gray bit leads from column k to one beside it.
bool flips_to_neighbour(int k, int bit) { return std::abs((k ^ ((2 << bit) - 1)) - k) == 1; }

/// Where a line of pixels passes from one column to the next.
struct Border {
  float position = 0;    // in pixels
  float sigma = 0;       // of the position, from noise alone
  int code = 0;          // of the border: the greater of the two columns
  int direction = 0;     // +1: codes grow along the line
  bool follows = false;  // the border before it is the other one of the same column
};

/// One line of pixels through the bits.
class Line {
 public:
  Line(GrayBits const& bits, cv::Mat1i const& codes, cv::Mat1f const& noise, int y)
      : word_(bits.word[y]),
        finest_(bits.finest[y]),
        weakest_(bits.weakest[y]),
        weakest_bit_(bits.weakest_bit[y]),
        largest_(bits.largest[y]),
        code_(codes[y]),
        noise_(noise[y]),
        length_(codes.cols) {}

  /// All borders, from left to right.
  void find_borders(std::vector<Border>& borders) const {
    borders.clear();
    for (int x = 0; x + 1 < length_; ++x) {
      int const a = code_[x], b = code_[x + 1];
      if (a < 0 || b < 0 || a == b || std::abs(b - a) > kMostBorders) continue;
      int const direction = b > a ? 1 : -1;
      float least = static_cast<float>(x);
      for (int k = a; k != b; k += direction) {
        int const border = std::max(k, k + direction);
        int const bit = std::countr_zero(static_cast<unsigned>(border));
        float const da = difference(x, bit), db = difference(x + 1, bit);
        float const step = std::abs(da - db);
        float position = static_cast<float>(x) + (step > 0 ? std::clamp(da / (da - db), 0.0F, 1.0F) : 0.5F);
        position = least = std::max(position, least);
        bool const follows =
            !borders.empty() && borders.back().direction == direction && borders.back().code == border - direction &&
            position - borders.back().position < kWidestColumn && same_column(borders.back().position, x);
        borders.push_back({position, noise_[x] / std::max(step, 1.0F), border, direction, follows});
      }
    }
  }

 private:
  /// d of a bit at a pixel: kept where it is the finest or the weakest, else it is far from zero.
  float difference(int x, int bit) const {
    if (bit == 0) return finest_[x];
    if (weakest_bit_[x] == bit) return weakest_[x];
    return (word_[x] >> bit & 1) != 0 ? largest_[x] : static_cast<float>(-largest_[x]);
  }
  /// All pixels from a border to pixel x have a column.
  bool same_column(float border, int x) const {
    for (int i = static_cast<int>(border) + 1; i <= x; ++i)
      if (code_[i] < 0) return false;
    return true;
  }

  std::uint16_t const* word_;
  std::int16_t const *finest_, *weakest_, *weakest_bit_, *largest_;
  int const* code_;
  float const* noise_;
  int length_;
};

/// What the position of a border scatters, beyond noise: from second differences of three borders of one surface (whose
/// variance is 6 of one position's), robustly.
float border_scatter(GrayBits const& bits, cv::Mat1i const& codes, cv::Mat1f const& noise) {
  std::vector<Border> borders;
  std::vector<float> seconds;
  for (int y = 0; y < codes.rows; y += 8) {
    Line(bits, codes, noise, y).find_borders(borders);
    for (std::size_t i = 2; i < borders.size(); ++i)
      if (borders[i].follows && borders[i - 1].follows)
        seconds.push_back(std::abs(borders[i].position - 2 * borders[i - 1].position + borders[i - 2].position));
  }
  if (seconds.empty()) return 0;
  auto const middle = seconds.begin() + static_cast<std::ptrdiff_t>(seconds.size() / 2);
  std::nth_element(seconds.begin(), middle, seconds.end());
  return *middle / 0.6745F / std::sqrt(6.0F);
}

/// Codes of the pixels of one line, between its borders.
void interpolate_line(std::vector<Border> const& borders, int const* codes, int length, float scatter, float* code,
                      float* sigma) {
  for (int x = 0; x < length; ++x) {
    if (codes[x] < 0) continue;
    code[x] = static_cast<float>(codes[x]) + 0.5F;
    sigma[x] = kUniform;
  }
  for (std::size_t i = 1; i < borders.size(); ++i) {
    Border const &a = borders[i - 1], &b = borders[i];
    float const width = b.position - a.position;
    if (!b.follows || !(width > 0)) continue;
    float const slope = static_cast<float>(b.direction) / width;
    for (int x = static_cast<int>(std::ceil(a.position)); static_cast<float>(x) <= b.position; ++x) {
      float const share = (static_cast<float>(x) - a.position) / width;
      code[x] = static_cast<float>(a.code) + slope * (static_cast<float>(x) - a.position);
      float const at_a = (1 - share) * std::max(a.sigma, scatter), at_b = share * std::max(b.sigma, scatter);
      sigma[x] = std::min(kUniform, std::abs(slope) * std::hypot(at_a, at_b));
    }
  }
}

/// Whether the code changes more down the picture than across it.
bool changes_down(cv::Mat1i const& codes) {
  std::array<std::size_t, 2> changes = {0, 0};
  for (int y = 0; y + 1 < codes.rows; y += 4)
    for (int x = 0; x + 1 < codes.cols; ++x) {
      int const here = codes(y, x), right = codes(y, x + 1), below = codes(y + 1, x);
      if (here < 0 || right < 0 || below < 0) continue;
      changes[0] += here != right && std::abs(here - right) <= kMostBorders;
      changes[1] += here != below && std::abs(here - below) <= kMostBorders;
    }
  return changes[1] > changes[0];
}

GrayBits transposed(GrayBits const& bits) {
  GrayBits t;
  cv::transpose(bits.word, t.word);
  cv::transpose(bits.finest, t.finest);
  cv::transpose(bits.weakest, t.weakest);
  cv::transpose(bits.weakest_bit, t.weakest_bit);
  cv::transpose(bits.largest, t.largest);
  return t;
}

CodeImage interpolate(GrayBits const& bits, cv::Mat1i const& codes, cv::Mat1f const& noise) {
  CodeImage image;
  image.code = cv::Mat1f(codes.size(), kMissing);
  image.sigma = cv::Mat1f(codes.size(), kMissing);
  image.bias = cv::Mat1f(codes.size(), kMissing);
  image.classes = cv::Mat1b(codes.size());
  float const scatter = border_scatter(bits, codes, noise);
  std::vector<Border> borders;
  for (int y = 0; y < codes.rows; ++y) {
    Line(bits, codes, noise, y).find_borders(borders);
    interpolate_line(borders, codes[y], codes.cols, scatter, image.code[y], image.sigma[y]);
    for (int x = 0; x < codes.cols; ++x) {
      PixelClass const what = codes(y, x) >= 0    ? PixelClass::object
                              : codes(y, x) == -1 ? PixelClass::no_light
                                                  : PixelClass::several_peaks;
      image.classes(y, x) = static_cast<std::uint8_t>(what);
      if (codes(y, x) >= 0) image.bias(y, x) = 0;
    }
  }
  return image;
}

}  // namespace

void GrayBits::create(cv::Size size) {
  constexpr std::int16_t kMost = 32767;
  word = cv::Mat1w(size, std::uint16_t{0});
  finest = cv::Mat1s(size, kMost);
  weakest = cv::Mat1s(size, kMost);
  weakest_bit = cv::Mat1s(size, std::int16_t{0});
  second = cv::Mat1s(size, kMost);
  largest = cv::Mat1s(size, std::int16_t{0});
}

void GrayBits::add(int bit, cv::Mat1s const& d) {
  if (word.empty()) create(d.size());
  for (int y = 0; y < d.rows; ++y) add_row(bit, y, d[y]);
}

void GrayBits::add_row(int bit, int y, std::int16_t const* d) {
  auto const mask = static_cast<std::uint16_t>(1U << bit);
  auto const this_bit = static_cast<std::int16_t>(bit);
  int const cols = word.cols;
  std::uint16_t* const words = word[y];
  std::int16_t *const weak = weakest[y], *const weak_bit = weakest_bit[y], *const next = second[y],
                      *const most = largest[y];
  // All 16 bits wide and without branches: the compiler makes vectors of it.
  if (bit == 0) {
    std::copy(d, d + cols, finest[y]);
    for (int x = 0; x < cols; ++x) {
      std::int16_t const size = size_of(d[x]);
      words[x] = static_cast<std::uint16_t>(words[x] | (d[x] > 0 ? mask : 0));
      most[x] = size > most[x] ? size : most[x];
    }
    return;
  }
  for (int x = 0; x < cols; ++x) {
    std::int16_t const value = d[x], size = size_of(value), least = size_of(weak[x]);
    bool const weaker = size < least;
    std::int16_t const other = weaker ? least : size;
    words[x] = static_cast<std::uint16_t>(words[x] | (value > 0 ? mask : 0));
    next[x] = other < next[x] ? other : next[x];
    weak[x] = weaker ? value : weak[x];
    weak_bit[x] = weaker ? this_bit : weak_bit[x];
    most[x] = size > most[x] ? size : most[x];
  }
}

cv::Mat1i whole_codes(GrayBits const& bits, cv::Mat1f const& noise_of_d, std::optional<int> count) {
  cv::Mat1i codes(bits.word.size());
  for (int y = 0; y < codes.rows; ++y)
    for (int x = 0; x < codes.cols; ++x) {
      float const noise = noise_of_d(y, x);
      if (bits.largest(y, x) < std::max(kLightSigmas * noise, kLeastLevels)) {
        codes(y, x) = -1;
        continue;
      }
      int const k = binary_from_gray(bits.word(y, x));
      float const doubtful = kDoubtSigmas * noise;
      bool const weak = size_of(bits.weakest(y, x)) < doubtful;
      bool good = !count || k < *count;
      if (weak)
        good = good && size_of(bits.second(y, x)) >= doubtful &&
               (flips_to_neighbour(k, bits.weakest_bit(y, x)) ||
                (size_of(bits.finest(y, x)) < doubtful && flips_to_neighbour(k ^ 1, bits.weakest_bit(y, x))));
      codes(y, x) = good ? k : -2;
    }
  return codes;
}

CodeImage border_codes(GrayBits const& bits, cv::Mat1f const& noise_of_d, std::optional<int> count) {
  cv::Mat1i codes = whole_codes(bits, noise_of_d, count);
  if (!changes_down(codes)) return interpolate(bits, codes, noise_of_d);
  // Borders lie along the lines: the same work on the picture laid on its side.
  cv::transpose(codes, codes);
  CodeImage image = interpolate(transposed(bits), codes, noise_of_d.t());
  cv::transpose(image.code, image.code);
  cv::transpose(image.sigma, image.sigma);
  cv::transpose(image.bias, image.bias);
  cv::transpose(image.classes, image.classes);
  return image;
}

}  // namespace scanview
