// What a reader asks of us again and again: batches of 100 queries, each of one revision. Const members from any
// thread.
#ifndef LOCUS_TESTS_BENCH_DYNAMIC_MIXED_BATCHES_H_
#define LOCUS_TESTS_BENCH_DYNAMIC_MIXED_BATCHES_H_

#include <vector>

#include "tests/bench/dynamic/world.h"
#include "tests/support/run_batch.h"

namespace locus::bench::dynamic {

class MixedBatches {
 public:
  explicit MixedBatches(const Queries& queries);

  // 40 balls, 30 boxes, 20 rays and 10 balls, the `number`th hundred of the queries, as one batch: the ids found.
  size_t ask(const SceneSnapshot& snapshot, size_t number) const;

 private:
  QueryBlock ball_block(size_t begin, size_t count) const;
  QueryBlock box_block(size_t begin, size_t count) const;
  QueryBlock ray_block(size_t begin, size_t count) const;

  size_t batches_;
  std::vector<float> centers_, origins_, directions_;
};

// The objects in a box around the world and far more, each of which has to be there once.
size_t count_objects(const SceneSnapshot& snapshot);

}  // namespace locus::bench::dynamic

#endif  // LOCUS_TESTS_BENCH_DYNAMIC_MIXED_BATCHES_H_
