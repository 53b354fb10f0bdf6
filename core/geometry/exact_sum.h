// Exact sum of doubles and of products of doubles, for signs that must not depend on rounding. The sum is stored as an
// expansion: components of increasing magnitude whose bits do not overlap, so that the last one determines the sign.
// Plain value; any thread. Each call of add(double) costs a few additions for each component. The sum has as many
// components as its bits need, mostly one to five.
//
// Exact as long as no operation over- or underflows. The magnitude of every summand and product must be below 2^990.
// Every summand, and every product of the 26-bit halves into which factors are split, must be a multiple of 2^-1074.
// For a product of up to three factors it suffices that each factor is a multiple of 2^-310.
//
// Source: Shewchuk, Adaptive Precision Floating-Point Arithmetic and Fast Robust Geometric Predicates, 1997
// (Grow-Expansion with zero elimination, theorem 10).
#ifndef LOCUS_CORE_GEOMETRY_EXACT_SUM_H_
#define LOCUS_CORE_GEOMETRY_EXACT_SUM_H_

#include <array>

#include "core/base/check.h"
#include "core/geometry/double_double.h"

namespace locus {

// `kMaxSummands` is the maximum number of calls of add(double).
template <int kMaxSummands>
class ExactSum {
 public:
  void add(double value) {
    int kept = 0;
    for (int i = 0; i < count_; ++i) {
      const DoubleDouble sum = DoubleDouble(value) + DoubleDouble(components_[static_cast<size_t>(i)]);
      if (sum.error() != 0) components_[static_cast<size_t>(kept++)] = sum.error();
      value = sum.rounded();
    }
    if (value != 0) {
      LOCUS_DCHECK_LT(kept, kMaxSummands);
      components_[static_cast<size_t>(kept++)] = value;
    }
    count_ = kept;
  }
  // Adds both doubles of `value`.
  void add(DoubleDouble value) {
    add(value.error());
    add(value.rounded());
  }
  // Returns the sign of the sum: -1, 0 or 1.
  int sign() const { return count_ == 0 ? 0 : DoubleDouble(components_[static_cast<size_t>(count_ - 1)]).sign(); }

 private:
  std::array<double, kMaxSummands> components_;
  int count_ = 0;
};

}  // namespace locus

#endif  // LOCUS_CORE_GEOMETRY_EXACT_SUM_H_
