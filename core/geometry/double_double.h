// Extended precision: a number of about 106 bits, stored as the sum of two doubles. Results are equal on all processors
// with IEEE doubles, unlike the results of long double. Used for the few geometric tests for which double is not
// precise enough. Plain value; any thread; no overflow below 2^990.
//
// Sources: Dekker, A Floating-Point Technique for Extending the Available Precision, 1971 (product and split); Knuth,
// The Art of Computer Programming, volume 2 (sum). Both methods require that each operation is rounded separately: no
// fused multiply-add.
#ifndef LOCUS_CORE_GEOMETRY_DOUBLE_DOUBLE_H_
#define LOCUS_CORE_GEOMETRY_DOUBLE_DOUBLE_H_

#include "core/base/check.h"

namespace locus {

// Number high_ + low_. Invariant: |low_| is at most half a unit in the last place of high_.
class DoubleDouble {
 public:
  constexpr DoubleDouble() = default;
  constexpr DoubleDouble(double value) : high_(value) {}  // NOLINT(google-explicit-constructor): no bit is lost

  // Returns the nearest double.
  constexpr double rounded() const { return high_; }
  // Returns the difference between the number and rounded(), exactly.
  constexpr double error() const { return low_; }
  // Returns the sign of the number: -1, 0 or 1.
  constexpr int sign() const { return (high_ > 0) - (high_ < 0); }

  // Returns the sum with a relative error below 2^-102; the sum of two doubles is exact.
  friend constexpr DoubleDouble operator+(DoubleDouble a, DoubleDouble b) {
    const DoubleDouble high = sum(a.high_, b.high_), low = sum(a.low_, b.low_);
    const DoubleDouble first = ordered_sum(high.high_, high.low_ + low.high_);
    return ordered_sum(first.high_, first.low_ + low.low_);
  }
  friend constexpr DoubleDouble operator-(DoubleDouble a) { return {-a.high_, -a.low_}; }
  friend constexpr DoubleDouble operator-(DoubleDouble a, DoubleDouble b) { return a + -b; }
  // Returns the product with a relative error below 2^-102; the product of two doubles is exact.
  friend constexpr DoubleDouble operator*(DoubleDouble a, DoubleDouble b) {
    const DoubleDouble high = product(a.high_, b.high_);
    return ordered_sum(high.high_, high.low_ + (a.high_ * b.low_ + a.low_ * b.high_));
  }
  friend constexpr bool operator==(const DoubleDouble&, const DoubleDouble&) = default;

 private:
  constexpr DoubleDouble(double high, double low) : high_(high), low_(low) { LOCUS_DCHECK_EQ(high_ + low_, high_); }

  // Returns a + b exactly.
  static constexpr DoubleDouble sum(double a, double b) {
    const double s = a + b, b_part = s - a;
    return {s, (a - (s - b_part)) + (b - b_part)};
  }
  // Returns a + b exactly if a is 0 or |a| >= |b|.
  static constexpr DoubleDouble ordered_sum(double a, double b) {
    const double s = a + b;
    return {s, b - (s - a)};
  }
  // Returns `a` rounded to 26 significant bits; the difference from `a` fits 26 bits too.
  static constexpr double upper_half(double a) {
    const double c = 0x8000001p0 * a;
    return c - (c - a);
  }
  // Returns a * b exactly.
  static constexpr DoubleDouble product(double a, double b) {
    const double p = a * b, a1 = upper_half(a), b1 = upper_half(b), a2 = a - a1, b2 = b - b1;
    return {p, ((a1 * b1 - p) + a1 * b2 + a2 * b1) + a2 * b2};
  }

  double high_ = 0, low_ = 0;
};

}  // namespace locus

#endif  // LOCUS_CORE_GEOMETRY_DOUBLE_DOUBLE_H_
