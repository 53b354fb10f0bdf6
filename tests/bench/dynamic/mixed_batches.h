// The repeated requests of a reader of locus: batches of 100 queries, each at one revision. Any thread may call const
// members.
#ifndef LOCUS_TESTS_BENCH_DYNAMIC_MIXED_BATCHES_H_
#define LOCUS_TESTS_BENCH_DYNAMIC_MIXED_BATCHES_H_

#include <vector>

#include "tests/bench/dynamic/world.h"
#include "tests/support/run_batch.h"

namespace locus::bench::dynamic {

class MixedBatches {
 public:
  explicit MixedBatches(const Queries& queries);

  // Runs 100 of the queries as one batch: 40 balls, 30 boxes, 20 rays and 10 more balls. `number` selects which 100
  // queries. Returns the number of ids found.
  size_t ask(const SceneSnapshot& snapshot, size_t number) const;

 private:
  QueryBlock ball_block(size_t begin, size_t count) const;
  QueryBlock box_block(size_t begin, size_t count) const;
  QueryBlock ray_block(size_t begin, size_t count) const;

  size_t batches_;
  std::vector<float> centers_, origins_, directions_;
};

// Counts the objects by a box query that is far larger than the world. The query must find each object of the world
// exactly once.
size_t count_objects(const SceneSnapshot& snapshot);

}  // namespace locus::bench::dynamic

#endif  // LOCUS_TESTS_BENCH_DYNAMIC_MIXED_BATCHES_H_
