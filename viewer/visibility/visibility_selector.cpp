#include "viewer/visibility/visibility_selector.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <bit>
#include <cmath>

#include "viewer/visibility/visibility_kernels.h"

namespace scanview {
namespace {

void set_bits(std::vector<std::uint64_t>& bits, std::size_t begin, std::size_t end) {
  std::size_t const first = begin / 64, last = end / 64;
  std::uint64_t const from = ~std::uint64_t{0} << (begin % 64), until = ~(~std::uint64_t{0} << (end % 64));
  if (first == last) {
    bits[first] |= from & until;
    return;
  }
  bits[first] |= from;
  for (std::size_t w = first + 1; w < last; ++w) bits[w] = ~std::uint64_t{0};
  if (until != 0) bits[last] |= until;
}

}  // namespace

VisibilitySelector::VisibilitySelector(VisibilityField const& field, TriangleMesh const& drawn, bool facing)
    : field_(&field),
      facing_(facing),
      planes_(drawn, field.center, field.radius),
      drawn_(drawn.triangles.size() / 64 + 2) {}

void VisibilitySelector::take(Run const& run, EyePoint const& eye) {
  if (!facing_ || run.sides == 3) {
    set_bits(drawn_, run.begin, run.end);
  } else if (run.sides != 0) {
    facing_bits(planes_.arrays(), {eye.x, eye.y, eye.z, eye.w}, run.sides == 1 ? 1.0F : -1.0F, run.begin, run.end,
                drawn_.data());
  }
}

void VisibilitySelector::collect_ranges() {
  ranges_.clear();
  triangles_ = 0;
  std::uint64_t carried = 0;  // the bit before the word
  std::uint32_t begin = 0;
  for (std::size_t w = 0; w < drawn_.size(); ++w) {
    std::uint64_t const bits = drawn_[w];
    // Where runs begin and end.
    for (std::uint64_t changes = bits ^ (bits << 1 | carried); changes != 0; changes &= changes - 1) {
      auto const at = static_cast<std::uint32_t>(64 * w + static_cast<std::size_t>(std::countr_zero(changes)));
      if ((bits >> (at % 64) & 1) != 0) {
        begin = at;
      } else {
        ranges_.push_back({begin, at - begin});
        triangles_ += at - begin;
      }
    }
    carried = bits >> 63;
  }
}

std::span<IndexRange const> VisibilitySelector::answer(VisibilityField::Query const& query, EyePoint const& eye) {
  tests_ = query.tests;
  patches_ = 0;
  whole_ = query.count == 0;
  if (whole_) {
    patches_ = field_->patches.count();
    triangles_ = field_->patches.triangles.size();
    ranges_.assign(1, {0, static_cast<std::uint32_t>(triangles_)});
    if (triangles_ == 0) ranges_.clear();
    return ranges_;
  }
  if (!facing_ && query.cell < kept_.size() && kept_[query.cell].patches > 0) {
    Kept const& kept = kept_[query.cell];
    triangles_ = kept.triangles;
    patches_ = kept.patches;
    return kept.ranges;
  }
  std::fill(drawn_.begin(), drawn_.end(), 0);
  Run run;
  field_->rows.visit_union({query.rows, query.count}, [&](std::size_t word, std::uint64_t bits) {
    while (bits != 0) {
      auto const shift = static_cast<std::size_t>(std::countr_zero(bits)) & ~std::size_t{1};
      std::uint64_t const sides = bits >> shift & 3;
      bits &= ~(std::uint64_t{3} << shift);
      std::size_t const patch = 32 * word + shift / 2;
      ++patches_;
      if (run.end != field_->patches.begins[patch] || (facing_ && run.sides != sides)) {
        take(run, eye);
        run = {field_->patches.begins[patch], 0, sides};
      }
      run.end = field_->patches.begins[patch + 1];
    }
  });
  take(run, eye);
  collect_ranges();
  if (facing_) return ranges_;
  if (kept_.size() <= query.cell) kept_.resize(query.cell + 1);
  kept_[query.cell] = {ranges_, triangles_, patches_};
  return ranges_;
}

std::span<IndexRange const> VisibilitySelector::select(Eigen::Vector3d const& eye) {
  return answer(field_->query(eye), planes_.eye(eye));
}

std::span<IndexRange const> VisibilitySelector::select_from_afar(Eigen::Vector3d const& direction) {
  Eigen::Vector3d const unit = direction.normalized();
  Eigen::Vector3f const d = unit.cast<float>();
  // Far beyond every finite shell.
  return answer(field_->query(field_->center + 1e9 * field_->radius * unit), {d.x(), d.y(), d.z(), 0});
}

}  // namespace scanview
