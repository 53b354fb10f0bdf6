// Work of small queries of a structure on uniform boxes, and how it grows with the number of boxes. Work is counted,
// not timed, so that the results are the same on every machine.
#ifndef LOCUS_TESTS_SUPPORT_STRUCTURE_WORK_H_
#define LOCUS_TESTS_SUPPORT_STRUCTURE_WORK_H_

#include <cmath>
#include <vector>

#include "core/index/queries/index_queries.h"
#include "tests/support/random.h"
#include "tests/support/small_world.h"

namespace locus::test {

// Returns boxes with half extents up to 0.25 in a cube with one box for each unit of volume.
inline std::vector<Object> uniform_boxes(uint32_t count, Random& random) {
  const double half = std::cbrt(count) / 2;
  std::vector<Object> objects;
  for (uint32_t i = 0; i < count; ++i)
    objects.push_back(box_object(i + 1, random.vector(half), to_float(random.positive_vector(0.25))));
  return objects;
}

// Mean work of one query: nodes opened, cells looked up and values tested.
struct SmallQueryWork {
  double ball;  // of a ball of radius 1
  double ray;   // of the first hit of a ray within a distance of 4
};

template <class Index>
SmallQueryWork small_query_work(const Index& index, uint32_t count, Random& random) {
  constexpr int kQueries = 500;
  const double half = std::cbrt(count) / 2;
  Work ball, ray;
  for (int i = 0; i < kQueries; ++i) {
    std::vector<Object> found;
    ball_overlap(index, {random.vector(half), 1}, found, &ball);
    Object hit;
    double t = 4;
    first_ray(index, ObjectRay(Rayd{random.vector(half), random.unit_vector()}), hit, t, &ray);
  }
  const auto mean = [](const Work& work) {
    return static_cast<double>(work.nodes + work.cells + work.tests) / kQueries;
  };
  return {mean(ball), mean(ray)};
}

// Work of small queries on 1,000 and on 64,000 boxes, and the power of the number of boxes by which it grows.
struct WorkGrowth {
  SmallQueryWork few, many;
  double ball_exponent() const { return std::log(many.ball / few.ball) / std::log(64); }
  double ray_exponent() const { return std::log(many.ray / few.ray) / std::log(64); }
};

// `make` makes an index of a vector of objects.
template <class Make>
WorkGrowth work_growth(const Make& make) {
  WorkGrowth growth;
  Random random(1);
  for (const bool many : {false, true}) {
    const uint32_t count = many ? 64'000 : 1'000;
    const auto index = make(uniform_boxes(count, random));
    (many ? growth.many : growth.few) = small_query_work(index, count, random);
  }
  return growth;
}

}  // namespace locus::test

#endif  // LOCUS_TESTS_SUPPORT_STRUCTURE_WORK_H_
