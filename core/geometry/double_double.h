// A number as the sum of two doubles: about 106 bits, the same on every processor that has IEEE doubles, which long
// double is not. For the few verdicts that double is too coarse for. Plain value; no overflow below 2^990.
//
// Sources: Dekker, A Floating-Point Technique for Extending the Available Precision, 1971 (product and split); Knuth,
// The Art of Computer Programming, volume 2 (sum). Both take every operation to be rounded by itself: no fused product.
#ifndef LOCUS_CORE_GEOMETRY_DOUBLE_DOUBLE_H_
#define LOCUS_CORE_GEOMETRY_DOUBLE_DOUBLE_H_

namespace locus {

class DoubleDouble {
 public:
  constexpr DoubleDouble() = default;
  constexpr DoubleDouble(double value) : high_(value) {}  // NOLINT(google-explicit-constructor): no bit is lost

  constexpr double rounded() const { return high_; }
  // -1, 0 or 1.
  constexpr int sign() const { return (high_ > 0) - (high_ < 0); }

  // Off by less than 2^-102 of the result, exact where 106 bits hold it.
  friend constexpr DoubleDouble operator+(DoubleDouble a, DoubleDouble b) {
    const DoubleDouble high = sum(a.high_, b.high_), low = sum(a.low_, b.low_);
    const DoubleDouble first = ordered_sum(high.high_, high.low_ + low.high_);
    return ordered_sum(first.high_, first.low_ + low.low_);
  }
  friend constexpr DoubleDouble operator-(DoubleDouble a) { return {-a.high_, -a.low_}; }
  friend constexpr DoubleDouble operator-(DoubleDouble a, DoubleDouble b) { return a + -b; }
  // Off by less than 2^-102 of the result; of two doubles exact.
  friend constexpr DoubleDouble operator*(DoubleDouble a, DoubleDouble b) {
    const DoubleDouble high = product(a.high_, b.high_);
    return ordered_sum(high.high_, high.low_ + (a.high_ * b.low_ + a.low_ * b.high_));
  }
  friend constexpr bool operator==(const DoubleDouble&, const DoubleDouble&) = default;

 private:
  constexpr DoubleDouble(double high, double low) : high_(high), low_(low) {}

  // Exact.
  static constexpr DoubleDouble sum(double a, double b) {
    const double s = a + b, of_b = s - a;
    return {s, (a - (s - of_b)) + (b - of_b)};
  }
  // Exact where a is zero or not smaller than b.
  static constexpr DoubleDouble ordered_sum(double a, double b) {
    const double s = a + b;
    return {s, b - (s - a)};
  }
  // The upper 26 bits; the rest needs no more than 26 either.
  static constexpr double upper_half(double a) {
    const double c = 0x8000001p0 * a;
    return c - (c - a);
  }
  // Exact.
  static constexpr DoubleDouble product(double a, double b) {
    const double p = a * b, a1 = upper_half(a), b1 = upper_half(b), a2 = a - a1, b2 = b - b1;
    return {p, ((a1 * b1 - p) + a1 * b2 + a2 * b1) + a2 * b2};
  }

  double high_ = 0, low_ = 0;  // low: at most half a unit in the last place of high
};

}  // namespace locus

#endif  // LOCUS_CORE_GEOMETRY_DOUBLE_DOUBLE_H_
