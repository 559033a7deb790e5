#pragma once
#include <bit>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

namespace scanview {

/// A table of bits, a row a sample, a column a patch; rows are read whole. Above each row stands a second one with a
/// bit for each of its words that is not zero, so that OR-ing and walking rows skips what holds nothing (Meruvia 2001,
/// section 5).
class BitRows {
 public:
  BitRows() = default;
  BitRows(std::size_t rows, std::size_t columns)
      : rows_(rows),
        columns_(columns),
        words_((columns + 63) / 64),
        summary_words_((words_ + 63) / 64),
        bits_(rows * words_),
        summary_(rows * summary_words_) {}

  std::size_t rows() const { return rows_; }
  std::size_t columns() const { return columns_; }
  bool test(std::size_t row, std::size_t column) const {
    return (bits_[row * words_ + column / 64] >> (column % 64) & 1) != 0;
  }
  /// Rows may be written from several threads at once, each by one.
  void set(std::size_t row, std::size_t column) {
    std::size_t const word = column / 64;
    bits_[row * words_ + word] |= std::uint64_t{1} << (column % 64);
    summary_[row * summary_words_ + word / 64] |= std::uint64_t{1} << (word % 64);
  }
  std::span<std::uint64_t const> row(std::size_t row) const { return {&bits_[row * words_], words_}; }

  /// Calls use(word, bits) for each word of the OR of some rows that is not zero, in order.
  template <typename Use>
  void visit_union(std::span<std::size_t const> rows, Use const& use) const {
    for (std::size_t s = 0; s < summary_words_; ++s) {
      std::uint64_t present = 0;
      for (std::size_t const row : rows) present |= summary_[row * summary_words_ + s];
      for (; present != 0; present &= present - 1) {
        std::size_t const word = 64 * s + static_cast<std::size_t>(std::countr_zero(present));
        std::uint64_t bits = 0;
        for (std::size_t const row : rows) bits |= bits_[row * words_ + word];
        use(word, bits);
      }
    }
  }

  bool operator==(BitRows const&) const = default;

 private:
  std::size_t rows_ = 0, columns_ = 0, words_ = 0, summary_words_ = 0;
  std::vector<std::uint64_t> bits_, summary_;
};

}  // namespace scanview
