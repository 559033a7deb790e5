#include "viewer/visibility/bit_coding.h"

#include <algorithm>
#include <array>

#include "base/error.h"

namespace scanview {
namespace {

constexpr int kProbabilityBits = 12, kAdaptation = 5;
constexpr std::uint32_t kTop = 1U << 24;
/// Probabilities stay above 31 of 4096: a bit costs at least log2(4096 / 4065) = 0.011 bits, a 91st.
constexpr std::size_t kMostBitsAByte = 8 * 128;

class Encoder {
 public:
  void put(std::uint16_t& probability, bool bit) {
    std::uint32_t const bound = (range_ >> kProbabilityBits) * probability;
    if (bit) {
      low_ += bound;
      range_ -= bound;
      probability = static_cast<std::uint16_t>(probability - (probability >> kAdaptation));
    } else {
      range_ = bound;
      probability = static_cast<std::uint16_t>(probability + (((1U << kProbabilityBits) - probability) >> kAdaptation));
    }
    while (range_ < kTop) {
      range_ <<= 8;
      shift();
    }
  }
  std::string finish() {
    for (int i = 0; i < 5; ++i) shift();
    return std::move(bytes_);
  }

 private:
  void shift() {
    if (low_ < 0xff000000U || low_ > 0xffffffffU) {
      auto const carry = static_cast<std::uint8_t>(low_ >> 32);
      if (begun_) bytes_.push_back(static_cast<char>(cached_ + carry));
      for (; pending_ > 0; --pending_) bytes_.push_back(static_cast<char>(0xff + carry));
      cached_ = static_cast<std::uint8_t>(low_ >> 24);
      begun_ = true;
    } else {
      ++pending_;
    }
    low_ = low_ << 8 & 0xffffffffU;
  }

  std::string bytes_;
  std::uint64_t low_ = 0;
  std::uint32_t range_ = 0xffffffffU;
  std::uint8_t cached_ = 0;
  bool begun_ = false;
  std::size_t pending_ = 0;
};

class Decoder {
 public:
  explicit Decoder(std::string_view bytes) : bytes_(bytes) {
    for (int i = 0; i < 4; ++i) code_ = code_ << 8 | next();
  }
  bool get(std::uint16_t& probability) {
    std::uint32_t const bound = (range_ >> kProbabilityBits) * probability;
    bool const bit = code_ >= bound;
    if (bit) {
      code_ -= bound;
      range_ -= bound;
      probability = static_cast<std::uint16_t>(probability - (probability >> kAdaptation));
    } else {
      range_ = bound;
      probability = static_cast<std::uint16_t>(probability + (((1U << kProbabilityBits) - probability) >> kAdaptation));
    }
    while (range_ < kTop) {
      range_ <<= 8;
      code_ = code_ << 8 | next();
    }
    return bit;
  }

 private:
  std::uint32_t next() { return at_ < bytes_.size() ? static_cast<std::uint8_t>(bytes_[at_++]) : 0; }

  std::string_view bytes_;
  std::size_t at_ = 0;
  std::uint32_t code_ = 0, range_ = 0xffffffffU;
};

/// Calls code(probability, row, column) for each bit, in the order of the file.
template <typename Code>
void for_each_bit(std::size_t rows, std::size_t columns, std::vector<RowNeighbors> const& neighbors, Code const& code) {
  constexpr std::size_t kContexts = 2 * 4 * 4 * 3 * 4;
  std::array<std::uint16_t, kContexts> probabilities;
  probabilities.fill(1U << (kProbabilityBits - 1));
  // The bits of this column, and of the same side of the two patches before.
  std::array<std::vector<std::uint8_t>, 5> columns_kept;
  for (auto& kept : columns_kept) kept.assign(rows, 0);
  for (std::size_t column = 0; column < columns; ++column) {
    auto& now = columns_kept[column % 5];
    auto const& before = columns_kept[(column + 3) % 5];
    auto const& earlier = columns_kept[(column + 1) % 5];
    for (std::size_t row = 0; row < rows; ++row) {
      RowNeighbors const& near = neighbors[row];
      auto const pair = [&](std::int32_t a, std::int32_t b) -> std::size_t {
        if (a < 0) return 3;
        std::size_t const first = now[static_cast<std::size_t>(a)];
        return first + (b < 0 ? first : now[static_cast<std::size_t>(b)]);
      };
      std::size_t context = column % 2;
      context = 4 * context + pair(near.beside[0], near.beside[1]);
      context = 4 * context + pair(near.beside[2], near.beside[3]);
      context = 3 * context + (near.twin < 0 ? 2 : now[static_cast<std::size_t>(near.twin)]);
      context = 4 * context + (column >= 2 ? 2U * before[row] : 0U) + (column >= 4 ? earlier[row] : 0U);
      now[row] = code(probabilities[context], row, column) ? 1 : 0;
    }
  }
}

}  // namespace

std::string encode_bits(BitRows const& rows, std::vector<RowNeighbors> const& neighbors) {
  Encoder encoder;
  for_each_bit(rows.rows(), rows.columns(), neighbors,
               [&](std::uint16_t& probability, std::size_t row, std::size_t column) {
                 bool const bit = rows.test(row, column);
                 encoder.put(probability, bit);
                 return bit;
               });
  return encoder.finish();
}

BitRows decode_bits(std::string_view bytes, std::size_t rows, std::size_t columns,
                    std::vector<RowNeighbors> const& neighbors, std::filesystem::path const& path) {
  std::size_t const most = kMostBitsAByte * (bytes.size() + 8);
  if (rows > most || columns > most || (rows > 0 && columns > most / rows) || neighbors.size() != rows)
    throw Error(ErrorCode::bad_input, path, "fewer bytes than its visibility bits need");
  BitRows result(rows, columns);
  Decoder decoder(bytes);
  for_each_bit(rows, columns, neighbors, [&](std::uint16_t& probability, std::size_t row, std::size_t column) {
    bool const bit = decoder.get(probability);
    if (bit) result.set(row, column);
    return bit;
  });
  return result;
}

}  // namespace scanview
