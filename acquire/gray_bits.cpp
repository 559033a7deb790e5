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
constexpr int kScatterRows = 8;        // every so many rows tell of the whole picture
constexpr float kUniform = 0.288675F;  // standard deviation of a uniform distribution of width 1

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

/// One line of pixels through the bits; T is a size's type.
template <class T>
class Line {
 public:
  Line(GrayBits const& bits, DifferenceNoise const& noise, std::optional<int> count)
      : bits_(bits), of_level_(noise.of_level), levels_(noise.level), count_(count.value_or(1 << 16)) {
    code_.resize(static_cast<std::size_t>(bits.word.cols));
    noise_.resize(code_.size());
  }

  void read(int y) {
    word_ = bits_.word[y];
    weakest_bit_ = bits_.weakest_bit[y];
    finest_ = bits_.finest.ptr<T>(y), weakest_ = bits_.weakest.ptr<T>(y), second_ = bits_.second.ptr<T>(y);
    largest_ = bits_.largest.ptr<T>(y);
    T const* const level = levels_.ptr<T>(y);
    for (std::size_t x = 0; x < code_.size(); ++x) noise_[x] = of_level_[level[x]];
    for (std::size_t x = 0; x < code_.size(); ++x) code_[x] = whole_code(x);
  }

  /// See whole_codes.
  std::vector<int> const& codes() const { return code_; }

  /// All borders, from left to right.
  void find_borders(std::vector<Border>& borders) const {
    borders.clear();
    for (std::size_t x = 0; x + 1 < code_.size(); ++x) {
      int const a = code_[x], b = code_[x + 1];
      if (a < 0 || b < 0 || a == b || std::abs(b - a) > kMostBorders) continue;
      int const direction = b > a ? 1 : -1;
      auto least = static_cast<float>(x);
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
  int whole_code(std::size_t x) const {
    float const noise = noise_[x];
    if (static_cast<float>(largest_[x]) < std::max(kLightSigmas * noise, kLeastLevels)) return -1;
    int const k = binary_from_gray(word_[x]);
    float const doubtful = kDoubtSigmas * noise;
    bool good = k < count_;
    if (static_cast<float>(weakest_[x]) < doubtful)
      good = good && static_cast<float>(second_[x]) >= doubtful &&
             (flips_to_neighbour(k, weakest_bit_[x]) ||
              (static_cast<float>(finest_[x]) < doubtful && flips_to_neighbour(k ^ 1, weakest_bit_[x])));
    return good ? k : -2;
  }
  /// d of a bit at a pixel: its size is kept where it is the finest or the weakest, else it is far from zero.
  float difference(std::size_t x, int bit) const {
    T const size = bit == 0 ? finest_[x] : weakest_bit_[x] == bit ? weakest_[x] : largest_[x];
    return (word_[x] >> bit & 1) != 0 ? static_cast<float>(size) : -static_cast<float>(size);
  }
  /// All pixels from a border to pixel x have a column.
  bool same_column(float border, std::size_t x) const {
    for (std::size_t i = static_cast<std::size_t>(border) + 1; i <= x; ++i)
      if (code_[i] < 0) return false;
    return true;
  }

  GrayBits const& bits_;
  std::vector<float> const& of_level_;
  cv::Mat const& levels_;
  int count_;
  std::uint16_t const* word_ = nullptr;
  std::uint8_t const* weakest_bit_ = nullptr;
  T const *finest_ = nullptr, *weakest_ = nullptr, *second_ = nullptr, *largest_ = nullptr;
  std::vector<int> code_;
  std::vector<float> noise_;
};

/// What the position of a border scatters, beyond noise: from second differences of three borders of one surface (whose
/// variance is 6 of one position's), robustly.
template <class T>
float border_scatter(Line<T>& line, int rows) {
  std::vector<Border> borders;
  std::vector<float> seconds;
  for (int y = 0; y < rows; y += kScatterRows) {
    line.read(y);
    line.find_borders(borders);
    for (std::size_t i = 2; i < borders.size(); ++i)
      if (borders[i].follows && borders[i - 1].follows)
        seconds.push_back(std::abs(borders[i].position - 2 * borders[i - 1].position + borders[i - 2].position));
  }
  if (seconds.empty()) return 0;
  auto const middle = seconds.begin() + static_cast<std::ptrdiff_t>(seconds.size() / 2);
  std::nth_element(seconds.begin(), middle, seconds.end());
  return *middle / 0.6745F / std::sqrt(6.0F);
}

/// Codes of the pixels of one line, between its borders; NaN where there are none.
void interpolate_line(std::vector<Border> const& borders, std::vector<int> const& codes, float scatter, float* code,
                      float* sigma) {
  for (std::size_t x = 0; x < codes.size(); ++x) {
    code[x] = codes[x] < 0 ? kMissing : static_cast<float>(codes[x]) + 0.5F;
    sigma[x] = codes[x] < 0 ? kMissing : kUniform;
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
      sigma[x] = std::min(kUniform, std::abs(slope) * std::sqrt(at_a * at_a + at_b * at_b));
    }
  }
}

/// Whether the code changes more down the picture than across it.
template <class T>
bool changes_down(Line<T>& line, int rows) {
  std::array<std::size_t, 2> changes = {0, 0};
  auto const is_border = [](int a, int b) { return a != b && std::abs(a - b) <= kMostBorders; };
  std::vector<int> codes;
  for (int y = 0; y + 1 < rows; y += kScatterRows) {
    line.read(y);
    codes = line.codes();
    line.read(y + 1);
    for (std::size_t x = 0; x + 1 < codes.size(); ++x) {
      int const here = codes[x], right = codes[x + 1], below = line.codes()[x];
      if (here < 0 || right < 0 || below < 0) continue;
      changes[0] += is_border(here, right);
      changes[1] += is_border(here, below);
    }
  }
  return changes[1] > changes[0];
}

template <class T>
CodeImage interpolate(Line<T>& line, cv::Size size) {
  CodeImage image{cv::Mat1f(size), cv::Mat1f(size), cv::Mat1f(size), cv::Mat1b(size), {}};
  float const scatter = border_scatter(line, size.height);
  std::vector<Border> borders;
  for (int y = 0; y < size.height; ++y) {
    line.read(y);
    line.find_borders(borders);
    std::vector<int> const& codes = line.codes();
    interpolate_line(borders, codes, scatter, image.code[y], image.sigma[y]);
    float* const bias = image.bias[y];
    std::uint8_t* const classes = image.classes[y];
    for (std::size_t x = 0; x < codes.size(); ++x) {
      PixelClass const what = codes[x] >= 0    ? PixelClass::object
                              : codes[x] == -1 ? PixelClass::no_light
                                               : PixelClass::several_peaks;
      classes[x] = static_cast<std::uint8_t>(what);
      bias[x] = codes[x] >= 0 ? 0 : kMissing;
    }
  }
  return image;
}

template <class T>
CodeImage border_codes_of(GrayBits const& bits, DifferenceNoise const& noise, std::optional<int> count) {
  Line<T> line(bits, noise, count);
  if (!changes_down(line, bits.word.rows)) return interpolate(line, bits.word.size());
  // Borders lie along the lines: the same work on the picture laid on its side.
  GrayBits turned;
  DifferenceNoise turned_noise{{}, noise.of_level};
  cv::transpose(bits.word, turned.word);
  cv::transpose(bits.finest, turned.finest);
  cv::transpose(bits.weakest, turned.weakest);
  cv::transpose(bits.weakest_bit, turned.weakest_bit);
  cv::transpose(bits.second, turned.second);
  cv::transpose(bits.largest, turned.largest);
  cv::transpose(noise.level, turned_noise.level);
  Line<T> down(turned, turned_noise, count);
  CodeImage image = interpolate(down, turned.word.size());
  cv::transpose(image.code, image.code);
  cv::transpose(image.sigma, image.sigma);
  cv::transpose(image.bias, image.bias);
  cv::transpose(image.classes, image.classes);
  return image;
}

template <class T>
cv::Mat1i whole_codes_of(GrayBits const& bits, DifferenceNoise const& noise, std::optional<int> count) {
  cv::Mat1i codes(bits.word.size());
  Line<T> line(bits, noise, count);
  for (int y = 0; y < codes.rows; ++y) {
    line.read(y);
    std::copy(line.codes().begin(), line.codes().end(), codes[y]);
  }
  return codes;
}

template <class T>
void add_bit(GrayBits& bits, int bit, cv::Mat const& pattern, cv::Mat const& inverse) {
  auto const mask = static_cast<std::uint16_t>(1U << bit);
  auto const this_bit = static_cast<std::uint8_t>(bit);
  std::vector<T> row(static_cast<std::size_t>(pattern.cols));
  for (int y = 0; y < pattern.rows; ++y) {
    T const *const a = pattern.ptr<T>(y), *const b = inverse.ptr<T>(y);
    std::uint16_t* const word = bits.word[y];
    std::uint8_t* const weakest_bit = bits.weakest_bit[y];
    T *const weakest = bits.weakest.ptr<T>(y), *const second = bits.second.ptr<T>(y),
             *const largest = bits.largest.ptr<T>(y), *const size = bit == 0 ? bits.finest.ptr<T>(y) : row.data();
    int const cols = pattern.cols;
    // Without branches, and no two of the rows overlap: the compiler makes vectors of it.
#pragma GCC ivdep
    for (int x = 0; x < cols; ++x) word[x] = static_cast<std::uint16_t>(word[x] | (a[x] > b[x] ? mask : 0));
#pragma GCC ivdep
    for (int x = 0; x < cols; ++x) {
      T const more = a[x] > b[x] ? a[x] : b[x], less = a[x] > b[x] ? b[x] : a[x];
      T const here = static_cast<T>(more - less), most = largest[x];
      size[x] = here;
      largest[x] = here > most ? here : most;
    }
    if (bit == 0) continue;
#pragma GCC ivdep
    for (int x = 0; x < cols; ++x) weakest_bit[x] = size[x] < weakest[x] ? this_bit : weakest_bit[x];
#pragma GCC ivdep
    for (int x = 0; x < cols; ++x) {
      T const here = size[x], least = weakest[x], next = second[x];
      bool const is_weaker = here < least;
      T const other = is_weaker ? least : here;
      second[x] = other < next ? other : next;
      weakest[x] = is_weaker ? here : least;
    }
  }
}

}  // namespace

void GrayBits::add(int bit, cv::Mat const& pattern, cv::Mat const& inverse) {
  bool const is_deep = pattern.depth() == CV_16U;
  if (word.empty()) {
    cv::Size const size = pattern.size();
    word = cv::Mat1w(size, std::uint16_t{0});
    weakest_bit = cv::Mat1b(size, std::uint8_t{0});
    for (cv::Mat* const least : {&finest, &weakest, &second})
      *least = cv::Mat(size, pattern.depth(), cv::Scalar(is_deep ? 65535 : 255));
    largest = cv::Mat::zeros(size, pattern.depth());
  }
  is_deep ? add_bit<std::uint16_t>(*this, bit, pattern, inverse) : add_bit<std::uint8_t>(*this, bit, pattern, inverse);
}

cv::Mat1i whole_codes(GrayBits const& bits, DifferenceNoise const& noise, std::optional<int> count) {
  return bits.largest.depth() == CV_16U ? whole_codes_of<std::uint16_t>(bits, noise, count)
                                        : whole_codes_of<std::uint8_t>(bits, noise, count);
}

CodeImage border_codes(GrayBits const& bits, DifferenceNoise const& noise, std::optional<int> count) {
  return bits.largest.depth() == CV_16U ? border_codes_of<std::uint16_t>(bits, noise, count)
                                        : border_codes_of<std::uint8_t>(bits, noise, count);
}

}  // namespace scanview
