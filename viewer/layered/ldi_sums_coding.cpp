#include "viewer/layered/ldi_sums_coding.h"

#include <algorithm>
#include <array>
#include <cstdint>
#include <memory>
#include <vector>

#include "base/error.h"
#include "viewer/layered/ldi_key_order.h"

namespace scanview {
namespace {

class Writer {
 public:
  void put(std::uint64_t value) {
    for (; value >= 128; value >>= 7) bytes.push_back(static_cast<char>(value | 128));
    bytes.push_back(static_cast<char>(value));
  }
  /// Small whatever its sign.
  void put_signed(std::int64_t value) {
    put(static_cast<std::uint64_t>(value) << 1 ^ static_cast<std::uint64_t>(value >> 63));
  }
  std::string bytes;
};

class Reader {
 public:
  Reader(std::string_view bytes, std::filesystem::path const& path) : bytes_(bytes), path_(path) {}
  std::uint64_t get() {
    std::uint64_t value = 0;
    for (int shift = 0; shift < 64 && !bytes_.empty(); shift += 7) {
      auto const byte = static_cast<std::uint8_t>(bytes_.front());
      bytes_.remove_prefix(1);
      value |= std::uint64_t{byte & 127U} << shift;
      if (byte < 128) return value;
    }
    refuse();
  }
  std::int64_t get_signed() {
    std::uint64_t const value = get();
    return static_cast<std::int64_t>(value >> 1) ^ -static_cast<std::int64_t>(value & 1);
  }
  /// Not above `most`.
  std::uint64_t get(std::uint64_t most) {
    std::uint64_t const value = get();
    if (value > most) refuse();
    return value;
  }
  std::size_t left() const { return bytes_.size(); }
  [[noreturn]] void refuse() const {
    throw Error(ErrorCode::bad_input, path_, "is damaged: its sums are not as they are written");
  }

 private:
  std::string_view bytes_;
  std::filesystem::path const& path_;
};

/// What a sum consists of but for its place, each a sum of weight · (0 .. kMost).
constexpr int kParts = 6;
constexpr std::uint64_t kMost[kParts] = {255, kLinearOne, kLinearOne, kLinearOne, 255, 255};
using Parts = std::array<std::uint64_t, kParts>;
constexpr std::size_t kLeastBytes = 2 + 1 + kParts;  // of a sum

Parts parts_of(LdiSum const& sum) { return {sum.depth, sum.red, sum.green, sum.blue, sum.slope_x, sum.slope_y}; }

/// The same means at another weight. Weights have 24 bits, means 16.
struct Expected {
  std::uint64_t weight = 256;
  Parts parts{};
  std::int64_t at(std::size_t k, std::uint64_t other_weight) const {
    std::uint64_t const mean = (parts[k] << 8) / weight;  // 8 bits behind the point
    return static_cast<std::int64_t>(mean * other_weight >> 8);
  }
};

void encode_face(LdiSums const& sums, int face, Writer& out) {
  int const n = sums.resolution();
  std::uint64_t count = 0;
  auto const for_each = [&](auto const& work) {
    for (int y = 0; y < n; ++y)
      for (int x = 0; x < n; ++x)
        for (std::uint32_t k = sums.first(face, x, y); k != 0; k = sums[k].next) work(x, y, sums[k]);
  };
  if (sums.has_face(face)) for_each([&](int, int, LdiSum const&) { ++count; });
  out.put(count);
  if (count == 0) return;
  std::int64_t last_column = 0, last_bin = 0;
  Expected expected;
  for_each([&](int x, int y, LdiSum const& sum) {
    std::int64_t const column = std::int64_t{y} * n + x;
    out.put(static_cast<std::uint64_t>(column - last_column));
    out.put_signed(std::int64_t{sum.bin} - last_bin);
    out.put_signed(std::int64_t{sum.weight} - static_cast<std::int64_t>(expected.weight));
    Parts const parts = parts_of(sum);
    for (std::size_t k = 0; k < kParts; ++k)
      out.put_signed(static_cast<std::int64_t>(parts[k]) - expected.at(k, sum.weight));
    last_column = column;
    last_bin = sum.bin;
    expected = {sum.weight, parts};
  });
}

void decode_face(Reader& in, int face, LdiSums& sums) {
  int const n = sums.resolution();
  std::int64_t const columns = std::int64_t{n} * n, bins = ((n - 1) >> sums.bin_shift()) + 1;
  std::uint64_t const count = in.get(in.left() / kLeastBytes);
  std::int64_t column = 0, bin = 0;
  std::int64_t last_place = -1;
  Expected expected;
  for (std::uint64_t i = 0; i < count; ++i) {
    column += static_cast<std::int64_t>(in.get(static_cast<std::uint64_t>(columns)));
    std::int64_t const change = in.get_signed();
    if (column >= columns || change < -bin || change >= bins - bin) in.refuse();
    bin += change;
    std::int64_t const place = column * n + bin;
    if (place <= last_place) in.refuse();
    last_place = place;
    std::int64_t const weight_change = in.get_signed(), last_weight = static_cast<std::int64_t>(expected.weight);
    if (weight_change <= -last_weight || weight_change > std::int64_t{LdiSums::kMostWeight} - last_weight) in.refuse();
    auto const weight = static_cast<std::uint64_t>(last_weight + weight_change);
    Parts parts;
    for (std::size_t k = 0; k < kParts; ++k) {
      std::int64_t const difference = in.get_signed(), from = expected.at(k, weight);
      auto const most = static_cast<std::int64_t>(kMost[k] * weight);
      if (difference < -from || difference > most - from) in.refuse();
      parts[k] = static_cast<std::uint64_t>(from + difference);
    }
    LdiSum& sum =
        sums.at(face, static_cast<int>(column % n), static_cast<int>(column / n), static_cast<std::uint32_t>(bin));
    sum.weight = static_cast<std::uint32_t>(weight);
    sum.depth = static_cast<std::uint32_t>(parts[0]);
    sum.red = parts[1];
    sum.green = parts[2];
    sum.blue = parts[3];
    sum.slope_x = static_cast<std::uint32_t>(parts[4]);
    sum.slope_y = static_cast<std::uint32_t>(parts[5]);
    expected = {weight, parts};
  }
}

}  // namespace

std::string encode_sums(LdiSumCells const& cells) {
  std::vector<LdiCellKey> keys;
  for (auto const& [key, sums] : cells) keys.push_back(key);
  std::sort(keys.begin(), keys.end(), in_ldi_order);
  Writer out;
  out.put(keys.size());
  for (LdiCellKey const& key : keys) {
    out.put_signed(key.level);
    for (std::int64_t const index : key.index) out.put_signed(index);
    for (int face = 0; face < LdiSums::kFaces; ++face) encode_face(*cells.at(key), face, out);
  }
  return std::move(out.bytes);
}

LdiSumCells decode_sums(std::string_view bytes, LdiOptions const& options, std::filesystem::path const& path) {
  Reader in(bytes, path);
  constexpr std::size_t kLeastCellBytes = 4 + LdiSums::kFaces;
  std::uint64_t const count = in.get(in.left() / kLeastCellBytes);
  LdiSumCells cells;
  LdiCellKey last;
  for (std::uint64_t i = 0; i < count; ++i) {
    LdiCellKey key;
    std::int64_t const level = in.get_signed();
    for (std::int64_t& index : key.index) index = in.get_signed();
    key.level = static_cast<int>(std::clamp<std::int64_t>(level, -kLdiFarthestLevel - 1, kLdiFarthestLevel + 1));
    if (!is_ldi_key(key) || (i > 0 && !in_ldi_order(last, key))) in.refuse();
    auto sums = std::make_unique<LdiSums>(options.resolution, options.bin_shift(key.level));
    for (int face = 0; face < LdiSums::kFaces; ++face) decode_face(in, face, *sums);
    if (sums->count() == 0) in.refuse();
    cells.emplace(key, std::move(sums));
    last = key;
  }
  if (in.left() != 0) in.refuse();
  return cells;
}

}  // namespace scanview
