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

/// Of a zero, in 1/4096; brings it nearer to what came.
void adapt(std::uint16_t& probability, bool bit) {
  int const p = probability;
  probability =
      static_cast<std::uint16_t>(bit ? p - (p >> kAdaptation) : p + (((1 << kProbabilityBits) - p) >> kAdaptation));
}

class Encoder {
 public:
  void put(std::uint16_t& probability, bool bit) {
    std::uint32_t const bound = (range_ >> kProbabilityBits) * probability;
    if (bit) {
      low_ += bound;
      range_ -= bound;
    } else {
      range_ = bound;
    }
    adapt(probability, bit);
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
    } else {
      range_ = bound;
    }
    adapt(probability, bit);
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

/// How a patch faces an eye, in sixteen steps.
std::size_t facing(PatchPlace const& patch, Eigen::Vector4d const& eye) {
  Eigen::Vector3d const to_eye = eye.head<3>() - eye.w() * patch.center;
  double const length = to_eye.norm();
  if (!(length > 0)) return 8;
  return static_cast<std::size_t>(std::clamp(8 + 8 * patch.normal.dot(to_eye) / length, 0.0, 15.0));
}

/// Calls code(probability, row, column) for each bit, in the order of the file.
template <typename Code>
void for_each_bit(std::vector<RowPlace> const& rows, std::vector<PatchPlace> const& patches, Code const& code) {
  constexpr std::size_t kContexts = std::size_t{2} * 16 * 4 * 4 * 3 * 4;
  std::vector<std::uint16_t> probabilities(kContexts, 1U << (kProbabilityBits - 1));
  std::vector<std::uint8_t> faces(rows.size());
  // The bits of this column, and of the same side of the two patches before.
  std::array<std::vector<std::uint8_t>, 5> kept;
  for (auto& column : kept) column.assign(rows.size(), 0);
  for (std::size_t column = 0; column < 2 * patches.size(); ++column) {
    auto& now = kept[column % 5];
    auto const& before = kept[(column + 3) % 5];
    auto const& earlier = kept[(column + 1) % 5];
    for (std::size_t row = 0; row < rows.size(); ++row) {
      RowPlace const& place = rows[row];
      if (column % 2 == 0) faces[row] = static_cast<std::uint8_t>(facing(patches[column / 2], place.eye));
      auto const pair = [&](std::int32_t a, std::int32_t b) -> std::size_t {
        if (a < 0) return 3;
        std::size_t const first = now[static_cast<std::size_t>(a)];
        return first + (b < 0 ? first : now[static_cast<std::size_t>(b)]);
      };
      std::size_t context = 16 * (column % 2) + faces[row];
      context = 4 * context + pair(place.beside[0], place.beside[1]);
      context = 4 * context + pair(place.beside[2], place.beside[3]);
      context = 3 * context + (place.twin < 0 ? 2 : now[static_cast<std::size_t>(place.twin)]);
      context = 4 * context + (column >= 2 ? 2U * before[row] : 0U) + (column >= 4 ? earlier[row] : 0U);
      now[row] = code(probabilities[context], row, column) ? 1 : 0;
    }
  }
}

}  // namespace

std::string encode_flags(std::vector<bool> const& flags) {
  Encoder encoder;
  std::array<std::uint16_t, 4> probabilities;
  probabilities.fill(1U << (kProbabilityBits - 1));
  std::size_t context = 0;
  for (bool const flag : flags) {
    encoder.put(probabilities[context], flag);
    context = (2 * context + (flag ? 1 : 0)) % 4;
  }
  return encoder.finish();
}

std::vector<bool> decode_flags(std::string_view bytes, std::size_t count, std::filesystem::path const& path) {
  if (count > kMostBitsAByte * (bytes.size() + 8))
    throw Error(ErrorCode::bad_input, path, "fewer bytes than its patches need");
  Decoder decoder(bytes);
  std::array<std::uint16_t, 4> probabilities;
  probabilities.fill(1U << (kProbabilityBits - 1));
  std::vector<bool> flags(count);
  std::size_t context = 0;
  for (std::size_t i = 0; i < count; ++i) {
    flags[i] = decoder.get(probabilities[context]);
    context = (2 * context + (flags[i] ? 1 : 0)) % 4;
  }
  return flags;
}

std::string encode_bits(BitRows const& bits, std::vector<RowPlace> const& rows,
                        std::vector<PatchPlace> const& patches) {
  Encoder encoder;
  for_each_bit(rows, patches, [&](std::uint16_t& probability, std::size_t row, std::size_t column) {
    bool const bit = bits.test(row, column);
    encoder.put(probability, bit);
    return bit;
  });
  return encoder.finish();
}

BitRows decode_bits(std::string_view bytes, std::vector<RowPlace> const& rows, std::vector<PatchPlace> const& patches,
                    std::filesystem::path const& path) {
  std::size_t const most = kMostBitsAByte * (bytes.size() + 8);
  if (!patches.empty() && rows.size() > most / (2 * patches.size()))
    throw Error(ErrorCode::bad_input, path, "fewer bytes than its visibility bits need");
  BitRows result(rows.size(), 2 * patches.size());
  Decoder decoder(bytes);
  for_each_bit(rows, patches, [&](std::uint16_t& probability, std::size_t row, std::size_t column) {
    bool const bit = decoder.get(probability);
    if (bit) result.set(row, column);
    return bit;
  });
  return result;
}

}  // namespace scanview
