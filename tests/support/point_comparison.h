// Comparison of KdPoints with a search of all points, on random points of several kinds. Used by the tests, which
// expect no difference, and by the tests of planted bugs.
#ifndef LOCUS_TESTS_SUPPORT_POINT_COMPARISON_H_
#define LOCUS_TESTS_SUPPORT_POINT_COMPARISON_H_

#include <algorithm>
#include <string>
#include <vector>

#include "absl/strings/str_cat.h"
#include "core/index/kd_points/kd_points.h"
#include "tests/support/random.h"
#include "tests/support/test_scale.h"

namespace locus::test {

template <class S, size_t K>
struct PointKind {
  using Scalar = S;
  static constexpr size_t kDimensions = K;
};

// One random set of points with an index of them.
template <class S, size_t K>
class PointComparison {
 public:
  using Position = std::array<S, K>;

  explicit PointComparison(Random& random) : random_(random), lattice_(random.chance(0.5)) {
    const uint64_t count = random.below(200);
    for (uint64_t i = 0; i < count; ++i) points_.push_back({random_position(), i + 1});
    for (uint64_t i = 0; i < count / 4; ++i) points_.push_back({random_.pick(points_).position, count + i + 1});
    index_ = KdPoints<S, K>::build(points_);
  }

  // Returns the first difference of a box, a ball and a nearest query; empty if there is none.
  std::string difference() {
    const Position a = random_position(), b = random_position();
    Position low, high;
    for (size_t axis = 0; axis < K; ++axis) {
      low[axis] = std::min(a[axis], b[axis]);
      high[axis] = std::max(a[axis], b[axis]);
    }
    const double radius = random_.chance(0.2) ? 0 : std::sqrt(squared_distance(random_position(), a));
    Work work;
    std::vector<uint64_t> box, ball;
    index_.visit_box(low, high, adder(box), work);
    index_.visit_ball(a, radius, adder(ball), work);
    const auto in_box = [&](const Position& p) {
      for (size_t axis = 0; axis < K; ++axis)
        if (p[axis] < low[axis] || p[axis] > high[axis]) return false;
      return true;
    };
    const auto in_ball = [&](const Position& p) { return squared_distance(p, a) <= radius * radius; };
    if (sorted(box) != matching(in_box)) return "a box";
    if (sorted(ball) != matching(in_ball)) return "a ball";
    return nearest_difference(a, random_.chance(0.5) ? radius : 1e9, random_.below(10));
  }

 private:
  // Returns a position on a lattice of few points, so that many coordinates are equal, or any position.
  Position random_position() {
    Position position;
    for (S& x : position) x = static_cast<S>(lattice_ ? random_.whole(-3, 3) : random_.between(-4, 4));
    return position;
  }

  static auto adder(std::vector<uint64_t>& ids) {
    return [&ids](const KdPoint<S, K>& point) {
      ids.push_back(point.id);
      return true;
    };
  }
  static std::vector<uint64_t> sorted(std::vector<uint64_t> ids) {
    std::sort(ids.begin(), ids.end());
    return ids;
  }

  template <class Inside>
  std::vector<uint64_t> matching(const Inside& inside) const {
    std::vector<uint64_t> ids;
    for (const KdPoint<S, K>& point : points_)
      if (inside(point.position)) ids.push_back(point.id);
    return sorted(ids);
  }

  std::string nearest_difference(const Position& center, double max_distance, size_t count) {
    std::vector<KdPointAt<S, K>> got, expected;
    Work work;
    index_.nearest(center, max_distance, count, got, work);
    for (const KdPoint<S, K>& point : points_) {
      const double distance = squared_distance(point.position, center);
      if (distance <= max_distance * max_distance) expected.push_back({distance, point});
    }
    std::sort(expected.begin(), expected.end());
    if (expected.size() > count) expected.resize(count);
    if (got.size() != expected.size()) return absl::StrCat(got.size(), " nearest, not ", expected.size());
    for (size_t i = 0; i < got.size(); ++i)
      if (got[i].point != expected[i].point) return absl::StrCat("nearest point ", i);
    return "";
  }

  Random& random_;
  const bool lattice_;
  std::vector<KdPoint<S, K>> points_;
  KdPoints<S, K> index_;
};

// Returns the first difference in `count` random sets of points; empty if there is none.
template <class S, size_t K>
std::string points_difference(uint64_t count) {
  for (uint64_t seed = 0; seed < count; ++seed) {
    Random random(seed);
    PointComparison<S, K> comparison(random);
    for (int query = 0; query < 20; ++query)
      if (const std::string what = comparison.difference(); !what.empty())
        return absl::StrCat("seed ", seed, ", ", what);
  }
  return "";
}

}  // namespace locus::test

#endif  // LOCUS_TESTS_SUPPORT_POINT_COMPARISON_H_
